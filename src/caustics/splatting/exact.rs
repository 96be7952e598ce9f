//! Photons whose paths are followed through the triangles of the scene, past the paper: any number of reflections and refractions, total reflection,
//! both parts of light at glass, and receivers that the light does not see itself. One ray for each texel of the photons' view; each of its ends is a
//! photon, and neighbours by the same path say how the map of the light bends there.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use nephroid_math::vector::v3;
use nephroid_scene::Light;
use nephroid_scene::geom::Aabb;

use super::hits::Hit;
use crate::audit::{Audit, Entry};
use crate::passes::light_view::TexelView;
use crate::passes::shadow_map::LightUniform;
use crate::surfaces::{Arrival, Followed, Losses, Surfaces};

/// Most photons along a side of a square view: all their paths are kept at once.
pub const MOST_PHOTONS: u32 = 2048;

/// Bytes of a ray with its photons, of which there are one and a half on average: its ends, and records of them while they are put in order.
pub const RAY_BYTES: u64 = (size_of::<Ends>() + 3 * (size_of::<Arrival>() + 2 * size_of::<PhotonRecord>()) / 2) as u64;

/// A photon on a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PhotonRecord {
    /// Position, m. w: diameter of its beam there, m.
    pub position_ws: Vec4,
    /// Unit direction in which it arrives.
    pub direction_ws: Vec4,
    /// Flux, W, linear RGB.
    pub flux: Vec4,
    /// How far the light moves with one texel of the view along x, m; w is 1 if that is known, else 0.
    pub x_ws: Vec4,
    /// The same along y.
    pub y_ws: Vec4,
}

/// All photons of a light.
pub struct ExactPhotons {
    /// Those that have landed in the box, in the order of the view's texels.
    pub records: Vec<PhotonRecord>,
    /// Number of those that have landed outside of it.
    pub beyond: u64,
    /// Rays that have met a mirror, glass or water first.
    pub arrived: u64,
    /// Where their light has gone.
    pub audit: Audit,
}

/// The ends of the ray of a texel.
#[derive(Default)]
struct Ends {
    /// Irradiance across the light's ray times area of the texel: flux on arrival, W.
    flux: Vec3,
    /// Width of the texel at the first surface, m.
    width: f32,
    arrivals: Vec<Arrival>,
    /// Shares of the light that end elsewhere.
    losses: Losses,
}

/// A light whose rays are followed.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// The light.
    pub light: &'a Light,
    /// Where it is, and in what; `None` where losses do not matter.
    pub uniform: Option<&'a LightUniform>,
}

impl Source<'_> {
    /// Where light was emitted that meets its first surface at a point, after `start` on its ray. In air nothing is lost before the first surface.
    fn emitted(&self, start: Vec3, first: Vec3) -> Vec3 {
        match self.uniform.filter(|light| light.water.x < 0.0) {
            None => start,
            Some(LightUniform { position_ws: at, .. }) if at.w != 0.0 => at.truncate(),
            Some(LightUniform { position_ws: along, own, .. }) => first - along.truncate() * (first.dot(along.truncate()) - own.w).max(0.0),
        }
    }
}

/// Follows the light of each texel of a view to receivers in `reached`. `lossless`: only paths that image space can follow, without losses but those of
/// mirrors.
pub fn follow(surfaces: &Surfaces, source: &Source<'_>, view: &TexelView, reached: Aabb, lossless: bool) -> ExactPhotons {
    let ends = ends_of(surfaces, source, view, lossless);
    let records: Vec<Vec<PhotonRecord>> = (0..ends.len())
        .into_par_iter()
        .map(|y| {
            let at = |x: usize, y: usize, hash: u64| by_path(ends.get(y)?.get(x)?, hash);
            let of_texel = |x: usize| {
                let of = &ends[y][x];
                let make = move |arrival: &Arrival| {
                    let (p, hash) = (arrival.position, arrival.hash);
                    // Before the first texel there is none: the wrapped number is beyond the last.
                    let along_x = step(p, at(x.wrapping_sub(1), y, hash), at(x + 1, y, hash));
                    let along_y = step(p, at(x, y.wrapping_sub(1), hash), at(x, y + 1, hash));
                    record(of, arrival, along_x, along_y)
                };
                of.arrivals.iter().map(make).collect::<Vec<_>>()
            };
            (0..ends[y].len()).flat_map(of_texel).filter(|record| record.flux != Vec4::ZERO).collect()
        })
        .collect();
    let (records, beyond): (Vec<_>, Vec<_>) =
        records.into_iter().flatten().partition(|record: &PhotonRecord| reached.contains(record.position_ws.truncate()));
    let watts = |flux: Vec3| flux.as_dvec3().element_sum();
    let carried = |records: &[PhotonRecord]| records.iter().map(|record| watts(record.flux.truncate())).sum();
    let lit = || ends.iter().flatten().filter(|ends| ends.flux != Vec3::ZERO);
    let mut audit = Audit::default();
    audit.add(Entry::LightIn, lit().map(|ends| watts(ends.flux)).sum());
    audit.add(Entry::Landed, carried(&records));
    audit.add(Entry::BeyondTheMap, carried(&beyond));
    for ends in lit() {
        ends.losses.each().into_iter().for_each(|(entry, share)| audit.add(entry, watts(ends.flux * share)));
    }
    if lossless {
        audit.add(Entry::OtherPaths, lit().filter(|ends| ends.arrivals.is_empty()).map(|ends| watts(ends.flux)).sum());
    }
    ExactPhotons { beyond: beyond.len() as u64, arrived: lit().count() as u64, audit, records }
}

