//! A conformance drawing: primitives, state and targets, as a frame.

use std::sync::Arc;

use super::program::{Output, Vertex, program_for};
use nephroid_pipeline::frame::{BindEntry, ColorAttachment, DepthStencilAttachment, Draw, Frame, Pass};
use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::{
    ADDITIVE, BlendState, Color, ColorTargetState, ColorWrites, DepthStencilState, PrimitiveState, PrimitiveTopology, RasterRules,
    TextureFormat, Viewport,
};
use nephroid_pipeline::{Buffer, LoadOp, RenderPipelineDescriptor, TextureDescriptor};

/// Primitives that one draw renders into cleared targets.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// Width and height of the targets in pixels.
    pub size: (u32, u32),
    /// Vertices of the primitives, in order.
    pub vertices: Vec<Vertex>,
    /// Topology: a list of points, lines or triangles.
    pub topology: PrimitiveTopology,
    /// How colours are interpolated.
    pub interpolation: Interpolation,
    /// Format of the colour target, and its blending; `None` without a colour target.
    pub color: Option<(TextureFormat, Option<BlendState>)>,
    /// Clear value of the colour target.
    pub clear: Color,
    /// Depth and stencil state.
    pub depth_stencil: Option<DepthStencilState>,
    /// Clear value of depth.
    pub clear_depth: f32,
    /// All other primitive state.
    pub primitive: PrimitiveState,
    /// Edge of points, pixels.
    pub point_size: f32,
    /// Width of lines, pixels.
    pub line_width: f32,
    /// Whether fragments are counted.
    pub query: bool,
    /// Stencil reference.
    pub stencil_reference: u32,
    /// Blend constant.
    pub blend_constant: [f32; 4],
    /// Viewport; `None` for the whole target.
    pub viewport: Option<Viewport>,
}

impl Drawing {
    /// Triangles whose colours are added up in a 32-bit float target.
    #[must_use]
    pub fn adding(size: (u32, u32), vertices: Vec<Vertex>) -> Self {
        Self {
            size,
            vertices,
            topology: PrimitiveTopology::TriangleList,
            interpolation: Interpolation::Flat,
            color: Some((TextureFormat::R32Float, Some(ADDITIVE))),
            clear: Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 },
            depth_stencil: None,
            clear_depth: 1.0,
            primitive: PrimitiveState::default(),
            point_size: 1.0,
            line_width: 1.0,
            query: false,
            stencil_reference: 0,
            blend_constant: [0.0; 4],
            viewport: None,
        }
    }

    /// Number of primitives.
    #[must_use]
    pub fn count(&self) -> usize {
        self.vertices.len() / self.corners()
    }

    /// A drawing of some of the primitives, chosen by number, with all other state unchanged.
    #[must_use]
    pub fn only(&self, primitives: &[usize]) -> Self {
        let corners = self.corners();
        let vertices = primitives.iter().flat_map(|p| self.vertices[p * corners..(p + 1) * corners].iter().copied()).collect();
        Self { vertices, ..self.clone() }
    }

    /// Number of vertices of a primitive.
    #[must_use]
    pub fn corners(&self) -> usize {
        match self.topology {
            PrimitiveTopology::PointList => 1,
            PrimitiveTopology::LineList | PrimitiveTopology::LineStrip => 2,
            PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip => 3,
        }
    }

    /// The drawing as a frame: one pass with one draw.
    #[must_use]
    pub fn frame(&self, rules: RasterRules) -> Frame {
        let mut frame = Frame { rules, ..Frame::default() };
        let vertices = frame.buffer("vertices", Arc::new(Buffer::from_slice(&self.vertices)));
        let settings = frame.buffer("settings", Arc::new(Buffer::from_slice(&[self.point_size, 0.0, 0.0, 0.0])));
        let group = frame.bind_group(vec![BindEntry::Storage(vertices), BindEntry::Uniform(settings, 0)]);
        let (width, height) = self.size;
        let color = self.color.map(|(format, blend)| {
            let view = frame.texture(TextureDescriptor::d2("color", width, height, format)).into();
            let state = ColorTargetState { format, blend, write_mask: ColorWrites::ALL };
            (ColorAttachment { view, load: LoadOp::Clear(self.clear) }, state)
        });
        let depth = self.depth_stencil.as_ref().map(|state| DepthStencilAttachment {
            view: frame.texture(TextureDescriptor::d2("depth", width, height, state.format)).into(),
            depth_load: LoadOp::Clear(self.clear_depth),
            stencil_load: LoadOp::Clear(0),
        });
        let output = self.color.map_or(Output::Float, |(format, _)| Output::of(format));
        let mut program = program_for(self.interpolation, output);
        if color.is_none() {
            let mut without_fragment = (*program).clone();
            without_fragment.fragment = None;
            program = Arc::new(without_fragment);
        }
        let pipeline = frame.pipeline(RenderPipelineDescriptor {
            primitive: PrimitiveState { topology: self.topology, ..self.primitive },
            depth_stencil: self.depth_stencil.clone(),
            targets: color.iter().map(|(_, state)| Some(state.clone())).collect(),
            line_width: self.line_width,
            ..RenderPipelineDescriptor::new("conformance", program)
        });
        let draw = Draw {
            query: self.query.then_some(0),
            stencil_reference: self.stencil_reference,
            blend_constant: self.blend_constant,
            viewport: self.viewport,
            ..Draw::new(pipeline, group, 0..self.vertices.len() as u32)
        };
        frame.passes.push(Pass {
            label: "conformance".into(),
            color: color.iter().map(|(target, _)| Some(*target)).collect(),
            depth_stencil: depth,
            draws: vec![draw],
            query_count: usize::from(self.query),
            ..Pass::default()
        });
        frame
    }
}
