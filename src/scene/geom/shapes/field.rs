//! Signed distance fields, evaluated sixteen points at a time.

use fearless_simd::{Level, Simd, f32x16};
use fearless_simd_macros::simd;
use glam::Vec3;
use nephroid_math::lanes::Lanes;
use nephroid_math::level::wide_dispatch;
use nephroid_math::vector::{V3, v3};

/// Points that are evaluated together, at most.
const WIDTH: usize = 16;

/// A function of space, negative inside of a body.
pub(super) trait Field: Sync {
    /// The value at a point; of about the size of the distance from the surface.
    fn value<L: Lanes>(&self, p: V3<L>) -> L;
}

/// A point near the surface of a field.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Near {
    /// Where it is.
    pub position: Vec3,
    /// How far it may be moved, m.
    pub reach_m: f32,
}

/// What the surface of a field asks of it. Without generics: code that takes a `dyn Sampled` is compiled once for all fields.
pub(super) trait Sampled: Sync {
    /// Values along a row of points parallel to x, one for each number of `out`, at the `xs`.
    fn values_along_x(&self, level: Level, xs: &[f32], y: f32, z: f32, out: &mut [f32]);
    /// Moves points towards the surface along the gradient, each by at most its reach; places and normals there.
    ///
    /// `cell_m` is the scale of the lattice that the points were found with: the gradient is taken over a fifth of it to either side.
    fn settle(&self, level: Level, cell_m: f32, points: &[Near]) -> Vec<[Vec3; 2]>;
}

impl<F: Field> Sampled for F {
    fn values_along_x(&self, level: Level, xs: &[f32], y: f32, z: f32, out: &mut [f32]) {
        wide_dispatch!(level, simd => wide_row(simd, self, xs, y, z, out), row::<F, f32>((), self, xs, y, z, out));
    }

    fn settle(&self, level: Level, cell_m: f32, points: &[Near]) -> Vec<[Vec3; 2]> {
        let mut settled = Vec::with_capacity(points.len());
        wide_dispatch!(level, simd => wide_settle(simd, self, cell_m, points, &mut settled), {
            settle_all::<F, f32>((), self, cell_m, points, &mut settled);
        });
        settled
    }
}

#[simd]
fn wide_row<S: Simd, F: Field>(simd: S, field: &F, xs: &[f32], y: f32, z: f32, out: &mut [f32]) {
    row::<F, f32x16<S>>(simd, field, xs, y, z, out);
}

#[inline(always)]
fn row<F: Field, L: Lanes>(token: L::Token, field: &F, xs: &[f32], y: f32, z: f32, out: &mut [f32]) {
    let (y, z) = (L::splat(token, y), L::splat(token, z));
    for (xs, out) in xs.chunks(L::LEN).zip(out.chunks_mut(L::LEN)) {
        let mut padded = [0.0; WIDTH];
        padded[..xs.len()].copy_from_slice(xs);
        let values = field.value(v3(L::load(token, &padded), y, z)).to_array();
        out.copy_from_slice(&values[..out.len()]);
    }
}

#[simd]
fn wide_settle<S: Simd, F: Field>(simd: S, field: &F, cell_m: f32, points: &[Near], out: &mut Vec<[Vec3; 2]>) {
    settle_all::<F, f32x16<S>>(simd, field, cell_m, points, out);
}

#[inline(always)]
fn settle_all<F: Field, L: Lanes>(token: L::Token, field: &F, cell_m: f32, points: &[Near], out: &mut Vec<[Vec3; 2]>) {
    for points in points.chunks(L::LEN) {
        let mut columns = [[0.0; WIDTH]; 4];
        for (i, point) in points.iter().enumerate() {
            columns[0][i] = point.position.x;
            columns[1][i] = point.position.y;
            columns[2][i] = point.position.z;
            columns[3][i] = point.reach_m;
        }
        let start = v3(L::load(token, &columns[0]), L::load(token, &columns[1]), L::load(token, &columns[2]));
        let (position, normal) = settle_lanes(field, cell_m, start, L::load(token, &columns[3]));
        let (px, py, pz) = (position.x.to_array(), position.y.to_array(), position.z.to_array());
        let (nx, ny, nz) = (normal.x.to_array(), normal.y.to_array(), normal.z.to_array());
        for i in 0..points.len() {
            out.push([Vec3::new(px[i], py[i], pz[i]), Vec3::new(nx[i], ny[i], nz[i])]);
        }
    }
}

/// Two steps of Newton's method, cut at the reach; also the direction of the gradient at the end, or +y.
#[inline(always)]
fn settle_lanes<F: Field, L: Lanes>(field: &F, cell_m: f32, start: V3<L>, reach: L) -> (V3<L>, V3<L>) {
    let step = cell_m * 0.2;
    let mut p = start;
    let mut g = start;
    for round in 0..3 {
        g = gradient(field, p, step);
        if round < 2 {
            p = p - g * (field.value(p) / Lanes::max(g.dot(g), g.x.like(0.05)));
        }
        if round == 1 {
            let moved = p - start;
            let squared = moved.dot(moved);
            let length = squared.sqrt();
            let cut = v3(reach * (moved.x / length), reach * (moved.y / length), reach * (moved.z / length));
            p = start + V3::select(squared.gt(reach * reach), cut, moved);
        }
    }
    let scale = g.x.like(1.0) / g.length();
    let exists = scale.gt(g.x.like(0.0)) & scale.lt(g.x.like(f32::INFINITY));
    let up = v3(g.x.like(0.0), g.x.like(1.0), g.x.like(0.0));
    (p, V3::select(exists, g * scale, up))
}

/// Central differences over `step` to either side.
#[inline(always)]
fn gradient<F: Field, L: Lanes>(field: &F, p: V3<L>, step: f32) -> V3<L> {
    let mut values = [p.x; 6];
    // A loop, so that the field is compiled once.
    for (i, value) in values.iter_mut().enumerate() {
        let along = |axis: usize| if i / 2 == axis { step } else { 0.0 };
        let offset = v3(p.x.like(along(0)), p.x.like(along(1)), p.x.like(along(2)));
        *value = field.value(if i % 2 == 0 { p + offset } else { p - offset });
    }
    let across = 2.0 * step;
    v3((values[0] - values[1]) / across, (values[2] - values[3]) / across, (values[4] - values[5]) / across)
}
