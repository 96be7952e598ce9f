//! The albedo patterns: from a point and a normal to a colour.
//!
//! Patterns are point samples without filtering: a caller that wants no moiré asks more than once per pixel. Every random choice is a
//! function of (seed, cell), so a pattern has the same bits on any machine.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

use nephroid_math::lanes::Lanes;
use nephroid_math::noise::Fbm;
use nephroid_math::vector::{V2, V3, v2, v3};

use super::material::{Albedo, MAX_TILE_COLOURS};

/// An [`Albedo`] as shaders read it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PatternUniform {
    /// 0 solid, 1 tiles, 2 checker, 3 noise; number of tile colours; seed; octaves.
    pub kind: [u32; 4],
    /// Tiles: width, height and grout width in m, and variation. Checker: side in m. Noise: feature size in m.
    pub numbers: Vec4,
    /// Solid: the colour. Tiles: the grout. Checker: the square at the origin. Noise: the low end.
    pub first: Vec4,
    /// Tiles: their colours. Checker: the other square, noise: the high end, both in the first place.
    pub colours: [Vec4; MAX_TILE_COLOURS],
}

/// [`PatternUniform::kind`].
const SOLID: u32 = 0;
const TILES: u32 = 1;
const CHECKER: u32 = 2;
const NOISE: u32 = 3;

impl From<&Albedo> for PatternUniform {
    fn from(albedo: &Albedo) -> Self {
        let mut colours = [Vec4::ZERO; MAX_TILE_COLOURS];
        match albedo {
            Albedo::Solid(colour) => Self { kind: [SOLID, 0, 0, 0], numbers: Vec4::ZERO, first: colour.extend(0.0), colours },
            Albedo::Tiles { size_m, colours: tiles, grout, grout_width_m, variation, seed } => {
                for (slot, colour) in colours.iter_mut().zip(tiles) {
                    *slot = colour.extend(0.0);
                }
                let count = tiles.len().min(MAX_TILE_COLOURS) as u32;
                let numbers = Vec4::new(size_m.x, size_m.y, *grout_width_m, *variation);
                Self { kind: [TILES, count, *seed, 0], numbers, first: grout.extend(0.0), colours }
            }
            Albedo::Checker { size_m, even, odd } => {
                colours[0] = odd.extend(0.0);
                Self { kind: [CHECKER, 1, 0, 0], numbers: Vec4::new(*size_m, 0.0, 0.0, 0.0), first: even.extend(0.0), colours }
            }
            Albedo::Noise { low, high, scale_m, octaves, seed } => {
                colours[0] = high.extend(0.0);
                Self { kind: [NOISE, 1, *seed, *octaves], numbers: Vec4::new(*scale_m, 0.0, 0.0, 0.0), first: low.extend(0.0), colours }
            }
        }
    }
}

impl Albedo {
    /// Albedo at `position_ws` (m) of a surface with normal `normal_ws` (any length), linear RGB.
    #[must_use]
    pub fn at(&self, position_ws: Vec3, normal_ws: Vec3) -> Vec3 {
        let (p, n) = (position_ws, normal_ws);
        let color = PatternUniform::from(self).at::<f32>(v3(p.x, p.y, p.z), v3(n.x, n.y, n.z));
        Vec3::new(color.x, color.y, color.z)
    }
}

impl PatternUniform {
    /// Albedo at points (m, world space) of surfaces with these normals (any length), linear RGB.
    #[inline(always)]
    #[must_use]
    pub fn at<L: Lanes>(&self, position_ws: V3<L>, normal_ws: V3<L>) -> V3<L> {
        let token = position_ws.x.token();
        let first = V3::splat(token, self.first.truncate());
        let second = self.colours[0].truncate();
        match self.kind[0] {
            TILES => self.tiles(position_ws, normal_ws),
            CHECKER => {
                let (_, point_m) = pattern_point(position_ws, normal_ws);
                let square = (point_m.x / self.numbers.x).floor() + (point_m.y / self.numbers.x).floor();
                let is_even = square.equals((square * 0.5).floor() * 2.0);
                V3::select(is_even, first, V3::splat(token, second))
            }
            NOISE => {
                let fbm = Fbm { octaves: self.kind[3], ..Fbm::default() };
                let (p, scale_m) = (position_ws, self.numbers.x);
                let noise = fbm.at3_lanes(v3(p.x / scale_m, p.y / scale_m, p.z / scale_m), self.kind[2]);
                // Fbm sums keep within about ±0.6 almost everywhere; spread that over the two colours.
                let share = Lanes::clamp(noise * (0.5 / 0.6) + 0.5, 0.0, 1.0);
                first + V3::splat(token, second - self.first.truncate()) * share
            }
            _ => first,
        }
    }

