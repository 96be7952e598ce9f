//! The first straight part of every view: a beam is a line in the picture, which is followed from pixel to pixel.
//!
//! A pixel is a pyramid with its tip at the eye, or a column if views are parallel. Its mean radiance from a beam is
//!
//! `L = ∫ σ_s p(θ) Φ T(beam) T(eye) / J ds`, over the part of the beam inside, J = r² dΩ per pixel.
//!
//! There is no width to spread the light over: the pixel is the kernel. Of `1/J`, `∫ ds/z²` is exact, since `z` is linear along the beam.

use glam::{DVec4, Vec3};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::V3;

use super::super::eye::{Eye, Projection};
use super::super::media::Place;
use super::beam::{Lit, Parts};
use super::columns::Columns;
use super::looks::{CUT, Part, Plane};
use super::{Canvas, LANES, Media};

/// The number of a pixel that is not cut.
const WHOLE: u32 = u32::MAX;

/// Most pieces that the part of a beam in one pixel is cut into.
const MAX_PIECES: f64 = 1024.0;

/// Angle of a part of a beam, seen from the eye, over which the phase function counts as constant, radians.
const MAX_ANGLE: f64 = 0.02;

/// Where the first straight part of every view ends.
pub(super) struct Screen {
    projection: Projection,
    columns: i32,
    rows: i32,
    /// Whether pixels are wider than [`MAX_ANGLE`].
    is_wide: bool,
    /// The medium around the eye.
    pub place: Place,
    /// By pixel: the plane where its views end.
    ends: Vec<Plane>,
    /// By pixel: [`WHOLE`], or the number of the first of its [`CUT`]² planes in `parts`.
    cut: Vec<u32>,
    parts: Vec<Plane>,
    /// Smoke of varying density on the way to the eye.
    smoke: Option<Columns>,
}

/// Ends of a row of pixels.
#[derive(Default)]
pub(super) struct Ends {
    whole: Vec<Plane>,
    cut: Vec<u32>,
    parts: Vec<Plane>,
}

impl Ends {
    /// Adds a part of a pixel, in order.
    pub fn add(&mut self, part: &Part<'_>) {
        let plane = part.middle.stretches.first().map_or(Plane { normal: Vec3::ZERO, d: -1.0 }, Plane::at_end);
        if part.number == 0 {
            self.whole.push(plane);
            self.cut.push(if part.count == 1 { WHOLE } else { self.parts.len() as u32 });
        }
        if part.count > 1 {
            self.parts.push(plane);
        }
    }
}

impl Screen {
    /// Puts rows together.
    pub fn new(eye: &Eye<'_>, media: Media<'_>, rows: Vec<Ends>) -> Self {
        let place = eye.place();
        let uneven = media.smoke.filter(|smoke| place == Place::Air && smoke.is_uneven());
        let projection = eye.projection();
        let mut screen = Self {
            is_wide: !projection.parallel && projection.area.sqrt() > MAX_ANGLE,
            projection,
            columns: eye.columns() as i32,
            rows: eye.rows() as i32,
            place,
            ends: Vec::new(),
            cut: Vec::new(),
            parts: Vec::new(),
            smoke: uneven.and_then(|smoke| Columns::new(eye, smoke)),
        };
        for row in rows {
            let first = screen.parts.len() as u32;
            screen.ends.extend(row.whole);
            screen.cut.extend(row.cut.into_iter().map(|cut| if cut == WHOLE { WHOLE } else { first + cut }));
            screen.parts.extend(row.parts);
        }
        screen
    }

    /// Adds the light of a beam to the pixels that it passes. `crossings` is a buffer.
    #[inline(always)]
    pub fn add<L: Lanes>(&self, token: L::Token, lit: &Lit<'_>, crossings: &mut Crossings, canvas: &mut Canvas) {
        self.cross(lit, crossings);
        let mut first = 0;
        while first < crossings.pixel.len() {
            self.light::<L>(token, lit, crossings, first, canvas);
            first += L::LEN;
        }
    }

