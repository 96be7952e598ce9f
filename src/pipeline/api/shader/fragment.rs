//! Fragment shaders: their inputs and outputs.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V3, V4, v2, v3, v4};

use crate::api::bindings::Bindings;
use crate::api::shader::separable::{Axis, SeparableShader};
use crate::api::shader::varying::Interpolation;
use crate::api::state::MAX_COLOR_TARGETS;
use crate::api::surface::TILE_PIXELS;
use crate::api::texture_view::TextureView;

/// The planes and numbers that interpolate a primitive's varyings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrimitiveAttributes {
    /// Pixel coordinates of the anchor, at which the first number of each plane holds.
    pub anchor: [f32; 2],
    /// Screen-linear weight of vertex 1: at the anchor, per pixel right, per pixel down.
    pub l1: [f32; 3],
    /// Screen-linear weight of vertex 2, likewise.
    pub l2: [f32; 3],
    /// `1/w` of the three vertices.
    pub inv_w: [f32; 3],
    /// Index of each vertex's first scalar among the batch's varyings.
    pub varyings: [u32; 3],
    /// `primitive_index`, from 0 in each instance.
    pub primitive_id: u32,
    /// `front_facing`; always true for points and lines.
    pub front_facing: bool,
    /// Whether `point_coord` is meaningful.
    pub is_point: bool,
}

impl PrimitiveAttributes {
    /// Stands for every primitive of a draw that keeps no interpolation data: only the facing is known.
    pub(crate) const fn facing_only(front_facing: bool) -> Self {
        Self {
            anchor: [0.0; 2],
            l1: [0.0; 3],
            l2: [0.0; 3],
            inv_w: [1.0; 3],
            varyings: [0; 3],
            primitive_id: 0,
            front_facing,
            is_point: false,
        }
    }
}

/// The fragments of one call: one pixel, or a 4x4 block.
pub struct FragmentInput<'a, L: Lanes> {
    /// Needed to make lanes from constants.
    pub token: L::Token,
    /// `@builtin(position)`: pixel centre x and y, depth, and `1/w` interpolated.
    pub position: V4<L>,
    /// Column and row of lane 0.
    pub pixel: (u32, u32),
    /// Whether the primitive faces the viewer; true for points and lines.
    pub front_facing: bool,
    /// `primitive_index`.
    pub primitive_id: u32,
    varyings: &'a [f32],
    interpolation: &'a [Interpolation],
    own: Weighted<'a, L>,
    /// The other primitives that share the block, each with its lanes; the remaining lanes belong to `own`.
    others: &'a [(L::Mask, Weighted<'a, L>)],
}

/// A primitive and the weights of its vertices at the fragments.
#[derive(Clone, Copy)]
pub(crate) struct Weighted<'a, L> {
    attributes: &'a PrimitiveAttributes,
    /// Screen-linear and perspective weights of vertices 1 and 2.
    linear: V2<L>,
    perspective: V2<L>,
    inv_w: L,
}

impl<'a, L: Lanes> Weighted<'a, L> {
    /// For fragments at pixel coordinates (integers, not centres).
    #[inline(always)]
    pub fn new(attributes: &'a PrimitiveAttributes, x: L, y: L) -> Self {
        let (linear, perspective, inv_w) = weights(attributes, x, y);
        Self { attributes, linear, perspective, inv_w }
    }

    /// A varying's scalar at the fragments.
    #[inline(always)]
    fn varying(&self, varyings: &[f32], interpolation: Interpolation, scalar: usize) -> L {
        let start = self.attributes.varyings;
        let f0 = varyings[start[0] as usize + scalar];
        let f1 = varyings[start[1] as usize + scalar];
        let f2 = varyings[start[2] as usize + scalar];
        let b = match interpolation {
            Interpolation::Flat => return self.inv_w.like(f0),
            Interpolation::Linear => self.linear,
            Interpolation::Perspective => self.perspective,
        };
        // Differences keep a constant attribute exactly constant.
        b.x * (f1 - f0) + b.y * (f2 - f0) + f0
    }
}

