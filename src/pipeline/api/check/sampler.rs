//! Samplers: ranges of levels of detail, and address modes.

use crate::api::sampler::{AddressMode, Sampler};

/// Why a sampler is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SamplerError {
    /// The least level of detail is negative, infinite or not a number.
    #[error("lod_min_clamp {lod_min_clamp}; allowed: finite numbers from 0 on")]
    LodMinClamp {
        /// The value seen.
        lod_min_clamp: f32,
    },
    /// The greatest level of detail is below the least, infinite or not a number.
    #[error("lod_max_clamp {lod_max_clamp}; allowed: finite numbers from lod_min_clamp {lod_min_clamp} on")]
    LodMaxClamp {
        /// The least level of detail.
        lod_min_clamp: f32,
        /// The value seen.
        lod_max_clamp: f32,
    },
    /// Clamp to border, which WebGPU does not have.
    #[error("address mode ClampToBorder for axis {axis}; allowed: ClampToEdge, Repeat, MirrorRepeat")]
    AddressMode {
        /// The axis, 0 to 2.
        axis: usize,
    },
}

impl Sampler {
    /// Checks that every field is in its range.
    ///
    /// # Errors
    /// If a level-of-detail clamp is out of order, or an address mode is not offered.
    pub fn validate(&self) -> Result<(), SamplerError> {
        let Self { lod_min_clamp, lod_max_clamp, .. } = *self;
        if !(lod_min_clamp >= 0.0 && lod_min_clamp.is_finite()) {
            return Err(SamplerError::LodMinClamp { lod_min_clamp });
        }
        if !(lod_max_clamp >= lod_min_clamp && lod_max_clamp.is_finite()) {
            return Err(SamplerError::LodMaxClamp { lod_min_clamp, lod_max_clamp });
        }
        match self.address_mode.iter().position(|mode| *mode == AddressMode::ClampToBorder) {
            Some(axis) => Err(SamplerError::AddressMode { axis }),
            None => Ok(()),
        }
    }
}
