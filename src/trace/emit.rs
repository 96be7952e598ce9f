//! Starts of photons: on each light, in proportion to flux, towards specular surfaces.
//!
//! The rays of a light have two coordinates: for parallel light a position on a plane across the light; for a point or spot light the cosine of the
//! angle from an axis and the azimuth about it, in which equal areas are equal solid angles. A grid over the coordinates marks the cells that contain
//! specular surfaces; only these cells emit. Light that would miss all specular surfaces makes no caustic; it is neither traced nor counted.
//!
//! Marked cells are laid out on a line in the order of a Z-curve, each with a length equal to the flux it emits. A batch of n photons cuts the line
//! into n equal parts with one start in each, all at the same random place of its part: photons with neighbouring numbers start near each other. Within
//! a cell, the starts are a lattice: one coordinate is the place on the line, the other grows by the golden ratio from start to start. Every cell has its
//! lattice shifted by a random vector of its own, and turned or not. So photons are spread far more evenly than by chance, over squares as over
//! strips; each is at every place of its cell with the same probability.

use glam::{DVec3, Vec3};

use nephroid_math::space::sin_cos_deg;
use nephroid_scene::geom::Aabb;
use nephroid_scene::{Light, spot_falloff};

use super::random::{Draws, Purpose, start_bits};

/// Cells of the grid along each of a light's two coordinates.
const CELLS: u32 = 256;

/// Most subdivisions of a triangle while its cells are marked.
const MAX_DEPTH: u32 = 12;

/// The golden ratio's fractional part.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A photon as it leaves its light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// World space, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Flux of the photon, W, linear RGB; the photons of a batch together carry the flux that the lights emit.
    pub flux: Vec3,
    /// Its random numbers; the start has used the first.
    pub draws: Draws,
}

/// All lights of a scene as one line of flux.
pub(super) struct Emitter {
    lights: Vec<LightEmission>,
    cells: Vec<Cell>,
    /// Start of each cell on the line, in W summed over RGB, followed by the end of the line.
    starts: Vec<f64>,
    /// One over the length of each cell on the line.
    inverse_lengths: Vec<f64>,
}

struct LightEmission {
    domain: Domain,
    /// Mean spot falloff over each row of cells: the share of the intensity that is emitted in its directions.
    falloffs: Vec<f64>,
    /// Irradiance (parallel light) or intensity (others), linear RGB.
    strength: Vec3,
}

/// A marked cell of one light.
#[derive(Clone, Copy)]
struct Cell {
    light: u32,
    column: u32,
    row: u32,
}

/// The two coordinates of a light's rays, each in 0..1 over the grid.
enum Domain {
    /// A ray starts at `origin + u·side + v·up`.
    Parallel { direction: Vec3, origin: DVec3, side: DVec3, up: DVec3 },
    /// `u` is the azimuth about the axis; `v` is the cosine of the angle from the axis, in `lowest..1`.
    Cone { position: Vec3, axis: DVec3, side: DVec3, up: DVec3, lowest: f64, spot: Option<(f32, f32)> },
}

/// Ranges of both coordinates in cells. The range of the first may wrap around.
struct Footprint {
    columns: (f64, f64),
    rows: (f64, f64),
}

impl Emitter {
    /// Marks the cells of every light that contain a part of the triangles.
    pub fn new(lights: &[Light], bounds: Aabb, targets: &[[Vec3; 3]]) -> Self {
        let mut emitter = Self { lights: Vec::new(), cells: Vec::new(), starts: vec![0.0], inverse_lengths: Vec::new() };
        for light in lights {
            emitter.add(light, bounds, targets);
        }
        emitter
    }

    /// Flux that all lights emit into marked cells, W summed over RGB.
    pub fn total_w(&self) -> f64 {
        self.starts.last().copied().unwrap_or(0.0)
    }

