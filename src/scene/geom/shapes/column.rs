//! A fluted column with base and capital.

use std::f32::consts::FRAC_PI_2;

use glam::{Mat4, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    Check, Cuboid, ShapeError,
    lathe::{Run, arc, revolve},
};
use crate::geom::Mesh;

/// Segments across the hollow of a flute.
const FLUTE_STEPS: u32 = 8;
/// Part of a flute's width that is hollow; the rest is the fillet between two of them.
const HOLLOW: f32 = 0.78;
/// Rings that round off each end of the flutes.
const END_STEPS: u32 = 6;
/// Rings between the ends, for the curve of the shaft.
const SHAFT_STEPS: u32 = 20;
/// Radius of the shaft's top over that of its foot [Vitruvius III.3.12, for columns of 15 to 20 feet: 11 to 13].
const TAPER: f32 = 0.85;
/// Overlap of parts that stand on each other, in radii: no two faces coincide.
const OVERLAP: f32 = 0.02;

/// A fluted column on an Attic base (plinth, torus, scotia, torus) with a plain round capital and a square abacus, standing on `y = 0`.
///
/// Heights of the parts are fixed multiples of the radius; the shaft takes the rest, narrows by a seventh and swells slightly on the
/// way (entasis). Six closed surfaces, stuck into each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Column {
    /// Height with base and capital in metres, at least 4 times the radius. Default: 3.
    pub height_m: f32,
    /// Radius of the shaft at its foot in metres, above 0. Default: 0.2.
    pub radius_m: f32,
    /// Number of flutes, 8 to 64. Default: 24.
    pub flutes: u32,
}

impl Default for Column {
    fn default() -> Self {
        Self { height_m: 3.0, radius_m: 0.2, flutes: 24 }
    }
}

impl Column {
    /// Builds the mesh.
    ///
    /// # Errors
    /// If a field is outside its range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        let check = Check("Column");
        check.length("radius_m", self.radius_m)?;
        check.length("height_m", self.height_m)?;
        if self.height_m < 4.0 * self.radius_m {
            check.fail("height_m", self.height_m, format_args!("at least 4 × radius_m, {}", 4.0 * self.radius_m))?;
        }
        check.count("flutes", self.flutes, 8..=64)?;

