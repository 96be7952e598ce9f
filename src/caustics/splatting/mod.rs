//! `splatting`: C. Wyman, C. Dachsbacher, *Improving Image-Space Caustics via Variable-Sized Splatting*, University of Iowa UICS-06-02, 2006 (WD06).
//!
//! Light is a view: for each of its texels a photon is reflected by mirrors or refracted by glass or water, and lands on a receiver that the light sees
//! as well. Photons are drawn as splats into a map that the light projects onto the scene. The size of a splat decides between noise and blur.
//!
//! | File | What |
//! |---|---|
//! | `frame` | the frame: the order of all steps below, for the moments whose photons are in the map |
//! | `light_pass` | the passes of one light |
//! | `drawn`, `totals` | surfaces ready to be drawn; counters and audit |
//! | `views` | the light's view of mirrors, glass or water, and that of the map |
//! | `photons` | from the first surface to the receiver |
//! | `receiver_search` | where a ray ends among the receivers |
//! | `lens` | how wide a beam is after a lens |
//! | `ray_differential` | how a ray is bent by both curvatures of each face |
//! | `hits` | where photons of pictures should land |
//! | `exact` | photons that are followed through the triangles of the scene |
//! | `splats` | photons as vertices; round splats of one size, or by the lens |
//! | `sizes` | splats of four sizes, and the choice among them |
//! | `pyramid` | one texel in each level of a pyramid, for comparison |
//! | `differential` | splats as the map of the light bends them |
//! | `gather` | from the map to pixels |
//!
//! Decisions where the paper leaves a choice, in full in `docs/techniques/splatting.md`:
//! - E1 a lens has its power in the medium around it;
//! - E2 diameters by vergence, which is finite in focus; at least three texels;
//! - E3 curvature at the vertices of the mesh, or from normals;
//! - E4 a splat keeps its photon's energy;
//! - E5 shares are divided by their sampled sum; `paper` divides by the integral;
//! - E6 splats of four sizes keep colours in more targets;
//! - E7 the cosine at a receiver is that of the map's ray;
//! - E8 Fresnel's equations at each surface; `paper` has none.

pub mod differential;
mod drawn;
mod error;
pub mod exact;
pub mod frame;
pub mod gather;
pub mod hits;
pub mod lens;
mod light_pass;
pub mod photons;
pub mod pyramid;
pub mod ray_differential;
pub mod receiver_search;
mod settings;
pub mod sizes;
pub mod splats;
mod totals;
mod views;

pub use error::SplattingError;
pub use settings::{Blend, CurvatureFrom, Gather, Intersection, Lens, Search, Splats, Splatting, Views};

use nephroid_image::metrics::bounds::{ANOTHER_SURFACE, Bound, LOOKED_UP, PassBounds, SEARCHED, SHADED, VERTEX};
use nephroid_pipeline::Device;
use nephroid_scene::water::{HeightField, WaterSim};
use nephroid_scene::{Group, Part, Scene, Settings};

use super::passes::shape_operator::ShapeOperator;
use super::passes::water_surface::WaterVertex;
use super::surfaces;
use super::{Builder, Feature, Layout, RenderError, Technique, TechniqueFrame, Variant};
use crate::layout;
use exact::PhotonRecord;
use frame::{Moment, Shared};
use photons::PhotonsUniform;
use splats::SplatsUniform;

/// Vertices that hold differences of nearly equal numbers: a part of a Jacobian that cancels to zero has no exact places, and its error is relative to
/// those of other photons. Where light passes undeviated, whole parts are nothing but rounding errors. What is drawn with them has bounds of its own.
const DIFFERENCED: Bound = Bound::new("differenced-vertex", 1.0e-2, [200_000.0, 200_000.0], 0.5, 0.0);

/// Sums of splats with equal vertices: at the edge of a splat, where its weight falls to nothing, the last place of a coordinate decides what is added.
const SPLATTED: Bound = Bound::new("splatted", 1.0e-5, [1000.0, 5.0], 1.0e-2, 1.0e-6);

/// Splats whose vertices are the driver's own: one that ends elsewhere takes pixels along its edge with it.
const OWN_SPLATS: Bound = Bound::new("own-splats", 5.0e-4, [1000.0, 50.0], ANOTHER_SURFACE, 1.0e-4);

/// Differentials of rays: next to total reflection they grow beyond all bounds, and the last places of a direction with them.
const RAY_DIFFERENTIAL: Bound = Bound::new("ray-differential", 1.0e-3, [5_000.0, 2_000.0], ANOTHER_SURFACE, 5.0e-2);

/// The technique, as a row of the table.
pub const TECHNIQUE: &dyn Technique = &SplattingTechnique;

struct SplattingTechnique;

