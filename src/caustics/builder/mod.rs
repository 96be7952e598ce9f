//! The part of a frame that all techniques share: the receivers as the camera sees them, shadow maps and direct light of each light, and the picture.
//!
//! [`FrameBuilder::new`] draws the receivers, [`FrameBuilder::lights`] runs the loop over lights, in which a technique adds its own passes, and
//! [`FrameBuilder::finish`] turns the technique's [`Contributions`] into the picture and its layers.
//!
//! | File | What |
//! |---|---|
//! | `view` | size of the targets, refraction of the eye, the camera's uniform: [`ViewOptions`] |
//! | `geometry` | pass `geometry_buffer`: position, normal and albedo of what each pixel sees |
//! | `specular` | what a scene with mirrors or glass has in addition: receivers behind them, and what the eye sees in them |
//! | `light`, `shadow_view`, `refine` | passes `shadow_map_straight N`, `shadow_map_refracted N`, `light N` |
//! | `targets` | textures in which caustic light is summed |
//! | `picture` | passes `shade` and `picture` |
//! | `state` | pipeline state that passes share |

mod geometry;
pub mod light;
mod picture;
mod refine;
mod shadow_view;
mod specular;
pub mod state;
pub mod targets;
pub mod view;

use std::sync::Arc;

use crate::Receivers;
use crate::passes::camera::CameraUniform;
use crate::passes::geometry_buffer::MaterialUniform;
use nephroid_pipeline::frame::{BufferId, Frame, PipelineId, TextureId};
use nephroid_pipeline::shader::Program;
use nephroid_pipeline::state::{DepthStencilState, TextureFormat};
use nephroid_pipeline::{Buffer, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::water::HeightField;
use nephroid_scene::{Material, Scene};

use geometry::GeometryTargets;
pub use light::{FrameLight, is_in_water};
pub use picture::Contributions;
use specular::Specular;
pub use targets::CausticTargets;
pub use view::{ViewOptions, cut_level, eye_is_under_water};

/// Builds a frame.
///
/// All targets have the size of the picture times [`ViewOptions::samples`], plus [`Self::margin`] on each side.
pub struct FrameBuilder<'a> {
    /// The frame as built so far.
    pub frame: Frame,
    /// The scene.
    pub scene: &'a Scene,
    /// The scene's receivers.
    pub receivers: &'a Receivers,
    /// The water surface, if there is water.
    pub water: Option<&'a HeightField>,
    /// How the technique views the scene.
    pub view: ViewOptions,
    /// Width and height of the targets, in samples.
    pub size: (u32, u32),
    /// Samples beyond each edge of the picture.
    pub margin: u32,
    /// The camera.
    pub camera: CameraUniform,
    /// Uniform buffer with the camera.
    pub camera_buffer: BufferId,
    /// World position, m, of the receivers: the nearest diffuse surfaces, also behind mirrors and glass. w is
    /// 1 + [`crate::passes::geometry_buffer::MaterialKind`], 0 where there is no receiver.
    pub position: TextureId,
    /// Unit normal towards the eye.
    pub normal: TextureId,
    /// Albedo; w is 1 under water, otherwise 0.
    pub albedo: TextureId,
    /// Depth of the receivers, with a stencil if [`ViewOptions::stencil`] is set.
    pub depth: TextureId,
    /// Format of the depth texture.
    pub depth_format: TextureFormat,
    /// Direct irradiance, W/m², summed over the lights drawn so far.
    pub direct: TextureId,
    /// Visibility, through the water's surface, of the light drawn last, 0 to 1; 0 on the light's own side.
    pub visibility: TextureId,
    /// The picture: radiance, W/(m² sr).
    pub color: TextureId,
    vertices: BufferId,
    indices: BufferId,
    /// Heights of the water's surface, m, a texel per vertex; one texel without water.
    pub heights: TextureId,
    specular: Option<Specular>,
}