        // In radii from here on.
        let height = self.height_m / self.radius_m;
        let (base_top, capital_foot) = (1.05, height - 0.85);
        let slices = self.flutes * 4;
        let slab = |half_side: f32, bottom: f32, top: f32| {
            let mesh = Cuboid { size_m: Vec3::new(2.0 * half_side, top - bottom, 2.0 * half_side) }.mesh()?;
            Ok::<_, ShapeError>(mesh.transformed(Mat4::from_translation(Vec3::Y * (top + bottom) * 0.5)))
        };
        let parts = [
            slab(1.38, 0.0, 0.32)?,
            revolve(&base_profile(0.32 - OVERLAP, base_top), slices),
            self.shaft(base_top - OVERLAP, capital_foot + OVERLAP),
            revolve(&capital_profile(capital_foot, height - 0.27 + OVERLAP), slices),
            slab(TAPER * 1.42, height - 0.27, height - 0.07)?,
            slab(TAPER * 1.50, height - 0.07 - OVERLAP, height)?,
        ];
        let mut mesh = Mesh::merged(&parts).transformed(Mat4::from_scale(Vec3::splat(self.radius_m)));
        mesh.uvs.iter_mut().for_each(|uv| *uv *= self.radius_m);
        // A sum of rounded heights: make the top exact.
        mesh.positions.iter_mut().for_each(|p| p.y = p.y.clamp(0.0, self.height_m));
        Ok(mesh)
    }

    /// The fluted shaft as rings of equal vertex count, closed by two discs.
    fn shaft(&self, bottom: f32, top: f32) -> Mesh {
        let per_flute = FLUTE_STEPS + 1;
        let count = self.flutes * per_flute;
        let half_width = std::f32::consts::PI / self.flutes as f32 * HOLLOW;
        // Across one flute: angle from its middle, and the same in half widths of the hollow.
        let across: Vec<(f32, f32)> = (0..=FLUTE_STEPS)
            .map(|i| {
                let x = libm::sinf((i as f32 / FLUTE_STEPS as f32 - 0.5) * std::f32::consts::PI);
                (x * half_width, x)
            })
            .collect();
        let depth = half_width * 0.75;

        let mut mesh = Mesh::default();
        let levels = self.levels(bottom, top, half_width);
        for &(y, radius, past_end) in &levels {
            for k in 0..=count {
                let k_in_turn = k % count;
                let (flute, i) = (k_in_turn / per_flute, k_in_turn % per_flute);
                let (offset, x) = across[i as usize];
                let angle = (flute as f32 + 0.5) / self.flutes as f32 * std::f32::consts::TAU + offset;
                let (sin, cos) = libm::sincosf(angle);
                // A half cylinder that ends in a quarter of a ball.
                let hollow = (1.0 - x * x - past_end * past_end).max(0.0).sqrt();
                let r = radius * (1.0 - depth * hollow);
                let uv = Vec2::new(k as f32 / count as f32 * std::f32::consts::TAU, y);
                mesh.push_vertex(Vec3::new(r * cos, y, -r * sin), Vec3::Y, Some(uv));
            }
        }
        let stride = count + 1;
        for level in 0..levels.len() as u32 - 1 {
            for k in 0..count {
                let a = level * stride + k;
                mesh.push_quad([a, a + 1, a + stride + 1, a + stride]);
            }
        }
        for (level, y, up) in [(0, bottom, -1.0), (levels.len() as u32 - 1, top, 1.0)] {
            let middle = mesh.push_vertex(Vec3::Y * y, Vec3::Y, Some(Vec2::ZERO));
            let rim = mesh.positions.len() as u32;
            for k in 0..=count {
                let p = mesh.positions[(level * stride + k) as usize];
                mesh.push_vertex(p, Vec3::Y, Some(Vec2::new(p.x, -p.z * up)));
            }
            for (a, b) in (rim..rim + count).map(|a| (a, a + 1)) {
                mesh.push_triangle(if up < 0.0 { [middle, b, a] } else { [middle, a, b] });
            }
        }
        mesh.crease(0.7);
        mesh
    }

    /// Of each ring from the foot up: height, radius, and how far it is past the straight part of the flutes (0 to 1, in half widths).
    fn levels(&self, bottom: f32, top: f32, half_width: f32) -> Vec<(f32, f32, f32)> {
        // Entasis: a parabola that leaves the foot upright and takes off two thirds of the taper evenly.
        let radius = |y: f32| {
            let s = ((y - bottom) / (top - bottom)).clamp(0.0, 1.0);
            1.0 - (1.0 - TAPER) * s * (0.35 + 0.65 * s)
        };
        // The shaft spreads a little towards both ends (apophyge), where the flutes have already ended.
        let margin = 0.16;
        let (low, high) = (bottom + margin, top - margin);
        let end = half_width;
        let mut levels = Vec::new();
        let spread = |t: f32| 0.06 * (1.0 - t) * (1.0 - t);
        for i in 0..4 {
            let t = i as f32 / 4.0;
            levels.push((bottom + margin * t, radius(bottom) + spread(t), 1.0));
        }
        let rounding = |i: u32| libm::cosf(FRAC_PI_2 * i as f32 / END_STEPS as f32);
        levels.extend((0..END_STEPS).map(|i| {
            let cos = rounding(i);
            let y = low + end * (1.0 - cos);
            (y, radius(y), cos)
        }));
        levels.extend((0..=SHAFT_STEPS).map(|i| {
            let y = low + end + (high - low - 2.0 * end) * (i as f32 / SHAFT_STEPS as f32);
            (y, radius(y), 0.0)
        }));
        levels.extend((0..END_STEPS).rev().map(|i| {
            let cos = rounding(i);
            let y = high - end * (1.0 - cos);
            (y, radius(y), cos)
        }));
        for i in (0..4).rev() {
            let t = i as f32 / 4.0;
            levels.push((top - margin * t, radius(top) + spread(t) * 0.7, 1.0));
        }
        levels
    }
}

