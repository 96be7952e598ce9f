//! Abstract sculptures, as smooth unions of simple distance fields.

use glam::{Vec2, Vec3};
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V3, v3};
use serde::{Deserialize, Serialize};

use super::{Check, ShapeError, field::Field, isosurface::isosurface, sphere::wrap_uvs};
use crate::geom::{Aabb, Mesh};

/// What a sculpture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum FigureKind {
    /// A head with a long face on a block, looking to `+z`.
    #[default]
    Bust,
    /// A reclining figure with openings, lying along x.
    Reclining,
}

/// An abstract sculpture standing on `y = 0`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Figure {
    /// What it shows. Default: Bust.
    pub kind: FigureKind,
    /// Height in metres, above 0. Default: 1.
    pub height_m: f32,
    /// Number of lattice cells along its longest side, 16 to 256; triangles grow with its square. Default: 96.
    pub resolution: u32,
}

impl Default for Figure {
    fn default() -> Self {
        Self { kind: FigureKind::Bust, height_m: 1.0, resolution: 96 }
    }
}

impl Figure {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Figure");
        check.length("height_m", self.height_m)?;
        check.count("resolution", self.resolution, 16..=256)?;
        // Both fields are one unit high, with a margin for the border of the lattice.
        let half = match self.kind {
            FigureKind::Bust => Vec2::new(0.36, 0.30),
            FigureKind::Reclining => Vec2::new(0.98, 0.42),
        };
        let cell = (2.0 * half.x).max(1.0) / self.resolution as f32;
        let margin = 2.0 * cell;
        let bounds = Aabb::from_corners(Vec3::new(-half.x, -margin, -half.y), Vec3::new(half.x, 1.0 + margin, half.y));
        let mut mesh = match self.kind {
            FigureKind::Bust => isosurface(bounds, cell, &Bust),
            FigureKind::Reclining => isosurface(bounds, cell, &Reclining),
        };
        // Stand it on the ground and bring it to its height exactly.
        let seen = mesh.bounds();
        let scale = self.height_m / seen.size().y;
        for p in &mut mesh.positions {
            *p = Vec3::new(p.x * scale, ((p.y - seen.min.y) * scale).min(self.height_m), p.z * scale);
        }
        wrap_uvs(&mut mesh, self.height_m * 0.2, &|p| p.y);
        Ok(mesh)
    }
}

/// Union of two fields with a fillet about `k` wide (polynomial smooth minimum).
#[inline(always)]
fn join<L: Lanes>(a: L, b: L, k: f32) -> L {
    let zero = a.like(0.0);
    let h = Lanes::max(a.like(k) - (a - b).abs(), zero) / k;
    Lanes::min(a, b) - h * h * k * 0.25
}

/// `a` without `b`, the edge rounded over about `k`.
#[inline(always)]
fn carve<L: Lanes>(a: L, b: L, k: f32) -> L {
    -join(-a, b, k)
}

/// An ellipsoid; a lower bound of the distance, exact on the surface.
#[inline(always)]
fn ellipsoid<L: Lanes>(p: V3<L>, center: Vec3, radii: Vec3) -> L {
    let q = from(p, center);
    let squares = radii * radii;
    let k0 = v3(q.x / radii.x, q.y / radii.y, q.z / radii.z).length();
    let k1 = v3(q.x / squares.x, q.y / squares.y, q.z / squares.z).length();
    L::select(k1.equals(k1.like(0.0)), k1.like(-radii.min_element()), k0 * (k0 - 1.0) / k1)
}

/// A segment between two points with a radius at each end.
#[inline(always)]
fn limb<L: Lanes>(p: V3<L>, a: Vec3, b: Vec3, radius_a: f32, radius_b: f32) -> L {
    let (along, token) = (b - a, p.x.token());
    let t = (from(p, a).dot(V3::splat(token, along)) / a.distance_squared(b)).clamp(0.0, 1.0);
    let nearest = V3::splat(token, a) + V3::splat(token, along) * t;
    (p - nearest).length() - (t * (radius_b - radius_a) + radius_a)
}

/// A block with rounded edges.
#[inline(always)]
fn block<L: Lanes>(p: V3<L>, center: Vec3, half: Vec3, radius: f32) -> L {
    let q = from(p, center);
    let q = v3(q.x.abs() - half.x + radius, q.y.abs() - half.y + radius, q.z.abs() - half.z + radius);
    let zero = q.x.like(0.0);
    let outside = v3(Lanes::max(q.x, zero), Lanes::max(q.y, zero), Lanes::max(q.z, zero)).length();
    let inside = Lanes::min(Lanes::max(q.x, Lanes::max(q.y, q.z)), zero);
    outside + inside - radius
}

/// `p − origin`.
#[inline(always)]
fn from<L: Lanes>(p: V3<L>, origin: Vec3) -> V3<L> {
    v3(p.x - origin.x, p.y - origin.y, p.z - origin.z)
}

/// A Cycladic head: a long oval, tilted back, a ridge of a nose, hollows for eyes.
struct Bust;

