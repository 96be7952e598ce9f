//! The two views of a light: that of its photons, and that of the caustic map.

use std::borrow::Cow;

use glam::Vec3;
use rayon::prelude::*;

use nephroid_math::optics::refract;
use nephroid_math::vector::v3;
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::{HeightField, Water};
use nephroid_scene::{Aim, Light, Material};

use super::SplattingError;
use super::settings::Views;
use crate::beams::window;
use crate::builder::is_in_water;
use crate::passes::light_view::{FittedView, TexelView};
use crate::passes::shadow_map::refracted_at_flat_water;
use crate::receivers::Receivers;
use crate::surfaces::Surfaces;

/// Rays along a side of the view that are followed to find out what the light of mirrors and glass reaches.
const PILOTS: u32 = 64;

/// Share of the light that may land outside of the box on each of its sides; widening the box then catches most of it.
const TAIL: f64 = 1.0e-3;

/// Share of its size by which the box is widened on each side.
const WIDENING: f32 = 0.05;

/// The views of a light.
#[derive(Clone)]
pub struct LightViews {
    /// Mirrors, glass or water from the light, a photon for each texel: one view, or several around a lamp that one view does not hold.
    pub photons: Vec<PhotonView>,
    /// Receivers from the light.
    pub map: TexelView,
    /// What the map holds, m.
    pub reached: Aabb,
    /// Whether both views hold the whole scene.
    pub whole: bool,
}

/// A view of photons.
#[derive(Clone, Copy)]
pub struct PhotonView {
    /// The view.
    pub texels: TexelView,
    /// Component along its axis of the deepest point of mirrors, glass or water, m.
    pub deepest: f32,
}

/// What lights shine on.
pub struct Stage<'a> {
    /// All objects.
    pub receivers: &'a Receivers,
    /// All objects, to be hit by rays.
    pub surfaces: &'a Surfaces,
    /// The water and its surface.
    pub water: Option<Wet<'a>>,
}

/// The water, as a light meets it.
pub struct Wet<'a> {
    /// The water.
    pub water: &'a Water,
    /// Its surface, or the part of it through which the light passes.
    pub field: Cow<'a, HeightField>,
    /// Whether the light is in it.
    pub in_water: bool,
}

impl<'a> Wet<'a> {
    /// Water with a surface, as a light meets it.
    pub fn new(water: &'a Water, field: &'a HeightField, light: &Light) -> Self {
        let in_water = is_in_water(light, Some(field));
        let part = if in_water { window(field, light, water.ior) } else { None };
        Self { water, field: part.map_or(Cow::Borrowed(field), Cow::Owned), in_water }
    }

    /// The refracted ray of light that meets the surface at a point with this normal, and the share of a surface across it that the surface shows; `None`
    /// if no light passes.
    fn refracted(&self, direction: Vec3, normal: Vec3) -> Option<(Vec3, f32)> {
        let (normal, eta) = if self.in_water { (-normal, self.water.ior) } else { (normal, 1.0 / self.water.ior) };
        let (ray, passes) = refract(v3(direction.x, direction.y, direction.z), v3(normal.x, normal.y, normal.z), eta);
        let across = -direction.dot(normal);
        (passes && across > 0.0).then_some((Vec3::new(ray.x, ray.y, ray.z), across))
    }

    /// Vertices of the surface that send light on. Seen from above these are taken to be all.
    fn emitters(&self, light: &Light) -> Vec<Vec3> {
        let positions = self.field.positions_ws();
        if !self.in_water {
            return positions;
        }
        let passes = |(p, n): &(Vec3, &Vec3)| self.refracted(light.incident(*p).direction_ws, **n).is_some();
        positions.into_iter().zip(&self.field.normals_ws).filter(passes).map(|(p, _)| p).collect()
    }

    /// A light whose rays behind the surface are about those of `light` behind a flat one: parallel light refracted, a lamp at its apparent height.
    fn apparent(&self, light: &Light) -> Light {
        match *light {
            Light::Directional { irradiance, .. } => {
                let along = refracted_at_flat_water(light.incident(Vec3::ZERO).direction_ws, self.water.ior);
                Light::Directional { aim: Aim::Along(along), irradiance }
            }
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                let stretch = if self.in_water { 1.0 / self.water.ior } else { self.water.ior };
                let raised = self.water.level_m + (position.y - self.water.level_m) * stretch;
                Light::Point { position: Vec3::new(position.x, raised, position.z), intensity }
            }
        }
    }
}

/// Sizes and choices from the settings.
pub struct Wanted {
    /// What the views hold.
    pub views: Views,
    /// Photons along a side.
    pub photons: u32,
    /// Texels of the map along a side.
    pub map_size: u32,
    /// Whether all paths are followed, or those alone that image space can follow.
    pub all_paths: bool,
}

