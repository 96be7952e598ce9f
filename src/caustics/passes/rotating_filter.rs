//! A low-pass filter with few taps on a disc that is rotated from texel to texel: "a multi-tap low pass filter with a rotating sampling kernel that
//! reduces noise" [PP10 §3.5].
//!
//! The paper gives neither the number of taps nor their positions, weights or angles. The table lists our decisions.
//!
//! | Quantity | Here | Why |
//! |---|---|---|
//! | positions | tap k of n at radius `R·√((k + ½)/n)`, angle `k·π·(√5 − 1)/2`, with its mirror image through the centre: a sunflower [Vogel 1979, Math. Biosci. 44] of pairs | every tap stands for an equal area of the disc; the pairs reproduce a linear ramp |
//! | weights | all equal, `1/(2n)` | the mean over the disc |
//! | angle | `π·B(x mod 4, y mod 4)/16` with B the 4x4 ordered-dither matrix [Bayer 1973] | every 4x4 texels contain each of the 16 angles once, and angles of neighbours differ by much |
//! | between texels | linear | the result is continuous in R |
//!
//! With all angles together the mean square distance of the taps is `R²/2`, that of a uniform disc, and the mean offset is zero.
//!
//! Inputs, outputs and edges are those of [`super::filter`]. The mean is a running one, `mₖ = mₖ₋₁ + (xₖ − mₖ₋₁)/k`: a constant keeps its bits, and
//! non-negative input gives non-negative output. Light is conserved on average over the 16 angles, not texel by texel, because neighbours gather with
//! different taps. Road not taken: an angle from a hash, whose noise has no period that a 4x4 mean could remove.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::frame::{BindEntry, Frame, TextureId};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, TextureDescriptor, TextureView};

use super::fullscreen::{FullscreenVertex, fill, load_clamped};

/// Most pairs of taps.
pub const MAX_PAIRS: u32 = 16;

/// Angles of the texels of a 4x4 square, row by row, in sixteenths of half a turn: the ordered-dither matrix.
pub const ANGLES: [u32; 16] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];

/// Positions on a disc at which the filter reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotatingKernel {
    /// Radius of the disc, texels, 0 or more. Default: 3, as wide as the 7x7 texels of Wyman & Davis 2006.
    pub radius_tx: f32,
    /// Pairs of taps, 1 to [`MAX_PAIRS`]; other values are clamped. Default: 8.
    pub pairs: u32,
}

impl Default for RotatingKernel {
    fn default() -> Self {
        Self { radius_tx: 3.0, pairs: 8 }
    }
}

impl RotatingKernel {
    fn pair_count(&self) -> u32 {
        self.pairs.clamp(1, MAX_PAIRS)
    }

    /// Offset of one tap of each pair before rotation, texels. The other tap is at minus that offset.
    #[must_use]
    pub fn taps_tx(&self) -> Vec<[f32; 2]> {
        let count = self.pair_count();
        let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0) / 2.0;
        let tap = |k: u32| {
            let radius = f64::from(self.radius_tx) * ((f64::from(k) + 0.5) / f64::from(count)).sqrt();
            let angle = f64::from(k) * golden;
            [(radius * libm::cos(angle)) as f32, (radius * libm::sin(angle)) as f32]
        };
        (0..count).map(tap).collect()
    }
}

/// Uniform of a rotating kernel.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RotatingUniform {
    /// One tap of each pair, two to a vector, texels.
    pub taps: [Vec4; 8],
    /// Cosine and sine of the angle at each texel of a 4x4 square, row by row, two to a vector.
    pub rotations: [Vec4; 8],
    /// x: number of pairs.
    pub count: Vec4,
}

impl From<&RotatingKernel> for RotatingUniform {
    fn from(kernel: &RotatingKernel) -> Self {
        let taps = kernel.taps_tx();
        let tap = |k: usize| taps.get(k).copied().unwrap_or([0.0; 2]);
        let turn = |k: usize| {
            let angle = f64::from(ANGLES[k]) * std::f64::consts::PI / 16.0;
            [libm::cos(angle) as f32, libm::sin(angle) as f32]
        };
        let pack = |[a, b]: [f32; 2], [c, d]: [f32; 2]| Vec4::new(a, b, c, d);
        Self {
            taps: std::array::from_fn(|k| pack(tap(2 * k), tap(2 * k + 1))),
            rotations: std::array::from_fn(|k| pack(turn(2 * k), turn(2 * k + 1))),
            count: Vec4::new(kernel.pair_count() as f32, 0.0, 0.0, 0.0),
        }
    }
}

/// Vector number `k` of an array that stores two 2D vectors in each `Vec4`.
#[inline(always)]
fn unpack(packed: &[Vec4; 8], k: usize) -> [f32; 2] {
    let both = packed[k / 2];
    if k.is_multiple_of(2) { [both.x, both.y] } else { [both.z, both.w] }
}

/// Bindings: kernel, source.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<RotatingUniform>()), BindingKind::Texture];

/// The program.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("fullscreen.wgsl"), include_str!("load_clamped.wgsl"), include_str!("rotating_filter.wgsl"))),
        ..Program::new("rotating_filter", FullscreenVertex, Fragment)
    })
}

/// Bilinear interpolation between the four texels around a position in texels, with centres at integers.
#[inline(always)]
fn bilinear<L: Lanes>(source: &TextureView<'_>, x: L, y: L) -> V4<L> {
    let (left, top) = (x.floor(), y.floor());
    let (right, lower) = (x - left, y - top);
    let upper_left = load_clamped(source, left, top);
    let upper = upper_left + (load_clamped(source, left + 1.0, top) - upper_left) * right;
    let lower_left = load_clamped(source, left, top + 1.0);
    let below = lower_left + (load_clamped(source, left + 1.0, top + 1.0) - lower_left) * right;
    upper + (below - upper) * lower
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let kernel: &RotatingUniform = bindings.uniform(0);
        let source = bindings.texture(1);
        let (x, y) = (input.position.x - 0.5, input.position.y - 0.5);
        let (columns, rows) = (x.to_i32(), y.to_i32());
        let place = |lane: usize| ((rows[lane] & 3) * 4 + (columns[lane] & 3)) as usize;
        let cos = L::from_fn(input.token, |lane| unpack(&kernel.rotations, place(lane))[0]);
        let sin = L::from_fn(input.token, |lane| unpack(&kernel.rotations, place(lane))[1]);
        let zero = x.like(0.0);
        let mut mean = v4(zero, zero, zero, zero);
        for k in 0..kernel.count.x as usize {
            let tap = unpack(&kernel.taps, k);
            let (dx, dy) = (cos * tap[0] - sin * tap[1], sin * tap[0] + cos * tap[1]);
            let pair = (bilinear(source, x + dx, y + dy) + bilinear(source, x - dx, y - dy)) * x.like(0.5);
            mean = mean + (pair - mean) * (x.like(1.0) / (k as f32 + 1.0));
        }
        output.color[0] = mean;
    }
}

/// Adds the pass and a texture, both named `label`. Returns the texture, which has the source's size and format.
///
/// `source` is a float texture, one layer, one level.
pub fn rotating(frame: &mut Frame, label: &str, source: TextureId, kernel: &RotatingKernel) -> TextureId {
    let desc = TextureDescriptor { label: label.to_owned(), ..frame.textures[source.index()].desc.clone() };
    let kernel = frame.buffer(label, Arc::new(Buffer::from_value(&RotatingUniform::from(kernel))));
    fill(frame, desc, program(), vec![BindEntry::Uniform(kernel, 0), BindEntry::texture(source)])
}