impl<'a> FrameBuilder<'a> {
    /// Starts a frame with the pass `geometry_buffer`.
    #[must_use]
    pub fn new(scene: &'a Scene, receivers: &'a Receivers, water: Option<&'a HeightField>, view: &ViewOptions) -> Self {
        let eye = view::Eye::new(scene, water, receivers.bounds.min.y, view);
        let size = eye.size;
        let depth_format = if view.stencil { TextureFormat::Depth32FloatStencil8 } else { TextureFormat::Depth32Float };
        let mut frame = Frame::default();
        let mut target = |label: &str, format| frame.texture(TextureDescriptor::d2(label, size.0, size.1, format));
        let position = target("position", TextureFormat::Rgba32Float);
        let normal = target("normal", TextureFormat::Rgba32Float);
        let albedo = target("albedo", TextureFormat::Rgba32Float);
        let depth = target("depth", depth_format);
        let direct = target("direct", TextureFormat::Rgba32Float);
        let visibility = target("visibility", TextureFormat::R32Float);
        let color = target("color", TextureFormat::Rgba32Float);
        let camera_buffer = frame.buffer("camera", Arc::new(Buffer::from_value(&eye.camera)));
        let vertices = frame.buffer("receivers", receivers.vertices.clone());
        let indices = frame.buffer("receiver indices", receivers.indices.clone());
        let heights = water_heights(&mut frame, water);
        let mut builder = Self {
            frame,
            scene,
            receivers,
            water,
            view: *view,
            size,
            margin: eye.margin,
            camera: eye.camera,
            camera_buffer,
            position,
            normal,
            albedo,
            depth,
            depth_format,
            direct,
            visibility,
            color,
            vertices,
            indices,
            heights,
            specular: None,
        };
        let nearest = receivers.groups.iter().map(|group| (group, MaterialUniform::from(&group.material))).collect();
        builder.geometry_pass("geometry_buffer", camera_buffer, builder.geometry_targets(), None, &nearest);
        if scene.objects.iter().any(|object| !matches!(object.material, Material::Diffuse { .. })) {
            builder.look_behind_specular();
        }
        builder
    }

    /// The textures of the receivers.
    fn geometry_targets(&self) -> GeometryTargets {
        let Self { position, normal, albedo, depth, depth_format, .. } = *self;
        GeometryTargets { position, normal, albedo, depth, depth_format }
    }

    /// Adds a texture of the targets' size.
    pub fn target(&mut self, label: &str, format: TextureFormat) -> TextureId {
        self.frame.texture(TextureDescriptor::d2(label, self.size.0, self.size.1, format))
    }

    /// Adds a buffer of one struct.
    pub fn uniform<T: bytemuck::NoUninit>(&mut self, label: &str, value: &T) -> BufferId {
        self.frame.buffer(label, Arc::new(Buffer::from_value(value)))
    }

    /// Adds a pipeline for a pass over every pixel.
    pub fn fullscreen(
        &mut self,
        label: &str,
        program: Arc<Program>,
        formats: &[TextureFormat],
        depth_stencil: Option<DepthStencilState>,
    ) -> PipelineId {
        let targets = formats.iter().map(|&format| state::target(format, None)).collect();
        self.frame.pipeline(RenderPipelineDescriptor { targets, depth_stencil, ..RenderPipelineDescriptor::new(label, program) })
    }
}

/// The heights of the water's surface as a texture, m, a texel per vertex; one texel without water.
#[must_use]
pub fn water_heights(frame: &mut Frame, water: Option<&HeightField>) -> TextureId {
    let (columns, rows, heights) = water.map_or((1, 1, &[0.0][..]), |field| (field.columns, field.rows, &field.heights_ws[..]));
    let bytes = heights.iter().flat_map(|height| height.to_le_bytes()).collect();
    frame.texture_with(TextureDescriptor::d2("water heights", columns, rows, TextureFormat::R32Float), vec![bytes])
}
