//! Surfaces of revolution about the y axis.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Check, MAX_LENGTH_M, ShapeError, circle};
use crate::geom::Mesh;

/// Most points of the profile of a [`Lathe`].
pub const MAX_PROFILE_POINTS: usize = 256;

/// A turned body: a smooth profile revolved about the y axis.
///
/// The profile is a list of points `(radius, height)`. Seen with the axis on the left, it runs with the solid on its left: from the axis
/// at the bottom, out, up, and back to the axis. A point that is given twice is a sharp edge. Between sharp edges the surface is a smooth
/// curve through the points (centripetal Catmull and Rom); two points alone are joined by a straight line. A curve meets the axis level,
/// and circular arcs of equal steps stay circular up to their ends. If both ends are on the axis, the body is closed; otherwise it is
/// an open surface, which mirrors and diffuse surfaces may be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lathe {
    /// Points `(radius, height)` in metres, 2 to 256 of them; radii above 0, at the ends 0 or above; never three equal points in a row.
    /// Default: a tumbler.
    pub profile: Vec<Vec2>,
    /// Number of steps between two points of a curve, 1 to 64. Default: 6.
    pub steps: u32,
    /// Number of sides, 3 to 4096. Default: 96.
    pub slices: u32,
}

impl Default for Lathe {
    fn default() -> Self {
        let profile = [
            (0.0, 0.0),
            (0.30, 0.0),
            (0.30, 0.0),
            (0.33, 0.03),
            (0.35, 0.40),
            (0.40, 0.985),
            (0.385, 1.0),
            (0.37, 0.985),
            (0.32, 0.40),
            (0.28, 0.15),
            (0.15, 0.11),
            (0.0, 0.10),
        ];
        Self { profile: profile.map(Vec2::from).to_vec(), steps: 6, slices: 96 }
    }
}

impl Lathe {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Lathe");
        check.count("steps", self.steps, 1..=64)?;
        check.count("slices", self.slices, 3..=4096)?;
        Ok(revolve(&self.runs(check)?, self.slices))
    }

    /// The profile as curves between sharp edges, after checking it.
    fn runs(&self, check: Check) -> Result<Vec<Run>, ShapeError> {
        let points = &self.profile;
        if !(2..=MAX_PROFILE_POINTS).contains(&points.len()) {
            check.fail("profile", format_args!("{} points", points.len()), format_args!("2 to {MAX_PROFILE_POINTS} points"))?;
        }
        let last = points.len() - 1;
        for (i, p) in points.iter().enumerate() {
            let is_end = i == 0 || i == last;
            let radius_fits = p.x > 0.0 || is_end && p.x == 0.0;
            if !(radius_fits && p.x <= MAX_LENGTH_M && p.y.abs() <= MAX_LENGTH_M) {
                let allowed = format_args!("radii above 0 (at the ends 0 or above) and lengths of at most {MAX_LENGTH_M} (metres)");
                check.fail("profile", format_args!("({}, {}) at point {i}", p.x, p.y), allowed)?;
            }
        }
        // `-0.0` is in range but is not the axis to the last bit.
        let points: Vec<Vec2> = points.iter().map(|p| Vec2::new(p.x.abs(), p.y)).collect();
        let mut runs = Vec::new();
        let mut start = 0;
        for i in 1..=last {
            let is_edge = points[i] == points[i - 1];
            if is_edge && (i - 1 == start || i == last) {
                let allowed = "points of which at most two in a row are equal, and not at the ends";
                check.fail("profile", format_args!("({}, {}) again at point {i}", points[i].x, points[i].y), allowed)?;
            }
            if is_edge || i == last {
                let end = if is_edge { i - 1 } else { i };
                runs.push(smooth(&points[start..=end], self.steps));
                start = i;
            }
        }
        let off_axis = |run: &Run| run[1..run.len() - 1].iter().all(|p| p.x > 0.0) && run.iter().any(|p| p.x > 0.0);
        if !runs.iter().all(off_axis) {
            check.fail("profile", "a curve that crosses the axis", "a curve that stays off the axis between its ends")?;
        }
        Ok(runs)
    }
}

/// A smooth curve through points that are not equal; a straight line through two.
///
/// Beyond its ends the curve continues as the mirror image of its start: in the axis if it is there, otherwise in the perpendicular bisector of
/// the first two points, which continues an arc as an arc.
fn smooth(points: &[Vec2], steps: u32) -> Run {
    if let [_, _] = points {
        return points.to_vec();
    }
    let beyond = |[a, b, c]: [Vec2; 3]| {
        if a.x == 0.0 {
            return Vec2::new(-b.x, b.y);
        }
        let along = (b - a).normalize();
        let from_middle = c - (a + b) * 0.5;
        c - along * (2.0 * from_middle.dot(along))
    };
    let n = points.len();
    let ends = [beyond([points[0], points[1], points[2]]), beyond([points[n - 1], points[n - 2], points[n - 3]])];
    spline_between(ends[0], points, ends[1], steps)
}

/// A smooth piece of a profile: points `(radius, height)`, at least two. Where one piece ends and the next begins there is a sharp edge.
pub(super) type Run = Vec<Vec2>;