/// Torus, scotia, torus between fillets, in radii.
fn base_profile(bottom: f32, top: f32) -> Vec<Run> {
    let v = Vec2::new;
    let steps = 10;
    // Heights of the mouldings from the plinth up.
    let [a, b, c, d, e] = [0.36, 0.42, 0.64, 0.70, 1.00].map(|s| bottom + (top - bottom) * s);
    let torus = |from: f32, to: f32, r: f32| {
        let half = (to - from) * 0.5;
        arc(v(r - half, (from + to) * 0.5), v(half, half), -FRAC_PI_2, FRAC_PI_2, steps)
    };
    let lower = torus(bottom, a, 1.36);
    let upper = torus(d, top, 1.22);
    // The scotia: a hollow that reaches further in at its top.
    let mut scotia: Run = (0..=steps)
        .map(|i| {
            let t = i as f32 / steps as f32;
            let (sin, _) = libm::sincosf(t * std::f32::consts::PI);
            v(1.24 - 0.11 * t - 0.10 * sin, b + (c - b) * t)
        })
        .collect();
    let (first, last) = (scotia[0], scotia[scotia.len() - 1]);
    let fillet_out = v(first.x, a);
    let fillet_in = v(last.x, d);
    scotia[0] = first;
    let join = |from: &Run, to: Vec2| vec![from[from.len() - 1], to];
    vec![
        vec![v(0.0, bottom), lower[0]],
        lower.clone(),
        join(&lower, fillet_out),
        vec![fillet_out, first],
        scotia,
        vec![last, fillet_in],
        vec![fillet_in, upper[0]],
        upper.clone(),
        vec![upper[upper.len() - 1], v(0.0, e)],
    ]
    .into_iter()
    .filter(|run| run.len() > 2 || run[0] != run[1])
    .collect()
}

/// Astragal, neck and echinus, in radii.
fn capital_profile(bottom: f32, top: f32) -> Vec<Run> {
    let v = Vec2::new;
    let neck = TAPER * 1.02;
    let bead = 0.05;
    let astragal = arc(v(neck + 0.01, bottom + bead), v(bead + 0.03, bead), -FRAC_PI_2, FRAC_PI_2, 8);
    let neck_foot = v(neck, bottom + 2.0 * bead);
    let annulet = bottom + (top - bottom) * 0.52;
    // A cushion that swells out steeply and turns in under the abacus.
    let reach = TAPER * 1.36 - neck;
    let height = top - annulet - 0.05;
    let echinus: Run = (0..=12)
        .map(|i| {
            let (sin, cos) = libm::sincosf(FRAC_PI_2 * i as f32 / 12.0 * 1.18);
            v(neck + 0.04 + (reach - 0.04) * sin, annulet + 0.05 + height * (1.0 - cos) / 1.28)
        })
        .collect();
    let last = echinus[echinus.len() - 1];
    vec![
        vec![v(0.0, bottom), astragal[0]],
        astragal.clone(),
        vec![astragal[astragal.len() - 1], neck_foot],
        vec![neck_foot, v(neck, annulet)],
        vec![v(neck, annulet), v(neck + 0.04, annulet)],
        vec![v(neck + 0.04, annulet), echinus[0]],
        echinus,
        vec![last, v(last.x, top)],
        vec![v(last.x, top), v(0.0, top)],
    ]
    .into_iter()
    .filter(|run| run.len() > 2 || run[0] != run[1])
    .collect()
}
