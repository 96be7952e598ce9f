//! Vessels in classical outlines, with an inside.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    Check, ShapeError,
    lathe::{Run, revolve, spline},
    sweep::{Ring, tube},
};
use crate::geom::Mesh;

/// Points per gap of an outline.
const OUTLINE_STEPS: u32 = 10;
/// Points of the rounded lip.
const LIP_STEPS: u32 = 8;
/// Points of the curve from the inner wall to the middle of the floor.
const FLOOR_STEPS: u32 = 8;

/// The outline of a vessel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum PotKind {
    /// A neck amphora: small foot, full shoulder, slender neck.
    #[default]
    Amphora,
    /// A vase: low belly, long drawn-in neck, spreading lip.
    Vase,
    /// A krater: a wide bowl on a stem.
    Krater,
    /// A pithos: a storage jar with a wide mouth.
    Pithos,
    /// A shallow bowl.
    Bowl,
}

/// The outline of a vessel one unit high, and where handles go.
struct Outline {
    /// `(radius, height)` from the rim of the foot to the lip.
    outer: &'static [(f32, f32)],
    /// Height of the middle of the floor inside.
    floor: f32,
    /// Height above which the inner wall follows the outer one.
    inner_from: f32,
    /// The handles, if the kind has any.
    handle: Option<Handle>,
}

/// A handle in outline.
struct Handle {
    /// Heights at which it leaves the wall and comes back.
    ends: [f32; 2],
    /// `(radius, height)` on the way from the upper end to the lower.
    between: &'static [(f32, f32)],
}

impl PotKind {
    fn outline(self) -> Outline {
        match self {
            Self::Amphora => Outline {
                outer: &[
                    (0.120, 0.000),
                    (0.132, 0.018),
                    (0.112, 0.040),
                    (0.074, 0.068),
                    (0.120, 0.150),
                    (0.220, 0.310),
                    (0.288, 0.480),
                    (0.296, 0.590),
                    (0.248, 0.695),
                    (0.160, 0.762),
                    (0.112, 0.810),
                    (0.100, 0.870),
                    (0.108, 0.935),
                    (0.142, 0.982),
                    (0.158, 1.000),
                ],
                floor: 0.120,
                inner_from: 0.180,
                handle: Some(Handle { ends: [0.905, 0.722], between: &[(0.195, 0.915), (0.243, 0.870), (0.252, 0.810)] }),
            },
            Self::Vase => Outline {
                outer: &[
                    (0.150, 0.000),
                    (0.162, 0.015),
                    (0.170, 0.050),
                    (0.240, 0.170),
                    (0.282, 0.310),
                    (0.262, 0.450),
                    (0.190, 0.590),
                    (0.122, 0.710),
                    (0.098, 0.810),
                    (0.108, 0.900),
                    (0.152, 0.970),
                    (0.190, 1.000),
                ],
                floor: 0.045,
                inner_from: 0.085,
                handle: None,
            },
            Self::Krater => Outline {
                outer: &[
                    (0.240, 0.000),
                    (0.250, 0.025),
                    (0.190, 0.070),
                    (0.105, 0.120),
                    (0.092, 0.185),
                    (0.150, 0.245),
                    (0.300, 0.330),
                    (0.380, 0.470),
                    (0.386, 0.640),
                    (0.374, 0.800),
                    (0.400, 0.920),
                    (0.470, 0.985),
                    (0.500, 1.000),
                ],
                floor: 0.275,
                inner_from: 0.345,
                handle: Some(Handle { ends: [0.700, 0.430], between: &[(0.478, 0.700), (0.530, 0.630), (0.535, 0.540), (0.500, 0.460)] }),
            },
            Self::Pithos => Outline {
                outer: &[
                    (0.170, 0.000),
                    (0.182, 0.012),
                    (0.230, 0.120),
                    (0.320, 0.310),
                    (0.372, 0.500),
                    (0.366, 0.660),
                    (0.300, 0.810),
                    (0.228, 0.885),
                    (0.216, 0.930),
                    (0.246, 0.980),
                    (0.262, 1.000),
                ],
                floor: 0.050,
                inner_from: 0.110,
                handle: Some(Handle { ends: [0.800, 0.660], between: &[(0.390, 0.825), (0.425, 0.780), (0.430, 0.720)] }),
            },
            Self::Bowl => Outline {
                outer: &[(0.420, 0.000), (0.440, 0.040), (0.430, 0.100), (0.640, 0.260), (0.900, 0.540), (1.050, 0.850), (1.090, 1.000)],
                floor: 0.150,
                inner_from: 0.330,
                handle: None,
            },
        }
    }
}

/// A vessel standing on `y = 0`: outer and inner wall, rounded lip, and two handles where the kind has them.
///
/// Body and handles are one closed surface each; the ends of the handles are inside the wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pot {
    /// Outline. Default: Amphora.
    pub kind: PotKind,
    /// Height to the lip in metres, above 0. Default: 0.8.
    pub height_m: f32,
    /// Thickness of the wall as a fraction of the height, 0.005 to 0.04. Default: 0.02.
    pub thickness: f32,
    /// Whether handles are made. Default: true.
    pub handles: bool,
    /// Number of sides, 8 to 2048. Default: 96.
    pub slices: u32,
}

