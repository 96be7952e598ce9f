//! What a shader can read beside its inputs: uniform and storage buffers, textures, samplers.

use bytemuck::AnyBitPattern;

use crate::api::buffer::Buffer;
use crate::api::sampler::Sampler;
use crate::api::texture_view::TextureView;

/// One bound thing.
#[derive(Clone, Copy, Debug)]
pub enum Binding<'a> {
    /// A uniform buffer; `dynamic` adds the draw's dynamic offset. `size` is what one use of it sees.
    Uniform {
        /// The bytes.
        buffer: &'a Buffer,
        /// Byte offset, a multiple of 16.
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
/// The accessors panic if the binding is of another kind or too short: pass validation has compared
/// every program's [`BindingKind`]s and sizes with what is bound, so a shader of a validated pass never sees that.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bindings<'a> {
    entries: &'a [Binding<'a>],
    dynamic_offset: usize,
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
    /// A sampler.
    Sampler,
}

impl<'a> Bindings<'a> {
    /// Bindings with the draw's dynamic offset in bytes, a multiple of 16.
    #[must_use]
    pub fn new(entries: &'a [Binding<'a>], dynamic_offset: usize) -> Self {
        Self { entries, dynamic_offset }
    }

    /// Whether both are the same entries with the same dynamic offset.
    pub(crate) fn are_same(a: &Self, b: &Self) -> bool {
        std::ptr::eq(a.entries, b.entries) && a.dynamic_offset == b.dynamic_offset
    }

    /// The struct at the start of a uniform binding.
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
    /// The elements of a storage binding.
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

    /// What is wrong with these bindings for a program that expects `kinds`, in words, or `None`.
    #[must_use]
    pub fn mismatch(&self, kinds: &[BindingKind]) -> Option<String> {
        if self.entries.len() < kinds.len() {
            return Some(format!("{} bindings given, the program reads {}", self.entries.len(), kinds.len()));
        }
        kinds.iter().zip(self.entries).enumerate().find_map(|(number, (kind, entry))| {
            let (have, need, fits_kind) = match (*kind, *entry) {
                (BindingKind::Uniform(need), Binding::Uniform { buffer, offset, dynamic: false }) => {
                    (buffer.len().saturating_sub(offset), need, offset % 16 == 0)
                }
                (BindingKind::DynamicUniform(need), Binding::Uniform { buffer, offset, dynamic: true }) => {
                    let start = offset.saturating_add(self.dynamic_offset);
                    (buffer.len().saturating_sub(start), need, start % 16 == 0)
                }
                (BindingKind::Storage(need), Binding::Storage(buffer)) => (buffer.len(), need, true),
                (BindingKind::Texture, Binding::Texture(_)) | (BindingKind::Sampler, Binding::Sampler(_)) => (0, 0, true),
                _ => (0, 0, false),
            };
            if !fits_kind {
                Some(format!("binding {number} is not a {kind:?} at a multiple of 16 bytes"))
            } else if have < need {
                Some(format!("binding {number} has {have} bytes, the program reads {need}"))
            } else {
                None
            }
        })
    }
}

#[cold]
fn wrong_kind(binding: usize, wanted: &str, found: Binding<'_>) -> ! {
    panic!("binding {binding} is not a {wanted}: {found:?}")
}
