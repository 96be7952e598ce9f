//! The water surface as light meets it: a height above the mean level over a rectangle, sixteen rays at a time.
//!
//! Three kinds: the model's own formula; for simulated water, which has none, biquadratic patches through samples of the model; and a mesh of
//! triangles with smooth normals, which is what techniques draw. All answer two questions, how high and how steep the surface is at
//! (x, z), and which way it faces there; [`hit`] finds where rays meet it from those alone.
//!
//! Water has a surface and no sides: light that leaves the rectangle under water stays in the water, and light that comes in
//! below the surface from beside it stays dry.

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
    /// Corner with the largest.
    pub max: Vec2,
    /// Bound on the magnitude of the height above the mean level, m.
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

/// What [`hit`] asks of a surface.
pub(super) trait Heights {
    /// Height above the mean level and slope along x and z at points of the rectangle; the surface is continuous.
    fn rise_and_slope<L: Lanes>(&self, x: L, z: L) -> (L, L, L);
    /// Unit normal that light is refracted at; y is positive.
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

/// Work over a surface whose kind is known only at run time: a generic function as a value.
pub(super) trait OverHeights {
    /// What comes of it.
    type Output;
    /// Does it.
    fn run<H: Heights>(self, heights: &H) -> Self::Output;
}

impl WaterSurface {
    /// The surface of the scene's water at its time: exact, or the mesh that the scene's trace settings ask for; `None` for a dry scene.
    pub fn new(scene: &Scene) -> Option<Self> {
        let water = scene.water.as_ref()?;
        // Heights near 0 keep their digits, whatever the level is.
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
        // A little more than the bounds, for rounding.
        let rise = (rise * 1.000_01 + 1.0e-6 * reach) as f32;
        Some(Self { level: water.level_m, min, max, rise, slope: (slope * 1.000_01) as f32, shape })
    }

    /// World y of the surface at world (x, z) and its unit normal, whether or not the point is in the rectangle.
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

    /// Runs generic work with the surface's own kind.
    #[inline]
    pub fn over<W: OverHeights>(&self, work: W) -> W::Output {
        match &self.shape {
            Shape::Formula(formula) => work.run(formula),
            Shape::Patches(patches) => work.run(patches),
            Shape::Mesh(mesh) => work.run(mesh),
        }
    }

    /// Where one ray meets the surface.
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

/// Samples along x and z that hold a simulated model exactly, or as finely as the limit of a grid allows: three for every two steps.
fn samples(water: &Water) -> (u32, u32) {
    match &water.model {
        // A biquadratic spline over its columns: one patch for each.
        WaterModel::PipeFluid(settings) => {
            let (columns, rows) = settings.cell_counts(water);
            (2 * columns + 1, 2 * rows + 1)
        }
        // A cubic convolution of a periodic grid, of any size against the water: as fine as can be.
        _ => (4095, 4095),
    }
}