impl Field for Bust {
    #[inline(always)]
    fn value<L: Lanes>(&self, p: V3<L>) -> L {
        let v = Vec3::new;
        // Left and right are one.
        let p = v3(p.x.abs(), p.y, p.z);
        // Lean the face back about the chin.
        let lean = 0.16;
        let tilted = v3(p.x, p.y, p.z + (p.y - 0.55) * lean);

        let skull = ellipsoid(tilted, v(0.0, 0.78, -0.015), v(0.145, 0.205, 0.155));
        let face = ellipsoid(tilted, v(0.0, 0.66, 0.045), v(0.105, 0.165, 0.115));
        let mut head = join(skull, face, 0.08);
        // A flat face, cut by a plane, with the brow left standing.
        let nose = limb(tilted, v(0.0, 0.795, 0.128), v(0.0, 0.655, 0.176), 0.016, 0.027);
        let hollow = ellipsoid(tilted, v(0.062, 0.755, 0.185), v(0.05, 0.035, 0.05));
        head = carve(head, hollow, 0.05);
        head = join(head, nose, 0.045);
        let ear = limb(tilted, v(0.136, 0.748, -0.022), v(0.124, 0.690, -0.004), 0.019, 0.013);
        head = join(head, ear, 0.022);
        // Hair drawn back into a knot.
        let knot = ellipsoid(tilted, v(0.0, 0.82, -0.185), v(0.055, 0.055, 0.05));
        head = join(head, knot, 0.04);

        let neck = limb(p, v(0.0, 0.60, -0.04), v(0.0, 0.36, -0.03), 0.070, 0.088);
        let shoulders = limb(p, v(0.0, 0.315, -0.03), v(0.195, 0.265, -0.035), 0.105, 0.085);
        let chest = ellipsoid(p, v(0.0, 0.22, 0.0), v(0.20, 0.13, 0.125));
        let mut body = join(shoulders, chest, 0.08);
        body = join(body, neck, 0.10);
        let figure = join(body, head, 0.045);
        let plinth = block(p, v(0.0, 0.07, -0.01), v(0.215, 0.07, 0.155), 0.012);
        let waist = limb(p, v(0.0, 0.12, -0.01), v(0.0, 0.24, -0.01), 0.115, 0.13);
        join(join(figure, waist, 0.07), plinth, 0.02)
    }
}

/// A reclining figure: raised knees, a propped torso, openings under both.
struct Reclining;

impl Field for Reclining {
    #[inline(always)]
    fn value<L: Lanes>(&self, p: V3<L>) -> L {
        let v = Vec3::new;
        let mut figure = limb(p, v(-0.42, 0.30, 0.02), v(-0.50, 0.62, 0.0), 0.145, 0.125);
        // Shoulders, neck and head.
        figure = join(figure, limb(p, v(-0.52, 0.64, 0.19), v(-0.50, 0.64, -0.19), 0.085, 0.085), 0.12);
        figure = join(figure, limb(p, v(-0.52, 0.70, 0.0), v(-0.56, 0.84, 0.0), 0.055, 0.050), 0.06);
        figure = join(figure, ellipsoid(p, v(-0.57, 0.895, 0.0), v(0.075, 0.098, 0.070)), 0.035);
        // The arm the body leans on, and the other along the side.
        figure = join(figure, limb(p, v(-0.54, 0.62, 0.21), v(-0.76, 0.30, 0.24), 0.072, 0.062), 0.09);
        figure = join(figure, limb(p, v(-0.76, 0.30, 0.24), v(-0.62, 0.08, 0.26), 0.062, 0.054), 0.08);
        figure = join(figure, limb(p, v(-0.50, 0.62, -0.21), v(-0.20, 0.34, -0.27), 0.070, 0.060), 0.09);
        figure = join(figure, limb(p, v(-0.20, 0.34, -0.27), v(0.10, 0.30, -0.19), 0.060, 0.052), 0.08);
        // Hips and legs: one knee high, one low.
        figure = join(figure, ellipsoid(p, v(-0.30, 0.20, 0.0), v(0.21, 0.15, 0.20)), 0.14);
        figure = join(figure, limb(p, v(-0.22, 0.20, -0.10), v(0.20, 0.56, -0.13), 0.125, 0.095), 0.15);
        figure = join(figure, limb(p, v(0.20, 0.56, -0.13), v(0.46, 0.10, -0.14), 0.094, 0.070), 0.10);
        figure = join(figure, limb(p, v(-0.20, 0.18, 0.12), v(0.34, 0.33, 0.16), 0.120, 0.090), 0.15);
        figure = join(figure, limb(p, v(0.34, 0.33, 0.16), v(0.72, 0.10, 0.10), 0.089, 0.066), 0.10);
        figure = join(figure, limb(p, v(0.44, 0.10, -0.14), v(0.62, 0.09, -0.13), 0.062, 0.046), 0.07);
        // A hole through the chest, after Moore.
        let hole = limb(p, v(-0.56, 0.47, -0.4), v(-0.40, 0.47, 0.4), 0.055, 0.055);
        figure = carve(figure, hole, 0.07);
        let slab = block(p, v(-0.04, 0.035, 0.0), v(0.84, 0.035, 0.34), 0.015);
        join(figure, slab, 0.035)
    }
}