impl LightViews {
    /// Views of the light with this number; `None` if it reaches no receiver by way of mirrors, glass or water.
    ///
    /// # Errors
    /// If the light is so near to what it should see that no view holds it.
    pub fn new(stage: &Stage<'_>, number: usize, light: &Light, wanted: &Wanted) -> Result<Option<Self>, SplattingError> {
        let all = stage.water.as_ref().map_or(stage.receivers.bounds, |wet| stage.receivers.bounds.union(bounds_of(&wet.field)));
        let emitters = stage.water.as_ref().map_or_else(|| specular_points(stage.receivers), |wet| wet.emitters(light));
        if emitters.is_empty() {
            return Ok(None);
        }
        // A lamp among the objects of a scene does not see all of it from one side.
        let whole = if wanted.views == Views::Scene { FittedView::of_points(light, &all.corners(), all) } else { None };
        let own =
            whole.or_else(|| FittedView::of_points(light, &emitters, all)).map_or_else(|| sides(light, &emitters, stage), |one| vec![one]);
        let Some(first) = own.first() else {
            return Err(SplattingError::NoView { light: number, of: "mirrors, glass or water" });
        };
        let landings = match (whole, &stage.water) {
            (Some(_), _) => Vec::new(),
            (None, Some(wet)) => water_pilots(stage.surfaces, light, wet),
            (None, None) => own.iter().flat_map(|view| pilots(stage.surfaces, view, wanted.all_paths)).collect(),
        };
        let reached = match whole {
            Some(_) => stage.receivers.bounds.expanded(stage.receivers.bounds.size().max_element() * 1.0e-3),
            None => box_of(&landings),
        };
        if reached.is_empty() {
            return Ok(None);
        }
        let map_light = stage.water.as_ref().map_or(*light, |wet| wet.apparent(light));
        // Light that lands all around a lamp is held by a map of parallel rays.
        let towards = Light::Directional { aim: Aim::Along(reached.center() - first.view.position_ws.truncate()), irradiance: Vec3::ONE };
        let map = FittedView::new(&map_light, reached)
            .or_else(|| FittedView::of_points(&map_light, &around(&landings, reached), Aabb::EMPTY))
            .or_else(|| FittedView::of_points(&map_light, &before(&map_light, &landings, reached), Aabb::EMPTY))
            .or_else(|| FittedView::new(&towards, reached));
        let map = map.ok_or(SplattingError::NoView { light: number, of: "what its caustics reach" })?;
        let texels = |view: &FittedView, side| TexelView::new(view, view.square_texels(side));
        let side = if own.len() == 1 { wanted.photons } else { (wanted.photons / 2).max(1) };
        let photon_view = |view: &FittedView| PhotonView {
            texels: texels(view, side),
            deepest: emitters.iter().fold(f32::NEG_INFINITY, |deepest, &p| deepest.max(p.dot(view.axis_ws))),
        };
        let photons = own.iter().map(photon_view).collect();
        Ok(Some(Self { photons, map: texels(&map, wanted.map_size), reached, whole: whole.is_some() }))
    }
}

/// Views around a lamp at the water's surface, which no single view holds; none for other lights.
fn sides(light: &Light, emitters: &[Vec3], stage: &Stage<'_>) -> Vec<FittedView> {
    match (*light, &stage.water) {
        (Light::Point { position, .. } | Light::Spot { position, .. }, Some(wet)) => {
            FittedView::sides_around(position, emitters, if wet.in_water { Vec3::Y } else { Vec3::NEG_Y })
        }
        _ => Vec::new(),
    }
}

/// Least cosine between the mean direction of a lamp's light and what a map of it holds, if a single view does not hold all.
const WIDEST_COS: f32 = 0.25;

/// Where most of the light of a lamp lands: around the mean of its directions. What lands elsewhere is lost, and counted as not found.
fn before(lamp: &Light, landings: &[Pilot], reached: Aabb) -> Vec<Vec3> {
    let (Light::Point { position, .. } | Light::Spot { position, .. }) = *lamp else { return Vec::new() };
    let direction = |p: Vec3| (p - position).normalize_or_zero();
    let mean = landings.iter().map(|(p, light)| direction(*p) * *light as f32).sum::<Vec3>().normalize_or_zero();
    around(landings, reached).into_iter().filter(|&p| direction(p).dot(mean) > WIDEST_COS).collect()
}

/// Where light lands inside of a box, and a little around.
fn around(landings: &[Pilot], reached: Aabb) -> Vec<Vec3> {
    let margin = reached.size().max_element() * (0.5 * WIDENING);
    let beside = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|side| side * margin);
    landings.iter().filter(|(p, _)| reached.contains(*p)).flat_map(|(p, _)| beside.map(|side| *p + side)).collect()
}

