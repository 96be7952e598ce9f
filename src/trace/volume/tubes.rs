//! Later straight parts of views, behind the water's surface: the views of a pixel are a tube, whose four edges are the views through the corners.
//!
//! Places in a tube are `p(u, v, t) = q(u, v) + t d(u, v)`, q and d bilinear between the edges. The mean radiance of the pixel from a beam is
//!
//! `L = ∫ σ_s p(θ) Φ T(beam) T(eye) / J ds`, over the part of the beam inside, `J = |∂p/∂(u, v, t)| / |d|`.
//!
//! Where a beam enters and leaves follows by Newton's method: the equations are solved near the middle of the tube, then again in the middle of the
//! part of the beam that was found. Sixteen tubes are computed together; tubes of pixels that are next to each other are in one group.

use arrayvec::ArrayVec;
use glam::Vec3;
use rayon::prelude::*;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V3, v3};

use super::super::media::Place;
use super::beam::{Lit, Parts, safe};
use super::hull::{Hull, Hulls, hull};
use super::looks::Plane;
use super::{Canvas, LANES};

/// Capacity of the stack of nodes: fifteen for each level.
const STACK: usize = 128;

/// Margin of the first solution, in widths of a tube.
const MARGIN: f32 = 0.5;

/// Most pieces that the part of a beam in one tube is cut into.
const MAX_PIECES: f32 = 64.0;

/// The views of a pixel, or of a part of one, along one of their straight parts.
#[derive(Clone, Copy)]
pub(super) struct Tube {
    /// Starts and directions of the views through the corners, in the order of rows.
    pub edges: [(Vec3, Vec3); 4],
    /// Length of the longest edge, m.
    pub length: f32,
    /// Where the views end.
    pub end: Plane,
    /// Factor from radiance at the start to radiance at the eye, linear RGB.
    pub passed: Vec3,
    /// The part's share of the pixel.
    pub share: f32,
    pub pixel: u32,
    /// Number of the part in its pixel.
    pub part: u32,
}

impl Tube {
    /// The places where an edge starts and ends.
    fn ends(&self, edge: usize) -> [Vec3; 2] {
        let (origin, direction) = self.edges[edge];
        [origin, origin + direction * self.length]
    }
}

/// Sixteen tubes, one per element of each array.
#[derive(Clone)]
struct Group {
    /// Coefficients of 1, u, v and uv.
    origin: [[[f32; LANES]; 3]; 4],
    direction: [[[f32; LANES]; 3]; 4],
    length: [f32; LANES],
    end: [[f32; LANES]; 4],
    passed: [[f32; LANES]; 3],
    /// Shares; 0 where there is no tube.
    share: [f32; LANES],
    pixel: [u32; LANES],
}

/// All tubes of views that took the same way.
pub(super) struct Tubes {
    /// The medium that the tubes run through.
    pub place: Place,
    groups: Vec<Group>,
    /// Hulls of the groups, then of sixteen of those each, and so on.
    levels: Vec<Vec<Hulls>>,
}

impl Tubes {
    /// Puts the tubes of a picture with a number of columns into groups.
    pub fn new(place: Place, mut tubes: Vec<Tube>, columns: u32) -> Self {
        tubes.sort_by_key(|tube| (z_curve(tube.pixel % columns, tube.pixel / columns), tube.part));
        let groups = tubes.chunks(LANES).map(Group::new).collect();
        let mut levels = Vec::new();
        let mut per_hull = LANES;
        loop {
            let hulls: Vec<Hull> = tubes.par_chunks(per_hull).map(around).collect();
            let packed: Vec<Hulls> = hulls.chunks(LANES).map(Hulls::new).collect();
            let last = packed.len() <= 1;
            levels.push(packed);
            if last {
                return Self { place, groups, levels };
            }
            per_hull *= LANES;
        }
    }

    /// Adds the light of a beam to the pixels whose tubes it passes.
    #[inline(always)]
    pub fn add<L: Lanes>(&self, token: L::Token, lit: &Lit<'_>, canvas: &mut Canvas) {
        let (origin, direction) = (lit.beam.origin, lit.beam.direction);
        let mut stack = ArrayVec::<(usize, usize), STACK>::new();
        stack.push((self.levels.len() - 1, 0));
        while let Some((level, index)) = stack.pop() {
            let ([from, to], mut met) = self.levels[level][index].clip::<L>(token, origin, direction, (0.0, lit.beam.length));
            while met != 0 {
                let k = met.trailing_zeros() as usize;
                met &= met - 1;
                let child = index * LANES + k;
                if level > 0 {
                    stack.push((level - 1, child));
                    continue;
                }
                let mut first = 0;
                while first < LANES {
                    self.groups[child].add::<L>(token, lit, first, (from[k], to[k]), canvas);
                    first += L::LEN;
                }
            }
        }
    }
}

