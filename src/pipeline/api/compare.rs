//! Comparison functions of depth tests, stencil tests and comparison samplers.

use nephroid_math::lanes::Lanes;

use crate::api::state::CompareFunction;

/// `a OP b`. If either is NaN: true for `NotEqual` and `Always`, false otherwise.
#[inline(always)]
#[must_use]
pub fn compare(function: CompareFunction, a: f32, b: f32) -> bool {
    match function {
        CompareFunction::Never => false,
        CompareFunction::Less => a < b,
        CompareFunction::Equal => a == b,
        CompareFunction::LessEqual => a <= b,
        CompareFunction::Greater => a > b,
        CompareFunction::NotEqual => a != b,
        CompareFunction::GreaterEqual => a >= b,
        CompareFunction::Always => true,
    }
}

/// [`compare`] lane by lane.
#[inline(always)]
pub(crate) fn compare_lanes<L: Lanes>(function: CompareFunction, a: L, b: L) -> L::Mask {
    match function {
        CompareFunction::Never => a.lt(a),
        CompareFunction::Less => a.lt(b),
        CompareFunction::Equal => a.equals(b),
        CompareFunction::LessEqual => a.le(b),
        CompareFunction::Greater => b.lt(a),
        CompareFunction::NotEqual => !a.equals(b),
        CompareFunction::GreaterEqual => b.le(a),
        CompareFunction::Always => !a.lt(a),
    }
}
