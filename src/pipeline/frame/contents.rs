//! What a frame's textures hold before the first pass.

use crate::api::format::format_info;
use crate::api::state::LoadOp;
use crate::api::texture::{Texture, TextureError};
use crate::frame::description::{BindEntry, Frame, FrameTexture, Initial, TextureId};
use crate::frame::executor::FrameError;

/// Makes a frame's textures, or takes those of the last frame, and puts into them what they hold before the first pass.
pub(crate) fn prepare_textures(frame: &Frame, textures: &mut Vec<Texture>) -> Result<(), FrameError> {
    textures.truncate(frame.textures.len());
    let cleared = cleared_first(frame);
    for (i, described) in frame.textures.iter().enumerate() {
        let reusable = textures.get(i).is_some_and(|t| *t.desc() == described.desc);
        if !reusable {
            let texture = Texture::new(described.desc.clone())?;
            if i < textures.len() {
                textures[i] = texture;
            } else {
                textures.push(texture);
            }
        }
        fill_initial(&mut textures[i], described, reusable && !cleared[i])?;
    }
    Ok(())
}

/// The frame's textures as they are before the first pass.
pub fn initial_textures(frame: &Frame) -> Result<Vec<Texture>, TextureError> {
    let filled = |described: &FrameTexture| {
        let mut texture = Texture::new(described.desc.clone())?;
        fill_initial(&mut texture, described, false)?;
        Ok(texture)
    };
    frame.textures.iter().map(filled).collect()
}

/// Puts a texture's initial contents in place; `stale` if it may hold an earlier frame.
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
            for (layer, bytes) in layers.iter().enumerate() {
                texture.write_bytes(0, layer as u32, bytes)?;
            }
            texture.generate_mips();
        }
    }
    Ok(())
}

/// By texture: whether the first thing that happens to it is that a pass clears all of it.
pub fn cleared_first(frame: &Frame) -> Vec<bool> {
    // By texture: nothing has happened yet, or whether it was cleared.
    let mut first: Vec<Option<bool>> =
        frame.textures.iter().map(|t| (t.desc.mip_level_count > 1 || t.desc.depth_or_layers > 1).then_some(false)).collect();
    let mut happens = |texture: TextureId, clears: bool| {
        first[texture.index()].get_or_insert(clears);
    };
    for pass in &frame.passes {
        for target in pass.color.iter().flatten() {
            happens(target.view.texture, matches!(target.load, LoadOp::Clear(_)));
        }
        if let Some(target) = &pass.depth {
            let format = format_info(frame.textures[target.view.texture.index()].desc.format);
            let depth = format.is_none_or(|f| !f.depth) || matches!(target.depth_load, LoadOp::Clear(_));
            let stencil = format.is_none_or(|f| !f.stencil) || matches!(target.stencil_load, LoadOp::Clear(_));
            happens(target.view.texture, depth && stencil);
        }
        for entry in pass.bind_groups().iter().flat_map(|group| &frame.bind_groups[group.index()].entries) {
            if let BindEntry::Texture(texture) = entry {
                happens(*texture, false);
            }
        }
    }
    first.into_iter().map(|first| first == Some(true)).collect()
}