    fn add(&mut self, light: &Light, bounds: Aabb, targets: &[[Vec3; 3]]) {
        let (strength, domain) = match *light {
            Light::Directional { irradiance, .. } => {
                let direction = light.incident(Vec3::ZERO).direction_ws;
                (irradiance, Domain::parallel(direction, bounds, targets))
            }
            Light::Point { position, intensity } => (intensity, Domain::around(position, targets)),
            Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                (intensity, Domain::spot(position, direction, inner_deg, outer_deg))
            }
        };
        if strength == Vec3::ZERO || targets.is_empty() {
            return;
        }
        let mut marked = vec![false; (CELLS * CELLS) as usize];
        for triangle in targets {
            domain.mark(*triangle, 0, &mut marked);
        }
        let number = self.lights.len() as u32;
        let colour = f64::from(strength.x) + f64::from(strength.y) + f64::from(strength.z);
        let falloffs: Vec<f64> = (0..CELLS).map(|row| domain.mean_falloff(row)).collect();
        let mut end = self.total_w();
        for code in 0..CELLS * CELLS {
            let (column, row) = (every_other_bit(code), every_other_bit(code >> 1));
            let flux = colour * domain.cell_measure() * falloffs[row as usize];
            if marked[(row * CELLS + column) as usize] && flux > 0.0 {
                self.cells.push(Cell { light: number, column, row });
                let start = end;
                end += flux;
                self.starts.push(end);
                self.inverse_lengths.push(1.0 / (end - start));
            }
        }
        self.lights.push(LightEmission { domain, falloffs, strength });
    }

    /// Starts of the photons `first..first + number` of a batch of `count`. `seed` and `batch` select the random numbers.
    pub fn start(&self, seed: u32, batch: u32, first: u32, count: u32, out: &mut Vec<Start>, number: usize) {
        out.clear();
        let total = self.total_w();
        let step = total / f64::from(count);
        let mut cell = self.cell_at(f64::from(first) * step);
        let unit = |bits: u32| f64::from(bits) / 4_294_967_296.0;
        let offset = unit(start_bits(seed, batch, u32::MAX)[0]);
        for photon in first..first + number as u32 {
            let place = (f64::from(photon) + offset) * step;
            while cell + 1 < self.cells.len() && place >= self.starts[cell + 1] {
                cell += 1;
            }
            let along = place - self.starts[cell];
            let [a, b, turn] = start_bits(seed, batch, cell as u32);
            let first = (along * self.inverse_lengths[cell] + unit(a)).fract();
            let second = ((along / step).floor() * GOLDEN + unit(b)).fract();
            let within = if turn & 1 == 0 { [first, second] } else { [second, first] };
            out.push(self.ray(self.cells[cell], within, step, Draws::new(seed, Purpose::Photon, batch, photon)));
        }
    }

    /// The cell that contains a position on the line.
    fn cell_at(&self, place: f64) -> usize {
        self.starts.partition_point(|&start| start <= place).saturating_sub(1).min(self.cells.len() - 1)
    }

    fn ray(&self, cell: Cell, within: [f64; 2], step: f64, draws: Draws) -> Start {
        let source = &self.lights[cell.light as usize];
        let u = (f64::from(cell.column) + within[0]) / f64::from(CELLS);
        let v = (f64::from(cell.row) + within[1]) / f64::from(CELLS);
        let strength = source.strength;
        let colour = strength / (strength.x + strength.y + strength.z);
        let (origin, direction, falloff) = source.domain.ray(u, v);
        let weight = falloff / source.falloffs[cell.row as usize];
        Start { origin, direction, flux: colour * (step * weight) as f32, draws }
    }
}

/// Bits 0, 2, 4... of a word, packed.
fn every_other_bit(word: u32) -> u32 {
    let mut x = word & 0x5555_5555;
    x = (x | x >> 1) & 0x3333_3333;
    x = (x | x >> 2) & 0x0f0f_0f0f;
    x = (x | x >> 4) & 0x00ff_00ff;
    (x | x >> 8) & 0x0000_ffff
}