impl<'a, L: Lanes> FragmentInput<'a, L> {
    /// Fragments at pixel coordinates (integers, not centres) and depth. They belong to one primitive, or to several that share a block and have the
    /// same facing.
    #[inline(always)]
    pub(crate) fn new(
        token: L::Token,
        pixel: (u32, u32),
        (x, y, z): (L, L, L),
        source: &ShadeSource<'a>,
        own: Weighted<'a, L>,
        others: &'a [(L::Mask, Weighted<'a, L>)],
    ) -> Self {
        let inv_w = others.iter().fold(own.inv_w, |inv_w, (lanes, other)| L::select(*lanes, other.inv_w, inv_w));
        Self {
            token,
            position: v4(x + 0.5, y + 0.5, z, inv_w),
            pixel,
            front_facing: own.attributes.front_facing,
            primitive_id: own.attributes.primitive_id,
            varyings: source.varyings,
            interpolation: source.interpolation,
            own,
            others,
        }
    }

    /// A varying's scalar.
    #[inline(always)]
    #[must_use]
    pub fn varying(&self, scalar: usize) -> L {
        let mode = self.interpolation[scalar];
        let mut value = self.own.varying(self.varyings, mode, scalar);
        for (lanes, other) in self.others {
            value = L::select(*lanes, other.varying(self.varyings, mode, scalar), value);
        }
        value
    }
    /// Two scalars, from number `scalar` on.
    #[inline(always)]
    #[must_use]
    pub fn varying2(&self, scalar: usize) -> V2<L> {
        v2(self.varying(scalar), self.varying(scalar + 1))
    }
    /// Three scalars, from number `scalar` on.
    #[inline(always)]
    #[must_use]
    pub fn varying3(&self, scalar: usize) -> V3<L> {
        v3(self.varying(scalar), self.varying(scalar + 1), self.varying(scalar + 2))
    }
    /// A scalar of the provoking vertex (flat interpolation), the same for all lanes.
    #[inline(always)]
    #[must_use]
    pub fn flat(&self, scalar: usize) -> f32 {
        self.flat_varyings()[scalar]
    }
    /// All scalars of the provoking vertex.
    #[inline(always)]
    #[must_use]
    pub fn flat_varyings(&self) -> &'a [f32] {
        debug_assert!(self.others.is_empty(), "what joins primitives has no flat varyings");
        let start = self.own.attributes.varyings[0] as usize;
        &self.varyings[start..start + self.interpolation.len()]
    }
    /// Position in a point sprite: 0..1 to the right and down from its top left corner.
    #[inline(always)]
    #[must_use]
    pub fn point_coord(&self) -> V2<L> {
        self.others.iter().fold(self.own.linear, |at, (lanes, other)| V2::select(*lanes, other.linear, at))
    }

    /// `dpdx` of a varying: right minus left pixel of the 2x2 quad, in the fragment's own row (WGSL `dpdxFine`).
    #[inline(always)]
    #[must_use]
    pub fn ddx(&self, scalar: usize) -> L {
        let (x, y) = (self.position.x - 0.5, self.position.y - 0.5);
        let left = (x * 0.5).floor() * 2.0;
        self.varying_at(scalar, left + 1.0, y) - self.varying_at(scalar, left, y)
    }
    /// `dpdy` of a varying: lower minus upper pixel of the 2x2 quad, in the fragment's own column (WGSL `dpdyFine`).
    #[inline(always)]
    #[must_use]
    pub fn ddy(&self, scalar: usize) -> L {
        let (x, y) = (self.position.x - 0.5, self.position.y - 0.5);
        let top = (y * 0.5).floor() * 2.0;
        self.varying_at(scalar, x, top + 1.0) - self.varying_at(scalar, x, top)
    }

    /// One channel of the texel at the fragment's own pixel, level 0, layer 0. The texture must be at least as large as the target.
    #[inline(always)]
    #[must_use]
    pub fn texel_here(&self, texture: &TextureView<'_>, channel: usize) -> L {
        let surface = texture.surface(0, 0);
        let (x, y) = (self.pixel.0 as usize, self.pixel.1 as usize);
        if L::LEN == 16 {
            L::load(self.token, surface.block(x, y, channel))
        } else {
            L::splat(self.token, surface.get(self.pixel.0, self.pixel.1, channel))
        }
    }

    /// The first three channels of the texel at the fragment's own pixel; see [`Self::texel_here`].
    #[inline(always)]
    #[must_use]
    pub fn texel3_here(&self, texture: &TextureView<'_>) -> V3<L> {
        let surface = texture.surface(0, 0);
        let (x, y) = (self.pixel.0 as usize, self.pixel.1 as usize);
        // A block starts at its first pixel.
        let start = surface.plane_index(x, y);
        let channels = &surface.planes[start..start + 2 * TILE_PIXELS + L::LEN];
        v3(L::load(self.token, channels), L::load(self.token, &channels[TILE_PIXELS..]), L::load(self.token, &channels[2 * TILE_PIXELS..]))
    }

    /// A varying's scalar of the fragment's own primitive at other pixel coordinates (integers, not centres).
    #[inline(always)]
    pub(crate) fn varying_at(&self, scalar: usize, x: L, y: L) -> L {
        let mode = self.interpolation[scalar];
        let mut value = Weighted::new(self.own.attributes, x, y).varying(self.varyings, mode, scalar);
        for (lanes, other) in self.others {
            value = L::select(*lanes, Weighted::new(other.attributes, x, y).varying(self.varyings, mode, scalar), value);
        }
        value
    }
}

