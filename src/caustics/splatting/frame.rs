//! Builds the frame: for each light its photons, their splats in the caustic map, and the map's light on the receivers.

use nephroid_pipeline::frame::Pass;
use nephroid_scene::geom::Mesh;
use nephroid_scene::water::{HeightField, Water};
use nephroid_scene::{Material, Radiometry, Scene};

use super::SplattingError;
use super::drawn::{Surfaced, Vertices, surfaces};
use super::exact::MOST_PHOTONS;
use super::light_pass::{LightPass, Map, eye_map};
use super::settings::{Gather, Intersection, Splatting, Views};
use super::totals::Totals;
use super::views::{LightViews, PhotonView, Stage, Wanted, Wet};
use crate::builder::cut_level;
use crate::builder::state::clear;
use crate::builder::{CausticTargets, FrameBuilder, FrameLight, ViewOptions};
use crate::passes::light_buffer::{Keep, Kept, Side};
use crate::receivers::Receivers;
use crate::surfaces::Surfaces;
use crate::{RenderError, TechniqueFrame};

/// How the technique views the scene.
#[must_use]
pub fn view(settings: &Splatting) -> ViewOptions {
    ViewOptions {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: true,
        underwater_shadows: true,
        shadow_map_size: settings.shadow_map_size,
        stencil: false,
    }
}

/// What frames of one scene share.
pub struct Shared {
    /// The objects.
    pub receivers: Receivers,
    /// The objects, to be hit by rays.
    pub surfaces: Surfaces,
    /// The objects' vertices, with curvature.
    pub vertices: Vertices,
}

impl Shared {
    /// What the frames of a scene with these settings share.
    ///
    /// # Errors
    /// If a mesh cannot be loaded.
    pub fn new(scene: &Scene, settings: &Splatting) -> Result<Self, RenderError> {
        let receivers = Receivers::new(scene, cut_level(scene, settings.eye_refraction))?;
        let meshes = scene.objects.iter().enumerate().map(|(index, object)| {
            let mesh = scene.placed_mesh(index)?.mesh;
            Ok((mesh, object.material.clone()))
        });
        let surfaces = Surfaces::new(meshes.collect::<Result<_, RenderError>>()?);
        let vertices = Vertices::new(&receivers, settings);
        Ok(Self { receivers, surfaces, vertices })
    }
}

/// A moment whose photons are in the map.
pub struct Moment {
    /// Its number in a sequence of frames, which says how the photons' grid is shifted.
    pub number: u64,
    /// The water's surface.
    pub field: Option<HeightField>,
}

/// What emits photons at a moment.
struct Emitters<'a> {
    moment: &'a Moment,
    surfaces: Surfaced,
    /// The objects, and the water if photons are followed through it.
    rays: Option<Surfaces>,
}