/// Light that lands at a place, W.
type Pilot = (Vec3, f64);

/// Where light lands that the view's rays bring to mirrors and glass.
fn pilots(surfaces: &Surfaces, view: &FittedView, all_paths: bool) -> Vec<Pilot> {
    let world_from_clip = view.view.clip_from_world.inverse();
    let texels = TexelView::new(view, (PILOTS, PILOTS));
    let row = |y: u32| {
        (0..PILOTS).flat_map(move |x| {
            let at = |depth| {
                let ndc = |i: u32| (i as f32 + 0.5) * (2.0 / PILOTS as f32) - 1.0;
                world_from_clip.project_point3(Vec3::new(ndc(x), ndc(y), depth))
            };
            let (start, end) = (at(0.0), at(1.0));
            let across = f64::from(texels.area_at(v3(end.x, end.y, end.z)) / (end - start).length_squared());
            let arrivals =
                surfaces.arrivals(start, (end - start).normalize_or_zero(), |_| start).map_or_else(Vec::new, |followed| followed.arrivals);
            let counted = arrivals.into_iter().filter(move |arrival| all_paths || arrival.plain);
            counted.map(move |arrival| (arrival.position, across * f64::from(arrival.share.element_sum())))
        })
    };
    (0..PILOTS).into_par_iter().map(|y| row(y).collect::<Vec<_>>()).collect::<Vec<_>>().concat()
}

/// Where light lands that passes the water's surface, at places that do not depend on its mesh: one of two rows would have none between its edges.
fn water_pilots(surfaces: &Surfaces, light: &Light, wet: &Wet<'_>) -> Vec<Pilot> {
    let field = &*wet.field;
    let place = |i: u32, vertices: u32| (i as f32 + 0.5) / PILOTS as f32 * (vertices - 1) as f32;
    let row = |y: u32| {
        (0..PILOTS).filter_map(move |x| {
            let (p, n) = interpolated(field, place(x, field.columns), place(y, field.rows));
            let incident = light.incident(p);
            let (ray, across) = wet.refracted(incident.direction_ws, n)?;
            Some((surfaces.receiver(p, ray)?, f64::from(across) * f64::from(incident.irradiance.element_sum())))
        })
    };
    (0..PILOTS).into_par_iter().map(|y| row(y).collect::<Vec<_>>()).collect::<Vec<_>>().concat()
}

/// Position and unit normal at a column and row of vertices, or between them.
fn interpolated(field: &HeightField, column: f32, row: f32) -> (Vec3, Vec3) {
    let (left, above) = ((column as u32).min(field.columns - 2), (row as u32).min(field.rows - 2));
    let (right, down) = (column - left as f32, row - above as f32);
    let (mut p, mut n) = (Vec3::ZERO, Vec3::ZERO);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = (if dx == 1 { right } else { 1.0 - right }) * (if dy == 1 { down } else { 1.0 - down });
        p += field.position_ws(left + dx, above + dy) * share;
        n += field.normals_ws[field.index(left + dx, above + dy)] * share;
    }
    (p, n.normalize())
}

/// The box around all pilots but the last [`TAIL`] of the light on each side, widened.
fn box_of(pilots: &[Pilot]) -> Aabb {
    let total: f64 = pilots.iter().map(|(_, light)| light).sum();
    if total.is_nan() || total <= 0.0 {
        return Aabb::EMPTY;
    }
    let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
    for axis in 0..3 {
        let mut along: Vec<(f32, f64)> = pilots.iter().map(|(p, light)| (p[axis], *light)).collect();
        along.sort_by(|a, b| a.0.total_cmp(&b.0));
        min[axis] = beyond_tail(along.iter(), total);
        max[axis] = beyond_tail(along.iter().rev(), total);
    }
    let held = Aabb::from_corners(min, max);
    held.expanded((held.size().max_element() * WIDENING).max(1.0e-6 * max.abs().max(min.abs()).max_element()).max(f32::MIN_POSITIVE))
}

/// The first place behind which more than [`TAIL`] of the light lies.
fn beyond_tail<'a>(along: impl Iterator<Item = &'a (f32, f64)>, total: f64) -> f32 {
    let mut sum = 0.0;
    let mut place = 0.0;
    for (at, light) in along {
        place = *at;
        sum += light;
        if sum > TAIL * total {
            break;
        }
    }
    place
}

/// Vertices of mirrors and glass.
fn specular_points(receivers: &Receivers) -> Vec<Vec3> {
    let specular = receivers.groups.iter().filter(|group| !matches!(group.material, Material::Diffuse { .. }));
    specular.flat_map(|group| receivers.positions_of(group)).collect()
}

fn bounds_of(field: &HeightField) -> Aabb {
    Aabb::from_points(field.positions_ws())
}
