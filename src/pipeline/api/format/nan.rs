//! NaN as textures store it: one bit pattern, whatever operation made it.
//!
//! The sign and the payload of a computed NaN differ between instruction sets (x86 sets the sign of `0/0`, ARM does not) and with the order of
//! operands, so bytes with a NaN in them would differ between machines. Where a float is stored, every NaN becomes [`NAN`].

use nephroid_math::lanes::Lanes;

/// The quiet NaN without sign and payload.
pub(crate) const NAN: f32 = f32::from_bits(0x7fc0_0000);

/// The number, or [`NAN`] in place of any NaN.
#[inline(always)]
pub(crate) fn one_nan(value: f32) -> f32 {
    if value.is_nan() { NAN } else { value }
}

/// [`one_nan`] lane by lane.
#[inline(always)]
pub(crate) fn one_nan_lanes<L: Lanes>(value: L) -> L {
    L::select(value.equals(value), value, value.like(NAN))
}
