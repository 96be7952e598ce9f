//! Bindings: compares the bound resources with what the program declares.

use crate::api::bindings::{Binding, BindingKind, Bindings};
use crate::api::buffer::Buffer;
use crate::api::check::sampler::SamplerError;
use crate::api::state::TextureFormat;

/// Alignment of offsets of uniform buffers, bytes. WebGPU's `minUniformBufferOffsetAlignment` default.
pub const UNIFORM_OFFSET_ALIGNMENT: usize = 256;

/// Most bytes of a uniform buffer that a program may read. WebGPU's `maxUniformBufferBindingSize` default.
pub const MAX_UNIFORM_BYTES: usize = 65536;

/// Alignment of sizes of storage buffers, bytes [WebGPU, `GPUBindGroupDescriptor` validation].
pub const STORAGE_SIZE_ALIGNMENT: usize = 4;

/// Why the bindings of a draw are refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BindingProblem {
    /// The program reads more bindings than there are.
    #[error("{given} bindings given, the program reads {expected}")]
    Count {
        /// Bindings given.
        given: usize,
        /// Bindings that the program reads.
        expected: usize,
    },
    /// A resource of another kind than the program declares.
    #[error("binding {binding} is {found}, the program reads {expected:?}")]
    Kind {
        /// The binding number.
        binding: usize,
        /// What is bound.
        found: BoundKind,
        /// What the program reads.
        expected: BindingKind,
    },
    /// A uniform buffer whose offset is not aligned.
    #[error("binding {binding} begins at byte {offset}, which is not a multiple of {UNIFORM_OFFSET_ALIGNMENT}")]
    UniformOffset {
        /// The binding number.
        binding: usize,
        /// The offset seen: the binding's own, or the draw's dynamic one.
        offset: usize,
    },
    /// A buffer with fewer bytes than the program reads.
    #[error("binding {binding} has {bytes} bytes, the program reads {expected}")]
    Size {
        /// The binding number.
        binding: usize,
        /// Bytes from the offset on.
        bytes: usize,
        /// Bytes that the program reads.
        expected: usize,
    },
    /// The size of a storage buffer is not a multiple of four.
    #[error("binding {binding} is a storage buffer of {bytes} bytes, which is not a multiple of {STORAGE_SIZE_ALIGNMENT}")]
    StorageSize {
        /// The binding number.
        binding: usize,
        /// Bytes of the buffer.
        bytes: usize,
    },
    /// A texture of a format that shaders cannot read: stencil alone.
    #[error("binding {binding} is a texture of {format:?}, which shaders cannot read")]
    TextureFormat {
        /// The binding number.
        binding: usize,
        /// The format seen.
        format: TextureFormat,
    },
    /// The program uses a comparison sampler on a texture without depth.
    #[error("binding {binding} is a texture of {format:?}, the program reads depth")]
    NoDepth {
        /// The binding number.
        binding: usize,
        /// The format seen.
        format: TextureFormat,
    },
    /// A sampler is not valid.
    #[error("binding {binding}: {error}")]
    Sampler {
        /// The binding number.
        binding: usize,
        /// What is wrong with the sampler.
        error: SamplerError,
    },
}

/// The kind of a bound resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundKind {
    /// A uniform buffer.
    Uniform,
    /// A uniform buffer whose offset each draw gives.
    DynamicUniform,
    /// A storage buffer.
    Storage,
    /// A texture.
    Texture,
    /// A sampler that does not compare.
    Sampler,
    /// A sampler that compares.
    ComparisonSampler,
}

impl std::fmt::Display for BoundKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Uniform => "a uniform buffer",
            Self::DynamicUniform => "a uniform buffer with a dynamic offset",
            Self::Storage => "a storage buffer",
            Self::Texture => "a texture",
            Self::Sampler => "a sampler that does not compare",
            Self::ComparisonSampler => "a comparison sampler",
        })
    }
}

