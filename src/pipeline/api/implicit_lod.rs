//! Sampling with the level of detail that the fragment's own quad gives [WGSL `textureSample`].
//!
//! GPUs shade the four pixels of a quad together and subtract the values of neighbours. Here a fragment may be shaded alone (one-lane execution), so
//! lanes exchange nothing. Coordinates are evaluated again at the neighbours' pixels, on the fragment's own primitive: what a GPU's helper
//! invocations compute. Sixteen lanes and one lane give the same bits, also where the neighbour lies outside of the primitive or belongs to another.
//!
//! Road not taken: shuffling lanes. A block of 4x4 pixels holds four whole quads, but a neighbour in the block may belong to another primitive, and
//! one lane has no neighbours.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V4, v2};

use crate::api::sampler::{Sampler, level_of_detail, sample_level};
use crate::api::shader::fragment::FragmentInput;
use crate::api::texture_view::TextureView;

/// A pixel on a fragment's primitive: the fragment's own, or a neighbour's in its 2x2 quad.
pub struct FragmentPlace<'a, L: Lanes> {
    input: &'a FragmentInput<'a, L>,
    /// Pixel coordinates (integers, not centres).
    x: L,
    y: L,
}

impl<L: Lanes> FragmentPlace<'_, L> {
    /// A varying's scalar at this pixel.
    #[inline(always)]
    #[must_use]
    pub fn varying(&self, scalar: usize) -> L {
        self.input.varying_at(scalar, self.x, self.y)
    }
    /// Two scalars, from number `scalar` on.
    #[inline(always)]
    #[must_use]
    pub fn varying2(&self, scalar: usize) -> V2<L> {
        v2(self.varying(scalar), self.varying(scalar + 1))
    }
    /// Centre of the pixel, as x and y of `@builtin(position)`.
    #[inline(always)]
    #[must_use]
    pub fn position(&self) -> V2<L> {
        v2(self.x + 0.5, self.y + 0.5)
    }
}

/// Texture coordinates that a shader computes from varyings and position. Fields of the implementor hold all other inputs.
///
/// Mark the method `#[inline(always)]`, see [`VertexShader`](crate::shader::VertexShader).
pub trait Coordinates {
    /// The coordinates at a pixel, 0..1 over the texture. Called for the fragment and for two of its neighbours.
    fn coordinates<L: Lanes>(&self, place: &FragmentPlace<'_, L>) -> V2<L>;
}

impl<L: Lanes> FragmentInput<'_, L> {
    /// Samples a 2D texture at the coordinates in two varying scalars, from `uv` on. The level of detail follows from their derivatives
    /// ([`Self::ddx`], [`Self::ddy`]), as in [`sample_grad`](crate::sampler::sample_grad) [WGSL `textureSample`].
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, texture: &TextureView<'_>, sampler: &Sampler, uv: usize, layer: u32) -> V4<L> {
        sample_level(texture, sampler, self.varying2(uv), layer, self.implicit_level(texture, uv))
    }

    /// [`Self::sample`] with `bias` added to the level of detail before the sampler clamps it [WGSL `textureSampleBias`]. WGSL allows −16..=15.99.
    #[inline(always)]
    #[must_use]
    pub fn sample_bias(&self, texture: &TextureView<'_>, sampler: &Sampler, uv: usize, layer: u32, bias: L) -> V4<L> {
        sample_level(texture, sampler, self.varying2(uv), layer, self.implicit_level(texture, uv) + bias)
    }

    /// [`Self::sample`] at computed coordinates, evaluated at three pixels of the quad to get their derivatives.
    #[inline(always)]
    #[must_use]
    pub fn sample_computed(&self, texture: &TextureView<'_>, sampler: &Sampler, coordinates: &impl Coordinates, layer: u32) -> V4<L> {
        let (x, y) = (self.position.x - 0.5, self.position.y - 0.5);
        let (left, top) = ((x * 0.5).floor() * 2.0, (y * 0.5).floor() * 2.0);
        let (is_left, is_top) = (x.equals(left), y.equals(top));
        let own = coordinates.coordinates(&FragmentPlace { input: self, x, y });
        let beside = coordinates.coordinates(&FragmentPlace { input: self, x: L::select(is_left, x + 1.0, left), y });
        let above_or_below = coordinates.coordinates(&FragmentPlace { input: self, x, y: L::select(is_top, y + 1.0, top) });
        let ddx = V2::select(is_left, beside - own, own - beside);
        let ddy = V2::select(is_top, above_or_below - own, own - above_or_below);
        sample_level(texture, sampler, own, layer, level_of_detail(texture, ddx, ddy))
    }

    #[inline(always)]
    fn implicit_level(&self, texture: &TextureView<'_>, uv: usize) -> L {
        level_of_detail(texture, v2(self.ddx(uv), self.ddx(uv + 1)), v2(self.ddy(uv), self.ddy(uv + 1)))
    }
}
