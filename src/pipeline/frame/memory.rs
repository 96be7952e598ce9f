//! What a frame will take before it runs.

use crate::frame::description::Frame;

/// Bytes that running a frame takes at its peak.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Textures, attachments included.
    pub textures: u64,
    /// Buffers.
    pub buffers: u64,
    /// Passes and draws of the largest pass, as the executor lists them.
    pub draws: u64,
}

impl MemoryEstimate {
    /// Everything but the bins, whose budget is set apart.
    #[must_use]
    pub fn resources(&self) -> u64 {
        self.textures.saturating_add(self.buffers).saturating_add(self.draws)
    }
}

/// Bytes per draw: the description's and the executor's.
const DRAW_BYTES: u64 = 512;

impl Frame {
    /// What running this frame takes, from sizes alone.
    #[must_use]
    pub fn memory(&self) -> MemoryEstimate {
        MemoryEstimate {
            textures: self.textures.iter().map(|t| t.desc.memory_bytes()).fold(0, u64::saturating_add),
            buffers: self.buffers.iter().map(|b| b.data.len() as u64).sum(),
            draws: self.passes.iter().map(|p| p.draws.len() as u64 * DRAW_BYTES).max().unwrap_or(0),
        }
    }

    /// The largest texture or buffer: what to make smaller.
    #[must_use]
    pub fn largest_resource(&self) -> Option<(&str, u64)> {
        let textures = self.textures.iter().map(|t| (t.desc.label.as_str(), t.desc.memory_bytes()));
        let buffers = self.buffers.iter().map(|b| (b.label.as_str(), b.data.len() as u64));
        textures.chain(buffers).max_by_key(|r| r.1)
    }
}
