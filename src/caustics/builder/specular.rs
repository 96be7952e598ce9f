//! What the frame of a scene with mirrors or glass has in addition, so that light lands on the receivers behind them and the eye sees it there.
//!
//! | Pass | What it draws | Targets |
//! |---|---|---|
//! | `geometry_buffer` | the nearest surfaces, as in every scene; the layers of surfaces are theirs | `position`, `normal`, `albedo`, `depth` |
//! | `receiver_buffer` | the nearest diffuse surfaces: the textures of [`FrameBuilder`], on which all light is computed | `receiver position`, ... |
//! | `back_faces` | the nearest back faces of glass | `back position`, `back normal`, `back absorption`, `back depth` |
//! | `surroundings` | diffuse surfaces in a wider view, for rays that leave the picture | `surroundings position`, ... |
//! | `surroundings light N` | direct light of a light on them | `surroundings direct` |
//! | `surroundings radiance` | their radiance, without caustics: these are near what makes them, and so in the picture | `surroundings radiance` |
//! | `glass` | what mirrors and glass show | `glass` |

use glam::{Mat4, Vec4};

use crate::passes::camera::CameraUniform;
use crate::passes::geometry_buffer::MaterialUniform;
use crate::passes::receiver_search::ReceiverBounds;
use crate::passes::{fullscreen, glass};
use nephroid_pipeline::TextureDescriptor;
use nephroid_pipeline::frame::{BindEntry, BufferId, Draw, Pass, TextureId};
use nephroid_pipeline::state::{Face, TextureFormat};
use nephroid_scene::Material;
use nephroid_scene::geom::Aabb;

use super::FrameBuilder;
use super::geometry::{GeometryTargets, Surfaces};
use super::light::Lit;
use super::picture::Shaded;
use super::state::clear;

/// How much wider the view of the surroundings is than the picture, on the plane at distance 1. From 32 degrees this makes 98, from 60 degrees 133; the
/// sky begins within the view unless the camera looks down steeply.
const WIDER: f32 = 4.0;

/// Textures beside those of the receivers.
pub(super) struct Specular {
    /// The nearest surfaces.
    pub front: GeometryTargets,
    /// Back faces of glass.
    back: GeometryTargets,
    surroundings: Surroundings,
}

/// Receivers in a wider view.
struct Surroundings {
    camera: BufferId,
    size: (u32, u32),
    geometry: GeometryTargets,
    direct: TextureId,
}

