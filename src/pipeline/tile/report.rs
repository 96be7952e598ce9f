//! Events of a tile for an observer.

use crate::api::draw::Draw;
use crate::api::format::depth::{depth_value, quantize_depth_by};
use crate::api::format::facts::ChannelKind;
use crate::api::observer::{FragmentEvent, FragmentOutcome};
use crate::api::render_pipeline::RenderPipeline;
use crate::api::shader::stages::ShadeItem;
use crate::api::surface::{TILE_PIXELS, offset_in_tile};
use crate::tile::block_depth::clamp_depth;
use crate::tile::worker::TileWorker;

impl<'a> TileWorker<'a, '_> {
    pub fn stencil_block(&self, offset: usize) -> [u8; 16] {
        let mut block = [0; 16];
        if let Some(stencil) = self.targets.stencil.as_deref() {
            block.copy_from_slice(&stencil[offset..offset + 16]);
        }
        block
    }

    /// Target 0 of a block, `[component][16]`.
    pub fn color_block(&self, pipeline: &RenderPipeline, offset: usize) -> Vec<f32> {
        let mut block = vec![0.0; 64];
        if let (Some(Some(plan)), Some(planes)) = (pipeline.targets.first(), self.targets.color[0].as_deref()) {
            for c in 0..plan.channels {
                block[c * 16..c * 16 + 16].copy_from_slice(&planes[c * TILE_PIXELS + offset..][..16]);
            }
        }
        block
    }

    /// Reports the outcome of the pixels in `mask` to the observer, if there is one.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "an event has this many parts")]
    pub fn report(
        &mut self,
        draw: &Draw<'_>,
        item: ShadeItem,
        i: usize,
        mask: u32,
        outcome: FragmentOutcome,
        color_before: Option<&[f32]>,
    ) {
        if self.observer.is_some() && mask != 0 {
            self.report_fragments(draw, item, i, mask, outcome, color_before);
        }
    }

    #[cold]
    #[allow(clippy::too_many_arguments, reason = "an event has this many parts")]
    fn report_fragments(
        &mut self,
        draw: &Draw<'_>,
        item: ShadeItem,
        i: usize,
        mask: u32,
        outcome: FragmentOutcome,
        color_before: Option<&[f32]>,
    ) {
        let pipeline = draw.pipeline;
        let offset = offset_in_tile((item.x as i32 - self.origin[0]) as usize, (item.y as i32 - self.origin[1]) as usize);
        let after = self.color_block(pipeline, offset);
        let stencil_after = self.stencil_block(offset);
        let outputs = pipeline.fragment.outputs;
        let shaded = outcome == FragmentOutcome::Passed && outputs > 0;
        let kind = pipeline.depth.kind.unwrap_or(ChannelKind::Float32);
        let z = self.scratch.z[i];
        let attributes = self.chunk.and_then(|c| c.attributes.get(item.primitive as usize));
        let primitive_id = attributes.filter(|_| pipeline.fragment.attributes).map_or(0, |a| a.primitive_id);
        for lane in (0..16usize).filter(|lane| mask >> lane & 1 == 1) {
            let four = |block: &[f32]| [0, 1, 2, 3].map(|c: usize| block[c * 16 + lane]);
            let event = FragmentEvent {
                draw: self.draw,
                primitive_id,
                x: item.x + (lane as u32 & 3),
                y: item.y + (lane as u32 >> 2),
                depth: depth_value(kind, quantize_depth_by(pipeline.rules.unorm_depth, kind, clamp_depth(z[lane], draw))),
                outcome,
                stencil_before: self.stencil_before[lane],
                stencil_after: stencil_after[lane],
                shader_color: if shaded { four(&self.scratch.colors[i * outputs * 64..][..64]) } else { [0.0; 4] },
                color_before: four(color_before.unwrap_or(&after)),
                color_after: four(&after),
            };
            if let Some(observer) = self.observer.as_deref_mut() {
                observer.fragment(event);
            }
        }
    }
}