/// Two unit vectors perpendicular to `axis` and to each other.
fn across(axis: DVec3) -> (DVec3, DVec3) {
    let helper = if axis.y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
    let side = helper.cross(axis).normalize();
    (side, axis.cross(side))
}

impl Domain {
    /// A plane upstream of the whole scene, as large as the targets seen along the light.
    fn parallel(direction: Vec3, bounds: Aabb, targets: &[[Vec3; 3]]) -> Self {
        let axis = direction.as_dvec3();
        let (side, up) = across(axis);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in targets.iter().flatten() {
            let p = p.as_dvec3();
            for (k, value) in [p.dot(side), p.dot(up)].into_iter().enumerate() {
                low[k] = low[k].min(value);
                high[k] = high[k].max(value);
            }
        }
        let behind = bounds.corners().iter().fold(f64::INFINITY, |least: f64, p| least.min(p.as_dvec3().dot(axis)));
        let size = ((high[0] - low[0]).max(high[1] - low[1])).max(1.0e-6);
        let margin = size * 1.0e-6;
        let extent = [high[0] - low[0] + 2.0 * margin, high[1] - low[1] + 2.0 * margin];
        let origin = side * (low[0] - margin) + up * (low[1] - margin) + axis * (behind - 1.0e-3 * size);
        Self::Parallel { direction, origin, side: side * extent[0], up: up * extent[1] }
    }

    /// All directions from a point; if the point is outside of the targets, only the cone around them.
    fn around(position: Vec3, targets: &[[Vec3; 3]]) -> Self {
        let bounds = Aabb::from_points(targets.iter().flatten().copied());
        let to = (bounds.center() - position).as_dvec3();
        let (distance, radius) = (to.length(), f64::from(bounds.size().length()) * 0.5);
        let axis = if distance > 0.0 { to / distance } else { DVec3::NEG_Y };
        let lowest = if distance > radius * 1.001 { (1.0 - (radius / distance) * (radius / distance)).sqrt() - 1.0e-6 } else { -1.0 };
        let (side, up) = across(axis);
        Self::Cone { position, axis, side, up, lowest, spot: None }
    }

    fn spot(position: Vec3, direction: Vec3, inner_deg: f32, outer_deg: f32) -> Self {
        let axis = direction.as_dvec3().normalize();
        let (side, up) = across(axis);
        Self::Cone { position, axis, side, up, lowest: sin_cos_deg(outer_deg).1, spot: Some((inner_deg, outer_deg)) }
    }

    /// Area in m² (parallel light) or solid angle in sr (others) of a cell.
    fn cell_measure(&self) -> f64 {
        let cells = f64::from(CELLS);
        match *self {
            Self::Parallel { side, up, .. } => side.length() * up.length() / (cells * cells),
            Self::Cone { lowest, .. } => std::f64::consts::TAU * (1.0 - lowest) / (cells * cells),
        }
    }

    /// Mean spot falloff over a row of cells.
    fn mean_falloff(&self, row: u32) -> f64 {
        const SAMPLES: u32 = 16;
        let Self::Cone { lowest, spot: Some((inner_deg, outer_deg)), .. } = *self else { return 1.0 };
        let at = |k: u32| {
            let v = (f64::from(row) + (f64::from(k) + 0.5) / f64::from(SAMPLES)) / f64::from(CELLS);
            f64::from(spot_falloff((lowest + (1.0 - lowest) * v) as f32, inner_deg, outer_deg))
        };
        (0..SAMPLES).fold(0.0, |sum, k| sum + at(k)) / f64::from(SAMPLES)
    }

    /// The ray at two coordinates, and the spot falloff in its direction.
    fn ray(&self, u: f64, v: f64) -> (Vec3, Vec3, f64) {
        match *self {
            Self::Parallel { direction, origin, side, up } => ((origin + side * u + up * v).as_vec3(), direction, 1.0),
            Self::Cone { position, axis, side, up, lowest, spot } => {
                let cos = lowest + (1.0 - lowest) * v;
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let (s, c) = libm::sincos(std::f64::consts::TAU * u);
                let direction = axis * cos + (side * c + up * s) * sin;
                let falloff = spot.map_or(1.0, |(inner_deg, outer_deg)| f64::from(spot_falloff(cos as f32, inner_deg, outer_deg)));
                (position, direction.as_vec3().normalize(), falloff)
            }
        }
    }