impl Default for Pot {
    fn default() -> Self {
        Self { kind: PotKind::Amphora, height_m: 0.8, thickness: 0.02, handles: true, slices: 96 }
    }
}

impl Pot {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Pot");
        check.length("height_m", self.height_m)?;
        check.number("thickness", self.thickness, 0.005..=0.04)?;
        check.count("slices", self.slices, 8..=2048)?;
        let outline = self.kind.outline();
        let points: Vec<Vec2> = outline.outer.iter().map(|&p| p.into()).collect();
        let outer = spline(&points, OUTLINE_STEPS);
        let path = outline.handle.as_ref().map(|handle| self.handle_path(handle, &outer));
        let mut wall = self.wall(&outline, outer);
        // The lip rises above the outline by half a thickness: bring the whole to the height asked for.
        let top = wall.iter().fold(0.0_f32, |y, p| y.max(p.y));
        let scale = self.height_m / top;
        wall.iter_mut().for_each(|p| *p *= scale);
        let foot = vec![Vec2::ZERO, wall[0]];
        let mut mesh = revolve(&[foot, wall], self.slices);
        if let Some(path) = path.filter(|_| self.handles) {
            let path: Run = path.iter().map(|&p| p * scale).collect();
            for side in [1.0, -1.0] {
                mesh.append(&self.handle(&path, side));
            }
        }
        Ok(mesh)
    }

    /// From the rim of the foot up the outside, over the lip, down the inside to the middle of the floor.
    fn wall(&self, outline: &Outline, outer: Run) -> Run {
        let n = outer.len();
        let normal = |i: usize| outward(&outer, i);
        let half = self.thickness * 0.5;
        let mut wall = outer.clone();
        let (last, out) = (outer[n - 1], normal(n - 1));
        let up = Vec2::new(-out.y, out.x);
        wall.extend((1..LIP_STEPS).map(|i| {
            let (sin, cos) = libm::sincosf(PI * i as f32 / LIP_STEPS as f32);
            last - out * half + (out * cos + up * sin) * half
        }));
        wall.extend((0..n).rev().filter(|&i| outer[i].y > outline.inner_from).map(|i| outer[i] - normal(i) * self.thickness));

        // A cubic from the wall, in its direction, to the axis, level.
        let (a, b) = (wall[wall.len() - 1], wall[wall.len() - 2]);
        let end = Vec2::new(0.0, outline.floor);
        let down = (a - b).normalize() * (a.distance(end) * 0.55);
        let (c1, c2) = (a + down, end + Vec2::new(a.x * 0.55, 0.0));
        wall.extend((1..FLOOR_STEPS).map(|i| {
            let t = i as f32 / FLOOR_STEPS as f32;
            let s = 1.0 - t;
            a * (s * s * s) + c1 * (3.0 * s * s * t) + c2 * (3.0 * s * t * t) + end * (t * t * t)
        }));
        wall.push(end);
        wall
    }

    /// Half the thickness of a handle, in heights.
    fn handle_radius(&self) -> f32 {
        0.012 + self.thickness * 0.4
    }

    /// The middle of a handle: straight out of the wall, over the points between, straight back in.
    fn handle_path(&self, handle: &Handle, outer: &[Vec2]) -> Run {
        let end = |y: f32| {
            let i = outer.partition_point(|p| p.y < y).min(outer.len() - 1);
            let (p, out) = (outer[i], outward(outer, i));
            // The end is a disc: half way into the wall, it shows neither outside nor inside.
            (p - out * self.thickness * 0.5, p + out * self.handle_radius() * 0.9)
        };
        let [(top, out_of_top), (bottom, out_of_bottom)] = handle.ends.map(end);
        let mut path = vec![top, out_of_top];
        path.extend(handle.between.iter().map(|&p| Vec2::from(p)));
        path.extend([out_of_bottom, bottom]);
        spline(&path, OUTLINE_STEPS)
    }

    /// A strap in the plane `z = 0`, broader than thick.
    fn handle(&self, path: &[Vec2], side: f32) -> Mesh {
        let thickness = self.height_m * self.handle_radius();
        let at = |p: Vec2| Vec3::new(p.x * side, p.y, 0.0);
        let n = path.len();
        let rings: Vec<Ring> = (0..n)
            .map(|i| {
                let along = (at(path[(i + 1).min(n - 1)]) - at(path[i.saturating_sub(1)])).normalize();
                // `side × up = along` with `up` across the strap.
                let across = Vec3::Z * side;
                Ring { center: at(path[i]), side: across.cross(along), up: across, radius: Vec2::new(thickness, thickness * 1.7) }
            })
            .collect();
        tube(&rings, 20, false)
    }
}

/// Unit normal of an outline at a point: to the right of the way up is outside.
fn outward(outline: &[Vec2], i: usize) -> Vec2 {
    let along = outline[(i + 1).min(outline.len() - 1)] - outline[i.saturating_sub(1)];
    Vec2::new(along.y, -along.x).normalize()
}