    #[inline(always)]
    fn tiles<L: Lanes>(&self, position_ws: V3<L>, normal_ws: V3<L>) -> V3<L> {
        let token = position_ws.x.token();
        let [width, height, grout_width, _] = self.numbers.to_array();
        let (face, point_m) = pattern_point(position_ws, normal_ws);
        let tile = v2((point_m.x / width).floor(), (point_m.y / height).floor());
        let (x, y) = (point_m.x - tile.x * width, point_m.y - tile.y * height);
        let to_edge_x = Lanes::min(x, -x + width);
        let to_edge_y = Lanes::min(y, -y + height);
        let on_grout = Lanes::min(to_edge_x, to_edge_y).lt(x.like(0.5 * grout_width));
        let (face, columns, rows) = (face.to_array(), tile.x.to_array(), tile.y.to_array());
        let mut lanes = [[0.0; 16]; 3];
        let mut last = ([f32::NAN; 3], Vec3::ZERO);
        for lane in 0..L::LEN {
            let place = [face[lane], columns[lane], rows[lane]];
            // Neighbouring points mostly lie on one tile.
            if place != last.0 {
                last = (place, self.tile_colour(place));
            }
            lanes[0][lane] = last.1.x;
            lanes[1][lane] = last.1.y;
            lanes[2][lane] = last.1.z;
        }
        let colour = v3(L::load(token, &lanes[0]), L::load(token, &lanes[1]), L::load(token, &lanes[2]));
        V3::select(on_grout, V3::splat(token, self.first.truncate()), colour)
    }

    /// The colour of a tile, named by its face, column and row.
    fn tile_colour(&self, [face, column, row]: [f32; 3]) -> Vec3 {
        let bits = hash(self.kind[2], face as u32, Vec2::new(column, row));
        let colour = self.colours[(bits >> 8) as usize % (self.kind[1] as usize).clamp(1, MAX_TILE_COLOURS)].truncate();
        // Sixteen bits for the brightness, from 1 − variation to 1 + variation; a bright tile may not reflect more than it gets.
        let brightness = 1.0 + self.numbers.w * ((bits & 0xffff) as f32 * (2.0 / 65535.0) - 1.0);
        (colour * brightness).min(Vec3::ONE)
    }
}

/// The two pattern coordinates of a point, m, and the axis (0 = x, 1 = y, 2 = z) its surface faces.
///
/// The axis is the one of the normal's largest component, y before x before z where they are equal: (x, z) on floors, (z, y) on walls
/// that face along x, (x, y) on those that face along z.
#[inline(always)]
fn pattern_point<L: Lanes>(p: V3<L>, normal_ws: V3<L>) -> (L, V2<L>) {
    let (x, y, z) = (normal_ws.x.abs(), normal_ws.y.abs(), normal_ws.z.abs());
    let along_y = y.ge(x) & y.ge(z);
    let along_x = !along_y & x.ge(z);
    let face = L::select(along_y, x.like(1.0), L::select(along_x, x.like(0.0), x.like(2.0)));
    (face, v2(L::select(along_x, p.z, p.x), L::select(along_y, p.z, p.y)))
}

