//! Bindings: the uniform and storage buffers, textures and samplers that shaders read.

use bytemuck::AnyBitPattern;

use crate::api::buffer::Buffer;
use crate::api::sampler::Sampler;
use crate::api::texture_view::TextureView;

/// One bound resource.
#[derive(Clone, Copy, Debug)]
pub enum Binding<'a> {
    /// A uniform buffer. A shader reads as many bytes from the offset on as its [`BindingKind`] says.
    Uniform {
        /// The bytes.
        buffer: &'a Buffer,
        /// Byte offset, a multiple of 256.
        offset: usize,
        /// Whether the draw's dynamic offset is added.
        dynamic: bool,
    },
    /// A read-only storage buffer.
    Storage(&'a Buffer),
    /// A texture.
    Texture(TextureView<'a>),
    /// A sampler.
    Sampler(Sampler),
}

impl<'a> Binding<'a> {
    /// A uniform buffer from its first byte on, the same for every draw.
    #[must_use]
    pub const fn uniform(buffer: &'a Buffer) -> Self {
        Self::Uniform { buffer, offset: 0, dynamic: false }
    }
}

/// The bindings of a draw, by binding number. Default: none.
///
/// The accessors panic if the binding is of another kind or too short. Pass validation compares every program's [`BindingKind`]s and sizes with the
/// bound resources, so a shader of a validated pass never sees that.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bindings<'a> {
    pub(crate) entries: &'a [Binding<'a>],
    pub(crate) dynamic_offset: usize,
}

/// What a program expects at a binding number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// A uniform buffer with at least this many bytes.
    Uniform(usize),
    /// A uniform buffer whose offset each draw gives, with at least this many bytes beyond it.
    DynamicUniform(usize),
    /// A storage buffer of elements of this many bytes, at least one of them.
    Storage(usize),
    /// A texture.
    Texture,
    /// A texture with depth, for a comparison sampler.
    DepthTexture,
    /// A sampler that does not compare.
    Sampler,
    /// A sampler that compares.
    ComparisonSampler,
}

impl<'a> Bindings<'a> {
    /// Bindings with the draw's dynamic offset in bytes, a multiple of 256.
    #[must_use]
    pub fn new(entries: &'a [Binding<'a>], dynamic_offset: usize) -> Self {
        Self { entries, dynamic_offset }
    }

    /// Whether both have the same entries and the same dynamic offset.
    pub(crate) fn are_same(a: &Self, b: &Self) -> bool {
        std::ptr::eq(a.entries, b.entries) && a.dynamic_offset == b.dynamic_offset
    }

    /// The struct at the start of a uniform binding, from the binding's offset (plus the draw's, if dynamic) on.
    #[inline(always)]
    #[must_use]
    pub fn uniform<T: AnyBitPattern>(&self, binding: usize) -> &'a T {
        match self.entries[binding] {
            Binding::Uniform { buffer, offset, dynamic } => {
                let start = offset + if dynamic { self.dynamic_offset } else { 0 };
                bytemuck::from_bytes(&buffer.bytes()[start..start + size_of::<T>()])
            }
            other => wrong_kind(binding, "uniform buffer", other),
        }
    }
    /// All whole elements of a storage binding.
    #[inline(always)]
    #[must_use]
    pub fn storage<T: AnyBitPattern>(&self, binding: usize) -> &'a [T] {
        match self.entries[binding] {
            Binding::Storage(buffer) => {
                let whole = buffer.len() / size_of::<T>() * size_of::<T>();
                bytemuck::cast_slice(&buffer.bytes()[..whole])
            }
            other => wrong_kind(binding, "storage buffer", other),
        }
    }
    /// A texture binding.
    #[inline(always)]
    #[must_use]
    pub fn texture(&self, binding: usize) -> &'a TextureView<'a> {
        match &self.entries[binding] {
            Binding::Texture(view) => view,
            other => wrong_kind(binding, "texture", *other),
        }
    }
    /// A sampler binding.
    #[inline]
    #[must_use]
    pub fn sampler(&self, binding: usize) -> Sampler {
        match self.entries[binding] {
            Binding::Sampler(sampler) => sampler,
            other => wrong_kind(binding, "sampler", other),
        }
    }
}

#[cold]
fn wrong_kind(binding: usize, wanted: &str, found: Binding<'_>) -> ! {
    panic!("binding {binding} is not a {wanted}: {found:?}")
}