/// The hull of some tubes.
fn around(tubes: &[Tube]) -> Hull {
    let across = |edge: usize| tubes.iter().map(|tube| tube.ends(edge)[1] - tube.ends(0)[1]).sum::<Vec3>();
    let along = tubes.iter().map(|tube| tube.edges[0].1).sum::<Vec3>();
    let points = tubes.iter().flat_map(|tube| (0..4).flat_map(|edge| tube.ends(edge)));
    hull([along.cross(across(1)), along.cross(across(2)), along], points)
}

impl Group {
    fn new(tubes: &[Tube]) -> Self {
        let mut group = Self {
            origin: [[[0.0; LANES]; 3]; 4],
            direction: [[[0.0; LANES]; 3]; 4],
            length: [0.0; LANES],
            end: [[0.0; LANES]; 4],
            passed: [[0.0; LANES]; 3],
            share: [0.0; LANES],
            pixel: [0; LANES],
        };
        for (k, tube) in tubes.iter().enumerate() {
            let coefficients = |at: [Vec3; 4]| [at[0], at[1] - at[0], at[2] - at[0], at[0] - at[1] - at[2] + at[3]];
            let (q, d) = (coefficients(tube.edges.map(|edge| edge.0)), coefficients(tube.edges.map(|edge| edge.1)));
            for axis in 0..3 {
                for n in 0..4 {
                    group.origin[n][axis][k] = q[n][axis];
                    group.direction[n][axis][k] = d[n][axis];
                }
                group.end[axis][k] = tube.end.normal[axis];
                group.passed[axis][k] = tube.passed[axis];
            }
            group.end[3][k] = tube.end.d;
            group.length[k] = tube.length;
            group.share[k] = tube.share;
            group.pixel[k] = tube.pixel;
        }
        group
    }

    /// Adds the light of the part of a beam that is in the tubes.
    #[inline(always)]
    fn add<L: Lanes>(&self, token: L::Token, lit: &Lit<'_>, first: usize, range: (f32, f32), canvas: &mut Canvas) {
        let share = L::load(token, &self.share[first..]);
        let zero = L::splat(token, 0.0);
        if !share.gt(zero).any() {
            return;
        }
        let tubes = Edges {
            origin: coefficients(token, &self.origin, first),
            direction: coefficients(token, &self.direction, first),
            length: L::load(token, &self.length[first..]),
        };
        let beam = (V3::splat(token, lit.beam.origin), V3::splat(token, lit.beam.direction));
        let half = L::splat(token, 0.5);
        let (low, high) = (L::splat(token, range.0), L::splat(token, range.1));
        // First from the middle of the tube, at the place nearest to the beam.
        let [q, d] = [mixed(&tubes.origin, half, half), mixed(&tubes.direction, half, half)];
        let w = beam.0 - q;
        let (b, c) = (beam.1.dot(d), d.dot(d));
        let s = (b * d.dot(w) - c * beam.1.dot(w)) / safe(c - b * b);
        let s = Lanes::min(Lanes::max(s, low), high);
        let t = d.dot(w + beam.1 * s) / c;
        let t = Lanes::min(Lanes::max(t, zero), tubes.length);
        let (near, _) = tubes.solve(beam, [s, half, half, t]);
        let (from, to) = near.inside(s, (low, high), tubes.length, MARGIN);
        let met = from.lt(to) & share.gt(zero);
        if !met.any() {
            return;
        }
        // Then from the middle of what was found.
        let middle = L::select(met, (from + to) * 0.5, low);
        let on = near.at(middle - s);
        let on = [middle, on[0].clamp(0.0, 1.0), on[1].clamp(0.0, 1.0), Lanes::min(Lanes::max(on[2], zero), tubes.length)];
        let (found, volume) = tubes.solve(beam, on);
        let (from, to) = found.inside(middle, (low, high), tubes.length, 0.0);
        let normal =
            v3(L::load(token, &self.end[0][first..]), L::load(token, &self.end[1][first..]), L::load(token, &self.end[2][first..]));
        let (from, to) = before(beam, normal, L::load(token, &self.end[3][first..]), (from, to));
        let met = met & from.lt(to);
        if !met.any() {
            return;
        }
        let along = mixed(&tubes.direction, on[1], on[2]);
        let (speed, one) = (along.length(), L::splat(token, 1.0));
        let per_volume = share * speed / Lanes::max(volume.abs(), L::splat(token, f32::MIN_POSITIVE));
        let (from, to) = (L::select(met, from, zero), L::select(met, to, zero));
        let pieces = Lanes::max(-(-((to - from) / lit.most)).floor(), one);
        let pieces = Lanes::min(pieces, L::splat(token, MAX_PIECES));
        let chord = (to - from) / pieces;
        let most = pieces.to_array().into_iter().take(L::LEN).fold(1.0, f32::max);
        let mut sum = v3(zero, zero, zero);
        for piece in 0..most as u32 {
            let number = L::splat(token, piece as f32);
            let chord = L::select(number.lt(pieces), chord, zero);
            let s = from + chord * (number + 0.5);
            let [u, v, t] = found.at(s - middle);
            let to_eye = Lanes::max(t * speed, zero);
            let (start, toward) = (mixed(&tubes.origin, u, v), mixed(&tubes.direction, u, v).normalize());
            let (density, column) = lit.densities(token, s);
            let columns = [column, lit.view_columns(token, start, toward, to_eye, met.bits())];
            let direction = along * (one / speed);
            let light = lit.scattered(token, &Parts { chord, direction, per_volume, density, columns, slope: found.slope[2] * speed });
            sum = sum + light;
        }
        let passed = v3(
            L::load(token, &self.passed[0][first..]),
            L::load(token, &self.passed[1][first..]),
            L::load(token, &self.passed[2][first..]),
        );
        let light = sum.hadamard(passed);
        let (r, g, b) = (light.x.to_array(), light.y.to_array(), light.z.to_array());
        let met = met.bits();
        for (k, &pixel) in self.pixel[first..first + L::LEN].iter().enumerate() {
            if met >> k & 1 == 1 {
                canvas.add(pixel, [r[k], g[k], b[k]]);
            }
        }
    }
}

