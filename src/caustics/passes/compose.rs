//! Sum of layers: `O(p) = Σₗ sₗ·Lₗ(p)`, where layers may be smaller than the result [PP10 §3, step 7, and §4.1].
//!
//! A layer of the result's size is read texel by texel. A smaller one is upsampled by depth: joint bilateral upsampling [Kopf et al. 2007] over the
//! 2x2 texels q around a pixel p,
//!
//! `L(p) = Σ_q I_q·f_q·g_q / Σ_q f_q·g_q`, with f the weights of linear interpolation and `g_q = 1 where |z_q − z_p| ≤ τ·z_p, else 0`,
//!
//! where z is the distance along the view: `z_p` from the result's depth, `z_q` from the layer's. If no texel passes, the one nearest in depth is
//! taken [nearest-depth upsampling, white paper of NVIDIA's OpacityMapping sample]; of several, the first in row order. Kopf's g is a Gaussian, which
//! is nowhere zero, so a bright background bleeds over an edge.
//!
//! Properties:
//! - a constant keeps its bits, because the sum is taken over differences from the texel nearest in depth;
//! - on one surface a linear ramp is reproduced, except on the outermost half texel, where it is continued as a constant;
//! - no light crosses a step in depth larger than τ if one of the four texels lies on the pixel's side of the step, see [`super::downsample`];
//! - for equal sizes, f is 1 for the pixel's own texel: the layer keeps its bits, whatever the depths are.
//!
//! Layers are added in the given order by additive blending: one draw each, in one pass. A sum that is zero is +0.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::frame::{BindEntry, ColorAttachment, Draw, Frame, Pass, TextureId};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::state::{ADDITIVE, Color, ColorTargetState, ColorWrites, TextureFormat};
use nephroid_pipeline::{BindingKind, Bindings, Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};

use super::fullscreen::{FullscreenVertex, VERTICES, load_clamped};

/// Larger, infinite and NaN distances are replaced by this distance, m.
const FARTHEST_M: f32 = 1.0e30;

/// Distance along the view, m, from the value d of a depth texture: `(n₀ + n₁·d)/(m₀ + m₁·d)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceFromDepth {
    /// n₀ and n₁.
    pub numerator: Vec2,
    /// m₀ and m₁.
    pub denominator: Vec2,
}

impl DistanceFromDepth {
    /// For a texture that holds distances, m.
    pub const IDENTITY: Self = Self { numerator: Vec2::Y, denominator: Vec2::X };

    /// For depth of [`nephroid_math::space::perspective`]: `near/(1 − d·(far − near)/far)`. `far_m` may be infinite.
    #[must_use]
    pub fn perspective(near_m: f32, far_m: f32) -> Self {
        let slope = if far_m.is_infinite() { 1.0 } else { (f64::from(far_m) - f64::from(near_m)) / f64::from(far_m) };
        Self { numerator: Vec2::new(near_m, 0.0), denominator: Vec2::new(1.0, -slope as f32) }
    }

    /// For depth of [`nephroid_math::space::orthographic`], which is linear: `near + d·(far − near)`.
    #[must_use]
    pub fn orthographic(near_m: f32, far_m: f32) -> Self {
        Self { numerator: Vec2::new(near_m, far_m - near_m), denominator: Vec2::X }
    }
}

/// How a smaller layer is upsampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByDepth {
    /// Depth texture of the layer's size.
    pub layer_depth: TextureId,
    /// Depth texture of the result's size.
    pub full_depth: TextureId,
    /// Conversion of both depth textures to distances. Both hold the same quantity.
    pub distance: DistanceFromDepth,
    /// τ: the largest difference in distance between a texel and a pixel of one surface, as a share of the pixel's distance; 0 or more.
    pub tolerance: f32,
}

/// One layer of the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Up to four channels, float; one layer, one level.
    pub texture: TextureId,
    /// s: the factor of each channel.
    pub scale: Vec4,
    /// How the layer is upsampled; `None` for a layer of the result's size.
    pub by_depth: Option<ByDepth>,
}

/// Uniform of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LayerUniform {
    /// The factor of each channel.
    pub scale: Vec4,
    /// n₀, n₁, m₀, m₁ of [`DistanceFromDepth`].
    pub distance: Vec4,
    /// x, y: width and height of the layer over those of the result. z: τ.
    pub ratio: Vec4,
}

/// Bindings of a layer of the result's size: layer's uniform, texture.
pub const BINDINGS: [BindingKind; 2] = [BindingKind::Uniform(size_of::<LayerUniform>()), BindingKind::Texture];

/// Bindings of a smaller layer: layer's uniform, texture, its depth, the result's depth.
pub const BY_DEPTH_BINDINGS: [BindingKind; 4] = [BINDINGS[0], BINDINGS[1], BindingKind::Texture, BindingKind::Texture];

/// The program for a layer of the result's size.
#[must_use]
pub fn program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(concat!(include_str!("fullscreen.wgsl"), include_str!("layer.wgsl"), include_str!("compose.wgsl"))),
        ..Program::new("compose", FullscreenVertex, Plain)
    })
}

/// The program for a smaller layer.
#[must_use]
pub fn by_depth_program() -> Arc<Program> {
    Arc::new(Program {
        bindings: BY_DEPTH_BINDINGS.to_vec(),
        wgsl: Some(concat!(
            include_str!("fullscreen.wgsl"),
            include_str!("load_clamped.wgsl"),
            include_str!("layer.wgsl"),
            include_str!("compose_by_depth.wgsl")
        )),
        ..Program::new("compose_by_depth", FullscreenVertex, Upsampled)
    })
}

