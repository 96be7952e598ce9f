//! Cylinder, cone, capsule, torus and torus knot.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    Check, ShapeError, circle,
    lathe::{Run, arc, revolve},
    sweep::{Ring, tube},
};
use crate::geom::Mesh;

/// An upright cylinder with sharp rims, standing on `y = 0`: solid, or a wall alone that is seen from both sides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cylinder {
    /// Radius in metres, above 0. Default: 0.5.
    pub radius_m: f32,
    /// Height in metres, above 0. Default: 1.
    pub height_m: f32,
    /// Number of sides, 3 to 4096. Default: 64.
    pub slices: u32,
    /// Whether it has neither foot nor top: a ring, facing out. Default: false.
    pub open: bool,
}

impl Default for Cylinder {
    fn default() -> Self {
        Self { radius_m: 0.5, height_m: 1.0, slices: 64, open: false }
    }
}

impl Cylinder {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Cylinder");
        check.length("radius_m", self.radius_m)?;
        check.length("height_m", self.height_m)?;
        check.count("slices", self.slices, 3..=4096)?;
        if self.open {
            let wall = vec![Vec2::new(self.radius_m, 0.0), Vec2::new(self.radius_m, self.height_m)];
            return Ok(revolve(&[wall], self.slices));
        }
        Ok(frustum(self.radius_m, self.radius_m, self.height_m, self.slices))
    }
}

/// An upright cone, or frustum of one, standing on `y = 0`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cone {
    /// Radius of the foot in metres, above 0. Default: 0.5.
    pub radius_m: f32,
    /// Radius of the top in metres; 0 for a point. Default: 0.
    pub top_radius_m: f32,
    /// Height in metres, above 0. Default: 1.
    pub height_m: f32,
    /// Number of sides, 3 to 4096. Default: 64.
    pub slices: u32,
}

impl Default for Cone {
    fn default() -> Self {
        Self { radius_m: 0.5, top_radius_m: 0.0, height_m: 1.0, slices: 64 }
    }
}

impl Cone {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Cone");
        check.length("radius_m", self.radius_m)?;
        check.number("top_radius_m", self.top_radius_m, 0.0..=super::MAX_LENGTH_M)?;
        check.length("height_m", self.height_m)?;
        check.count("slices", self.slices, 3..=4096)?;
        // `-0.0` is in range but is not the axis to the last bit.
        Ok(frustum(self.radius_m, self.top_radius_m.abs(), self.height_m, self.slices))
    }
}

fn frustum(bottom_m: f32, top_m: f32, height_m: f32, slices: u32) -> Mesh {
    let (foot, top) = (Vec2::new(bottom_m, 0.0), Vec2::new(top_m, height_m));
    let mut runs: Vec<Run> = vec![vec![Vec2::ZERO, foot], vec![foot, top]];
    if top_m > 0.0 {
        runs.push(vec![top, Vec2::new(0.0, height_m)]);
    }
    revolve(&runs, slices)
}

/// An upright cylinder with hemispheres at both ends, centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Capsule {
    /// Radius in metres, above 0. Default: 0.25.
    pub radius_m: f32,
    /// Distance between the centres of the hemispheres in metres, above 0. Default: 0.5.
    pub length_m: f32,
    /// Number of sides, 3 to 4096. Default: 48.
    pub slices: u32,
    /// Number of bands of each hemisphere, 2 to 1024. Default: 12.
    pub stacks: u32,
}

impl Default for Capsule {
    fn default() -> Self {
        Self { radius_m: 0.25, length_m: 0.5, slices: 48, stacks: 12 }
    }
}

impl Capsule {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Capsule");
        check.length("radius_m", self.radius_m)?;
        check.length("length_m", self.length_m)?;
        check.count("slices", self.slices, 3..=4096)?;
        check.count("stacks", self.stacks, 2..=1024)?;
        let radius = Vec2::splat(self.radius_m);
        let half = Vec2::new(0.0, self.length_m * 0.5);
        let mut run = arc(-half, radius, -FRAC_PI_2, 0.0, self.stacks);
        run.extend(arc(half, radius, 0.0, FRAC_PI_2, self.stacks));
        // The cosine of a quarter turn is not exactly zero.
        run[0].x = 0.0;
        run.last_mut().expect("an arc has points").x = 0.0;
        let mut mesh = revolve(&[run], self.slices);
        // Exact normals: the direction from the nearest point of the axis.
        for (n, p) in mesh.normals.iter_mut().zip(&mesh.positions) {
            *n = (*p - Vec3::Y * p.y.clamp(-half.y, half.y)).normalize_or(*n);
        }
        Ok(mesh)
    }
}