/// Edges of tubes, one tube per lane, as coefficients of 1, u, v and uv.
struct Edges<L> {
    origin: [V3<L>; 4],
    direction: [V3<L>; 4],
    length: L,
}

/// u, v and t of the places along a beam near one of them: there, and by how much they grow with the way along the beam.
struct Solution<L> {
    value: [L; 3],
    slope: [L; 3],
}

impl<L: Lanes> Edges<L> {
    /// A step of Newton's method for `p(u, v, t) = o + s d` from a place and a guess; and the determinant of the derivatives at the guess.
    #[inline(always)]
    fn solve(&self, (o, d): (V3<L>, V3<L>), [s, u, v, t]: [L; 4]) -> (Solution<L>, L) {
        let (q, w) = (&self.origin, &self.direction);
        let pu = q[1] + q[3] * v + (w[1] + w[3] * v) * t;
        let pv = q[2] + q[3] * u + (w[2] + w[3] * u) * t;
        let pt = mixed(&self.direction, u, v);
        let p = mixed(&self.origin, u, v) + pt * t;
        let off = o + d * s - p;
        let normals = [pv.cross(pt), pt.cross(pu), pu.cross(pv)];
        let volume = pu.dot(normals[0]);
        let scale = s.like(1.0) / safe(volume);
        let guess = [u, v, t];
        let zero = s.like(0.0);
        let mut solution = Solution { value: [zero; 3], slope: [zero; 3] };
        for k in 0..3 {
            solution.value[k] = guess[k] + off.dot(normals[k]) * scale;
            solution.slope[k] = d.dot(normals[k]) * scale;
        }
        (solution, volume)
    }
}

impl<L: Lanes> Solution<L> {
    /// u, v and t as far along the beam.
    #[inline(always)]
    fn at(&self, along: L) -> [L; 3] {
        let ([a, b, c], [da, db, dc]) = (self.value, self.slope);
        [a + da * along, b + db * along, c + dc * along]
    }

    /// The part of a range in which u and v are between 0 and 1 and t is in the tube, with a margin. The solution is for `s`.
    #[inline(always)]
    fn inside(&self, s: L, (mut from, mut to): (L, L), length: L, margin: f32) -> (L, L) {
        let one = s.like(1.0);
        for (k, high) in [one, one, length].into_iter().enumerate() {
            let slack = high * margin;
            let slope = safe(self.slope[k]);
            let (a, b) = ((-slack - self.value[k]) / slope + s, (high + slack - self.value[k]) / slope + s);
            from = Lanes::max(Lanes::min(a, b), from);
            to = Lanes::min(Lanes::max(a, b), to);
        }
        (from, to)
    }
}

/// The part of a range in which beams are before planes `n·p = d`.
#[inline(always)]
fn before<L: Lanes>((o, direction): (V3<L>, V3<L>), normal: V3<L>, d: L, (from, to): (L, L)) -> (L, L) {
    let slope = safe(normal.dot(direction));
    let s = -((normal.dot(o) - d) / slope);
    let rises = slope.gt(slope.like(0.0));
    (L::select(rises, Lanes::max(s, from), from), L::select(rises, to, Lanes::min(s, to)))
}

/// The value of coefficients of 1, u, v and uv.
#[inline(always)]
fn mixed<L: Lanes>(c: &[V3<L>; 4], u: L, v: L) -> V3<L> {
    c[0] + c[1] * u + (c[2] + c[3] * u) * v
}

#[inline(always)]
fn coefficients<L: Lanes>(token: L::Token, lanes: &[[[f32; LANES]; 3]; 4], first: usize) -> [V3<L>; 4] {
    let zero = L::splat(token, 0.0);
    let mut out = [v3(zero, zero, zero); 4];
    for (out, [x, y, z]) in out.iter_mut().zip(lanes) {
        *out = v3(L::load(token, &x[first..]), L::load(token, &y[first..]), L::load(token, &z[first..]));
    }
    out
}

/// The number of a place along a Z-curve.
fn z_curve(x: u32, y: u32) -> u64 {
    let spread = |v: u32| (0..32).fold(0_u64, |sum, bit| sum | u64::from(v >> bit & 1) << (2 * bit));
    spread(x) | spread(y) << 1
}
