//! The view of the scene: size and margin of the targets, refraction of the eye at the water, the camera's uniform.

use glam::{Mat4, Vec3, Vec4};

use crate::passes::camera::{CameraUniform, apparent_depth_ratio};
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
    pub fn new(scene: &Scene, view: &ViewOptions) -> Self {
        let (under, ratio) = side_and_ratio(scene, view.eye_refraction);
        let (width, height) = (scene.image.width * view.samples, scene.image.height * view.samples);
        let margin = if ratio != 1.0 { (width.max(height) as f32 * SNELL_MARGIN).ceil() as u32 } else { 0 };
        let size = (width + 2 * margin, height + 2 * margin);
        Self { size, margin, camera: camera_uniform(scene, (width, height), size, under, ratio) }
    }
}

/// Whether the eye is under water, and the apparent-depth ratio (see [`CameraUniform::raise`]).
fn side_and_ratio(scene: &Scene, eye_refraction: EyeRefraction) -> (bool, f32) {
    let Some(water) = &scene.water else { return (false, 1.0) };
    let under = eye_is_under_water(scene);
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

/// Whether the eye is in the body of water. A parallel camera has its eye far away; it counts as under water if its position is.
#[must_use]
pub fn eye_is_under_water(scene: &Scene) -> bool {
    let Some(water) = &scene.water else { return false };
    let eye = scene.camera.position_ws();
    let (min, max) = (water.min_ws(), water.max_ws());
    eye.y < water.level_m && (min.x..=max.x).contains(&eye.x) && (min.y..=max.y).contains(&eye.z)
}

/// Height at which receivers are cut for this scene and this view, see [`crate::Receivers::new`].
#[must_use]
pub fn cut_level(scene: &Scene, eye_refraction: EyeRefraction) -> Option<f32> {
    let (_, ratio) = side_and_ratio(scene, eye_refraction);
    scene.water.as_ref().filter(|_| ratio != 1.0).map(|w| w.level_m)
}

/// The uniform of a camera for targets of `size` samples, of which the picture covers the central `inner` ones.
fn camera_uniform(scene: &Scene, inner: (u32, u32), size: (u32, u32), under: bool, ratio: f32) -> CameraUniform {
    let aspect = inner.0 as f32 / inner.1 as f32;
    let shrink = Vec3::new(inner.0 as f32 / size.0 as f32, inner.1 as f32 / size.1 as f32, 1.0);
    let clip_from_world = Mat4::from_scale(shrink) * scene.camera.clip_from_world(aspect);
    let eye_ws = match scene.camera {
        Camera::Perspective { position, .. } => position.extend(1.0),
        Camera::Orthographic { .. } => scene.camera.forward_ws().extend(0.0),
    };
    let (level, extent, exists) = scene.water.as_ref().map_or((0.0, Vec4::ZERO, 0.0), |w| {
        let (min, max) = w.extent_ws();
        (w.level_m, Vec4::new(min.x, min.y, max.x, max.y), 1.0)
    });
    CameraUniform {
        clip_from_world,
        world_from_clip: clip_from_world.inverse(),
        eye_ws,
        size_px: Vec4::new(size.0 as f32, size.1 as f32, 1.0 / size.0 as f32, 1.0 / size.1 as f32),
        water: Vec4::new(level, ratio, if under { 1.0 } else { 0.0 }, exists),
        extent,
    }
}
