//! Buffers: bytes that shaders and the input assembler read.

use bytemuck::{Pod, Zeroable};

/// Sixteen bytes at an address that is a multiple of sixteen. Buffers are made of this unit, so any Pod struct can be read in place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(16))]
struct Word([u8; 16]);

/// Bytes that shaders and the input assembler read, 16-byte aligned.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Buffer {
    words: Vec<Word>,
    len: usize,
}

impl Buffer {
    /// The bytes of a slice of plain data.
    #[must_use]
    pub fn from_slice<T: bytemuck::NoUninit>(data: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let mut words = vec![Word([0; 16]); bytes.len().div_ceil(16)];
        bytemuck::cast_slice_mut::<Word, u8>(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self { words, len: bytes.len() }
    }
    /// A buffer of `count` plain structs, zero at first, which `fill` writes in place.
    #[must_use]
    pub fn filled<T: Pod>(count: usize, fill: impl FnOnce(&mut [T])) -> Self {
        let len = count * size_of::<T>();
        let mut words: Vec<Word> = bytemuck::allocation::zeroed_vec(len.div_ceil(16));
        fill(bytemuck::cast_slice_mut(&mut bytemuck::cast_slice_mut::<Word, u8>(&mut words)[..len]));
        Self { words, len }
    }
    /// The bytes of one plain struct.
    #[must_use]
    pub fn from_value<T: bytemuck::NoUninit>(value: &T) -> Self {
        Self::from_slice(std::slice::from_ref(value))
    }
    /// All bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }
    /// All bytes, to write to.
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.words)[..self.len]
    }
    /// Length in bytes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }
    /// True if there are no bytes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}