/// The ends of all rays of a view, row by row.
fn ends_of(surfaces: &Surfaces, source: &Source<'_>, view: &TexelView, lossless: bool) -> Vec<Vec<Ends>> {
    let (columns, rows) = (view.size_tx.x as u32, view.size_tx.y as u32);
    let world_from_clip = view.view.clip_from_world.inverse();
    let texel = |x: u32, y: u32| {
        let ndc =
            |depth| Vec3::new((x as f32 + 0.5) * (2.0 * view.size_tx.z) - 1.0, 1.0 - (y as f32 + 0.5) * (2.0 * view.size_tx.w), depth);
        let (start, end) = (world_from_clip.project_point3(ndc(0.0)), world_from_clip.project_point3(ndc(1.0)));
        let direction = (end - start).normalize_or_zero();
        let followed = surfaces.arrivals(start, direction, |first| source.emitted(start, first))?;
        let Followed { first, mut arrivals, mut losses } = followed;
        if lossless {
            arrivals.retain(|arrival| arrival.plain);
            arrivals.iter_mut().for_each(|arrival| arrival.share = arrival.tint);
            // One path at most is plain.
            let by_mirrors = arrivals.first().map_or(Vec3::ZERO, |arrival| Vec3::ONE - arrival.tint);
            losses = Losses { by_mirrors, ..Losses::default() };
        }
        let area = view.area_at(v3(first.x, first.y, first.z));
        Some(Ends { flux: source.light.incident(first).irradiance * area, width: area.sqrt(), arrivals, losses })
    };
    (0..rows).into_par_iter().map(|y| (0..columns).map(|x| texel(x, y).unwrap_or_default()).collect()).collect()
}

/// By texel, row by row: where the path ends that image space follows.
pub(super) fn plain_hits(surfaces: &Surfaces, source: &Source<'_>, view: &TexelView) -> Vec<Option<Hit>> {
    let hit = |ends: Ends| {
        let arrival = ends.arrivals.first()?;
        Some(Hit { position: arrival.position, flux: ends.flux * arrival.share, width_m: ends.width })
    };
    ends_of(surfaces, source, view, true).into_iter().flatten().map(hit).collect()
}

/// Where a path of a texel ends.
fn by_path(ends: &Ends, hash: u64) -> Option<Vec3> {
    ends.arrivals.iter().find(|arrival| arrival.hash == hash).map(|arrival| arrival.position)
}

/// How far light moves per texel, from its neighbours by the same path.
fn step(p: Vec3, before: Option<Vec3>, after: Option<Vec3>) -> Option<Vec3> {
    match (before, after) {
        (Some(before), Some(after)) => Some((after - before) * 0.5),
        (Some(before), None) => Some(p - before),
        (None, Some(after)) => Some(after - p),
        (None, None) => None,
    }
}

fn record(of: &Ends, arrival: &Arrival, x: Option<Vec3>, y: Option<Vec3>) -> PhotonRecord {
    let beam = x.zip(y).map_or(of.width, |(x, y)| x.cross(y).length().sqrt());
    let known = |step: Option<Vec3>| step.map_or(Vec4::ZERO, |step| step.extend(1.0));
    PhotonRecord {
        position_ws: arrival.position.extend(beam),
        direction_ws: arrival.direction.extend(0.0),
        flux: (of.flux * arrival.share).extend(0.0),
        x_ws: known(x),
        y_ws: known(y),
    }
}
