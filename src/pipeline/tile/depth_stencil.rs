//! Depth and stencil tests and the stencil operations, for one fragment and for a 4x4 block.

use fearless_simd::{Simd, SimdBase, SimdInt, SimdMask, mask8x16, u8x16, u8x64};

use crate::api::state::{CompareFunction, StencilFaceState, StencilOperation};

/// The stencil value after an operation.
#[must_use]
pub fn stencil_operation(operation: StencilOperation, value: u8, reference: u8) -> u8 {
    match operation {
        StencilOperation::Keep => value,
        StencilOperation::Zero => 0,
        StencilOperation::Replace => reference,
        StencilOperation::Invert => !value,
        StencilOperation::IncrementClamp => value.saturating_add(1),
        StencilOperation::DecrementClamp => value.saturating_sub(1),
        StencilOperation::IncrementWrap => value.wrapping_add(1),
        StencilOperation::DecrementWrap => value.wrapping_sub(1),
    }
}

/// [`stencil_operation`] for sixteen pixels.
#[inline(always)]
pub(crate) fn stencil_operation16<S: Simd>(simd: S, operation: StencilOperation, value: u8x16<S>, reference: u8) -> u8x16<S> {
    match operation {
        StencilOperation::Keep => value,
        StencilOperation::Zero => u8x16::splat(simd, 0),
        StencilOperation::Replace => u8x16::splat(simd, reference),
        StencilOperation::Invert => !value,
        StencilOperation::IncrementClamp => simd.saturating_add_u8x16(value, u8x16::splat(simd, 1)),
        StencilOperation::DecrementClamp => simd.saturating_sub_u8x16(value, u8x16::splat(simd, 1)),
        StencilOperation::IncrementWrap => value + u8x16::splat(simd, 1),
        StencilOperation::DecrementWrap => value - u8x16::splat(simd, 1),
    }
}

/// [`compare`](crate::api::compare::compare) of bytes, lane by lane.
#[inline(always)]
fn compare_bytes<S: Simd, V: SimdInt<S, Element = u8>>(simd: S, function: CompareFunction, a: V, b: V) -> V::Mask {
    match function {
        CompareFunction::Never => a.simd_lt(a),
        CompareFunction::Less => a.simd_lt(b),
        CompareFunction::Equal => a.simd_eq(b),
        CompareFunction::LessEqual => a.simd_le(b),
        CompareFunction::Greater => a.simd_gt(b),
        CompareFunction::NotEqual => !a.simd_eq(b),
        CompareFunction::GreaterEqual => a.simd_ge(b),
        CompareFunction::Always => V::Mask::splat(simd, true),
    }
}

/// The stencil state of a draw for one facing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StencilFace {
    pub state: StencilFaceState,
    pub reference: u8,
    pub read_mask: u8,
    pub write_mask: u8,
}

impl StencilFace {
    /// The pixels of `mask` that pass: `(reference & read) OP (stencil & read)`.
    #[inline(always)]
    pub fn test<S: Simd>(&self, simd: S, stencil: &[u8], mask: u32) -> u32 {
        if self.state.compare == CompareFunction::Always {
            return mask;
        }
        let stored = u8x16::from_slice(simd, &stencil[..16]) & u8x16::splat(simd, self.read_mask);
        let reference = u8x16::splat(simd, self.reference & self.read_mask);
        mask & compare_bytes(simd, self.state.compare, reference, stored).to_bitmask() as u32
    }

    /// Blocks of a region with at least one pixel that passes, bit = block. `stencil` starts with the region.
    #[inline(always)]
    pub fn passing_blocks<S: Simd>(&self, simd: S, stencil: &[u8]) -> u32 {
        let reference = u8x64::splat(simd, self.reference & self.read_mask);
        let read_mask = u8x64::splat(simd, self.read_mask);
        let mut blocks = 0;
        for (four, bytes) in stencil[..256].chunks_exact(64).enumerate() {
            let stored = u8x64::from_slice(simd, bytes) & read_mask;
            let passing = compare_bytes(simd, self.state.compare, reference, stored).to_bitmask();
            for block in 0..4 {
                blocks |= u32::from(passing >> (16 * block) & 0xffff != 0) << (4 * four + block);
            }
        }
        blocks
    }

    /// Applies an operation to the pixels in `mask`.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, simd: S, operation: StencilOperation, stencil: &mut [u8], mask: u32) {
        if operation == StencilOperation::Keep || mask == 0 {
            return;
        }
        let old = u8x16::from_slice(simd, &stencil[..16]);
        let new = stencil_operation16(simd, operation, old, self.reference);
        let write = u8x16::splat(simd, self.write_mask);
        let merged = (old & !write) | (new & write);
        let selected = simd.select_u8x16(mask8x16::from_bitmask(simd, u64::from(mask)), merged, old);
        selected.store_slice(&mut stencil[..16]);
    }
}
