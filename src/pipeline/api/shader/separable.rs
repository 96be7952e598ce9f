//! Separable fragment shaders: outputs that are a product of a function of the column and a function of the row, such as splats with a kernel.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::V4;

use crate::api::bindings::Bindings;
use crate::api::state::MAX_COLOR_TARGETS;

/// An axis of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Along a row: columns.
    X,
    /// Down a column: rows.
    Y,
}

/// A function of the column and one of the row. [`Separable`](crate::shader::Separable) makes a fragment shader of it, whose output is their product:
/// in each channel of each target, `O(x, y) = f_X(x)·f_Y(y)`.
///
/// Sprites that are added to f32 targets then take a fast path: both functions are evaluated once for each column and row of a sprite, in place of
/// once for each of its pixels. Mark the method `#[inline(always)]`.
pub trait SeparableShader: Send + Sync {
    /// Number of targets that it writes, at least 1.
    const TARGETS: usize;
    /// Sets the first [`Self::TARGETS`] values to those of `f_axis`, one colour per target, at pixel centres `at` along the axis, pixels of the target.
    /// Values may depend on these centres, the bindings and `flat` alone: the scalars of the sprite's vertex. With varyings that are not flat, the
    /// general path runs, and `flat` has the scalars of the provoking vertex.
    fn factor<L: Lanes>(&self, bindings: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; MAX_COLOR_TARGETS]);
}