impl Technique for SplattingTechnique {
    fn name(&self) -> &'static str {
        "splatting"
    }
    fn summary(&self) -> &'static str {
        "photons of a light's view, drawn as splats of their own size into a map that the light projects"
    }
    fn paper(&self) -> &'static str {
        "Wyman & Dachsbacher 2006, Improving Image-Space Caustics via Variable-Sized Splatting"
    }
    fn settings(&self) -> &'static dyn Settings {
        Splatting::DEFAULTS
    }
    fn covers(&self, feature: Feature) -> bool {
        matches!(feature, Feature::WaterCaustics | Feature::SpecularCaustics)
    }
    fn bounds(&self) -> &'static [PassBounds] {
        &[
            PassBounds {
                pass: "photons",
                vertices: VERTEX,
                textures: &[
                    ("photon_step_x", RAY_DIFFERENTIAL, RAY_DIFFERENTIAL),
                    ("photon_step_y", RAY_DIFFERENTIAL, RAY_DIFFERENTIAL),
                    ("", SEARCHED, SEARCHED),
                ],
            },
            PassBounds { pass: "splats", vertices: DIFFERENCED, textures: &[("", SPLATTED, OWN_SPLATS)] },
            PassBounds { pass: "resolve", vertices: VERTEX, textures: &[("", SHADED, SHADED)] },
            PassBounds { pass: "gather", vertices: VERTEX, textures: &[("", LOOKED_UP, LOOKED_UP)] },
        ]
    }
    fn layouts(&self) -> Vec<Layout> {
        vec![
            layout!(PhotonsUniform: box_min, box_max, sigma_t),
            layout!(SplatsUniform: shape),
            layout!(PhotonRecord: position_ws, direction_ws, flux, x_ws, y_ws),
        ]
    }
    fn variants(&self) -> Vec<Variant> {
        let sizes = Splatting { splats: Splats::Sizes, ..Splatting::default() };
        let curvatures = Splatting { splats: Splats::Lens, curvature: CurvatureFrom::Both, ..Splatting::default() };
        let met = |intersection| Splatting { intersection, ..Splatting::default() };
        vec![
            Variant { name: "", settings: None },
            Variant { name: "paper", settings: Some(self.settings().paper()) },
            Variant { name: "sizes", settings: Some(sizes.boxed()) },
            Variant { name: "curvatures", settings: Some(curvatures.boxed()) },
            Variant { name: "exact", settings: Some(met(Intersection::Exact).boxed()) },
            Variant { name: "image", settings: Some(met(Intersection::Image).boxed()) },
        ]
    }
    fn grid(&self, scene: &Scene) -> Option<(u32, u32)> {
        let grid = scene.techniques.get::<Splatting>().grid;
        scene.water.as_ref().map(|water| grid.unwrap_or(water.grid))
    }
    fn memory(&self, scene: &Scene) -> Vec<Part> {
        let settings = scene.techniques.get::<Splatting>().decided(scene);
        let (columns, rows) = self.grid(scene).unwrap_or_default();
        let moments = u64::from(settings.frames);
        // A vertex of the emitting surface with its shape operator and two triangles, and the surface itself.
        let vertex = (size_of::<WaterVertex>() + 2 * size_of::<ShapeOperator>() + 2 * 24 + 16) as u64;
        let surface = moments * u64::from(columns) * u64::from(rows) * vertex;
        let triangles: u64 = (0..scene.objects.len()).map(|object| scene.triangle_estimate(object)).sum();
        let mut parts = vec![Part {
            what: "the tree of triangles",
            bytes: triangles * surfaces::TRIANGLE_BYTES,
            lower: "the detail of the objects".to_owned(),
        }];
        parts.push(Part {
            what: "the emitting surface",
            bytes: surface,
            lower: "water.grid, splatting.grid or splatting.frames".to_owned(),
        });
        if settings.intersection == Intersection::Exact {
            let rays = u64::from(settings.photons) * u64::from(settings.photons) * moments * scene.lights.len() as u64;
            let bytes = rays * exact::RAY_BYTES;
            parts.push(Part { what: "photons", bytes, lower: "splatting.photons or splatting.frames".to_owned() });
        }
        parts
    }
    fn sketch(&self, scene: &mut Scene) {
        let settings = scene.techniques.edit::<Splatting>();
        (settings.grid, settings.intersection) = (Some((2, 2)), Intersection::Image);
    }
    fn prepare(&self, scene: &Scene) -> Result<Box<dyn Builder>, RenderError> {
        let settings = scene.techniques.get::<Splatting>().decided(scene);
        let water = scene.water.as_ref().map(|water| water.simulator());
        Ok(Box::new(SplattingBuilder { shared: Shared::new(scene, &settings)?, water, fields: Vec::new() }))
    }
}

/// State kept between frames: the objects, the simulation of the water, and its surface at the moments of the last frame.
struct SplattingBuilder {
    shared: Shared,
    water: Option<WaterSim>,
    fields: Vec<(f32, (u32, u32), HeightField)>,
}

impl SplattingBuilder {
    /// The moments whose photons are in the map of a frame, in their order. There is none before the water was started.
    fn moments(&mut self, scene: &Scene, settings: &Splatting) -> Vec<Moment> {
        let now = (scene.time_s / settings.frame_s).round().max(0.0) as u64;
        let ages = (0..u64::from(settings.frames)).rev();
        let times = ages.map(|age| (now.wrapping_sub(age), scene.time_s - age as f32 * settings.frame_s));
        let times: Vec<(u64, f32)> = times.filter(|(_, time)| *time >= 0.0 || scene.water.is_none()).collect();
        let (Some(sim), Some(water)) = (&mut self.water, &scene.water) else {
            return times.into_iter().map(|(number, _)| Moment { number, field: None }).collect();
        };
        let grid = settings.grid.unwrap_or(water.grid);
        let known = std::mem::take(&mut self.fields);
        let mut moments = Vec::new();
        for (number, time) in times {
            let same = known.iter().find(|(at, of, _)| *at == time && *of == grid);
            let field = same.map_or_else(|| sim.surface_with_grid(grid.0, grid.1, time), |(_, _, field)| field.clone());
            moments.push((time, number, field));
        }
        if moments.len() > 1 {
            self.fields = moments.iter().map(|(time, _, field)| (*time, grid, field.clone())).collect();
        }
        moments.into_iter().map(|(_, number, field)| Moment { number, field: Some(field) }).collect()
    }
}

impl Builder for SplattingBuilder {
    fn frame(&mut self, scene: &Scene, _: &Device, _: &[&str]) -> Result<TechniqueFrame, RenderError> {
        let settings = scene.techniques.get::<Splatting>().decided(scene);
        let moments = self.moments(scene, &settings);
        frame::build(scene, &self.shared, &moments, &settings)
    }
}
