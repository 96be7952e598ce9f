//! A corner of a primitive on its way to setup.

use crate::primitive::window::WindowVertex;

/// A corner after clipping: its window vertex, its clip position, and the index of its first varying.
#[derive(Clone, Copy)]
pub(crate) struct Corner {
    pub window: WindowVertex,
    pub varyings: u32,
    pub clip: [f32; 4],
}