    /// Finds the parts of a beam in pixels.
    fn cross(&self, lit: &Lit<'_>, crossings: &mut Crossings) {
        crossings.clear();
        let (o, d) = (lit.beam.origin.as_dvec3().extend(1.0), lit.beam.direction.as_dvec3().extend(0.0));
        let line = self.projection.rows.map(|row| Linear { at_0: row.dot(o), slope: row.dot(d) });
        let [u, v, w, depth] = line;
        let (columns, rows) = (f64::from(self.columns), f64::from(self.rows));
        let mut range = (0.0, f64::from(lit.beam.length));
        for side in [depth.minus(Linear::constant(self.projection.near)), u, w.times(columns).minus(u), v, w.times(rows).minus(v)] {
            range = side.not_below_0(range);
        }
        if range.0 >= range.1 {
            return;
        }
        walk([u, v, w], range, ([0, 0], [self.columns - 1, self.rows - 1]), |cell, range| {
            let pixel = (cell[1] * self.columns + cell[0]) as usize;
            let first = self.cut[pixel];
            if first == WHOLE {
                self.cross_part(lit, pixel as u32, self.ends[pixel], range, crossings);
                return;
            }
            let (finer, cut) = (f64::from(CUT), CUT as i32);
            let low = cell.map(|c| c * cut);
            walk([u.times(finer), v.times(finer), w], range, (low, low.map(|c| c + cut - 1)), |part, range| {
                let number = (part[1] - low[1]) * cut + part[0] - low[0];
                self.cross_part(lit, pixel as u32, self.parts[first as usize + number as usize], range, crossings);
            });
        });
        crossings.pad();
    }

    /// Adds the part of the beam in a pixel that is before a plane.
    #[inline(always)]
    fn cross_part(&self, lit: &Lit<'_>, pixel: u32, end: Plane, (mut from, mut to): (f64, f64), crossings: &mut Crossings) {
        let beam = &lit.beam;
        let (height, slope) = (end.normal.dot(beam.origin) - end.d, end.normal.dot(beam.direction));
        if height + slope * (from as f32) < 0.0 || height + slope * (to as f32) < 0.0 {
            let clipped = end.clip(beam.origin, beam.direction, (from as f32, to as f32));
            (from, to) = (f64::from(clipped.0).max(from), f64::from(clipped.1).min(to));
            if from >= to {
                return;
            }
        }
        let mut pieces = (to - from) / f64::from(lit.most);
        if self.is_wide {
            let toward = |s: f64| (beam.origin.as_dvec3() + beam.direction.as_dvec3() * s - self.projection.eye).normalize();
            pieces = pieces.max((toward(to) - toward(from)).length() / MAX_ANGLE);
        }
        if pieces <= 1.0 {
            crossings.push(pixel, (from, to));
            return;
        }
        let pieces = pieces.ceil().min(MAX_PIECES);
        for piece in 0..pieces as u32 {
            let at = |k: u32| from + (to - from) * (f64::from(k) / pieces);
            crossings.push(pixel, (at(piece), at(piece + 1)));
        }
    }

