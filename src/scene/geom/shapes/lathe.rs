//! Surfaces of revolution about the y axis.

use glam::{Vec2, Vec3};

use super::circle;
use crate::geom::Mesh;

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
    let at = |i: isize| {
        if i < 0 {
            points[0] * 2.0 - points[1]
        } else if i as usize >= n {
            points[n - 1] * 2.0 - points[n - 2]
        } else {
            points[i as usize]
        }
    };
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