/// Screen-linear weights, perspective weights and `1/w` at pixel coordinates (integers, not centres).
#[inline(always)]
fn weights<L: Lanes>(a: &PrimitiveAttributes, x: L, y: L) -> (V2<L>, V2<L>, L) {
    let (dx, dy) = (x - a.anchor[0], y - a.anchor[1]);
    let linear = v2((dy * a.l1[2] + a.l1[0]) + dx * a.l1[1], (dy * a.l2[2] + a.l2[0]) + dx * a.l2[1]);
    if a.inv_w[0] == a.inv_w[1] && a.inv_w[0] == a.inv_w[2] {
        return (linear, linear, x.like(a.inv_w[0]));
    }
    let (w1, w2) = (linear.x * a.inv_w[1], linear.y * a.inv_w[2]);
    let inv_w = (-(linear.x + linear.y) + 1.0) * a.inv_w[0] + w1 + w2;
    let scale = x.like(1.0) / inv_w;
    (linear, v2(w1 * scale, w2 * scale), inv_w)
}

/// The output of a fragment shader for one call.
pub struct FragmentOutput<L: Lanes> {
    /// Colour per target. A target that the shader does not write keeps the value of an earlier call, so a shader must write all targets that the
    /// program declares.
    pub color: [V4<L>; MAX_COLOR_TARGETS],
    /// `@builtin(frag_depth)`, used if the program declares it.
    pub depth: L,
    /// Lanes that are kept; used only if the program may discard. All true on entry.
    pub keep: L::Mask,
}

/// A fragment shader, generic over the number of lanes. Mark the method `#[inline(always)]`, see [`VertexShader`](crate::shader::VertexShader).
pub trait FragmentShader: Send + Sync {
    /// Whether the output is the same for all fragments of a primitive: the shader reads only flat varyings, facing and bindings. The pipeline may
    /// then call it once per primitive, or, without varyings, once per draw and facing with `primitive_id` 0.
    const PER_PRIMITIVE: bool = false;
    /// Whether the output depends on nothing that belongs to the primitive as a whole except its facing: neither flat varyings nor `primitive_id`.
    /// The pipeline may then shade a block once for all primitives that share it, which makes small triangles cheaper.
    const MERGES_FRAGMENTS: bool = false;
    /// Whether the output is the product of the factors of both axes; [`Separable`] sets it.
    const SEPARABLE: bool = false;
    /// Shades the fragments of one call.
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>);
    /// The factors of a separable output: [`SeparableShader::factor`].
    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, _flat: &[f32], _: Axis, _at: L, _values: &mut [V4<L>; MAX_COLOR_TARGETS]) {}
}

/// The fragment shader of a [`SeparableShader`].
pub struct Separable<T>(pub T);

impl<T: SeparableShader> FragmentShader for Separable<T> {
    const SEPARABLE: bool = true;

    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let zero = L::splat(input.token, 0.0);
        let flat = input.flat_varyings();
        let mut rows = [v4(zero, zero, zero, zero); MAX_COLOR_TARGETS];
        self.0.factor(bindings, flat, Axis::X, input.position.x, &mut output.color);
        self.0.factor(bindings, flat, Axis::Y, input.position.y, &mut rows);
        for (x, y) in output.color.iter_mut().zip(rows).take(T::TARGETS) {
            *x = v4(x.x * y.x, x.y * y.y, x.z * y.z, x.w * y.w);
        }
    }

    #[inline(always)]
    fn factor<L: Lanes>(&self, bindings: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; MAX_COLOR_TARGETS]) {
        self.0.factor(bindings, flat, axis, at, values);
    }
}

/// Data that interpolate the varyings of a batch's primitives.
#[derive(Clone, Copy)]
pub struct ShadeSource<'a> {
    pub(crate) primitives: &'a [PrimitiveAttributes],
    pub(crate) varyings: &'a [f32],
    pub(crate) interpolation: &'a [Interpolation],
}