/// Thirty-two well-mixed bits for one tile: the finaliser of MurmurHash3 over its coordinates, one after the other.
fn hash(seed: u32, face: u32, tile: Vec2) -> u32 {
    let mut bits = seed ^ 0x9e37_79b9;
    // The casts saturate far outside of any scene; a NaN coordinate is tile 0.
    for word in [face, tile.x as i32 as u32, tile.y as i32 as u32] {
        bits = bits.wrapping_mul(0x85eb_ca6b) ^ word;
        bits ^= bits >> 16;
        bits = bits.wrapping_mul(0x85eb_ca6b);
        bits ^= bits >> 13;
        bits = bits.wrapping_mul(0xc2b2_ae35);
        bits ^= bits >> 16;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiles(variation: f32) -> Albedo {
        Albedo::Tiles {
            size_m: Vec2::new(0.2, 0.1),
            colours: vec![Vec3::new(0.9, 0.1, 0.1), Vec3::new(0.1, 0.1, 0.9)],
            grout: Vec3::splat(0.5),
            grout_width_m: 0.02,
            variation,
            seed: 7,
        }
    }

    #[test]
    fn tiles_have_grout_of_the_stated_width() {
        let albedo = tiles(0.0);
        let count = 20000;
        let grouted = (0..count).filter(|i| albedo.at(Vec3::new(*i as f32 * 1e-4 + 5e-5, 0.0, 0.05), Vec3::Y) == Vec3::splat(0.5)).count();
        // 0.02 of every 0.2 m along x.
        assert!((grouted as f32 / count as f32 - 0.1).abs() < 0.002, "{grouted}");
        assert_eq!(albedo.at(Vec3::new(0.1, 0.0, 0.009), Vec3::Y), Vec3::splat(0.5));
        assert_ne!(albedo.at(Vec3::new(0.1, 0.0, 0.011), Vec3::Y), Vec3::splat(0.5));
    }

    #[test]
    fn tiles_draw_each_colour_with_the_same_chance() {
        let albedo = tiles(0.0);
        let mut red = 0;
        for column in 0..100 {
            for row in 0..100 {
                let p = Vec3::new(column as f32 * 0.2 + 0.1, 0.0, row as f32 * 0.1 + 0.05);
                red += usize::from(albedo.at(p, Vec3::Y).x > 0.5);
            }
        }
        // 10^4 fair draws: five standard deviations are 250.
        assert!((4750..=5250).contains(&red), "{red}");
    }

    #[test]
    fn tiles_vary_in_brightness_but_never_reflect_more_than_they_get() {
        let albedo = tiles(1.0);
        let values: Vec<f32> = (0..500).map(|i| albedo.at(Vec3::new(i as f32 * 0.2 + 0.1, 0.0, 0.05), Vec3::Y).max_element()).collect();
        assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(values.iter().any(|&v| v < 0.2) && values.contains(&1.0));
    }

    #[test]
    fn patterns_of_floor_and_wall_share_their_lines() {
        let albedo = tiles(0.0);
        let floor = |x: f32| albedo.at(Vec3::new(x, 0.0, 0.05), Vec3::Y) == Vec3::splat(0.5);
        let wall = |x: f32| albedo.at(Vec3::new(x, 0.05, 0.0), Vec3::Z) == Vec3::splat(0.5);
        for i in 0..1000 {
            let x = i as f32 * 1e-3 + 5e-4;
            assert_eq!(floor(x), wall(x), "{x}");
        }
    }

    #[test]
    fn checker_alternates_through_the_origin() {
        let albedo = Albedo::Checker { size_m: 0.5, even: Vec3::ONE, odd: Vec3::ZERO };
        let at = |x: f32, z: f32| albedo.at(Vec3::new(x, 9.0, z), Vec3::Y).x;
        assert_eq!([at(0.1, 0.1), at(-0.1, 0.1), at(-0.1, -0.1), at(0.6, 0.1), at(0.6, 0.6)], [1.0, 0.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn noise_stays_between_its_colours_and_uses_most_of_the_way() {
        let albedo = Albedo::Noise { low: Vec3::splat(0.2), high: Vec3::splat(0.6), scale_m: 0.3, octaves: 5, seed: 3 };
        let (mut low, mut high) = (1.0_f32, 0.0_f32);
        for i in 0..20000 {
            let p = Vec3::new((i % 141) as f32 * 0.071, 0.3, (i / 141) as f32 * 0.063);
            let value = albedo.at(p, Vec3::Y).x;
            low = low.min(value);
            high = high.max(value);
        }
        assert!((0.199..0.27).contains(&low) && (0.53..0.601).contains(&high), "{low} {high}");
    }
}
