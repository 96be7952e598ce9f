//! Both principal curvatures of a surface in a texel: its shape operator.
//!
//! The shape operator S says how the unit normal turns as one walks on the surface, `dn = S dp`; its eigenvalues are the principal curvatures, 1/m,
//! above 0 where the surface bends away from its normal, and `S n = 0`. Three numbers hold it: the forms `x·Sx`, `x·Sy` and `y·Sy` of the axes x and y
//! of a view. Unlike components in a tangent frame they are smooth over all normals; they say nothing where the view sees the surface edge-on.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V3, v2, v3};
use nephroid_scene::geom::Curvature;

/// A shape operator at a vertex: a symmetric matrix, 1/m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ShapeOperator {
    /// xx, yy, zz.
    pub diagonal: Vec4,
    /// yz, xz, xy.
    pub beside: Vec4,
}

impl ShapeOperator {
    /// From the principal curvatures of a surface with this unit normal.
    #[must_use]
    pub fn new(curvature: Curvature, normal: Vec3) -> Self {
        let (a, b) = (curvature.direction, normal.cross(curvature.direction));
        let part = |of: fn(Vec3, Vec3) -> Vec3| of(a, a) * curvature.largest_per_m + of(b, b) * curvature.smallest_per_m;
        let diagonal = part(|v, w| v * w).extend(0.0);
        let beside = part(|v, w| Vec3::new(v.y * w.z, v.x * w.z, v.x * w.y)).extend(0.0);
        Self { diagonal, beside }
    }

    /// From three columns, of which the symmetric part is taken.
    #[must_use]
    pub fn of_columns([x, y, z]: [Vec3; 3]) -> Self {
        let beside = Vec3::new(y.z + z.y, x.z + z.x, x.y + y.x) * 0.5;
        Self { diagonal: Vec4::new(x.x, y.y, z.z, 0.0), beside: beside.extend(0.0) }
    }
}

/// The axes of a view in world space, unit vectors: right and up.
#[must_use]
pub fn view_axes(clip_from_world: &Mat4) -> [Vec3; 2] {
    let row = |k: usize| clip_from_world.row(k).truncate();
    [row(0).normalize_or_zero(), row(1).normalize_or_zero()]
}

/// The three numbers of a shape operator with this diagonal and these numbers beside it: yz, xz, xy.
#[inline(always)]
pub fn forms<L: Lanes>(axes: [Vec3; 2], diagonal: V3<L>, beside: V3<L>) -> V3<L> {
    let (x, y) = (V3::splat(diagonal.x.token(), axes[0]), V3::splat(diagonal.x.token(), axes[1]));
    let (sx, sy) = (times(diagonal, beside, x), times(diagonal, beside, y));
    v3(x.dot(sx), x.dot(sy), y.dot(sy))
}

#[inline(always)]
fn times<L: Lanes>(diagonal: V3<L>, beside: V3<L>, v: V3<L>) -> V3<L> {
    v3(
        diagonal.x * v.x + beside.z * v.y + beside.y * v.z,
        beside.z * v.x + diagonal.y * v.y + beside.x * v.z,
        beside.y * v.x + beside.x * v.y + diagonal.z * v.z,
    )
}

/// How the normal turns along the tangent `step`: S·step. Exactly 0 where all forms are, even if the view sees the surface edge-on.
#[inline(always)]
pub fn turn<L: Lanes>(axes: [Vec3; 2], forms: V3<L>, normal: V3<L>, step: V3<L>) -> V3<L> {
    let (x, y) = (V3::splat(step.x.token(), axes[0]), V3::splat(step.x.token(), axes[1]));
    // The axes' tangent parts span the plane: vectors in it by their products with both.
    let (x, y) = (x - normal * normal.dot(x), y - normal * normal.dot(y));
    let gram = v3(x.dot(x), x.dot(y), y.dot(y));
    let t = by_products(gram, x.dot(step), y.dot(step));
    let v = by_products(gram, forms.x * t.x + forms.y * t.y, forms.y * t.x + forms.z * t.y);
    let zero = forms.x.like(0.0);
    let bends = (forms.x.abs() + forms.y.abs() + forms.z.abs()).gt(zero);
    V3::select(bends, x * v.x + y * v.y, v3(zero, zero, zero))
}

/// Coordinates of a vector in a plane from its products with the vectors that span it. `gram`: the products xx, xy, yy of these.
#[inline(always)]
fn by_products<L: Lanes>(gram: V3<L>, along_x: L, along_y: L) -> V2<L> {
    let inverse = gram.x.like(1.0) / (gram.x * gram.z - gram.y * gram.y);
    v2((along_x * gram.z - along_y * gram.y) * inverse, (along_y * gram.x - along_x * gram.y) * inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// S·t of a surface with curvatures 3 and −2, through the forms of several views.
    #[test]
    fn forms_of_a_view_hold_both_curvatures() {
        let normal = Vec3::new(0.3, 0.8, -0.5).normalize();
        let (along, across) = normal.any_orthonormal_pair();
        let curvature = Curvature { largest_per_m: 3.0, smallest_per_m: -2.0, direction: along };
        let operator = ShapeOperator::new(curvature, normal);
        let columns = [Vec3::X, Vec3::Y, Vec3::Z].map(|e| along * (3.0 * along.dot(e)) - across * (2.0 * across.dot(e)));
        let same = ShapeOperator::of_columns(columns);
        assert!((operator.diagonal - same.diagonal).length() + (operator.beside - same.beside).length() < 1.0e-5);
        let lane = |v: Vec3| v3(v.x, v.y, v.z);
        for axis in [Vec3::new(0.1, -1.0, 0.2), Vec3::new(-0.7, -0.6, 0.1), Vec3::new(0.0, 0.2, 1.0)] {
            let (x, y) = axis.normalize().any_orthonormal_pair();
            let forms = forms([x, y], lane(operator.diagonal.truncate()), lane(operator.beside.truncate()));
            for (a, b) in [(1.0, 0.0), (0.0, 1.0), (0.6, -1.7)] {
                let turned = turn([x, y], forms, lane(normal), lane(along * a + across * b));
                let expected = along * (3.0 * a) - across * (2.0 * b);
                let off = (Vec3::new(turned.x, turned.y, turned.z) - expected).length();
                assert!(off < 1.0e-4, "{axis}: {off}");
            }
        }
    }
}
