//! Images of a drawing: its attachments and its fragment count, from the software GPU or from a driver.

use super::drawing::Drawing;
use crate::crosscheck::relative;
use crate::{Gpu, GpuError, GpuFrame, Vertices};
use nephroid_pipeline::frame::{AttachmentView, Contents, Frame, FrameError, pipelines, run_frame_pass};
use nephroid_pipeline::state::RasterRules;
use nephroid_pipeline::{Device, Surface, Texture};

/// Attachments after a drawing.
#[derive(Clone, Debug)]
pub struct Image {
    /// Attachments: colour first, then depth and stencil.
    pub attachments: Vec<Texture>,
    /// Number of fragments that passed, if they were counted.
    pub count: Option<u64>,
}

/// A pixel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Number of the attachment; one past the last is the fragment count.
    pub attachment: usize,
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
}

/// Draws a drawing on the software GPU.
///
/// # Errors
/// If the drawing is not valid.
pub fn on_software(device: &Device, drawing: &Drawing, rules: RasterRules) -> Result<Image, FrameError> {
    let frame = drawing.frame(rules);
    let mut contents = Contents::initial(&frame)?;
    let output = run_frame_pass(device, &frame, &pipelines(&frame)?, &frame.passes[0], &mut contents, None)?;
    Ok(Image::new(&frame, contents.textures, output.queries))
}

/// Draws a drawing on a driver. WebGPU has no sprites and wide lines; they are expanded by `rules`.
///
/// # Errors
/// If the driver cannot draw the frame.
pub fn on_driver(gpu: &Gpu, device: &Device, drawing: &Drawing, rules: RasterRules) -> Result<Image, GpuError> {
    let frame = drawing.frame(rules);
    let mut contents = Contents::initial(&frame).map_err(FrameError::from)?;
    let mut on_gpu = GpuFrame::new(gpu, &frame)?;
    let ready = on_gpu.prepare(0, 0..1, Vertices::Shaded, device, &contents)?;
    on_gpu.run([&ready])?;
    for view in frame.passes[0].attachments() {
        on_gpu.download(view, &mut contents.textures[view.texture.index()])?;
    }
    let queries = on_gpu.queries(&ready)?;
    Ok(Image::new(&frame, contents.textures, queries))
}

impl Image {
    fn new(frame: &Frame, textures: Vec<Texture>, queries: Vec<u64>) -> Self {
        let attached: Vec<AttachmentView> = frame.passes[0].attachments();
        let is_attached = |i: usize| attached.iter().any(|view| view.texture.index() == i);
        let attachments = textures.into_iter().enumerate().filter(|(i, _)| is_attached(*i)).map(|(_, texture)| texture).collect();
        Self { attachments, count: queries.first().copied() }
    }

    /// The only surface of an attachment.
    #[must_use]
    pub fn surface(&self, attachment: usize) -> &Surface {
        self.attachments[attachment].surface(0, 0)
    }

    /// The surface of the attachment with this label.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Surface> {
        self.attachments.iter().find(|a| a.desc().label == name).map(|a| a.surface(0, 0))
    }

    /// The numbers at a place: all channels, then the stencil.
    #[must_use]
    pub fn values(&self, place: Place) -> Vec<f64> {
        let Some(texture) = self.attachments.get(place.attachment) else {
            return self.count.map(|n| n as f64).into_iter().collect();
        };
        let surface = texture.surface(0, 0);
        let mut values: Vec<f64> = (0..surface.channels).map(|c| f64::from(surface.get(place.x, place.y, c))).collect();
        if texture.info().stencil {
            values.push(f64::from(surface.stencil_at(place.x, place.y)));
        }
        values
    }

    /// Whether two images differ at a place by more than a relative error. For an error of 0, any difference of bits counts.
    #[must_use]
    pub fn differs_at(&self, other: &Self, place: Place, tolerance: f64) -> bool {
        let Some(texture) = self.attachments.get(place.attachment) else { return self.count != other.count };
        let (a, b) = (texture.surface(0, 0), other.surface(place.attachment));
        let info = texture.info();
        let Place { x, y, .. } = place;
        if info.stencil && a.stencil_at(x, y) != b.stencil_at(x, y) {
            return true;
        }
        (0..info.channels).any(|channel| {
            let (a, b) = (a.get(x, y, channel), b.get(x, y, channel));
            match info.kind {
                kind if kind.is_integer() => a.to_bits() != b.to_bits(),
                _ => relative(a, b, 0.0) > tolerance,
            }
        })
    }

    /// All places where two images differ by more than a relative error, in reading order.
    #[must_use]
    pub fn differing(&self, other: &Self, tolerance: f64) -> Vec<Place> {
        let mut places = Vec::new();
        for (attachment, texture) in self.attachments.iter().enumerate() {
            let surface = texture.surface(0, 0);
            // Most surfaces are identical. Integer bit patterns must not be compared as floats, because 2^31 would equal 0.
            if !texture.info().kind.is_integer() && surface == other.surface(attachment) {
                continue;
            }
            let all = (0..surface.height).flat_map(|y| (0..surface.width).map(move |x| Place { attachment, x, y }));
            places.extend(all.filter(|place| self.differs_at(other, *place, tolerance)));
        }
        if self.count != other.count {
            places.push(Place { attachment: self.attachments.len(), x: 0, y: 0 });
        }
        places
    }
}
