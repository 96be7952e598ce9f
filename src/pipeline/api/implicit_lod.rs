//! Sampling with the level of detail that the fragment's own quad gives [WGSL `textureSample`].
//!
//! GPUs shade four pixels of a quad together and subtract what neighbours computed. Here a lane may be alone, as in one-lane execution. So nothing is
//! exchanged between lanes: coordinates are evaluated again at the neighbours' places, on the fragment's own primitive, which is what a GPU's helper
//! invocations do. Sixteen lanes and one give the same bits, also where the neighbour lies outside of the primitive or belongs to another.
//!
//! Road not taken: shuffling lanes. A block of 4x4 pixels holds four whole quads, but the neighbours in it may be of another primitive that shares the
//! block, and one lane has no neighbours.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V4, v2};

use crate::api::sampler::{Sampler, level_of_detail, sample_level};
use crate::api::shader::fragment::FragmentInput;
use crate::api::texture_view::TextureView;

/// A place on a fragment's primitive: the fragment's own, or that of a neighbour in its 2x2 quad.
pub struct FragmentPlace<'a, L: Lanes> {
    input: &'a FragmentInput<'a, L>,
    /// Pixel coordinates (integers, not centres).
    x: L,
    y: L,
}

impl<L: Lanes> FragmentPlace<'_, L> {
    /// A varying's scalar there.
    #[inline(always)]
    #[must_use]
    pub fn varying(&self, scalar: usize) -> L {
        self.input.varying_at(scalar, self.x, self.y)
    }
    /// Two scalars from `scalar`.
    #[inline(always)]
    #[must_use]
    pub fn varying2(&self, scalar: usize) -> V2<L> {
        v2(self.varying(scalar), self.varying(scalar + 1))
    }
    /// Pixel centre, the x and y of `@builtin(position)` there.
    #[inline(always)]
    #[must_use]
    pub fn position(&self) -> V2<L> {
        v2(self.x + 0.5, self.y + 0.5)
    }
}

/// Texture coordinates that a shader computes: a function of varyings and position. What else it needs are fields of the implementor.
///
/// Mark the method `#[inline(always)]`, see [`VertexShader`](crate::shader::VertexShader).
pub trait Coordinates {
    /// The coordinates at a place, 0..1 over the texture. It is called for the fragment and for two of its neighbours.
    fn coordinates<L: Lanes>(&self, place: &FragmentPlace<'_, L>) -> V2<L>;
}

impl<L: Lanes> FragmentInput<'_, L> {
    /// A 2D texture at the coordinates that two varying scalars from `uv` are, at the level of detail that their derivatives ([`Self::ddx`],
    /// [`Self::ddy`]) give: the same as [`sample_grad`](crate::sampler::sample_grad) with these [WGSL `textureSample`].
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, texture: &TextureView<'_>, sampler: &Sampler, uv: usize, layer: u32) -> V4<L> {
        sample_level(texture, sampler, self.varying2(uv), layer, self.implicit_level(texture, uv))
    }

    /// [`Self::sample`] with a number added to the level of detail before the sampler clamps it [WGSL `textureSampleBias`]. WGSL allows −16..=15.99.
    #[inline(always)]
    #[must_use]
    pub fn sample_bias(&self, texture: &TextureView<'_>, sampler: &Sampler, uv: usize, layer: u32, bias: L) -> V4<L> {
        sample_level(texture, sampler, self.varying2(uv), layer, self.implicit_level(texture, uv) + bias)
    }

    /// [`Self::sample`] at computed coordinates, which are evaluated at three pixels of the quad for their derivatives.
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
