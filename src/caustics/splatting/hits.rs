//! Where photons of image space should land, by the triangles of the scene: the price of pictures, hit by hit.

use glam::Vec3;

use nephroid_scene::Scene;

use super::SplattingError;
use super::exact::{self, MOST_PHOTONS, Source};
use super::frame::{Shared, mesh_and_body};
use super::settings::Splatting;
use super::views::{LightViews, Stage, Wanted, Wet};
use crate::RenderError;
use crate::passes::light_view::TexelView;

/// The end of a photon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where it lands, m.
    pub position: Vec3,
    /// What it carries if surfaces take nothing but a mirror's share, W, linear RGB.
    pub flux: Vec3,
    /// Width of its texel of the light's view at the first surface, m.
    pub width_m: f32,
}

/// The photons of a light.
#[derive(Clone, Debug)]
pub struct Hits {
    /// Columns and rows of its view.
    pub size: (u32, u32),
    /// Its view.
    pub photons: TexelView,
    /// The view of its map.
    pub map: TexelView,
    /// Row by row: the end of the path that image space follows, one reflection, or one refraction into and one out of a body. `None` where the light
    /// meets no mirror, glass or water, or where this path ends otherwise.
    pub texels: Vec<Option<Hit>>,
}

/// The photons of each light of a scene, with its settings of this technique; `None` for a light without caustics.
///
/// # Errors
/// If a mesh cannot be loaded, a light has no view of what it should see, or there are more photons than exact ones may be.
pub fn exact_hits(scene: &Scene) -> Result<Vec<Option<Hits>>, RenderError> {
    let settings = scene.techniques.get::<Splatting>();
    if settings.photons > MOST_PHOTONS {
        return Err(SplattingError::TooManyExact { seen: settings.photons, most: MOST_PHOTONS }.into());
    }
    let shared = Shared::new(scene, settings)?;
    let grid = |water: &nephroid_scene::water::Water| settings.grid.unwrap_or(water.grid);
    let field = scene.water.as_ref().map(|water| water.simulator().surface_with_grid(grid(water).0, grid(water).1, scene.time_s));
    let water = scene.water.as_ref().zip(field.as_ref());
    let wet = water.map(|(water, field)| {
        let (mesh, body) = mesh_and_body(scene, water, field);
        shared.surfaces.with_water(mesh, body)
    });
    let surfaces = wet.as_ref().unwrap_or(&shared.surfaces);
    let wanted = Wanted { views: settings.views, photons: settings.photons, map_size: settings.map_size, all_paths: false };
    let mut lights = Vec::new();
    for (number, light) in scene.lights.iter().enumerate() {
        let water = water.map(|(water, field)| Wet::new(water, field, light));
        let stage = Stage { receivers: &shared.receivers, surfaces: &shared.surfaces, water };
        let views = LightViews::new(&stage, number, light, &wanted)?;
        let Some(views) = views else {
            lights.push(None);
            continue;
        };
        let [view] = views.photons[..] else {
            return Err(SplattingError::NoView { light: number, of: "water" }.into());
        };
        lights.push(Some(Hits {
            photons: view.texels,
            map: views.map,
            size: (view.texels.size_tx.x as u32, view.texels.size_tx.y as u32),
            texels: exact::plain_hits(surfaces, &Source { light, uniform: None }, &view.texels),
        }));
    }
    Ok(lights)
}
