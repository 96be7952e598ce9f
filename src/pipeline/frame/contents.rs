//! Contents of a frame's textures and buffers, before its first pass and while it runs.

use std::sync::Arc;

use crate::api::buffer::Buffer;
use crate::api::format::facts::format_info;
use crate::api::state::LoadOp;
use crate::api::texture::Texture;
use crate::api::texture_descriptor::TextureError;
use crate::frame::description::{BufferId, Frame, FrameTexture, Initial, TextureId};

/// Amount of data streamed out to a buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streamed {
    /// Bytes written, from the buffer's start on.
    pub bytes: usize,
    /// Vertices written.
    pub vertices: u32,
}

/// Contents of a frame's textures and buffers.
#[derive(Clone, Debug, Default)]
pub struct Contents {
    /// By texture number.
    pub textures: Vec<Texture>,
    /// By buffer number.
    pub buffers: Vec<Arc<Buffer>>,
    /// By buffer number: the amount that passes have streamed out to it.
    pub streamed: Vec<Streamed>,
}

impl Contents {
    /// The contents before the first pass.
    ///
    /// # Errors
    /// If the description of a texture is refused, or its initial bytes have another length.
    pub fn initial(frame: &Frame) -> Result<Self, TextureError> {
        let mut contents = Self::default();
        contents.reset(frame)?;
        Ok(contents)
    }

    /// As [`Self::initial`], but reuses the textures of an earlier frame that have the same descriptions: allocating fresh pages costs more than
    /// drawing.
    pub(crate) fn reset(&mut self, frame: &Frame) -> Result<(), TextureError> {
        self.buffers = frame.buffers.iter().map(|buffer| buffer.data.clone()).collect();
        self.streamed = vec![Streamed::default(); frame.buffers.len()];
        self.textures.truncate(frame.textures.len());
        let cleared = cleared_first(frame);
        for (i, described) in frame.textures.iter().enumerate() {
            let reusable = self.textures.get(i).is_some_and(|t| *t.desc() == described.desc);
            if !reusable {
                let texture = Texture::new(described.desc.clone())?;
                if i < self.textures.len() {
                    self.textures[i] = texture;
                } else {
                    self.textures.push(texture);
                }
            }
            fill_initial(&mut self.textures[i], described, reusable && !cleared[i])?;
        }
        Ok(())
    }

    /// A texture.
    #[must_use]
    pub fn texture(&self, id: TextureId) -> &Texture {
        &self.textures[id.index()]
    }

    /// A buffer.
    #[must_use]
    pub fn buffer(&self, id: BufferId) -> &Buffer {
        &self.buffers[id.index()]
    }

    /// Writes streamed-out data (`vertices` of them): after what the buffer holds if `append`, otherwise from the buffer's start on.
    pub fn write_streamed(&mut self, id: BufferId, append: bool, data: &[f32], vertices: u32) {
        let streamed = &mut self.streamed[id.index()];
        if !append {
            *streamed = Streamed::default();
        }
        let bytes: &[u8] = bytemuck::cast_slice(data);
        Arc::make_mut(&mut self.buffers[id.index()]).bytes_mut()[streamed.bytes..][..bytes.len()].copy_from_slice(bytes);
        streamed.bytes += bytes.len();
        streamed.vertices += vertices;
    }

    /// Bytes of a buffer that are free for stream-out.
    #[must_use]
    pub fn stream_room(&self, id: BufferId, append: bool) -> usize {
        let used = if append { self.streamed[id.index()].bytes } else { 0 };
        self.buffers[id.index()].len() - used
    }
}

/// Writes a texture's initial contents; `stale` if the texture may hold those of an earlier frame.
fn fill_initial(texture: &mut Texture, described: &FrameTexture, stale: bool) -> Result<(), TextureError> {
    match &described.initial {
        Initial::Zero => {
            if stale {
                for level in 0..described.desc.mip_level_count {
                    for layer in 0..described.desc.level_size(level).2 {
                        let surface = texture.surface_mut(level, layer);
                        surface.planes.fill(0.0);
                        surface.stencil.fill(0);
                    }
                }
            }
        }
        Initial::Layers(layers) => {
            let expected = described.desc.level_size(0).2;
            if layers.len() != expected as usize {
                return Err(TextureError::Layers { label: described.desc.label.clone(), seen: layers.len(), expected });
            }
            for (layer, bytes) in layers.iter().enumerate() {
                texture.write_bytes(0, layer as u32, bytes)?;
            }
            texture.generate_mips();
        }
    }
    Ok(())
}

/// By texture: whether a pass clears all of it before anything else reads or writes it.
#[must_use]
pub fn cleared_first(frame: &Frame) -> Vec<bool> {
    // By texture: `None` before its first use, then whether that use cleared it.
    let mut first: Vec<Option<bool>> =
        frame.textures.iter().map(|t| (t.desc.mip_level_count > 1 || t.desc.depth_or_layers > 1).then_some(false)).collect();
    let mut happens = |texture: TextureId, clears: bool| {
        first[texture.index()].get_or_insert(clears);
    };
    for pass in &frame.passes {
        for target in pass.color.iter().flatten() {
            happens(target.view.texture, matches!(target.load, LoadOp::Clear(_)));
        }
        if let Some(target) = &pass.depth_stencil {
            let format = format_info(frame.textures[target.view.texture.index()].desc.format);
            let depth = format.is_none_or(|f| !f.depth) || matches!(target.depth_load, LoadOp::Clear(_));
            let stencil = format.is_none_or(|f| !f.stencil) || matches!(target.stencil_load, LoadOp::Clear(_));
            happens(target.view.texture, depth && stencil);
        }
        pass.views_read(frame).for_each(|view| happens(view.texture, false));
    }
    first.into_iter().map(|first| first == Some(true)).collect()
}
