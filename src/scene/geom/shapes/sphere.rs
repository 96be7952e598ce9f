//! Spheres, and texture coordinates on closed round bodies.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Check, ShapeError,
    lathe::{arc, revolve},
};
use crate::geom::Mesh;

/// A sphere cut along meridians and parallels, centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UvSphere {
    /// Radius in metres, above 0. Default: 0.5.
    pub radius_m: f32,
    /// Number of meridians, 3 to 4096. Default: 64.
    pub slices: u32,
    /// Number of bands from pole to pole, 2 to 2048. Default: 32.
    pub stacks: u32,
}

impl Default for UvSphere {
    fn default() -> Self {
        Self { radius_m: 0.5, slices: 64, stacks: 32 }
    }
}

impl UvSphere {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("UvSphere");
        check.length("radius_m", self.radius_m)?;
        check.count("slices", self.slices, 3..=4096)?;
        check.count("stacks", self.stacks, 2..=2048)?;
        let mut run = arc(Vec2::ZERO, Vec2::splat(self.radius_m), -FRAC_PI_2, FRAC_PI_2, self.stacks);
        // The cosine of a quarter turn is not exactly zero.
        run[0].x = 0.0;
        run[self.stacks as usize].x = 0.0;
        let mut mesh = revolve(&[run], self.slices);
        for (n, p) in mesh.normals.iter_mut().zip(&mesh.positions) {
            *n = p.normalize_or(*n);
        }
        Ok(mesh)
    }
}

/// A sphere of nearly equal triangles: a subdivided icosahedron, centred on the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IcoSphere {
    /// Radius in metres, above 0. Default: 0.5.
    pub radius_m: f32,
    /// How often each triangle is cut into four, 0 to 9: 20 · 4ⁿ triangles. Default: 4.
    pub subdivisions: u32,
}

impl Default for IcoSphere {
    fn default() -> Self {
        Self { radius_m: 0.5, subdivisions: 4 }
    }
}

impl IcoSphere {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("IcoSphere");
        check.length("radius_m", self.radius_m)?;
        check.count("subdivisions", self.subdivisions, 0..=9)?;
        let mut mesh = unit_icosphere(self.subdivisions);
        mesh.positions.iter_mut().for_each(|p| *p *= self.radius_m);
        wrap_uvs(&mut mesh, self.radius_m, &|p| libm::asinf((p.y / self.radius_m).clamp(-1.0, 1.0)) * self.radius_m);
        Ok(mesh)
    }
}

/// A subdivided icosahedron on the unit sphere, without texture coordinates; vertices are shared.
pub(super) fn unit_icosphere(subdivisions: u32) -> Mesh {
    // A vertex at either pole, and two rings of five at latitudes ±atan(1/2), turned by half a step.
    let (ring_y, ring_r) = (1.0 / 5.0_f32.sqrt(), 2.0 / 5.0_f32.sqrt());
    let mut mesh = Mesh::default();
    let mut push = |p: Vec3| mesh.push_vertex(p, p, None);
    let north = push(Vec3::Y);
    let mut ring = |y: f32, half_steps: u32| -> [u32; 5] {
        std::array::from_fn(|i| {
            let (sin, cos) = libm::sincosf((2 * i as u32 + half_steps) as f32 * PI / 5.0);
            push(Vec3::new(ring_r * cos, y, -ring_r * sin))
        })
    };
    let (upper, lower) = (ring(ring_y, 0), ring(-ring_y, 1));
    let south = mesh.push_vertex(Vec3::NEG_Y, Vec3::NEG_Y, None);
    for i in 0..5 {
        let next = (i + 1) % 5;
        mesh.indices.extend([north, upper[i], upper[next]]);
        mesh.indices.extend([upper[i], lower[i], upper[next]]);
        mesh.indices.extend([lower[i], lower[next], upper[next]]);
        mesh.indices.extend([south, lower[next], lower[i]]);
    }
    for _ in 0..subdivisions {
        mesh = quartered(&mesh);
    }
    mesh
}

/// Every triangle cut into four, new vertices pushed out to the unit sphere.
fn quartered(mesh: &Mesh) -> Mesh {
    let mut fine = Mesh { indices: Vec::with_capacity(mesh.indices.len() * 4), ..mesh.clone() };
    fine.indices.clear();
    let mut edges: Vec<(u32, u32)> = mesh.triangles().flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|(a, b)| a < b).collect();
    edges.sort_unstable();
    for &(a, b) in &edges {
        let p = (mesh.positions[a as usize] + mesh.positions[b as usize]).normalize();
        fine.push_vertex(p, p, None);
    }
    let first = mesh.positions.len();
    let middle = |a: u32, b: u32| {
        let at = edges.binary_search(&(a.min(b), a.max(b))).expect("a closed mesh has each edge once in rising order");
        (first + at) as u32
    };
    for [a, b, c] in mesh.triangles() {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        fine.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
    }
    fine
}

/// Gives a body around the y axis texture coordinates: longitude × `radius_m` and whatever `v` makes of a position.
///
/// Vertices are split along the meridian where the longitude jumps, and on the axis, where a triangle takes the middle of its other
/// corners.
pub(super) fn wrap_uvs(mesh: &mut Mesh, radius_m: f32, v: &dyn Fn(Vec3) -> f32) {
    let on_axis = |p: Vec3| p.x.abs().max(p.z.abs()) <= radius_m * 1e-6;
    // In turns, 0..1, growing to the right seen from outside; on the axis there is none.
    let turn = |p: &Vec3| {
        let turn = libm::atan2f(-p.z, p.x) / TAU;
        (!on_axis(*p)).then_some(if turn < 0.0 { turn + 1.0 } else { turn })
    };
    let turns: Vec<Option<f32>> = mesh.positions.par_iter().with_min_len(1024).map(turn).collect();
    let triangle_corners = |(triangle, t): (usize, &[u32])| {
        let turns = [t[0], t[1], t[2]].map(|i| turns[i as usize]);
        let reference = turns.into_iter().flatten().next().unwrap_or(0.0);
        // Bring each corner to within half a turn of the first.
        let turns = turns.map(|turn| turn.map(|u| u - (u - reference).round()));
        let off_axis = || turns.into_iter().flatten();
        let middle = off_axis().sum::<f32>() / off_axis().count().max(1) as f32;
        let low = off_axis().fold(f32::INFINITY, f32::min);
        // Whole turns are taken off per triangle, so a corner has one of few values and vertices are shared where they can be.
        let shift = if low.is_finite() { low.floor() } else { 0.0 };
        let corner = |k: usize| {
            let u = turns[k].unwrap_or(middle) - shift;
            (t[k], (u + 0.0).to_bits(), (triangle * 3 + k) as u32)
        };
        [corner(0), corner(1), corner(2)]
    };
    let corners: Vec<[(u32, u32, u32); 3]> =
        mesh.indices.par_chunks_exact(3).enumerate().with_min_len(1024).map(triangle_corners).collect();
    let mut corners = corners.into_flattened();
    // No two are equal, so there is one order.
    corners.par_sort_unstable();
    let mut wrapped = Mesh { indices: vec![0; mesh.indices.len()], ..Mesh::default() };
    for run in corners.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let old = run[0].0 as usize;
        let uv = Vec2::new(f32::from_bits(run[0].1) * TAU * radius_m, v(mesh.positions[old]));
        let vertex = wrapped.push_vertex(mesh.positions[old], mesh.normals[old], Some(uv));
        for &(_, _, corner) in run {
            wrapped.indices[corner as usize] = vertex;
        }
    }
    *mesh = wrapped;
}