/// Builds the frame from the moments whose photons are in its map, the last one being its own.
///
/// # Errors
/// If a light has no view of what it should see, or the eye should see splats through water.
pub fn build(scene: &Scene, shared: &Shared, moments: &[Moment], settings: &Splatting) -> Result<TechniqueFrame, RenderError> {
    let now = moments.last().and_then(|moment| moment.field.as_ref());
    let mut builder = FrameBuilder::new(scene, &shared.receivers, now, &view(settings));
    if settings.gather == Gather::Eye && builder.margin > 0 {
        return Err(SplattingError::EyeThroughWater.into());
    }
    if settings.intersection == Intersection::Exact && settings.photons > MOST_PHOTONS {
        return Err(SplattingError::TooManyExact { seen: settings.photons, most: MOST_PHOTONS }.into());
    }
    let targets = CausticTargets::new(&mut builder, &[], "");
    let emitters: Vec<Emitters<'_>> = moments.iter().map(|moment| emitters(&mut builder, shared, moment, settings)).collect();
    let wanted = Wanted {
        views: settings.views,
        photons: settings.photons,
        map_size: settings.map_size,
        all_paths: settings.intersection == Intersection::Exact && settings.radiometry == Radiometry::Physical,
    };
    let mut totals = Totals::default();
    let mut tallies = Vec::new();
    builder.lights(|builder, light| {
        let views = |moment: &Moment| {
            let source = &builder.scene.lights[light.number];
            let water = builder.scene.water.as_ref().zip(moment.field.as_ref());
            let water = water.map(|(water, field)| Wet::new(water, field, source));
            if water.as_ref().is_some_and(|wet| wet.in_water != light.in_water) {
                // Photons of an earlier moment, when the light was on the other side of the surface.
                return Ok(None);
            }
            let stage = Stage { receivers: &shared.receivers, surfaces: &shared.surfaces, water };
            LightViews::new(&stage, light.number, source, &wanted)
        };
        let views = moments.iter().map(views).collect::<Result<Vec<_>, _>>()?;
        let Some(own) = views.last().cloned().flatten() else {
            totals.dark += 1;
            nothing(builder, light, &targets);
            return Ok(());
        };
        let pass = LightPass { light, own: &own, settings, moments: moments.len() };
        let seen_by_light = settings.gather == Gather::Light || settings.intersection == Intersection::Image;
        let receivers = seen_by_light.then(|| {
            let surfaces = &emitters[emitters.len() - 1].surfaces;
            // Light that comes through the water's surface lands behind it, whatever is before it.
            let side = builder.water.map(|_| Side { camera: builder.camera_buffer, heights: builder.heights, wet: !light.in_water });
            pass.light_buffer(builder, "receivers", &own.map, Kept { along: Keep::Nearest, side }, &surfaces.diffuse)
        });
        let map = match (settings.gather, &receivers) {
            (Gather::Light, Some(seen)) => Map { texels: own.map, position: seen.position, normal: seen.normal },
            _ => eye_map(builder),
        };
        let mut photons = Vec::new();
        for (age, (emitters, views)) in emitters.iter().zip(views).rev().enumerate() {
            let Some(views) = views else { continue };
            for (number, view) in views.photons.iter().enumerate() {
                let texels = if moments.len() > 1 { view.texels.shifted(emitters.moment.number) } else { view.texels };
                let view = PhotonView { texels, ..*view };
                let label = pass.label(age, number);
                totals.rays += u64::from(texels.size_tx.x as u32) * u64::from(texels.size_tx.y as u32);
                photons.push(match (settings.intersection, &receivers) {
                    (Intersection::Image, Some(receivers)) => {
                        pass.photons(builder, &label, &view, &emitters.surfaces, receivers, &mut tallies)
                    }
                    _ => pass.exact_photons(builder, &label, &texels, emitters.rays.as_ref().unwrap_or(&shared.surfaces), &mut totals),
                });
            }
        }
        totals.fitted += u64::from(settings.views == Views::Scene && !own.whole);
        totals.parallel += u64::from(own.map.view.position_ws.w != own.photons[0].texels.view.position_ws.w);
        let texture = pass.splats(builder, &photons, &map);
        pass.gather(builder, &map, texture, &targets);
        Ok(())
    })?;
    let mut frame = builder.finish(targets.contributions());
    frame.tallies.extend(tallies);
    let counters = totals.counters(&shared.receivers);
    Ok(TechniqueFrame { counters, audit: totals.exact.map(|exact| exact.audit).unwrap_or_default(), ..frame })
}

fn emitters<'a>(builder: &mut FrameBuilder<'_>, shared: &Shared, moment: &'a Moment, settings: &Splatting) -> Emitters<'a> {
    let wet = moment.field.as_ref().filter(|_| settings.intersection == Intersection::Exact).zip(builder.scene.water.as_ref());
    let rays = wet.map(|(field, water)| {
        let (mesh, body) = mesh_and_body(builder.scene, water, field);
        shared.surfaces.with_water(mesh, body)
    });
    Emitters { moment, surfaces: surfaces(builder, shared, moment.field.as_ref()), rays }
}

/// Clears the sums of the first light if it has no caustics.
fn nothing(builder: &mut FrameBuilder<'_>, light: &FrameLight, targets: &CausticTargets) {
    if light.is_first() {
        builder.frame.passes.push(Pass {
            label: format!("gather {}", light.number),
            color: vec![clear(targets.irradiance)],
            ..Pass::default()
        });
    }
}

/// The water's surface as a mesh, and as the boundary of a body.
pub(super) fn mesh_and_body(scene: &Scene, water: &Water, field: &HeightField) -> (Mesh, Material) {
    let mesh =
        Mesh { positions: field.positions_ws(), normals: field.normals_ws.clone(), indices: field.triangle_indices(), ..Mesh::default() };
    (mesh, Material::Dielectric { ior: water.ior, abbe: None, absorption: scene.medium.sigma_t() })
}