    /// Adds the light of some parts of a beam to their pixels.
    #[inline(always)]
    fn light<L: Lanes>(&self, token: L::Token, lit: &Lit<'_>, crossings: &Crossings, first: usize, canvas: &mut Canvas) {
        let projection = &self.projection;
        let (middle, chord) = (L::load(token, &crossings.middle[first..]), L::load(token, &crossings.chord[first..]));
        let axis = projection.axis.as_vec3();
        let p = V3::splat(token, lit.beam.origin) + V3::splat(token, lit.beam.direction) * middle;
        let to_p = p - V3::splat(token, projection.eye.as_vec3());
        let z = to_p.dot(V3::splat(token, axis));
        let near = projection.near as f32;
        let (direction, way, per_volume) = if projection.parallel {
            (V3::splat(token, axis), z - near, L::splat(token, (1.0 / projection.area) as f32))
        } else {
            let distance = to_p.length();
            // ρ/(A z₀ z₁), ρ = r/z, z₀ z₁ = z² − (½ Δz)².
            let half = chord * (0.5 * axis.dot(lit.beam.direction));
            let per_volume = distance / (z * (z * z - half * half) * (projection.area as f32));
            (to_p * (z.like(1.0) / distance), distance - distance / z * near, per_volume)
        };
        // Views start at the near plane.
        let (density, column) = lit.densities(token, middle);
        let view_column = match &self.smoke {
            Some(table) if lit.is_in_uneven_smoke() => self.tabulated(table, p, way),
            _ => lit.view_columns(token, p - direction * way, direction, way, u32::MAX),
        };
        let columns = [column, view_column];
        let slope = direction.dot(V3::splat(token, lit.beam.direction));
        let light = lit.scattered(token, &Parts { chord, direction, per_volume, density, columns, slope });
        let (r, g, b) = (light.x.to_array(), light.y.to_array(), light.z.to_array());
        for (k, &pixel) in crossings.pixel[first..].iter().take(L::LEN).enumerate() {
            canvas.add(pixel, [r[k], g[k], b[k]]);
        }
    }

    /// Integrals of the density of smoke along the views to places, from a table; `way` is the length of the views.
    #[inline(always)]
    fn tabulated<L: Lanes>(&self, table: &Columns, p: V3<L>, way: L) -> L {
        let (px, py, pz, way_lanes) = (p.x.to_array(), p.y.to_array(), p.z.to_array(), way.to_array());
        let mut columns = [0.0; LANES];
        for k in 0..L::LEN {
            let [u, v, w, _] = self.projection.rows;
            let p = DVec4::new(f64::from(px[k]), f64::from(py[k]), f64::from(pz[k]), 1.0);
            let scale = 1.0 / w.dot(p);
            let place = [u.dot(p) * scale, v.dot(p) * scale];
            let [x, y] = [place[0].clamp(0.0, f64::from(self.columns)), place[1].clamp(0.0, f64::from(self.rows))];
            columns[k] = table.at(x as f32, y as f32, way_lanes[k]);
        }
        L::load(way.token(), &columns)
    }
}

/// A function that is linear along a beam.
#[derive(Clone, Copy)]
struct Linear {
    at_0: f64,
    slope: f64,
}

impl Linear {
    fn constant(at_0: f64) -> Self {
        Self { at_0, slope: 0.0 }
    }

    #[inline(always)]
    fn at(self, s: f64) -> f64 {
        self.at_0 + self.slope * s
    }

    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        Self { at_0: self.at_0 * factor, slope: self.slope * factor }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self { at_0: self.at_0 - other.at_0, slope: self.slope - other.slope }
    }

    /// The part of a range in which the function is not below 0.
    #[inline(always)]
    fn not_below_0(self, (from, to): (f64, f64)) -> (f64, f64) {
        let s = -self.at_0 / self.slope;
        if self.slope > 0.0 {
            (from.max(s), to)
        } else if self.slope < 0.0 {
            (from, to.min(s))
        } else if self.at_0 >= 0.0 {
            (from, to)
        } else {
            (from, from)
        }
    }
}

