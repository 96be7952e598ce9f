//! A flight of steps.

use std::f32::consts::FRAC_PI_2;

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::{
    Check, ShapeError,
    extrude::{OutlineCorner, prism},
};
use crate::geom::Mesh;

/// Segments of a rounded nosing.
const NOSING_STEPS: u32 = 6;

/// A solid flight of steps rising towards `−z`, its foot at `z = 0`, `y = 0`, centred on `x = 0`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stairs {
    /// Number of steps, 1 to 256. Default: 4.
    pub steps: u32,
    /// Width along x in metres, above 0. Default: 2.
    pub width_m: f32,
    /// Height of a step in metres, above 0. Default: 0.25.
    pub rise_m: f32,
    /// Depth of a step along z in metres, above 0. Default: 0.35.
    pub run_m: f32,
    /// Radius of the rounded front edges in metres, at least 0 and below `rise_m` and `run_m`; 0 for sharp ones. Default: 0.03.
    pub nosing_radius_m: f32,
}

impl Default for Stairs {
    fn default() -> Self {
        Self { steps: 4, width_m: 2.0, rise_m: 0.25, run_m: 0.35, nosing_radius_m: 0.03 }
    }
}

impl Stairs {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Stairs");
        check.count("steps", self.steps, 1..=256)?;
        check.length("width_m", self.width_m)?;
        check.length("rise_m", self.rise_m)?;
        check.length("run_m", self.run_m)?;
        let limit = self.rise_m.min(self.run_m);
        if !(0.0..limit).contains(&self.nosing_radius_m) {
            check.fail("nosing_radius_m", self.nosing_radius_m, format_args!("at least 0 and below {limit} (rise_m and run_m)"))?;
        }
        Ok(prism(&self.outline(), self.width_m))
    }

    /// From the foot up the front over every step, then down the back.
    fn outline(&self) -> Vec<OutlineCorner> {
        // In (z, y): front faces look to +z, treads to +y.
        let (front, up) = (Vec2::X, Vec2::Y);
        let r = self.nosing_radius_m;
        let mut outline = vec![OutlineCorner { place: Vec2::ZERO, normal_before: -up, normal_after: front }];
        for step in 0..self.steps {
            let edge = Vec2::new(-(step as f32) * self.run_m, (step + 1) as f32 * self.rise_m);
            if r == 0.0 {
                outline.push(OutlineCorner { place: edge, normal_before: front, normal_after: up });
            } else {
                let center = edge - Vec2::splat(r);
                outline.extend((0..=NOSING_STEPS).map(|i| {
                    let (sin, cos) = libm::sincosf(FRAC_PI_2 * i as f32 / NOSING_STEPS as f32);
                    let normal = Vec2::new(cos, sin);
                    OutlineCorner::smooth(center + normal * r, normal)
                }));
            }
            let inner = Vec2::new(edge.x - self.run_m, edge.y);
            let after = if step + 1 == self.steps { -front } else { front };
            outline.push(OutlineCorner { place: inner, normal_before: up, normal_after: after });
        }
        outline.push(OutlineCorner { place: Vec2::new(-(self.steps as f32) * self.run_m, 0.0), normal_before: -front, normal_after: -up });
        outline
    }
}
