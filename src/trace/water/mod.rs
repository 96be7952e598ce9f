//! The water surface for light: height above the mean level over a rectangle, for sixteen rays at a time.
//!
//! There are three kinds: the model's own formula; for simulated water, which has no formula, biquadratic patches through samples of the model; and a
//! triangle mesh with smooth normals, which is what techniques draw. Each kind gives height, slope and normal at (x, z); [`hit`] intersects rays with
//! the surface from these alone.
//!
//! Water has a surface and no sides: light that leaves the rectangle under water stays in water, and light that enters from the side below the
//! surface stays in air.

mod hit;
mod mesh;
mod patches;

pub(super) use hit::{Crossing, Rays, crossings};

use glam::{Vec2, Vec3};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3};
use nephroid_scene::Scene;
use nephroid_scene::water::{Formula, Water, WaterModel};

use mesh::MeshSurface;
use patches::Patches;

/// A water surface.
pub(super) struct WaterSurface {
    /// World y of the mean level, m.
    pub level: f32,
    /// Corner of the rectangle with the smallest x and z, m.
    pub min: Vec2,
    /// Corner of the rectangle with the largest x and z, m.
    pub max: Vec2,
    /// The longer side of the rectangle, m.
    pub size: f32,
    /// Bound on the magnitude of height above the mean level, m.
    pub rise: f32,
    /// Bound on the magnitude of the slope.
    pub slope: f32,
    shape: Shape,
}

enum Shape {
    Formula(Formula),
    Patches(Patches),
    Mesh(MeshSurface),
}

/// Evaluation of a surface, for [`hit`].
pub(super) trait Heights {
    /// Height above the mean level and slopes along x and z, at points of the rectangle. The surface is continuous.
    fn rise_and_slope<L: Lanes>(&self, x: L, z: L) -> (L, L, L);
    /// Unit normal at which light is refracted; y is positive.
    fn normal<L: Lanes>(&self, x: L, z: L) -> V3<L>;
}

impl Heights for Formula {
    #[inline(always)]
    fn rise_and_slope<L: Lanes>(&self, x: L, z: L) -> (L, L, L) {
        self.rise_and_slope(x, z)
    }

    #[inline(always)]
    fn normal<L: Lanes>(&self, x: L, z: L) -> V3<L> {
        let (_, slope_x, slope_z) = self.rise_and_slope(x, z);
        normal_of_slope(slope_x, slope_z)
    }
}

/// `(−∂h/∂x, 1, −∂h/∂z)/|…|`.
#[inline(always)]
fn normal_of_slope<L: Lanes>(slope_x: L, slope_z: L) -> V3<L> {
    let inverse = slope_x.like(1.0) / (slope_x * slope_x + slope_z * slope_z + 1.0).sqrt();
    v3(-(slope_x * inverse), inverse, -(slope_z * inverse))
}

/// Work on a surface whose kind is known only at run time: a generic function as a value.
pub(super) trait OverHeights {
    /// Result of the work.
    type Output;
    /// Does the work on a surface.
    fn run<H: Heights>(self, heights: &H) -> Self::Output;
}

impl WaterSurface {
    /// The surface of the scene's water at the scene's time: exact, or the mesh that the scene's trace settings select; `None` without water.
    pub fn new(scene: &Scene) -> Option<Self> {
        let water = scene.water.as_ref()?;
        // Heights near 0 keep their digits, whatever the water level is.
        let leveled = Water { level_m: 0.0, ..water.clone() };
        let (min, max) = (water.min_ws(), water.max_ws());
        let reach = f64::from((max - min).length()) * 0.5;
        let (shape, rise, slope) = match (scene.trace.grid, leveled.formula(scene.time_s)) {
            (Some((columns, rows)), _) => {
                let mesh = MeshSurface::new(&leveled.surface_with_grid(columns, rows, scene.time_s));
                let (rise, slope) = mesh.bounds();
                (Shape::Mesh(mesh), rise, slope)
            }
            (None, Some(formula)) => {
                let (rise, slope) = formula.bounds(reach);
                (Shape::Formula(formula), rise, slope)
            }
            (None, None) => {
                let (columns, rows) = samples(&leveled);
                let patches = Patches::new(&leveled.surface_with_grid(columns, rows, scene.time_s));
                let (rise, slope) = patches.bounds();
                (Shape::Patches(patches), rise, slope)
            }
        };
        // Bounds with a margin for rounding.
        let rise = (rise * 1.000_01 + 1.0e-6 * reach) as f32;
        Some(Self { level: water.level_m, min, max, size: (max - min).max_element(), rise, slope: (slope * 1.000_01) as f32, shape })
    }

    /// World y of the surface at world (x, z), and its unit normal. The point may lie outside of the rectangle.
    pub fn at(&self, x: f32, z: f32) -> (f32, Vec3) {
        struct At(f32, f32);
        impl OverHeights for At {
            type Output = (f32, V3<f32>);
            fn run<H: Heights>(self, heights: &H) -> Self::Output {
                (heights.rise_and_slope(self.0, self.1).0, heights.normal(self.0, self.1))
            }
        }
        let (rise, n) = self.over(At(x, z));
        (self.level + rise, Vec3::new(n.x, n.y, n.z))
    }

    /// Runs generic work on the surface's own kind.
    #[inline]
    pub fn over<W: OverHeights>(&self, work: W) -> W::Output {
        match &self.shape {
            Shape::Formula(formula) => work.run(formula),
            Shape::Patches(patches) => work.run(patches),
            Shape::Mesh(mesh) => work.run(mesh),
        }
    }

    /// Intersects one ray with the surface.
    pub fn cross(&self, rays: Rays<f32>) -> Crossing<f32> {
        struct Cross<'a>(&'a WaterSurface, Rays<f32>);
        impl OverHeights for Cross<'_> {
            type Output = Crossing<f32>;
            fn run<H: Heights>(self, heights: &H) -> Self::Output {
                crossings(self.0, heights, self.1)
            }
        }
        self.over(Cross(self, rays))
    }

    /// Whether a point is in the body of water: over the rectangle and below the surface.
    pub fn holds(&self, p: Vec3) -> bool {
        let over = (self.min.x..=self.max.x).contains(&p.x) && (self.min.y..=self.max.y).contains(&p.z);
        over && p.y < self.level + self.rise && p.y < self.at(p.x, p.z).0
    }
}

/// Number of samples along x and z that represent a simulated model exactly, or as finely as a grid can: three for every two steps.
fn samples(water: &Water) -> (u32, u32) {
    match &water.model {
        // The model is a biquadratic spline over its columns: one patch per column.
        WaterModel::PipeFluid(settings) => {
            let (columns, rows) = settings.cell_counts(water);
            (2 * columns + 1, 2 * rows + 1)
        }
        // The model is a cubic convolution of a periodic grid of any size relative to the water: use the finest grid.
        _ => (4095, 4095),
    }
}
