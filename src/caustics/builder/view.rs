//! The view of the scene: size and margin of the targets, refraction of the eye at the water, the camera's uniform.

use glam::{Mat4, Vec3, Vec4};

use crate::passes::camera::{CameraUniform, apparent_depth_ratio};
use crate::passes::light::Shadows;
use nephroid_scene::water::{HeightField, Water};
use nephroid_scene::{Camera, EyeRefraction, Scene};

/// Width of the margin around the picture where refracted rays may leave it, as a share of the picture's larger side.
const SNELL_MARGIN: f32 = 0.06;

/// How a technique views the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewOptions {
    /// How the eye sees through the water surface.
    pub eye_refraction: EyeRefraction,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// Whether objects above the water cast shadows.
    pub surface_shadows: bool,
    /// Whether objects under water cast shadows.
    pub underwater_shadows: bool,
    /// Width and height of the shadow maps, in texels.
    pub shadow_map_size: u32,
    /// Whether the depth attachment has a stencil.
    pub stencil: bool,
}

impl ViewOptions {
    /// The shadows of a light in the air or in the water.
    #[must_use]
    pub fn shadows(&self, in_water: bool) -> Shadows {
        let (above, below) = (self.surface_shadows, self.underwater_shadows);
        if in_water { Shadows { straight: below, refracted: above } } else { Shadows { straight: above, refracted: below } }
    }
}

/// Targets and camera of a view.
pub(super) struct Eye {
    /// Width and height of the targets, samples.
    pub size: (u32, u32),
    /// Samples beyond each edge of the picture.
    pub margin: u32,
    /// The camera, for targets with that margin.
    pub camera: CameraUniform,
}

impl Eye {
    pub fn new(scene: &Scene, water: Option<&HeightField>, lowest_receiver_y: f32, view: &ViewOptions) -> Self {
        let (under, ratio) = side_and_ratio(scene, water, view.eye_refraction);
        let (width, height) = (scene.image.width * view.samples, scene.image.height * view.samples);
        let margin = if ratio != 1.0 { (width.max(height) as f32 * SNELL_MARGIN).ceil() as u32 } else { 0 };
        let size = (width + 2 * margin, height + 2 * margin);
        Self { size, margin, camera: camera_uniform(scene, water, lowest_receiver_y, (width, height), size, (under, ratio)) }
    }
}

/// Whether the eye is under water, and the apparent-depth ratio (see [`CameraUniform::raise`]).
fn side_and_ratio(scene: &Scene, surface: Option<&HeightField>, eye_refraction: EyeRefraction) -> (bool, f32) {
    let Some(water) = &scene.water else { return (false, 1.0) };
    let under = eye_is_under_water(scene, surface);
    if under || eye_refraction == EyeRefraction::VirtualPlane {
        return (under, 1.0);
    }
    let direction = match scene.camera {
        Camera::Orthographic { .. } => scene.camera.forward_ws(),
        Camera::Perspective { .. } => {
            let middle = (water.min_ws() + water.max_ws()) * 0.5;
            (Vec3::new(middle.x, water.level_m, middle.y) - scene.camera.position_ws()).normalize_or(Vec3::NEG_Y)
        }
    };
    (under, apparent_depth_ratio(direction, water.ior))
}

/// Whether the eye is in the body of water: below the surface at its place. A parallel camera has its eye far away; it counts as under water if its
/// position is.
#[must_use]
pub fn eye_is_under_water(scene: &Scene, surface: Option<&HeightField>) -> bool {
    surface.is_some_and(|surface| surface.is_above(scene.camera.position_ws()))
}

/// Height at which receivers are cut for this scene and this view, see [`crate::Receivers::new`]: that from which on they appear raised
/// ([`CameraUniform::raise`]), which no wave falls below. It is the same at all times, because receivers are made once.
#[must_use]
pub fn cut_level(scene: &Scene, eye_refraction: EyeRefraction) -> Option<f32> {
    scene.water.as_ref().filter(|_| eye_refraction == EyeRefraction::Snell).map(Water::lowest_m)
}

/// The uniform of a camera for targets of `size` samples, of which the picture covers the central `inner` ones.
fn camera_uniform(
    scene: &Scene,
    surface: Option<&HeightField>,
    lowest_receiver_y: f32,
    inner: (u32, u32),
    size: (u32, u32),
    (under, ratio): (bool, f32),
) -> CameraUniform {
    let aspect = inner.0 as f32 / inner.1 as f32;
    let shrink = Vec3::new(inner.0 as f32 / size.0 as f32, inner.1 as f32 / size.1 as f32, 1.0);
    let clip_from_world = Mat4::from_scale(shrink) * scene.camera.clip_from_world(aspect);
    let eye_ws = match scene.camera {
        Camera::Perspective { position, .. } => position.extend(1.0),
        Camera::Orthographic { .. } => scene.camera.forward_ws().extend(0.0),
    };
    let water = scene.water.as_ref().zip(surface);
    let (extent, grid) = water.map_or((Vec4::ZERO, Vec4::ZERO), |(water, surface)| {
        let ((min, max), first) = (water.extent_ws(), surface.origin_ws);
        let per_metre = surface.spacing_m.recip();
        (Vec4::new(min.x, min.y, max.x, max.y), Vec4::new(first.x, first.y, per_metre.x, per_metre.y))
    });
    let depth = scene.water.as_ref().map_or(1.0, |water| (water.level_m - lowest_receiver_y).max(water.size_m.max_element() * 0.1));
    let (lowest, level) = scene.water.as_ref().map_or((0.0, 0.0), |water| (water.lowest_m(), water.level_m));
    let (low, high) = surface.map_or((0.0, 0.0), HeightField::height_range_ws);
    CameraUniform {
        clip_from_world,
        world_from_clip: clip_from_world.inverse(),
        eye_ws,
        size_px: Vec4::new(size.0 as f32, size.1 as f32, 1.0 / size.0 as f32, 1.0 / size.1 as f32),
        water: Vec4::new(lowest, ratio, if under { 1.0 } else { 0.0 }, if water.is_some() { 1.0 } else { 0.0 }),
        extent,
        grid,
        level: Vec4::new(level, depth, low, high),
    }
}