    /// Marks every cell in which part of a triangle may be visible: the triangle is cut until its footprint is small, and the footprint's cells are
    /// marked.
    fn mark(&self, triangle: [Vec3; 3], depth: u32, marked: &mut [bool]) {
        let [a, b, c] = triangle;
        let Some(footprint) = self.footprint(triangle) else { return };
        let small = footprint.columns.1 - footprint.columns.0 <= 2.0 && footprint.rows.1 - footprint.rows.0 <= 2.0;
        if small || depth == MAX_DEPTH {
            let (first, last) = (footprint.rows.0.floor().max(0.0), footprint.rows.1.floor().min(f64::from(CELLS) - 1.0));
            let (left, right) = (footprint.columns.0.floor() as i64, footprint.columns.1.floor() as i64);
            for row in first as i64..=last as i64 {
                for column in left..=right.min(left + i64::from(CELLS) - 1) {
                    let wrapped = match self {
                        Self::Parallel { .. } => column.clamp(0, i64::from(CELLS) - 1),
                        Self::Cone { .. } => column.rem_euclid(i64::from(CELLS)),
                    };
                    marked[(row * i64::from(CELLS) + wrapped) as usize] = true;
                }
            }
            return;
        }
        let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            self.mark(part, depth + 1, marked);
        }
    }

    /// Range of the coordinates, in cells, that contains a triangle or a sphere around it; `None` outside of the light's range.
    fn footprint(&self, triangle: [Vec3; 3]) -> Option<Footprint> {
        let cells = f64::from(CELLS);
        match *self {
            Self::Parallel { origin, side, up, .. } => {
                let along = |axis: DVec3| {
                    let places = triangle.map(|p| (p.as_dvec3() - origin).dot(axis) / axis.length_squared() * cells);
                    // Margin for rounding.
                    let slack = 1.0e-6;
                    (places.into_iter().fold(f64::INFINITY, f64::min) - slack, places.into_iter().fold(f64::NEG_INFINITY, f64::max) + slack)
                };
                Some(Footprint { columns: along(side), rows: along(up) })
            }
            Self::Cone { position, axis, side, up, lowest, .. } => {
                let all = Footprint { columns: (0.0, cells), rows: (0.0, cells - 1.0) };
                let center = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
                let radius = f64::from(triangle.iter().fold(0.0_f32, |most, p| most.max(p.distance(center))) * 1.000_01);
                let offset = center.as_dvec3() - position.as_dvec3();
                let distance = offset.length();
                if distance <= radius * 1.001 {
                    return Some(all);
                }
                let half = libm::asin(radius / distance);
                let polar = libm::acos((offset.dot(axis) / distance).clamp(-1.0, 1.0));
                let cos = |angle: f64| libm::cos(angle.clamp(0.0, std::f64::consts::PI));
                let row = |cos: f64| (cos - lowest) / (1.0 - lowest) * cells;
                let rows = (row(cos(polar + half)), row(cos(polar - half)));
                if rows.1 < 0.0 {
                    return None;
                }
                if polar - half <= 0.0 || polar + half >= std::f64::consts::PI {
                    return Some(Footprint { columns: (0.0, cells - 1.0e-9), rows });
                }
                // The range is widest where the sphere's cone touches a meridian: sin Δφ = sin half / sin polar.
                let width = libm::asin((libm::sin(half) / libm::sin(polar)).min(1.0));
                let azimuth = libm::atan2(offset.dot(up), offset.dot(side));
                let column = |angle: f64| angle / std::f64::consts::TAU * cells;
                Some(Footprint { columns: (column(azimuth - width), column(azimuth + width)), rows })
            }
        }
    }
}
