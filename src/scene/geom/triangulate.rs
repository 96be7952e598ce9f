//! Cutting a polygon in space into triangles.

use glam::{Vec2, Vec3};

/// Polygons with more corners are cut as a fan: ear clipping takes time that grows with the square of the corner count.
pub const MAX_EAR_CLIPPED_CORNERS: usize = 1024;

/// Cuts a simple polygon into `n − 2` triangles that keep its winding; calls `emit` with corner numbers.
///
/// A convex polygon becomes a fan from corner 0, any other is cut by ear clipping (Meisters 1975) in the coordinate plane that
/// faces its Newell normal most. No corner is added or lost, so neighbours that share an edge still share it. A self-crossing or
/// flat polygon still gives `n − 2` triangles, some of them folded or empty; fewer than three corners give none.
pub fn triangulate_polygon(points: &[Vec3], mut emit: impl FnMut([usize; 3])) {
    let n = points.len();
    if n < 3 {
        return;
    }
    let flat = if n == 3 || n > MAX_EAR_CLIPPED_CORNERS { None } else { project(points).filter(|flat| !is_convex(flat)) };
    let Some(flat) = flat else {
        (1..n - 1).for_each(|i| emit([0, i, i + 1]));
        return;
    };

    let mut ring: Vec<usize> = (0..n).collect();
    let mut at = 0;
    let mut refused = 0;
    while ring.len() > 3 {
        let len = ring.len();
        let corner = [ring[(at + len - 1) % len], ring[at % len], ring[(at + 1) % len]];
        // After a whole turn without an ear the polygon crosses itself: cut anyway.
        if is_ear(&flat, &ring, corner) || refused >= len {
            emit(corner);
            ring.remove(at % len);
            refused = 0;
            at %= ring.len();
        } else {
            at = (at + 1) % len;
            refused += 1;
        }
    }
    emit([ring[0], ring[1], ring[2]]);
}

/// The polygon seen along the axis its normal is nearest to, counter-clockwise; `None` if it has no area.
fn project(points: &[Vec3]) -> Option<Vec<Vec2>> {
    let mut normal = Vec3::ZERO;
    for (i, &p) in points.iter().enumerate() {
        let q = points[(i + 1) % points.len()];
        normal += (p - points[0]).cross(q - points[0]);
    }
    let size = normal.abs();
    let flatten = |p: &Vec3| {
        if size.x >= size.y && size.x >= size.z {
            Vec2::new(p.y * normal.x.signum(), p.z)
        } else if size.y >= size.z {
            Vec2::new(p.z * normal.y.signum(), p.x)
        } else {
            Vec2::new(p.x * normal.z.signum(), p.y)
        }
    };
    (size.max_element() > 0.0).then(|| points.iter().map(flatten).collect())
}

/// Twice the signed area of a triangle, positive if counter-clockwise.
fn area2(a: Vec2, b: Vec2, c: Vec2) -> f32 {
    (b - a).perp_dot(c - a)
}

fn is_convex(flat: &[Vec2]) -> bool {
    let n = flat.len();
    (0..n).all(|i| area2(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) >= 0.0)
}

/// Whether the corner turns left and no other corner of the ring lies in its triangle.
fn is_ear(flat: &[Vec2], ring: &[usize], corner: [usize; 3]) -> bool {
    let [a, b, c] = corner.map(|i| flat[i]);
    let turns_left = area2(a, b, c) > 0.0;
    turns_left
        && ring.iter().filter(|i| !corner.contains(i)).all(|&i| {
            let p = flat[i];
            // A corner that repeats one of the three (a bridge to a hole) does not block the ear.
            p == a || p == b || p == c || area2(a, b, p) < 0.0 || area2(b, c, p) < 0.0 || area2(c, a, p) < 0.0
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[Vec3]) -> Vec<[usize; 3]> {
        let mut triangles = Vec::new();
        triangulate_polygon(points, |t| triangles.push(t));
        triangles
    }

    fn area_vector(points: &[Vec3], t: [usize; 3]) -> Vec3 {
        (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]) * 0.5
    }

    #[test]
    fn convex_polygon_is_a_fan() {
        let square = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert_eq!(cut(&square), [[0, 1, 2], [0, 2, 3]]);
        assert!(cut(&square[..2]).is_empty());
        assert_eq!(cut(&square[..3]), [[0, 1, 2]]);
    }

    #[test]
    fn concave_polygons_keep_area_and_winding_in_every_plane() {
        // A comb with three teeth, area 3 × 2 + 7 × 1, and an arrow head whose fan from corner 0 would leave it.
        let comb = [(0, 0), (7, 0), (7, 3), (6, 3), (6, 1), (4, 1), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)];
        let arrow = [(0, 0), (2, 1), (4, 0), (2, 5)];
        for (shape, area) in [(&comb[..], 13.0), (&arrow[..], 8.0)] {
            for turn in 0..shape.len() {
                let mut shape = shape.to_vec();
                shape.rotate_left(turn);
                let to_3d: [fn(f32, f32) -> Vec3; 6] = [
                    |x, y| Vec3::new(x, y, 2.0),
                    |x, y| Vec3::new(y, x, 2.0),
                    |x, y| Vec3::new(x, -3.0, y),
                    |x, y| Vec3::new(y, -3.0, x),
                    |x, y| Vec3::new(1.0, x, y),
                    |x, y| Vec3::new(1.0, y, x),
                ];
                for place in to_3d {
                    let points: Vec<Vec3> = shape.iter().map(|&(x, y)| place(x as f32, y as f32)).collect();
                    let triangles = cut(&points);
                    assert_eq!(triangles.len(), points.len() - 2);
                    let whole = triangles.iter().map(|&t| area_vector(&points, t)).fold(Vec3::ZERO, |a, b| a + b);
                    assert!((whole.length() - area).abs() < 1e-5, "{whole} {area}");
                    for &t in &triangles {
                        assert!(area_vector(&points, t).dot(whole) >= 0.0, "{t:?} is turned over");
                    }
                }
            }
        }
    }

    #[test]
    fn bad_polygons_still_end() {
        let crossing = [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::X, Vec3::Y, Vec3::new(0.5, 2.0, 0.0)];
        assert_eq!(cut(&crossing).len(), 3);
        assert_eq!(cut(&[Vec3::ONE; 7]).len(), 5);
        assert_eq!(cut(&[Vec3::splat(f32::NAN); 6]).len(), 4);
        assert_eq!(cut(&vec![Vec3::ONE; MAX_EAR_CLIPPED_CORNERS + 5]).len(), MAX_EAR_CLIPPED_CORNERS + 3);
    }
}
