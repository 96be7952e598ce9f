//! Sections of beams at a focus that are narrower than a pixel.
//!
//! Whether a pixel's middle lies in a section decides whether the pixel is lit. A section near a focus is a needle, and by that rule a pixel gets all of its
//! light or none: E = Φ/A without bound, with a probability of A over the pixel's area. The mean is right, and single pixels are a hundred times too bright.
//! The light of a narrow section is therefore its mean over a square around the pixel's middle: the share of the square that the section covers, by the signed
//! areas below its edges. The square is as wide as the pixel is wider than the section, so that it shrinks to the middle where sections grow to a pixel's width.
//! A section below a sixteenth of a pixel is taken to be that wide: below this, its corners are rounding errors.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, v2};

/// Least height and length of a section, and least width of a square, as a share of a pixel's width.
const LEAST: f32 = 1.0 / 16.0;

/// A narrow section and the square over which its light is averaged.
pub(super) struct Needle<L: Lanes> {
    /// Corners: start and end of the longest edge, and the apex.
    corners: [V2<L>; 3],
    /// Twice its signed area, m².
    double_area: L,
    /// Number of the section's corner at which the longest edge starts.
    first: L,
    /// Width of the square, m.
    square: L,
}

/// Sections of less than this share of their generator are at a focus. Elsewhere light is even enough for the pixel's middle to stand for the pixel, however
/// narrow the sections are: those of a fine mesh lie side by side, and the middle is in one of them.
pub(super) const FOCUSED: f32 = 1.0 / 32.0;

/// Whether a section is at a focus. `double_area`: twice its signed area, `generator`: twice the area of the beam's generator, both seen from above, m².
#[inline(always)]
pub(super) fn is_focused<L: Lanes>(double_area: L, generator: L) -> L::Mask {
    double_area.abs().lt(generator * FOCUSED)
}

/// Whether a section is narrower than a pixel: whether its height over its longest edge is.
#[inline(always)]
pub(super) fn is_narrow<L: Lanes>(corners: &[V2<L>; 3], double_area: L, pixel: L) -> L::Mask {
    let [a, b, c] = *corners;
    let (ab, bc, ca) = ((b - a).dot(b - a), (c - b).dot(c - b), (a - c).dot(a - c));
    let longest = Lanes::max(Lanes::max(ab, bc), ca);
    let wide = pixel * (1.0 - LEAST);
    (double_area * double_area).lt(wide * wide * longest) | longest.equals(pixel.like(0.0))
}

/// Whether a point may be lit by a section that is narrower than a pixel: false only where [`Needle::coverage`] is 0.
#[inline(always)]
pub(super) fn is_near<L: Lanes>(corners: &[V2<L>; 3], at: V2<L>, pixel: L) -> L::Mask {
    let [a, b, c] = *corners;
    let reach = pixel * (0.5 + 2.0 * LEAST);
    is_within([a.x, b.x, c.x], at.x, reach) & is_within([a.y, b.y, c.y], at.y, reach)
}

/// Whether a number is between the least and the greatest of three, or no farther from them than `reach`.
#[inline(always)]
fn is_within<L: Lanes>([a, b, c]: [L; 3], at: L, reach: L) -> L::Mask {
    let (low, high) = (Lanes::min(Lanes::min(a, b), c), Lanes::max(Lanes::max(a, b), c));
    at.ge(low - reach) & (high + reach).ge(at)
}