#[inline(always)]
fn scaled<L: Lanes>(texel: V4<L>, scale: Vec4) -> V4<L> {
    v4(texel.x * scale.x, texel.y * scale.y, texel.z * scale.z, texel.w * scale.w)
}

struct Plain;

impl FragmentShader for Plain {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let layer: &LayerUniform = bindings.uniform(0);
        let texel = load_clamped(bindings.texture(1), input.position.x - 0.5, input.position.y - 0.5);
        output.color[0] = scaled(texel, layer.scale);
    }
}

impl LayerUniform {
    /// Distance along the view, m, from the value of a depth texture.
    #[inline(always)]
    fn distance_m<L: Lanes>(&self, depth: L) -> L {
        let d = self.distance;
        let distance = (depth * d.y + d.x) / (depth * d.w + d.z);
        Lanes::min(distance, depth.like(FARTHEST_M))
    }
}

struct Upsampled;

impl FragmentShader for Upsampled {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let layer: &LayerUniform = bindings.uniform(0);
        let (texture, layer_depth, full_depth) = (bindings.texture(1), bindings.texture(2), bindings.texture(3));
        let (zero, one) = (input.position.x.like(0.0), input.position.x.like(1.0));
        let here = layer.distance_m(load_clamped(full_depth, input.position.x - 0.5, input.position.y - 0.5).x);
        // In these coordinates, texel centres of the layer are at integers.
        let (u, v) = (input.position.x * layer.ratio.x - 0.5, input.position.y * layer.ratio.y - 0.5);
        let (left, top) = (u.floor(), v.floor());
        let (right, lower) = (u - left, v - top);
        let mut texels = [v4(zero, zero, zero, zero); 4];
        let mut weights = [zero; 4];
        let mut nearest = texels[0];
        // Larger than any difference of distances.
        let mut least_gap = zero.like(1.0e38);
        for corner in 0..4 {
            let (column, row) = (corner % 2, corner / 2);
            let f = (if column == 1 { right } else { one - right }) * (if row == 1 { lower } else { one - lower });
            let (x, y) = (left + column as f32, top + row as f32);
            texels[corner] = load_clamped(texture, x, y);
            let gap = (layer.distance_m(load_clamped(layer_depth, x, y).x) - here).abs();
            let is_nearer = f.gt(zero) & gap.lt(least_gap);
            nearest = V4::select(is_nearer, texels[corner], nearest);
            least_gap = L::select(is_nearer, gap, least_gap);
            weights[corner] = L::select(gap.le(here * layer.ratio.z), f, zero);
        }
        let mut sum = v4(zero, zero, zero, zero);
        let mut total = zero;
        for corner in 0..4 {
            // A texel of weight 0 must not change the sum, whatever its value is (infinite or NaN).
            let difference = V4::select(weights[corner].gt(zero), texels[corner] - nearest, v4(zero, zero, zero, zero));
            sum = sum + difference * weights[corner];
            total = total + weights[corner];
        }
        let texel = nearest + sum * (one / L::select(total.gt(zero), total, one));
        output.color[0] = scaled(texel, layer.scale);
    }
}

/// Adds a texture named `desc.label`, and a pass of the same name that sums the layers in it. Returns the texture.
///
/// `desc` describes a float texture, one layer, one level. Without layers it is all zeros.
pub fn add(frame: &mut Frame, desc: TextureDescriptor, layers: &[Layer]) -> TextureId {
    let (label, format) = (desc.label.clone(), desc.format);
    let size = (desc.width, desc.height);
    let result = frame.texture(desc);
    let draws = layers.iter().enumerate().map(|(number, layer)| draw(frame, &format!("{label} {number}"), format, size, layer)).collect();
    let load = LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 });
    let color = vec![Some(ColorAttachment { view: result.into(), load })];
    frame.passes.push(Pass { label, color, draws, ..Pass::default() });
    result
}

fn draw(frame: &mut Frame, label: &str, format: TextureFormat, size: (u32, u32), layer: &Layer) -> Draw {
    let desc = &frame.textures[layer.texture.index()].desc;
    let ratio = [desc.width as f32 / size.0 as f32, desc.height as f32 / size.1 as f32];
    let distance = layer.by_depth.map_or(DistanceFromDepth::IDENTITY, |by| by.distance);
    let uniform = LayerUniform {
        scale: layer.scale,
        distance: Vec4::new(distance.numerator.x, distance.numerator.y, distance.denominator.x, distance.denominator.y),
        ratio: Vec4::new(ratio[0], ratio[1], layer.by_depth.map_or(0.0, |by| by.tolerance), 0.0),
    };
    let uniform = frame.buffer(label, Arc::new(Buffer::from_value(&uniform)));
    let mut entries = vec![BindEntry::Uniform(uniform, 0), BindEntry::texture(layer.texture)];
    entries.extend(layer.by_depth.iter().flat_map(|by| [BindEntry::texture(by.layer_depth), BindEntry::texture(by.full_depth)]));
    let bindings = frame.bind_group(entries);
    let target = ColorTargetState { format, blend: Some(ADDITIVE), write_mask: ColorWrites::ALL };
    let program = if layer.by_depth.is_some() { by_depth_program() } else { program() };
    let pipeline =
        frame.pipeline(RenderPipelineDescriptor { targets: vec![Some(target)], ..RenderPipelineDescriptor::new(label, program) });
    Draw::new(pipeline, bindings, VERTICES)
}
