//! A canvas: it has targets of one size, draws to them and reads them back. The shortest way to a pass, for tests and first programs.
//!
//! A [`Canvas`] adds nothing to what [`run_pass`] does: it owns the textures, attaches all of them, and reads them. Stream-out, observers, and mip
//! levels or layers as attachments need a [`Pass`] of their own.

use std::sync::Arc;

use crate::api::check::pass::PassError;
use crate::api::check::pipeline::PipelineError;
use crate::api::draw::Draw;
use crate::api::format::facts::ChannelKind;
use crate::api::format::srgb::linear_to_srgb8;
use crate::api::pass::{ColorAttachment, DepthStencilAttachment, Pass, PassOutput};
use crate::api::pipeline_descriptor::RenderPipelineDescriptor;
use crate::api::render_pipeline::RenderPipeline;
use crate::api::rules::RasterRules;
use crate::api::shader::program::Program;
use crate::api::state::{Color, CompareFunction, DepthStencilState, LoadOp, TextureFormat, depth_test};
use crate::api::texture::Texture;
use crate::api::texture_descriptor::{TextureDescriptor, TextureError};
use crate::run::device::Device;
use crate::run::pass::run_pass;

/// Colour targets and a depth-stencil target of one size, for passes on one device.
#[derive(Debug)]
pub struct Canvas<'d> {
    device: &'d Device,
    size: (u32, u32),
    color: Vec<Texture>,
    depth_stencil: Option<Texture>,
}

/// Why a canvas is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CanvasError {
    /// A target's size or format is not supported.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// The targets cannot be attachments of one pass.
    #[error(transparent)]
    Pass(#[from] PassError),
}

/// The clears before the first draw of a pass; `None` keeps the old values.
#[derive(Clone, Copy, Default)]
struct Clear {
    /// Number of a colour target, and its clear value.
    color: Option<(usize, Color)>,
    depth: Option<f32>,
    stencil: Option<u32>,
}