impl<L: Lanes> Needle<L> {
    /// The needle of a section. `double_area`: twice its signed area, m²; `pixel`: a pixel's width, m.
    #[inline(always)]
    pub fn of(corners: &[V2<L>; 3], double_area: L, pixel: L) -> Self {
        let (zero, one) = (pixel.like(0.0), pixel.like(1.0));
        let (mut start, mut span, mut apex) = (corners[0], corners[1] - corners[0], corners[2]);
        let (mut squared, mut first) = (span.dot(span), zero);
        for i in 1..3 {
            let other = corners[(i + 1) % 3] - corners[i];
            let longer = other.dot(other).gt(squared);
            start = V2::select(longer, corners[i], start);
            span = V2::select(longer, other, span);
            apex = V2::select(longer, corners[(i + 2) % 3], apex);
            squared = L::select(longer, other.dot(other), squared);
            first = L::select(longer, zero.like(i as f32), first);
        }
        let length = squared.sqrt();
        let point = !length.gt(zero);
        let inverse = one / L::select(point, one, length);
        let direction = v2(L::select(point, one, span.x * inverse), span.y * inverse);
        let height = double_area.abs() * inverse;
        let least = pixel * LEAST;
        let (long, wide) = (Lanes::max(length, least), Lanes::max(height, least));
        let grown = L::select(double_area.lt(zero), height - wide, wide - height);
        let end = v2(start.x + direction.x * long, start.y + direction.y * long);
        let apex = v2(apex.x - direction.y * grown, apex.y + direction.x * grown);
        Self {
            double_area: L::select(double_area.lt(zero), -(long * wide), long * wide),
            corners: [start, end, apex],
            first,
            square: pixel + least - wide,
        }
    }

    /// Area of the section, m².
    #[inline(always)]
    pub fn area(&self) -> L {
        self.double_area.abs() * 0.5
    }

    /// Share of the square around a point that the section covers, 0 to 1.
    #[inline(always)]
    pub fn coverage(&self, at: V2<L>) -> L {
        let zero = at.x.like(0.0);
        let inverse = zero.like(1.0) / self.square;
        let [mut a, mut b, mut c] = self.corners;
        for p in [&mut a, &mut b, &mut c] {
            *p = v2((p.x - at.x) * inverse + 0.5, (p.y - at.y) * inverse + 0.5);
        }
        let under = under_edge(a, b) + under_edge(b, c) + under_edge(c, a);
        // Counter-clockwise, the upper edges run backwards.
        Lanes::clamp(L::select(self.double_area.lt(zero), under, -under), 0.0, 1.0)
    }

    /// Barycentric weights of the section's point that is near a point, in the order of the section's corners.
    #[inline(always)]
    pub fn weights(&self, at: V2<L>) -> [L; 3] {
        let (zero, one) = (at.x.like(0.0), at.x.like(1.0));
        let [a, b, c] = self.corners;
        let inverse = one / self.double_area;
        let mut own = [zero; 3];
        for (weight, (from, to)) in own.iter_mut().zip([(b, c), (c, a), (a, b)]) {
            *weight = Lanes::max((to - from).perp_dot(at - from) * inverse, zero);
        }
        let whole = one / (own[0] + own[1] + own[2]);
        let (second, third) = (self.first.equals(one), self.first.equals(zero.like(2.0)));
        let mut weights = [zero; 3];
        for i in 0..3 {
            weights[i] = L::select(third, own[(i + 1) % 3], L::select(second, own[(i + 2) % 3], own[i])) * whole;
        }
        weights
    }
}

