//! Clears attachments, tile by tile.

use crate::api::format::depth::quantize_depth;
use crate::api::format::facts::format_info;
use crate::api::pass::Pass;
use crate::api::rules::RasterRules;
use crate::api::state::LoadOp;
use crate::api::surface::TILE_PIXELS;
use crate::tile::targets::TileTargets;

/// Numbers in a page of memory.
const PAGE: usize = 4096 / size_of::<f32>();

/// Values of attachments before the first draw.
pub(crate) struct Clears {
    color: Vec<Option<[f32; 4]>>,
    depth: Option<f32>,
    stencil: Option<u8>,
}

impl Clears {
    pub fn of(pass: &Pass<'_>) -> Self {
        // Clear values are rounded by the rules of the first draw. A pass without draws uses the reference rules.
        let rules = pass.draws.first().map_or(RasterRules::REFERENCE, |draw| draw.pipeline.rules);
        let f16 = rules.f16_rounding;
        let color = pass.color.iter().map(|attachment| {
            let attachment = attachment.as_ref()?;
            let info = format_info(attachment.view.format())?;
            match attachment.load {
                LoadOp::Clear(c) => Some(info.clear_value(c, f16)),
                _ => None,
            }
        });
        let depth_stencil = pass.depth_stencil.as_ref();
        let depth = depth_stencil.and_then(|a| match (a.depth_load, format_info(a.view.format())) {
            (LoadOp::Clear(z), Some(info)) if info.depth => Some(quantize_depth(info.kind, z.clamp(0.0, 1.0))),
            _ => None,
        });
        let stencil = depth_stencil.and_then(|a| match a.stencil_load {
            LoadOp::Clear(s) => Some(s as u8),
            _ => None,
        });
        Self { color: color.collect(), depth, stencil }
    }

    /// Clears a tile, except the colour targets in `replaced` (bit = target), whose every texel is drawn before it is needed.
    pub fn apply(&self, targets: &mut TileTargets<'_>, replaced: u8) {
        for (slot, (planes, color)) in targets.color.iter_mut().zip(&self.color).enumerate() {
            let (Some(planes), Some(color)) = (planes, color) else { continue };
            for (plane, value) in planes.chunks_exact_mut(TILE_PIXELS).zip(color) {
                if replaced >> slot & 1 == 0 {
                    plane.fill(*value);
                } else {
                    // New memory is one page of zeros, shared until it is written to. A draw reads before it writes, and the system would map each
                    // page twice, the second time with an interrupt of all other threads.
                    plane.iter_mut().step_by(PAGE).for_each(|first| *first = *value);
                }
            }
        }
        if let (Some(plane), Some(z)) = (&mut targets.depth, self.depth) {
            plane.fill(z);
        }
        if let (Some(plane), Some(value)) = (&mut targets.stencil, self.stencil) {
            plane.fill(value);
        }
    }
}
