//! From a frame's textures to named layers: crops the margin and reduces samples to pixels. Rows are computed in parallel.

use nephroid_image::{Image, Layer, LayerError, LayerSet, STANDARD_LAYERS};
use nephroid_pipeline::Surface;
use nephroid_pipeline::frame::{AttachmentView, Frame, FrameOutput};

use super::passes::geometry_buffer::MaterialKind;
use super::{LayerSource, Resolve, TechniqueFrame};

/// The layers requested from a frame: the named ones in the caller's order, or all standard ones. A layer of an attachment has its name with `_` for
/// each space.
pub(super) fn extract(built: &TechniqueFrame, output: &FrameOutput<'_>, names: Option<&[String]>) -> Result<LayerSet, LayerError> {
    let mut set = LayerSet::new();
    match names {
        None => {
            for standard in STANDARD_LAYERS {
                if let Some(source) = built.layers.iter().find(|layer| layer.name == standard.name) {
                    set.push(read(built, source, output)?)?;
                }
            }
        }
        Some(names) => {
            for name in names {
                if set.get(name).is_some() {
                    continue;
                }
                match built.layers.iter().find(|l| l.name == *name) {
                    Some(source) => set.push(read(built, source, output)?)?,
                    None => {
                        if let Some(view) = attachment(&built.frame, name) {
                            // Layers have no spaces in their names; passes and attachments have.
                            set.push(raw(&name.replace(' ', "_"), output.texture(view.texture).surface(view.level, view.layer))?)?;
                        }
                    }
                }
            }
        }
    }
    Ok(set)
}

/// What `pass/attachment` draws into: the level and the layer too.
pub(super) fn attachment(frame: &Frame, name: &str) -> Option<AttachmentView> {
    let (pass, attachment) = name.rsplit_once('/')?;
    let id = frame.texture_named(attachment)?;
    let pass = &frame.passes[frame.pass_index(pass)?];
    let mut views = pass.color.iter().flatten().map(|t| t.view).chain(pass.depth_stencil.iter().map(|t| t.view));
    views.find(|view| view.texture == id)
}

/// Names of all attachments of a frame, as `pass/attachment`.
pub(super) fn attachment_names(frame: &Frame) -> Vec<String> {
    let mut names = Vec::new();
    for pass in &frame.passes {
        for view in pass.color.iter().flatten().map(|t| t.view).chain(pass.depth_stencil.iter().map(|t| t.view)) {
            names.push(format!("{}/{}", pass.label, frame.textures[view.texture.index()].desc.label));
        }
    }
    names
}

/// An attachment without any change, margin and samples included.
fn raw(name: &str, surface: &Surface) -> Result<Layer, LayerError> {
    let plane = |c: usize| Image::from_rows(surface.width, surface.height, |y, row| fill(row, |x| surface.get(x, y, c)));
    let planes = (0..surface.channels.max(1)).map(plane).collect::<Result<Vec<_>, _>>();
    Layer::new(name, planes.map_err(|source| LayerError::Size { name: name.to_owned(), source })?)
}

/// Sets element `x` of a row to `value(x)`.
fn fill(row: &mut [f32], value: impl Fn(u32) -> f32) {
    for (x, number) in row.iter_mut().enumerate() {
        *number = value(x as u32);
    }
}

fn read(built: &TechniqueFrame, source: &LayerSource, output: &FrameOutput<'_>) -> Result<Layer, LayerError> {
    let surface = output.texture(source.texture).surface(0, 0);
    let samples = built.samples;
    let width = (surface.width - 2 * built.margin) / samples;
    let height = (surface.height - 2 * built.margin) / samples;
    let mask = built.light_mask.as_ref().filter(|mask| mask.layers.contains(&source.name));
    let kinds = mask.map(|mask| output.texture(mask.kinds).surface(0, 0));
    let pixel = Pixel { surface, kinds, margin: built.margin, samples };
    let plane = |c: usize| Image::from_rows(width, height, |y, row| fill(row, |x| pixel.fold(source.resolve, x, y, c)));
    let planes = (0..source.channels).map(plane).collect::<Result<Vec<_>, _>>();
    Layer::new(source.name, planes.map_err(|error| LayerError::Size { name: source.name.to_owned(), source: error })?)
}

/// Reads pixels of a supersampled surface with a margin.
struct Pixel<'a> {
    surface: &'a Surface,
    /// 1 + kind of the nearest surface, if mirrors and glass count as 0.
    kinds: Option<&'a Surface>,
    margin: u32,
    samples: u32,
}

impl Pixel<'_> {
    /// Sum of a channel over the pixel's samples, row by row.
    fn sum(&self, x: u32, y: u32, c: usize) -> f32 {
        let mut sum = 0.0;
        for sy in 0..self.samples {
            for sx in 0..self.samples {
                sum += self.sample(self.margin + x * self.samples + sx, self.margin + y * self.samples + sy, c);
            }
        }
        sum
    }

    fn nearest(&self, x: u32, y: u32, c: usize) -> f32 {
        let half = self.samples / 2;
        self.sample(self.margin + x * self.samples + half, self.margin + y * self.samples + half, c)
    }

    fn sample(&self, x: u32, y: u32, c: usize) -> f32 {
        let lands = self.kinds.is_none_or(|kinds| kinds.get(x, y, 3) <= 1.0 + MaterialKind::Diffuse as u8 as f32);
        if lands { self.surface.get(x, y, c) } else { 0.0 }
    }

    fn fold(&self, resolve: Resolve, x: u32, y: u32, c: usize) -> f32 {
        match resolve {
            Resolve::Mean => self.sum(x, y, c) / (self.samples * self.samples) as f32,
            Resolve::Sum => self.sum(x, y, c),
            Resolve::Nearest => self.nearest(x, y, c),
            Resolve::WeightedMean => {
                let weight = self.sum(x, y, 3);
                if weight > 0.0 { self.sum(x, y, c) / weight } else { 0.0 }
            }
            Resolve::Depth(origin, axis) => {
                if self.nearest(x, y, 3) == 0.0 {
                    return f32::INFINITY;
                }
                let p = glam::Vec3::new(self.nearest(x, y, 0), self.nearest(x, y, 1), self.nearest(x, y, 2));
                (p - origin).dot(axis)
            }
        }
    }
}
