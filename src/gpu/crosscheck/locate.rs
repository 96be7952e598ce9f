//! From an attachment that differs to the draw and the primitive that cause it, by bisection.

use serde::Serialize;

use super::{AttachmentReport, Mode, Pair, Pixel, compare, relative};
use crate::{Gpu, GpuError};
use nephroid_pipeline::Device;
use nephroid_pipeline::frame::stream_draw;
use nephroid_pipeline::frame::{Draw, Frame};
use nephroid_pipeline::state::PrimitiveTopology;

/// The draw and primitive at which two versions of a frame begin to differ.
#[derive(Clone, Debug, Serialize)]
pub struct Located {
    /// Label of the pass.
    pub pass: String,
    /// Label of the attachment.
    pub texture: String,
    /// The pixel that was followed, with both values after the pass.
    pub pixel: Pixel,
    /// The first draw after which the pixel differs, and its pipeline; `None` if the pixel differs before all draws.
    pub draw: Option<(usize, String)>,
    /// The first primitive of that draw after which the pixel differs; `None` for strips.
    pub primitive: Option<u32>,
    /// The pixel's values right after that primitive.
    pub after: Option<Pixel>,
    /// Vertices of the primitive as they leave the last stage before rasterization: clip position, then varyings.
    pub vertices: Vec<Vec<f32>>,
    /// Fixed-function state of the draw.
    pub state: String,
}

/// Follows the first outlier of an attachment back to its cause: finds the least number of draws, then of primitives, after which the pixel is beyond
/// the tolerance.
///
/// # Errors
/// If the driver fails.
pub fn locate(
    gpu: &Gpu,
    device: &Device,
    on_cpu: &Frame,
    on_gpu: &Frame,
    mode: Mode,
    failed: &AttachmentReport,
) -> Result<Option<Located>, GpuError> {
    let Some(pixel) = failed.difference.first.or(failed.difference.worst) else { return Ok(None) };
    let index = failed.pass_index;
    let search = Search { gpu, device, frames: [on_cpu, on_gpu], mode, failed, pixel };
    let pass = &on_cpu.passes[index];
    let mut located = Located {
        pass: failed.pass.clone(),
        texture: failed.texture.clone(),
        pixel,
        draw: None,
        primitive: None,
        after: None,
        vertices: Vec::new(),
        state: String::new(),
    };
    if search.after(0, None)?.is_some() {
        return Ok(Some(located));
    }
    let Some(draws) = first(pass.draws.len() as u32, |count| Ok(search.after(count as usize, None)?.is_some()))? else {
        return Ok(Some(located));
    };
    let draw = &pass.draws[draws as usize - 1];
    let desc = &on_cpu.pipelines[draw.pipeline.index()];
    located.draw = Some((draws as usize - 1, desc.label.clone()));
    located.state = format!(
        "primitive {:?}\ndepth_stencil {:?}\ntargets {:?}\nviewport {:?}, scissor {:?}, stencil reference {}, blend constant {:?}",
        desc.primitive, desc.depth_stencil, desc.targets, draw.viewport, draw.scissor, draw.stencil_reference, draw.blend_constant
    );
    located.after = search.after(draws as usize, None)?;
    let Some(corners) = list_corners(draw, on_cpu) else { return Ok(Some(located)) };
    let primitives = (draw.vertices.end - draw.vertices.start) / corners;
    let found = first(primitives, |count| Ok(search.after(draws as usize, Some(count * corners))?.is_some()))?;
    if let Some(count) = found {
        located.primitive = Some(count - 1);
        located.after = search.after(draws as usize, Some(count * corners))?;
        let start = draw.vertices.start + (count - 1) * corners;
        let alone = Draw { vertices: start..start + corners, ..draw.clone() };
        let pair = search.before()?;
        let (_, stream) = stream_draw(device, on_cpu, pass, &alone, pair.expected())?;
        let floats = on_cpu.stream_floats(draw.pipeline);
        located.vertices = stream.data.chunks_exact(floats).map(<[f32]>::to_vec).collect();
    }
    Ok(Some(located))
}

/// Vertices of a primitive, if the draw is a list in one instance.
fn list_corners(draw: &Draw, frame: &Frame) -> Option<u32> {
    let corners = match frame.pipelines[draw.pipeline.index()].primitive.topology {
        PrimitiveTopology::PointList => 1,
        PrimitiveTopology::LineList => 2,
        PrimitiveTopology::TriangleList => 3,
        PrimitiveTopology::LineStrip | PrimitiveTopology::TriangleStrip => return None,
    };
    (draw.instances.len() == 1).then_some(corners)
}

/// The least number up to `most` for which `differs` is true, provided that it stays true for all larger ones; `None` if it is false for `most`.
fn first(most: u32, mut differs: impl FnMut(u32) -> Result<bool, GpuError>) -> Result<Option<u32>, GpuError> {
    if most == 0 || !differs(most)? {
        return Ok(None);
    }
    let (mut low, mut high) = (0, most);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if differs(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(Some(high))
}

struct Search<'a> {
    gpu: &'a Gpu,
    device: &'a Device,
    frames: [&'a Frame; 2],
    mode: Mode,
    failed: &'a AttachmentReport,
    pixel: Pixel,
}

impl<'a> Search<'a> {
    /// Both sides as they are right before the failed pass.
    fn before(&self) -> Result<Pair<'a>, GpuError> {
        let mut pair = Pair::new(self.gpu, self.device, self.frames[0], self.frames[1], self.mode)?;
        for index in 0..self.failed.pass_index {
            pair.run(index)?;
            pair.settle(index)?;
        }
        Ok(pair)
    }

    /// The pixel after the first `draws` draws of the failed pass, the last of them cut to `vertices`; `None` if it is within the tolerance.
    fn after(&self, draws: usize, vertices: Option<u32>) -> Result<Option<Pixel>, GpuError> {
        let index = self.failed.pass_index;
        let cut = self.frames.map(|frame| {
            let mut frame = frame.clone();
            let pass = &mut frame.passes[index];
            pass.draws.truncate(draws);
            if let (Some(vertices), Some(draw)) = (vertices, pass.draws.last_mut()) {
                draw.vertices.end = draw.vertices.start + vertices;
            }
            frame.passes.truncate(index + 1);
            frame
        });
        let mut pair = Pair::new(self.gpu, self.device, &cut[0], &cut[1], self.mode)?;
        for earlier in 0..index {
            pair.run(earlier)?;
            pair.settle(earlier)?;
        }
        pair.run(index)?;
        let view = self.failed.view;
        let info = pair.chain.texture(view.texture).info();
        let [expected, actual] = pair.surfaces(view);
        let Pixel { x, y, channel, .. } = self.pixel;
        let values = match channel < info.channels {
            true => [expected, actual].map(|s| s.get(x, y, channel)),
            false => [expected, actual].map(|s| f32::from(s.stencil_at(x, y))),
        };
        if values[0].to_bits() == values[1].to_bits() {
            return Ok(None);
        }
        let tolerance = self.failed.bound.tolerance;
        // Relative errors have the scale of the whole attachment.
        let difference = compare(info, expected, actual, tolerance).difference;
        let error = difference.worst.filter(|w| (w.x, w.y) == (x, y)).map_or_else(|| relative(values[0], values[1], 0.0), |w| w.error);
        Ok((error > tolerance).then_some(Pixel { x, y, channel, expected: values[0], actual: values[1], error }))
    }
}