impl FrameBuilder<'_> {
    /// Moves from the nearest surfaces to the nearest receivers, and adds the passes `receiver_buffer`, `back_faces` and `surroundings`.
    pub(super) fn look_behind_specular(&mut self) {
        let front = self.geometry_targets();
        let receivers = self.new_geometry_targets("receiver", "albedo", self.size, self.depth_format);
        (self.position, self.normal) = (receivers.position, receivers.normal);
        (self.albedo, self.depth) = (receivers.albedo, receivers.depth);
        let diffuse = surfaces(self.receivers.groups.iter(), diffuse);
        self.geometry_pass("receiver_buffer", self.camera_buffer, receivers, None, &diffuse);
        let back = self.new_geometry_targets("back", "absorption", self.size, TextureFormat::Depth32Float);
        let glass = surfaces(self.receivers.groups.iter(), inside_of_glass);
        self.geometry_pass("back_faces", self.camera_buffer, back, Some(Face::Front), &glass);
        let surroundings = self.new_surroundings();
        self.geometry_pass("surroundings", surroundings.camera, surroundings.geometry, None, &diffuse);
        self.specular = Some(Specular { front, back, surroundings });
    }

    fn new_surroundings(&mut self) -> Surroundings {
        // A sample per pixel is enough: what is not in the picture is seen smaller than in the picture.
        let size = (self.scene.image.width, self.scene.image.height);
        let clip_from_world = Mat4::from_scale(glam::Vec3::new(1.0 / WIDER, 1.0 / WIDER, 1.0)) * self.camera.clip_from_world;
        let camera = CameraUniform {
            clip_from_world,
            world_from_clip: clip_from_world.inverse(),
            size_px: Vec4::new(size.0 as f32, size.1 as f32, 1.0 / size.0 as f32, 1.0 / size.1 as f32),
            ..self.camera
        };
        Surroundings {
            camera: self.uniform("surroundings camera", &camera),
            size,
            geometry: self.new_geometry_targets("surroundings", "albedo", size, TextureFormat::Depth32Float),
            direct: self.frame.texture(TextureDescriptor::d2("surroundings direct", size.0, size.1, TextureFormat::Rgba32Float)),
        }
    }

    fn new_geometry_targets(&mut self, of: &str, color: &str, size: (u32, u32), depth_format: TextureFormat) -> GeometryTargets {
        let mut target = |what: &str, format| self.frame.texture(TextureDescriptor::d2(format!("{of} {what}"), size.0, size.1, format));
        GeometryTargets {
            position: target("position", TextureFormat::Rgba32Float),
            normal: target("normal", TextureFormat::Rgba32Float),
            albedo: target(color, TextureFormat::Rgba32Float),
            depth: target("depth", depth_format),
            depth_format,
        }
    }

    /// The receivers that a light shines on besides those in the picture.
    pub(super) fn lit_surroundings(&self) -> Option<Lit> {
        self.specular.as_ref().map(|Specular { surroundings, .. }| Lit {
            position: surroundings.geometry.position,
            normal: surroundings.geometry.normal,
            albedo: surroundings.geometry.albedo,
            direct: surroundings.direct,
            visibility: None,
        })
    }

    /// The radiance of the surface that each sample shows, from that of the receivers.
    pub(super) fn glass(&mut self, environment: BufferId, radiance: TextureId) -> TextureId {
        let Some(Specular { front, back, surroundings: Surroundings { camera, size, geometry, direct } }) = &self.specular else {
            return radiance;
        };
        let (front, back, camera, size, geometry, direct) = (*front, *back, *camera, *size, *geometry, *direct);
        let mut wide = |label: &str| self.frame.texture(TextureDescriptor::d2(label, size.0, size.1, TextureFormat::Rgba32Float));
        // Nothing is drawn to the caustics: they are 0.
        let (wide_radiance, caustic) = (wide("surroundings radiance"), wide("surroundings caustic"));
        let target = self.target("glass", TextureFormat::Rgba32Float);
        let bounds = self.uniform("receiver bounds", &self.receiver_bounds());
        self.shade_pass("surroundings radiance", environment, &Shaded { camera, geometry, direct, caustic, radiance: wide_radiance });
        let bindings = self.frame.bind_group(vec![
            BindEntry::Uniform(self.camera_buffer, 0),
            BindEntry::Uniform(environment, 0),
            BindEntry::texture(front.position),
            BindEntry::texture(front.normal),
            BindEntry::texture(front.albedo),
            BindEntry::texture(back.position),
            BindEntry::texture(back.normal),
            BindEntry::texture(back.albedo),
            BindEntry::texture(self.position),
            BindEntry::texture(self.normal),
            BindEntry::texture(radiance),
            BindEntry::Uniform(camera, 0),
            BindEntry::texture(geometry.position),
            BindEntry::texture(geometry.normal),
            BindEntry::texture(wide_radiance),
            BindEntry::Uniform(bounds, 0),
        ]);
        let pipeline = self.fullscreen("glass", glass::program(), &[TextureFormat::Rgba32Float], None);
        self.frame.passes.push(Pass {
            label: "glass".into(),
            color: vec![clear(target)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        target
    }

    fn receiver_bounds(&self) -> ReceiverBounds {
        let groups = self.receivers.groups.iter().filter(|group| diffuse(&group.material).is_some());
        ReceiverBounds::around(Aabb::from_points(groups.flat_map(|group| self.receivers.positions_of(group))))
    }
}

/// The objects of some materials.
fn surfaces<'a>(
    groups: impl Iterator<Item = &'a crate::ReceiverGroup>,
    uniform: impl Fn(&Material) -> Option<MaterialUniform>,
) -> Surfaces<'a> {
    groups.filter_map(|group| Some((group, uniform(&group.material)?))).collect()
}

fn diffuse(material: &Material) -> Option<MaterialUniform> {
    matches!(material, Material::Diffuse { .. }).then(|| material.into())
}

fn inside_of_glass(material: &Material) -> Option<MaterialUniform> {
    match material {
        Material::Dielectric { ior, absorption, .. } => Some(MaterialUniform::inside_of_glass(*ior, *absorption)),
        _ => None,
    }
}