/// Follows the line `(u/w, v/w)` over a range from square to square of a grid. `visit` is called with each square and the range in it.
#[inline(always)]
fn walk([u, v, w]: [Linear; 3], (from, to): (f64, f64), (low, high): ([i32; 2], [i32; 2]), mut visit: impl FnMut([i32; 2], (f64, f64))) {
    let axes = [u, v];
    let mut cell = [0; 2];
    let mut step = [0_i32; 2];
    for axis in 0..2 {
        let place = axes[axis].at(from) / w.at(from);
        cell[axis] = (place.floor() as i32).clamp(low[axis], high[axis]);
        // The sign of d(u/w)/ds is the same all along.
        let turn = axes[axis].slope * w.at_0 - axes[axis].at_0 * w.slope;
        step[axis] = if turn > 0.0 {
            1
        } else if turn < 0.0 {
            -1
        } else {
            0
        };
    }
    // Where the line leaves a square along an axis; never, if it does not come so far.
    let leaves = |axis: usize, cell: i32| {
        let line = w.times(f64::from(cell + i32::from(step[axis] > 0)));
        let ahead = axes[axis].minus(line);
        if step[axis] == 0 || ahead.at(to) * f64::from(step[axis]) <= 0.0 { f64::INFINITY } else { -ahead.at_0 / ahead.slope }
    };
    let mut next = [leaves(0, cell[0]), leaves(1, cell[1])];
    let mut s = from;
    loop {
        let axis = usize::from(next[1] < next[0]);
        let end = next[axis].max(s).min(to);
        if end > s {
            visit(cell, (s, end));
        }
        if end >= to {
            return;
        }
        s = end;
        cell[axis] += step[axis];
        if cell[axis] < low[axis] || cell[axis] > high[axis] {
            return;
        }
        next[axis] = leaves(axis, cell[axis]);
    }
}

/// Parts of one beam in pixels.
#[derive(Default)]
pub(super) struct Crossings {
    pixel: Vec<u32>,
    /// Distance of the middle from the start of the beam, and length, m.
    middle: Vec<f32>,
    chord: Vec<f32>,
}

impl Crossings {
    fn clear(&mut self) {
        self.pixel.clear();
        self.middle.clear();
        self.chord.clear();
    }

    #[inline(always)]
    fn push(&mut self, pixel: u32, (from, to): (f64, f64)) {
        self.pixel.push(pixel);
        self.middle.push((0.5 * (from + to)) as f32);
        self.chord.push((to - from) as f32);
    }

    /// Fills the values up to a multiple of [`LANES`].
    fn pad(&mut self) {
        let padded = self.pixel.len().next_multiple_of(LANES);
        let last = self.middle.last().copied().unwrap_or(0.0);
        self.middle.resize(padded, last);
        self.chord.resize(padded, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines in all directions, also along and on the sides of squares, are covered by their parts without gaps, each in its own square.
    #[test]
    fn walks_cover_lines() {
        let lines = [(0.3, 0.7), (-1.3, 0.2), (0.0, 1.0), (1.0, 0.0), (-0.001, -2.0), (0.0, 0.0), (1.0, 1.0), (-1.0, 1.0)];
        let mut squares = 0;
        for (du, dv) in lines {
            for (u0, v0) in [(5.5, 3.25), (5.0, 3.0), (4.0, 4.5), (0.0, 0.0), (8.0, 8.0)] {
                for dw in [0.0, 0.04, -0.04] {
                    // In perspective: u/w starts at u0 and v/w at v0.
                    let w = Linear { at_0: 2.0, slope: dw };
                    let (u, v) = (Linear { at_0: 2.0 * u0, slope: du }, Linear { at_0: 2.0 * v0, slope: dv });
                    let mut range = (0.0, 12.0);
                    for side in [u, w.times(8.0).minus(u), v, w.times(8.0).minus(v)] {
                        range = side.not_below_0(range);
                    }
                    if range.0 >= range.1 {
                        continue;
                    }
                    let mut reached = range.0;
                    walk([u, v, w], range, ([0, 0], [7, 7]), |cell, (from, to)| {
                        assert!((from - reached).abs() < 1.0e-9 && to > from, "a gap from {reached} to {from}");
                        reached = to;
                        squares += 1;
                        let middle = 0.5 * (from + to);
                        for (axis, line) in [u, v].into_iter().enumerate() {
                            let place = line.at(middle) / w.at(middle) - f64::from(cell[axis]);
                            assert!((-1.0e-9..=1.0 + 1.0e-9).contains(&place), "{place} of square {cell:?}");
                        }
                    });
                    assert!(
                        (reached - range.1).abs() < 1.0e-9,
                        "the walk from ({u0}, {v0}) along ({du}, {dv}) ends at {reached} of {range:?}"
                    );
                }
            }
        }
        assert!(squares > 300, "{squares} squares");
    }
}
