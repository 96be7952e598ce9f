//! A separable low-pass filter: `O = Σᵢ Σⱼ wᵢ wⱼ I(x + i, y + j)`, as a horizontal and a vertical pass.
//!
//! Input: a float texture of one to four channels, any size; the output has its size and format. Beyond an edge of the texture the edge's texel is
//! repeated, so a constant stays constant up to the edge; light near an edge is not conserved.
//!
//! A pass computes `I₀ + Σᵢ wᵢ·((I₋ᵢ − I₀) + (I₊ᵢ − I₀))`, which is the same sum because the weights add up to one:
//! - a constant keeps its bits;
//! - weights are multiples of 2⁻²⁴ whose sum is 1 without rounding: the response to a single texel of 1 inside the texture equals the weights to the
//!   bit and adds up to 1; both passes together add up to 1 within `(R + 2)·2⁻²⁴`, the rounding of their products;
//! - non-negative input gives non-negative output, provided that the centre's weight is above `(R + 3)·2⁻²⁴`.
//!
//! These hold for 32-bit formats; 16-bit formats round after each pass. Texels must be finite: one infinite or NaN texel spoils all texels within the
//! radius. Road not taken: taps between texels, which halve their number by the sampler's linear filter, whose weights have 8 bits on GPUs.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::lanes::Lanes;
use nephroid_pipeline::frame::{BindEntry, Frame, TextureId};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, TextureDescriptor};

use super::fullscreen::{FullscreenVertex, fill, load_clamped};

/// Largest radius of a kernel, in texels.
pub const MAX_RADIUS_TX: u32 = 31;

/// Weights are multiples of `1/STEPS`. f32 holds them, and every partial sum of them up to 1, exactly.
const STEPS: f64 = (1_u32 << 24) as f64;

/// The weights of a symmetric kernel along one axis. They add up to 1 exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// By distance from the centre, texels.
    half: Vec<f32>,
}

impl Kernel {
    /// Gaussian at texel centres: `wᵢ ∝ e^(−i²/(2σ²))` for `|i| ≤ radius_tx`.
    ///
    /// `sigma_tx` is σ in texels and must be above 0; `radius_tx` is at most [`MAX_RADIUS_TX`]. Otherwise `None`. A radius of 3σ leaves out 0.3 % of
    /// the Gaussian.
    #[must_use]
    pub fn gaussian(sigma_tx: f32, radius_tx: u32) -> Option<Self> {
        let sigma = f64::from(sigma_tx);
        let half: Vec<f64> = (0..=radius_tx).map(|i| libm::exp(-0.5 * (f64::from(i) / sigma) * (f64::from(i) / sigma))).collect();
        if sigma > 0.0 { Self::from_weights(&half) } else { None }
    }

    /// `wᵢ = 1/(2R + 1)` for `|i| ≤ R`: the mean over `2·radius_tx + 1` texels. `None` beyond [`MAX_RADIUS_TX`].
    #[must_use]
    pub fn mean(radius_tx: u32) -> Option<Self> {
        Self::from_weights(&vec![1.0; radius_tx as usize + 1])
    }

    /// Weights proportional to `half`, by distance from the centre: `half[0]` is the centre's, `half[i]` that of each of the two texels at distance
    /// `i`.
    ///
    /// All must be finite and not negative, the centre's above 0; at most `MAX_RADIUS_TX + 1` of them. Otherwise `None`. Each weight but the centre's
    /// is rounded down by less than 2⁻²⁴; the centre gets the remainder.
    #[must_use]
    pub fn from_weights(half: &[f64]) -> Option<Self> {
        let valid = half.first().is_some_and(|centre| *centre > 0.0) && half.iter().all(|w| w.is_finite() && *w >= 0.0);
        if !valid || half.len() > MAX_RADIUS_TX as usize + 1 {
            return None;
        }
        let total = half[0] + 2.0 * half[1..].iter().fold(0.0, |sum, w| sum + w);
        let steps: Vec<f64> = half[1..].iter().map(|w| (w / total * STEPS).floor()).collect();
        let centre = STEPS - 2.0 * steps.iter().fold(0.0, |sum, s| sum + s);
        Some(Self { half: std::iter::once(centre).chain(steps).map(|s| (s / STEPS) as f32).collect() })
    }

    /// The radius, in texels.
    #[must_use]
    pub fn radius_tx(&self) -> u32 {
        self.half.len() as u32 - 1
    }

    /// The weight of a texel at distance `offset_tx`; 0 beyond the radius.
    #[must_use]
    pub fn weight(&self, offset_tx: i32) -> f32 {
        self.half.get(offset_tx.unsigned_abs() as usize).copied().unwrap_or(0.0)
    }
}

/// Uniform of a kernel along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct KernelUniform {
    /// Weights by distance from the centre, four to a vector; 0 beyond the radius.
    pub weights: [Vec4; 8],
    /// x, y: step from tap to tap, texels. z: the radius, texels.
    pub step: Vec4,
}

impl KernelUniform {
    fn new(kernel: &Kernel, step: (f32, f32)) -> Self {
        let weight = |i: usize| kernel.weight(i as i32);
        let weights = std::array::from_fn(|k| Vec4::new(weight(4 * k), weight(4 * k + 1), weight(4 * k + 2), weight(4 * k + 3)));
        Self { weights, step: Vec4::new(step.0, step.1, kernel.radius_tx() as f32, 0.0) }
    }
}

/// Bindings: kernel, source.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<KernelUniform>()), BindingKind::Texture];

/// The program of one pass.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("fullscreen.wgsl"), include_str!("load_clamped.wgsl"), include_str!("filter.wgsl"))),
        ..Program::new("filter", FullscreenVertex, Fragment)
    })
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let kernel: &KernelUniform = bindings.uniform(0);
        let source = bindings.texture(1);
        let (x, y) = (input.position.x - 0.5, input.position.y - 0.5);
        let here = load_clamped(source, x, y);
        let mut sum = here;
        for tap in 1..=kernel.step.z as usize {
            let (dx, dy) = (kernel.step.x * tap as f32, kernel.step.y * tap as f32);
            let before = load_clamped(source, x - dx, y - dy);
            let after = load_clamped(source, x + dx, y + dy);
            let weight = x.like(kernel.weights[tap / 4][tap % 4]);
            sum = sum + ((before - here) + (after - here)) * weight;
        }
        output.color[0] = sum;
    }
}

/// Adds both passes, each with a texture of its name: `{label} across` along x, then `label` along y. Returns the texture `label`.
///
/// `source` is a float texture, one layer, one level.
pub fn separable(frame: &mut Frame, label: &str, source: TextureId, kernel: &Kernel) -> TextureId {
    let across = pass(frame, format!("{label} across"), source, &KernelUniform::new(kernel, (1.0, 0.0)));
    pass(frame, label.to_owned(), across, &KernelUniform::new(kernel, (0.0, 1.0)))
}

fn pass(frame: &mut Frame, label: String, source: TextureId, kernel: &KernelUniform) -> TextureId {
    let desc = TextureDescriptor { label: label.clone(), ..frame.textures[source.index()].desc.clone() };
    let kernel = frame.buffer(label, Arc::new(Buffer::from_value(kernel)));
    fill(frame, desc, program(), vec![BindEntry::Uniform(kernel, 0), BindEntry::texture(source)])
}
