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
    /// `(radius, height)` of a handle from its upper end to its lower.
    handle: &'static [(f32, f32)],
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
                handle: &[(0.085, 0.925), (0.150, 0.945), (0.215, 0.925), (0.246, 0.865), (0.250, 0.790), (0.240, 0.690)],
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
                handle: &[],
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
                handle: &[(0.345, 0.470), (0.440, 0.430), (0.520, 0.460), (0.540, 0.560), (0.500, 0.650), (0.430, 0.690), (0.360, 0.700)],
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
                handle: &[(0.300, 0.795), (0.375, 0.815), (0.425, 0.775), (0.430, 0.710), (0.400, 0.650), (0.345, 0.630)],
            },
            Self::Bowl => Outline {
                outer: &[(0.420, 0.000), (0.440, 0.040), (0.430, 0.100), (0.640, 0.260), (0.900, 0.540), (1.050, 0.850), (1.090, 1.000)],
                floor: 0.150,
                inner_from: 0.330,
                handle: &[],
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
        let outer: Vec<Vec2> = outline.outer.iter().map(|&p| p.into()).collect();
        let mut wall = self.wall(&outline, spline(&outer, OUTLINE_STEPS));
        // The lip rises above the outline by half a thickness: bring the whole to the height asked for.
        let top = wall.iter().fold(0.0_f32, |y, p| y.max(p.y));
        let scale = self.height_m / top;
        wall.iter_mut().for_each(|p| *p *= scale);
        let foot = vec![Vec2::ZERO, wall[0]];
        let mut mesh = revolve(&[foot, wall], self.slices);
        if self.handles && !outline.handle.is_empty() {
            let path: Vec<Vec2> = outline.handle.iter().map(|&p| Vec2::from(p) * scale).collect();
            for side in [1.0, -1.0] {
                mesh.append(&self.handle(&spline(&path, OUTLINE_STEPS), side));
            }
        }
        Ok(mesh)
    }

    /// From the rim of the foot up the outside, over the lip, down the inside to the middle of the floor.
    fn wall(&self, outline: &Outline, outer: Run) -> Run {
        let n = outer.len();
        // To the right of the way up is outside.
        let normal = |i: usize| {
            let along = outer[(i + 1).min(n - 1)] - outer[i.saturating_sub(1)];
            Vec2::new(along.y, -along.x).normalize()
        };
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

    /// A strap in the plane `z = 0`, broader than thick.
    fn handle(&self, path: &[Vec2], side: f32) -> Mesh {
        let thickness = self.height_m * (0.012 + self.thickness * 0.4);
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