/// Area of the unit square below an edge, negative if the edge runs towards −x.
#[inline(always)]
fn under_edge<L: Lanes>(a: V2<L>, b: V2<L>) -> L {
    let (zero, one) = (a.x.like(0.0), a.x.like(1.0));
    let run = b.x - a.x;
    let inverse = L::select(run.equals(zero), zero, one / run);
    let (x0, x1) = (Lanes::clamp(a.x, 0.0, 1.0), Lanes::clamp(b.x, 0.0, 1.0));
    let rise = b.y - a.y;
    let (y0, y1) = (a.y + (x0 - a.x) * inverse * rise, a.y + (x1 - a.x) * inverse * rise);
    // The mean of y, clamped to the square, along the part over it: below it, in it, above it.
    let (low, high) = (Lanes::clamp(y0, 0.0, 1.0), Lanes::clamp(y1, 0.0, 1.0));
    let (climb, middle) = (y1 - y0, (low + high) * 0.5);
    let level = climb.abs().lt(zero.like(1e-6));
    let sum = (low - y0) * low + (high - low) * middle + (y1 - high) * high;
    let mean = L::select(level, middle, sum / L::select(level, one, climb));
    (x1 - x0) * mean
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXEL_M: f32 = 0.25;

    /// A section turned by the angle of a 3-4-5 triangle.
    fn section(length: f32, height: f32, move_by: V2<f32>) -> [V2<f32>; 3] {
        let at = |u: f32, v: f32| v2(1.0 + 0.8 * u - 0.6 * v, 2.0 + 0.6 * u + 0.8 * v) + move_by;
        [at(0.0, 0.0), at(length, 0.0), at(0.3 * length, height)]
    }

    fn needle(corners: &[V2<f32>; 3], pixel: f32) -> Needle<f32> {
        let double_area = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        assert!(
            is_narrow(corners, double_area, pixel)
                && is_focused(double_area, 64.0 * double_area.abs() + 1.0)
                && !is_focused(double_area, 0.5 * double_area.abs())
        );
        let wide = [v2(0.0, 0.0), v2(1.0, 0.0), v2(0.0, 1.0)];
        assert!(!is_narrow(&wide, 1.0, pixel) && is_narrow(&wide, 1.0, 2.0));
        Needle::of(corners, double_area, pixel)
    }

    /// The coverage against a count of points, for both orientations, every order of corners, and squares inside, outside and on edges.
    #[test]
    fn coverage_is_the_share_of_points() {
        for turn in 0..6 {
            let mut corners = section(0.7, 0.11, v2(0.0, 0.0));
            corners.rotate_left(turn % 3);
            if turn >= 3 {
                corners.swap(0, 1);
            }
            let needle = needle(&corners, PIXEL_M);
            assert!((needle.square - 0.155625).abs() < 1e-6 && (needle.area() - 0.5 * 0.7 * 0.11).abs() < 1e-6);
            let double_area = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            for k in 0..49 {
                let at = v2(0.95 + 0.11 * (k % 7) as f32, 1.95 + 0.09 * (k / 7) as f32);
                let counted = (0..200 * 200).filter(|n| {
                    let p = at + v2(((n % 200) as f32 + 0.5) / 200.0 - 0.5, ((n / 200) as f32 + 0.5) / 200.0 - 0.5) * needle.square;
                    (0..3).all(|i| ((corners[(i + 1) % 3] - corners[i]).perp_dot(p - corners[i])) * double_area >= 0.0)
                });
                let share = counted.count() as f32 / 40000.0;
                assert!(share == 0.0 || is_near(&corners, at, PIXEL_M));
                assert!((needle.coverage(at) - share).abs() < 2e-3, "{turn} {k}: {} {share}", needle.coverage(at));
            }
        }
    }

    /// Pixels on a grid get all of a section's light, wherever it lies and however narrow it is; by the rule of the middle they get none or several times it.
    #[test]
    fn pixels_share_the_light_of_a_section() {
        for (length, height) in [(0.9, 0.0), (0.9, 0.001), (0.9, 0.03), (0.01, 0.002), (0.0, 0.0), (0.9, 0.06)] {
            for shift in 0..16 {
                let corners = section(length, height, v2(shift as f32 * 0.037, shift as f32 * 0.053));
                let needle = needle(&corners, PIXEL_M);
                let pixel = |k: u32| v2((k % 32) as f32 * PIXEL_M - 2.0, (k / 32) as f32 * PIXEL_M);
                let light = (0..32 * 32).map(|k| needle.coverage(pixel(k)) / needle.area()).map(|e| e * PIXEL_M * PIXEL_M);
                let (sum, most) = light.fold((0.0, 0.0_f32), |(sum, most), e| (sum + e, most.max(e)));
                // The square is narrower than the pixel by the section's height less a sixteenth of a pixel, and so much the sum may vary.
                let within = (height / PIXEL_M - LEAST).max(0.0) + 2e-3;
                assert!((sum - 1.0).abs() < within, "{length} {height}: {sum}");
                assert!(most < 1.0 + within, "{length} {height}: {most}");
            }
        }
    }

    #[test]
    fn weights_follow_the_order_of_the_corners() {
        for turn in 0..3 {
            let mut corners = section(0.7, 0.11, v2(0.0, 0.0));
            corners.rotate_left(turn);
            let b = needle(&corners, PIXEL_M).weights(corners[0] * 0.5 + corners[1] * 0.3 + corners[2] * 0.2);
            assert!((b[0] - 0.5).abs() < 1e-4 && (b[1] - 0.3).abs() < 1e-4 && (b[2] - 0.2).abs() < 1e-4, "{turn}: {b:?}");
        }
    }
}
