//! Memory of a frame, known before it runs.

use crate::frame::description::Frame;

/// Peak memory of a frame, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Textures, attachments included.
    pub textures: u64,
    /// Buffers.
    pub buffers: u64,
    /// The executor's list of passes, and of the draws of the largest pass.
    pub draws: u64,
}

impl MemoryEstimate {
    /// Sum of all parts. Bins are not among them; their budget is separate.
    #[must_use]
    pub fn resources(&self) -> u64 {
        self.textures.saturating_add(self.buffers).saturating_add(self.draws)
    }
}

/// Bytes per draw, in the description and in the executor's list.
const DRAW_BYTES: u64 = 512;

impl Frame {
    /// Memory that running this frame takes, computed from sizes alone.
    #[must_use]
    pub fn memory(&self) -> MemoryEstimate {
        MemoryEstimate {
            textures: self.textures.iter().map(|t| t.desc.memory_bytes()).fold(0, u64::saturating_add),
            buffers: self.buffers.iter().map(|b| b.data.len() as u64).sum(),
            draws: self.passes.iter().map(|p| p.draws.len() as u64 * DRAW_BYTES).max().unwrap_or(0),
        }
    }

    /// Name and bytes of the largest texture or buffer.
    #[must_use]
    pub fn largest_resource(&self) -> Option<(&str, u64)> {
        let textures = self.textures.iter().map(|t| (t.desc.label.as_str(), t.desc.memory_bytes()));
        let buffers = self.buffers.iter().map(|b| (b.label.as_str(), b.data.len() as u64));
        textures.chain(buffers).max_by_key(|r| r.1)
    }
}