/// A ring about the y axis, centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Torus {
    /// Distance of the tube's centre from the axis in metres, above the tube's radius. Default: 0.5.
    pub radius_m: f32,
    /// Radius of the tube in metres, above 0. Default: 0.2.
    pub tube_radius_m: f32,
    /// Number of segments around the axis, 3 to 4096. Default: 96.
    pub slices: u32,
    /// Number of sides of the tube, 3 to 4096. Default: 48.
    pub sides: u32,
}

impl Default for Torus {
    fn default() -> Self {
        Self { radius_m: 0.5, tube_radius_m: 0.2, slices: 96, sides: 48 }
    }
}

impl Torus {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Torus");
        check.length("radius_m", self.radius_m)?;
        check.length("tube_radius_m", self.tube_radius_m)?;
        if self.tube_radius_m >= self.radius_m {
            check.fail("tube_radius_m", self.tube_radius_m, format_args!("below radius_m, {}", self.radius_m))?;
        }
        check.count("slices", self.slices, 3..=4096)?;
        check.count("sides", self.sides, 3..=4096)?;
        let rings: Vec<Ring> = circle(self.slices)[1..]
            .iter()
            .map(|c| {
                let out = Vec3::new(c.x, 0.0, -c.y);
                Ring { center: out * self.radius_m, side: out, up: Vec3::NEG_Y, radius: Vec2::splat(self.tube_radius_m) }
            })
            .collect();
        Ok(tube(&rings, self.sides, true))
    }
}

/// A tube along the `(p, q)` torus knot, centred on the origin.
///
/// `c(t) = ((R + r cos qt) cos pt, r sin qt, −(R + r cos qt) sin pt)`, `t` in `0..2π`: `p` turns about the y axis, `q` about the ring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TorusKnot {
    /// Turns about the y axis, 1 to 32. Default: 2.
    pub p: u32,
    /// Turns about the ring, 1 to 32, without a common divisor with `p`. Default: 3.
    pub q: u32,
    /// `R`, distance of the ring's centre line from the axis in metres, above `ring_radius_m`. Default: 0.5.
    pub radius_m: f32,
    /// `r`, radius of the ring the knot winds about in metres, above 0. Default: 0.2.
    pub ring_radius_m: f32,
    /// Radius of the tube in metres, above 0. Default: 0.09.
    pub tube_radius_m: f32,
    /// Number of segments along the knot, 8 to 16384. Default: 384.
    pub segments: u32,
    /// Number of sides of the tube, 3 to 1024. Default: 32.
    pub sides: u32,
}

impl Default for TorusKnot {
    fn default() -> Self {
        Self { p: 2, q: 3, radius_m: 0.5, ring_radius_m: 0.2, tube_radius_m: 0.09, segments: 384, sides: 32 }
    }
}

impl TorusKnot {
    /// Builds the mesh. A tube thicker than the gaps of the knot passes through itself; the mesh is closed all the same.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("TorusKnot");
        check.count("p", self.p, 1..=32)?;
        check.count("q", self.q, 1..=32)?;
        if gcd(self.p, self.q) != 1 {
            check.fail("q", self.q, format_args!("without a common divisor with p, {}", self.p))?;
        }
        check.length("radius_m", self.radius_m)?;
        check.length("ring_radius_m", self.ring_radius_m)?;
        if self.ring_radius_m >= self.radius_m {
            check.fail("ring_radius_m", self.ring_radius_m, format_args!("below radius_m, {}", self.radius_m))?;
        }
        check.length("tube_radius_m", self.tube_radius_m)?;
        check.count("segments", self.segments, 8..=16_384)?;
        check.count("sides", self.sides, 3..=1024)?;
        let rings: Vec<Ring> = (0..self.segments).map(|i| self.ring(i as f32 / self.segments as f32 * TAU)).collect();
        Ok(tube(&rings, self.sides, true))
    }

    /// The cross-section at parameter `t`. Its frame follows the surface of the ring, so it meets itself after a whole turn.
    fn ring(&self, t: f32) -> Ring {
        let (p, q) = (self.p as f32, self.q as f32);
        let (sin_p, cos_p) = libm::sincosf(p * t);
        let (sin_q, cos_q) = libm::sincosf(q * t);
        let out = self.radius_m + self.ring_radius_m * cos_q;
        let center = Vec3::new(out * cos_p, self.ring_radius_m * sin_q, -out * sin_p);
        let d_out = -self.ring_radius_m * sin_q * q;
        let velocity = Vec3::new(d_out * cos_p - out * sin_p * p, self.ring_radius_m * cos_q * q, -d_out * sin_p - out * cos_p * p);
        let along = velocity.normalize();
        let from_ring = Vec3::new(cos_q * cos_p, sin_q, -cos_q * sin_p);
        let side = (from_ring - along * from_ring.dot(along)).normalize();
        Ring { center, side, up: along.cross(side), radius: Vec2::splat(self.tube_radius_m) }
    }
}

pub(super) fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