/// Turns a profile about the y axis.
///
/// The profile runs with the solid on its left: from the axis at the bottom, out, up, and back to the axis for a solid, or around a
/// closed loop for a ring. Points on the axis collapse to one place. Texture coordinates: angle × largest radius, length along the profile.
pub(super) fn revolve(runs: &[Run], slices: u32) -> Mesh {
    let circle = circle(slices);
    let radius = runs.iter().flatten().fold(0.0_f32, |r, p| r.max(p.x));
    let mut mesh = Mesh::default();
    let mut v = 0.0;
    for run in runs {
        let mut previous: Option<(u32, Vec2)> = None;
        for (i, &p) in run.iter().enumerate() {
            let n = run_normal(run, i);
            if let Some((_, q)) = previous {
                v += p.distance(q);
            }
            let first = mesh.positions.len() as u32;
            for (k, c) in circle.iter().enumerate() {
                let u = k as f32 / slices as f32 * std::f32::consts::TAU * radius;
                // Clockwise seen from above, so that u grows to the right seen from outside. The axis has no side: +0 for both signs of the cosine.
                let around = |r: f32| if r == 0.0 { Vec2::ZERO } else { Vec2::new(r * c.x, -r * c.y) };
                let (place, normal) = (around(p.x), around(n.x));
                mesh.push_vertex(Vec3::new(place.x, p.y, place.y), Vec3::new(normal.x, n.y, normal.y), Some(Vec2::new(u, v)));
            }
            if let Some((below, _)) = previous {
                for k in 0..slices {
                    mesh.push_quad([below + k, below + k + 1, first + k + 1, first + k]);
                }
            }
            previous = Some((first, p));
        }
    }
    // A slice has two vertices per pole, of which a triangle uses one.
    mesh.compact();
    mesh
}

/// Unit normal of a run at a point: the tangent turned to the right.
fn run_normal(run: &[Vec2], i: usize) -> Vec2 {
    let last = run.len() - 1;
    // A curve that reaches the axis does so level; a straight run makes a cone.
    if run[i].x == 0.0 && last > 1 && (i == 0 || i == last) {
        return Vec2::new(0.0, if i == 0 { -1.0 } else { 1.0 });
    }
    let step = |k: usize| (run[k + 1] - run[k]).normalize_or_zero();
    let tangent = match i {
        // Straight on to the end: one and a half times the first turn before the middle of the first step.
        0 if last > 1 => step(0) * 1.5 - step(1) * 0.5,
        0 => step(0),
        _ if i == last && last > 1 => step(last - 1) * 1.5 - step(last - 2) * 0.5,
        _ if i == last => step(last - 1),
        // Weighted by the other step's length: exact for a parabola.
        _ => step(i - 1) * run[i + 1].distance(run[i]) + step(i) * run[i].distance(run[i - 1]),
    };
    Vec2::new(tangent.y, -tangent.x).normalize_or(Vec2::X)
}

/// Points along an arc about `center`, `steps + 1` of them, from one angle to another (radians, 0 is outward, π/2 is up).
pub(super) fn arc(center: Vec2, radius: Vec2, from_rad: f32, to_rad: f32, steps: u32) -> Run {
    (0..=steps)
        .map(|i| {
            let angle = from_rad + (to_rad - from_rad) * (i as f32 / steps as f32);
            center + radius * Vec2::new(libm::cosf(angle), libm::sinf(angle))
        })
        .collect()
}

/// A smooth curve through points (centripetal Catmull and Rom 1974, Yuksel et al. 2011: no loops, no cusps), `steps` per gap.
///
/// The end tangents follow from the mirrored neighbour of each end.
pub(super) fn spline(points: &[Vec2], steps: u32) -> Run {
    let n = points.len();
    spline_between(points[0] * 2.0 - points[1], points, points[n - 1] * 2.0 - points[n - 2], steps)
}

/// The same with the neighbours of both ends given.
fn spline_between(before: Vec2, points: &[Vec2], after: Vec2, steps: u32) -> Run {
    let n = points.len();
    let at = |i: isize| if i < 0 { before } else { points.get(i as usize).copied().unwrap_or(after) };
    let mut curve = vec![points[0]];
    for gap in 0..n as isize - 1 {
        let p = [at(gap - 1), at(gap), at(gap + 1), at(gap + 2)];
        let knot = |a: Vec2, b: Vec2| a.distance(b).sqrt();
        let t1 = knot(p[0], p[1]);
        let t2 = t1 + knot(p[1], p[2]);
        let t3 = t2 + knot(p[2], p[3]);
        let mix = |a: Vec2, b: Vec2, ta: f32, tb: f32, t: f32| a * ((tb - t) / (tb - ta)) + b * ((t - ta) / (tb - ta));
        for step in 1..=steps {
            if step == steps {
                curve.push(p[2]);
                continue;
            }
            let t = t1 + (t2 - t1) * (step as f32 / steps as f32);
            let (a, b, c) = (mix(p[0], p[1], 0.0, t1, t), mix(p[1], p[2], t1, t2, t), mix(p[2], p[3], t2, t3, t));
            let (d, e) = (mix(a, b, 0.0, t2, t), mix(b, c, t1, t3, t));
            curve.push(mix(d, e, t1, t2, t));
        }
    }
    curve
}
