//! The queue of blocks that passed the early tests and are to be shaded.

use crate::api::shader::stages::ShadeItem;
use crate::api::surface::TILE_PIXELS;

/// Most blocks that are shaded in one call.
pub(crate) const QUEUE: usize = 64;

/// Blocks that passed the early tests and are to be shaded.
pub(crate) struct Queue {
    pub len: usize,
    pub items: [ShadeItem; QUEUE],
    /// Depth as shaders see it, before it is clamped and rounded to the format.
    pub z: Box<[[f32; 16]; QUEUE]>,
    /// Whether the item is back-facing.
    pub facing: [bool; QUEUE],
    pub keep: [u16; QUEUE],
    pub colors: Vec<f32>,
    /// By block of the tile: the slot in which the block was queued last.
    pub latest: [u8; TILE_PIXELS / 16],
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            len: 0,
            items: [ShadeItem::default(); QUEUE],
            z: Box::new([[0.0; 16]; QUEUE]),
            facing: [false; QUEUE],
            keep: [0; QUEUE],
            colors: vec![0.0; QUEUE * 64],
            latest: [0; TILE_PIXELS / 16],
        }
    }
}