impl Binding<'_> {
    /// The kind of this binding.
    #[must_use]
    pub fn kind(&self) -> BoundKind {
        match self {
            Self::Uniform { dynamic: false, .. } => BoundKind::Uniform,
            Self::Uniform { dynamic: true, .. } => BoundKind::DynamicUniform,
            Self::Storage(_) => BoundKind::Storage,
            Self::Texture(_) => BoundKind::Texture,
            Self::Sampler(sampler) if sampler.compare.is_none() => BoundKind::Sampler,
            Self::Sampler(_) => BoundKind::ComparisonSampler,
        }
    }
}

impl Bindings<'_> {
    /// Why these bindings are refused for a program that declares `kinds`, or `None`. More bindings than the program declares are allowed, as a bind
    /// group layout of WebGPU may have more entries than a shader uses.
    #[must_use]
    pub fn mismatch(&self, kinds: &[BindingKind]) -> Option<BindingProblem> {
        if self.entries.len() < kinds.len() {
            return Some(BindingProblem::Count { given: self.entries.len(), expected: kinds.len() });
        }
        let mut pairs = kinds.iter().zip(self.entries).enumerate();
        pairs.find_map(|(number, (kind, entry))| problem(number, *kind, entry, self.dynamic_offset))
    }
}

fn problem(binding: usize, kind: BindingKind, entry: &Binding<'_>, dynamic_offset: usize) -> Option<BindingProblem> {
    match (kind, entry) {
        (BindingKind::Uniform(expected), Binding::Uniform { buffer, offset, dynamic: false }) => {
            uniform(binding, buffer, [*offset, 0], expected)
        }
        (BindingKind::DynamicUniform(expected), Binding::Uniform { buffer, offset, dynamic: true }) => {
            uniform(binding, buffer, [*offset, dynamic_offset], expected)
        }
        (BindingKind::Storage(_), Binding::Storage(buffer)) if !buffer.len().is_multiple_of(STORAGE_SIZE_ALIGNMENT) => {
            Some(BindingProblem::StorageSize { binding, bytes: buffer.len() })
        }
        (BindingKind::Storage(expected), Binding::Storage(buffer)) => size(binding, buffer.len(), expected),
        (BindingKind::Texture | BindingKind::DepthTexture, Binding::Texture(view)) if view.info().channels == 0 => {
            Some(BindingProblem::TextureFormat { binding, format: view.format() })
        }
        (BindingKind::DepthTexture, Binding::Texture(view)) => {
            (!view.info().depth).then(|| BindingProblem::NoDepth { binding, format: view.format() })
        }
        (BindingKind::Texture, Binding::Texture(_)) => None,
        (BindingKind::Sampler, Binding::Sampler(sampler)) if sampler.compare.is_none() => {
            sampler.validate().err().map(|error| BindingProblem::Sampler { binding, error })
        }
        (BindingKind::ComparisonSampler, Binding::Sampler(sampler)) if sampler.compare.is_some() => {
            sampler.validate().err().map(|error| BindingProblem::Sampler { binding, error })
        }
        (expected, entry) => Some(BindingProblem::Kind { binding, found: entry.kind(), expected }),
    }
}

/// Why a uniform buffer at the sum of two offsets is refused, or `None`.
fn uniform(binding: usize, buffer: &Buffer, offsets: [usize; 2], expected: usize) -> Option<BindingProblem> {
    if let Some(offset) = offsets.into_iter().find(|offset| !offset.is_multiple_of(UNIFORM_OFFSET_ALIGNMENT)) {
        return Some(BindingProblem::UniformOffset { binding, offset });
    }
    size(binding, buffer.len().saturating_sub(offsets[0].saturating_add(offsets[1])), expected)
}

fn size(binding: usize, bytes: usize, expected: usize) -> Option<BindingProblem> {
    (bytes < expected).then_some(BindingProblem::Size { binding, bytes, expected })
}