impl<'d> Canvas<'d> {
    /// Targets of `size` (width and height in pixels): one for each colour format, and a depth-stencil target if `depth_stencil` is given. Colours
    /// and stencil start at 0, depth at 1.
    ///
    /// # Errors
    /// If the size or a format is not supported, or a format is not for this kind of attachment.
    pub fn new(
        device: &'d Device,
        size: (u32, u32),
        color: &[TextureFormat],
        depth_stencil: Option<TextureFormat>,
    ) -> Result<Self, CanvasError> {
        let texture = |label: String, format| Texture::new(TextureDescriptor::d2(label, size.0, size.1, format));
        let color =
            color.iter().enumerate().map(|(target, &format)| texture(format!("color {target}"), format)).collect::<Result<_, _>>()?;
        let depth_stencil = depth_stencil.map(|format| texture("depth-stencil".into(), format)).transpose()?;
        let mut canvas = Self { device, size, color, depth_stencil };
        canvas.clear_depth_stencil(1.0, 0)?;
        Ok(canvas)
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// A pipeline of a program that fits these targets, under the reference rules. `edit` may change the description. Before that, every fragment
    /// overwrites every target; depth, if there is any, is tested with `Less` and written; all other state is default.
    ///
    /// # Errors
    /// If the edited description is not valid.
    pub fn pipeline(
        &self,
        program: impl Into<Arc<Program>>,
        edit: impl FnOnce(&mut RenderPipelineDescriptor),
    ) -> Result<RenderPipeline, PipelineError> {
        let program = program.into();
        let mut desc = RenderPipelineDescriptor::new(program.name, program);
        desc.targets = self.color.iter().map(|texture| Some(texture.desc().format.into())).collect();
        desc.depth_stencil = self.depth_stencil.as_ref().map(|texture| {
            let state = depth_test(texture.desc().format, CompareFunction::Less);
            if texture.info().depth { state } else { DepthStencilState::stencil(state.format, state.stencil) }
        });
        edit(&mut desc);
        RenderPipeline::new(desc, RasterRules::REFERENCE)
    }

    /// Fills a colour target. For integer formats each component is rounded toward zero and clamped.
    ///
    /// # Errors
    /// If the value is not valid for a pass.
    ///
    /// # Panics
    /// If there is no such target.
    pub fn clear_color(&mut self, target: usize, value: Color) -> Result<(), PassError> {
        assert!(target < self.color.len(), "target {target} of {}", self.color.len());
        self.run(Clear { color: Some((target, value)), ..Clear::default() }, Vec::new()).map(drop)
    }

    /// Fills the depth and the stencil of the depth-stencil target, as far as they exist.
    ///
    /// # Errors
    /// If a value is not valid for a pass.
    pub fn clear_depth_stencil(&mut self, depth: f32, stencil: u32) -> Result<(), PassError> {
        self.run(Clear { depth: Some(depth), stencil: Some(stencil), ..Clear::default() }, Vec::new()).map(drop)
    }

    /// Runs a pass with these draws, in order, on the present contents of the targets. The output has the pipeline statistics, and one occlusion
    /// query for every number up to the greatest [`Draw::query`].
    ///
    /// # Errors
    /// If a draw does not fit the targets or its pipeline. Then nothing is drawn.
    pub fn draw(&mut self, draws: Vec<Draw<'_>>) -> Result<PassOutput, PassError> {
        self.run(Clear::default(), draws)
    }

    fn run(&mut self, clear: Clear, draws: Vec<Draw<'_>>) -> Result<PassOutput, PassError> {
        let color = self.color.iter_mut().enumerate().map(|(target, texture)| {
            let load = match clear.color {
                Some((cleared, value)) if cleared == target => LoadOp::Clear(value),
                _ => LoadOp::Load,
            };
            Some(ColorAttachment { view: texture.view_mut(), load })
        });
        let mut pass = Pass {
            label: "canvas".into(),
            color: color.collect(),
            depth_stencil: self.depth_stencil.as_mut().map(|texture| DepthStencilAttachment {
                view: texture.view_mut(),
                depth_load: clear.depth.map_or(LoadOp::Load, LoadOp::Clear),
                stencil_load: clear.stencil.map_or(LoadOp::Load, LoadOp::Clear),
            }),
            query_count: draws.iter().filter_map(|draw| draw.query).max().map_or(0, |last| last as usize + 1),
            draws,
            stream_out: Vec::new(),
        };
        run_pass(self.device, &mut pass, None)
    }

    /// A colour target, for bindings of another canvas's pass or for reading.
    ///
    /// # Panics
    /// If there is no such target.
    #[must_use]
    pub fn color(&self, target: usize) -> &Texture {
        &self.color[target]
    }

    /// The depth-stencil target.
    #[must_use]
    pub fn depth_stencil(&self) -> Option<&Texture> {
        self.depth_stencil.as_ref()
    }

    /// A pixel of a colour target, as a shader would read it: missing channels are 0, missing alpha is 1, sRGB is decoded; row 0 is the top.
    ///
    /// # Panics
    /// If there is no such target or pixel.
    #[must_use]
    pub fn pixel(&self, target: usize, x: u32, y: u32) -> [f32; 4] {
        self.assert_inside(x, y);
        self.color[target].texel(0, 0, x, y)
    }

    /// Depth of a pixel, in 0..=1, row 0 at the top.
    ///
    /// # Panics
    /// If there is no depth or no such pixel.
    #[must_use]
    pub fn depth(&self, x: u32, y: u32) -> f32 {
        self.assert_inside(x, y);
        let texture = self.depth_stencil.as_ref().filter(|texture| texture.info().depth);
        texture.unwrap_or_else(|| panic!("the canvas has no depth")).texel(0, 0, x, y)[0]
    }

    /// Stencil value of a pixel, row 0 at the top.
    ///
    /// # Panics
    /// If there is no stencil or no such pixel.
    #[must_use]
    pub fn stencil(&self, x: u32, y: u32) -> u8 {
        self.assert_inside(x, y);
        let texture = self.depth_stencil.as_ref().filter(|texture| texture.info().stencil);
        texture.unwrap_or_else(|| panic!("the canvas has no stencil")).surface(0, 0).stencil_at(x, y)
    }

    /// The bytes of a colour target in its own format, rows top down, tightly packed.
    ///
    /// # Panics
    /// If there is no such target.
    #[must_use]
    pub fn bytes(&self, target: usize) -> Vec<u8> {
        self.color[target].read_bytes(0, 0)
    }

    /// A colour target as the bytes of a picture file: binary PPM, 8 bits for each of red, green and blue. A single channel is shown as grey; alpha
    /// is left out.
    ///
    /// Unorm and sRGB formats give their codes; integers are clamped to 0..=255. Other formats count as linear light, which is clamped to 0..=1 and
    /// encoded by the sRGB curve.
    ///
    /// # Panics
    /// If there is no such target.
    #[must_use]
    pub fn ppm(&self, target: usize) -> Vec<u8> {
        let texture = &self.color[target];
        let info = texture.info();
        let code = |value: f32| match info.kind {
            ChannelKind::Unorm8 | ChannelKind::Unorm10 => (value * 255.0).round() as u8,
            ChannelKind::Uint(_) => value.to_bits().min(255) as u8,
            ChannelKind::Sint(_) => (value.to_bits() as i32).clamp(0, 255) as u8,
            _ => linear_to_srgb8(value),
        };
        let mut file = format!("P6\n{} {}\n255\n", self.size.0, self.size.1).into_bytes();
        for y in 0..self.size.1 {
            for x in 0..self.size.0 {
                let [red, green, blue, _] = texture.texel(0, 0, x, y);
                file.extend(if info.channels == 1 { [code(red); 3] } else { [code(red), code(green), code(blue)] });
            }
        }
        file
    }

    fn assert_inside(&self, x: u32, y: u32) {
        assert!(x < self.size.0 && y < self.size.1, "pixel ({x}, {y}) of {}x{}", self.size.0, self.size.1);
    }
}
