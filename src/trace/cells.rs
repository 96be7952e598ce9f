//! The picture laid over the surfaces that it shows: which pixels see the point where a photon landed.
//!
//! Rays through the corners of a pixel meet a surface in a quadrilateral, two triangles, that together with those of its neighbours covers
//! what the picture shows. A photon that lands in a triangle counts for its pixel, divided by the triangle's area: the pixel's value is the
//! mean irradiance over what it sees. There is no search radius and no kernel, and so no blur beyond the pixel and no bias beyond the
//! flatness of the triangles; points that the water shows more than once lie in more than one triangle.
//!
//! Where the corners of a pixel meet different surfaces, it is cut in four, down to an eighth of its width, and the parts that are whole
//! stand for it.

use glam::Vec3;
use rayon::prelude::*;

use super::eye::{Eye, Seen};

/// Most halvings of a pixel that shows an edge.
const MAX_CUTS: u32 = 3;

/// Least share of a pixel that must be whole.
const LEAST_SHARE: f32 = 0.2;

/// How far the corners of a whole piece may be off the plane of its middle, as a share of their distance from it.
const FLATNESS: f32 = 0.2;

/// Sizes of triangles are told apart by powers of two, of which there are this many.
const LEVELS: i32 = 64;

/// A triangle of a pixel's footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    corners: [Vec3; 3],
    /// Unit normal on the side that is seen; corners are counter-clockwise about it.
    normal: Vec3,
    pixel: u32,
    /// Share of the pixel over area, 1/m².
    weight: f32,
}

/// Footprints of all pixels of a picture, and an index of them by place.
pub(super) struct Cells {
    /// Size of the picture.
    pub columns: u32,
    /// Size of the picture.
    pub rows: u32,
    /// Whether a pixel shows a surface on which light can land.
    pub valid: Vec<bool>,
    /// What the middle of each pixel shows.
    pub seen: Vec<Option<Seen>>,
    /// Area of each pixel's footprint, m²; 0 where it is not valid.
    pub areas: Vec<f64>,
    cells: Vec<Cell>,
    levels: Vec<Level>,
    /// Where each bucket of `entries` starts; a power of two of buckets, and the end.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

/// Boxes of one size.
#[derive(Clone, Copy, Debug)]
struct Level {
    exponent: i32,
    inverse: f32,
}

/// Points that someone else's picture shows: what a technique drew, to be judged where it drew it.
#[derive(Clone, Debug)]
pub struct Points {
    /// Size of the picture.
    pub columns: u32,
    /// Size of the picture.
    pub rows: u32,
    /// World-space position of each pixel's surface point, m; `None` where there is none.
    pub positions: Vec<Option<Vec3>>,
    /// Unit normals of the same points.
    pub normals: Vec<Vec3>,
}

impl Cells {
    /// The footprints of the camera's own pixels.
    pub fn of_camera(eye: &Eye<'_>, columns: u32, rows: u32) -> Self {
        let rows_of_cells: Vec<Vec<Pixel>> = (0..rows)
            .into_par_iter()
            .map(|row| {
                let mut corners = Corners::new(eye, columns, row);
                (0..columns).map(|column| corners.pixel(column)).collect()
            })
            .collect();
        Self::new(columns, rows, rows_of_cells.into_iter().flatten().collect())
    }

    /// The footprints of pixels whose middles lie at the points given: their corners are the means of four neighbours. Pixels at the
    /// border, and next to another surface, have none.
    pub fn of_points(points: &Points) -> Self {
        let (columns, rows) = (points.columns as usize, points.rows as usize);
        let pixel = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let mut pixel = Pixel::default();
            let Some(center) = points.positions[index] else { return pixel };
            let normal = points.normals[index].normalize_or_zero();
            pixel.seen = Some(Seen { position: center, normal, object: 0, diffuse: true });
            if column == 0 || row == 0 || column + 1 == columns || row + 1 == rows {
                return pixel;
            }
            let mut around = [[center; 3]; 3];
            for (dy, line) in around.iter_mut().enumerate() {
                for (dx, place) in line.iter_mut().enumerate() {
                    let neighbour = (row + dy - 1) * columns + column + dx - 1;
                    let Some(p) = points.positions[neighbour] else { return pixel };
                    if points.normals[neighbour].dot(normal) < 0.8 {
                        return pixel;
                    }
                    *place = p;
                }
            }
            let mean = |x: usize, y: usize| (around[y][x] + around[y][x + 1] + around[y + 1][x] + around[y + 1][x + 1]) * 0.25;
            let quad = [mean(0, 0), mean(1, 0), mean(1, 1), mean(0, 1)];
            if flat(&quad, center, normal) {
                pixel.whole(&quad, normal, 1.0);
            }
            pixel
        };
        Self::new(points.columns, points.rows, (0..columns * rows).into_par_iter().with_min_len(1024).map(pixel).collect())
    }

    fn new(columns: u32, rows: u32, pixels: Vec<Pixel>) -> Self {
        let mut cells = Vec::new();
        let mut valid = Vec::with_capacity(pixels.len());
        let mut areas = Vec::with_capacity(pixels.len());
        for (number, pixel) in pixels.iter().enumerate() {
            let share: f32 = pixel.parts.iter().map(|part| part.share).sum();
            valid.push(share >= LEAST_SHARE);
            let mut area = 0.0;
            if share >= LEAST_SHARE {
                for part in &pixel.parts {
                    area += f64::from(part.area);
                    let weight = part.share / share / part.area;
                    cells.push(Cell { corners: part.corners, normal: part.normal, pixel: number as u32, weight });
                }
            }
            areas.push(area);
        }
        let seen = pixels.into_iter().map(|pixel| pixel.seen).collect();
        let mut made = Self { columns, rows, valid, seen, areas, cells, levels: Vec::new(), starts: vec![0, 0], entries: Vec::new() };
        made.index();
        made
    }

    /// Sorts the triangles into boxes about as large as they are.
    fn index(&mut self) {
        let mut used = [false; LEVELS as usize];
        let exponents: Vec<i32> = self
            .cells
            .iter()
            .map(|cell| {
                let [a, b, c] = cell.corners;
                let size = a.distance(b).max(b.distance(c)).max(c.distance(a)).max(1.0e-6);
                let exponent = libm::ilogbf(size) + 1;
                used[(exponent + LEVELS / 2).clamp(0, LEVELS - 1) as usize] = true;
                exponent
            })
            .collect();
        self.levels = (0..LEVELS)
            .filter(|&k| used[k as usize])
            .map(|k| Level { exponent: k - LEVELS / 2, inverse: libm::ldexpf(1.0, LEVELS / 2 - k) })
            .collect();
        let buckets = (self.cells.len() * 4).next_power_of_two();
        let mut counts = vec![0_u32; buckets + 1];
        let boxes = |cell: &Cell, exponent: i32, visit: &mut dyn FnMut(usize)| {
            let inverse = libm::ldexpf(1.0, -exponent);
            // Light lands a rounding error off the triangle.
            let slack = 1.0e-3 / inverse;
            let low = ((cell.corners[0].min(cell.corners[1]).min(cell.corners[2]) - slack) * inverse).floor().as_ivec3();
            let high = ((cell.corners[0].max(cell.corners[1]).max(cell.corners[2]) + slack) * inverse).floor().as_ivec3();
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    for x in low.x..=high.x {
                        visit(bucket(exponent, [x, y, z], buckets));
                    }
                }
            }
        };
        for (cell, &exponent) in self.cells.iter().zip(&exponents) {
            boxes(cell, exponent, &mut |bucket| counts[bucket + 1] += 1);
        }
        for k in 1..counts.len() {
            counts[k] += counts[k - 1];
        }
        let mut entries = vec![0_u32; counts[buckets] as usize];
        let mut next = counts.clone();
        for (number, (cell, &exponent)) in self.cells.iter().zip(&exponents).enumerate() {
            boxes(cell, exponent, &mut |bucket| {
                entries[next[bucket] as usize] = number as u32;
                next[bucket] += 1;
            });
        }
        (self.starts, self.entries) = (counts, entries);
    }

    /// Calls `visit` with pixel and weight for every triangle around a point that light reaches along `direction` and whose surface has
    /// this normal. A weight is a share of the pixel over an area, 1/m².
    pub fn find(&self, p: Vec3, direction: Vec3, normal: Vec3, mut visit: impl FnMut(u32, f32)) {
        let buckets = self.starts.len() - 1;
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        for level in &self.levels {
            let at = (p * level.inverse).floor().as_ivec3();
            let bucket = bucket(level.exponent, at.to_array(), buckets);
            let mut last = u32::MAX;
            for &number in &self.entries[self.starts[bucket] as usize..self.starts[bucket + 1] as usize] {
                // Two boxes of one triangle may share a bucket.
                if number == last {
                    continue;
                }
                last = number;
                let cell = &self.cells[number as usize];
                if cell.normal.dot(normal) > 0.5 && cell.holds(p) {
                    visit(cell.pixel, cell.weight);
                }
            }
        }
    }
}

/// The bucket of a box.
fn bucket(exponent: i32, at: [i32; 3], buckets: usize) -> usize {
    let [x, y, z] = at.map(|c| c as u32);
    let mixed = x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ z.wrapping_mul(0xcb1a_b31f) ^ (exponent as u32).wrapping_mul(0x9e37_79b9);
    (mixed ^ mixed >> 15) as usize & (buckets - 1)
}

impl Cell {
    /// Whether a point, near the plane of the triangle, is over it.
    fn holds(&self, p: Vec3) -> bool {
        let [a, b, c] = self.corners;
        let size = (b - a).abs().max_element().max((c - a).abs().max_element());
        let inside = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(self.normal) >= 0.0;
        (p - a).dot(self.normal).abs() <= 0.5 * size && inside(a, b) && inside(b, c) && inside(c, a)
    }
}

/// Whether corners lie near the plane through a middle, around it.
fn flat(quad: &[Vec3; 4], center: Vec3, normal: Vec3) -> bool {
    let far = quad.iter().fold(0.0_f32, |most, q| most.max(q.distance(center)));
    let near = quad.iter().fold(f32::INFINITY, |least, q| least.min(q.distance(center)));
    near * 8.0 > far && quad.iter().all(|q| (*q - center).dot(normal).abs() <= FLATNESS * far)
}

/// What belongs to one pixel.
#[derive(Clone, Default)]
struct Pixel {
    seen: Option<Seen>,
    parts: Vec<Part>,
}

#[derive(Clone, Copy)]
struct Part {
    corners: [Vec3; 3],
    normal: Vec3,
    area: f32,
    share: f32,
}

impl Pixel {
    /// Adds both triangles of a piece whose corners run around it.
    fn whole(&mut self, quad: &[Vec3; 4], seen_side: Vec3, share: f32) {
        for [a, b, c] in [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] {
            let cross = (b - a).cross(c - a);
            let double = cross.length();
            let longest = (b - a).length_squared().max((c - a).length_squared());
            // Where the water folds the view, a triangle has no area to speak of.
            if double <= 1.0e-4 * longest {
                continue;
            }
            let normal = cross / double;
            let turned = normal.dot(seen_side) < 0.0;
            let corners = if turned { [a, c, b] } else { [a, b, c] };
            self.parts.push(Part { corners, normal: if turned { -normal } else { normal }, area: 0.5 * double, share: share * 0.5 });
        }
    }
}

/// Rays through the corners of a row of pixels, each shared by two of them.
struct Corners<'a> {
    eye: &'a Eye<'a>,
    row: u32,
    above: Vec<Option<Seen>>,
    below: Vec<Option<Seen>>,
}

impl<'a> Corners<'a> {
    fn new(eye: &'a Eye<'a>, columns: u32, row: u32) -> Self {
        let line = |y: u32| (0..=columns).map(|x| eye.look(f64::from(x), f64::from(y), |_| {})).collect();
        Self { eye, row, above: line(row), below: line(row + 1) }
    }

    fn pixel(&mut self, column: u32) -> Pixel {
        let k = column as usize;
        let mut pixel = Pixel::default();
        let (x, y) = (f64::from(column), f64::from(self.row));
        let middle = self.eye.look(x + 0.5, y + 0.5, |_| {});
        pixel.seen = middle;
        let corners = [self.above[k], self.above[k + 1], self.below[k + 1], self.below[k]];
        self.piece(&mut pixel, (x, y, 1.0), corners, middle, 0);
        pixel
    }

    /// Adds a square piece if all its rays meet one surface, else its quarters.
    fn piece(&self, pixel: &mut Pixel, (x, y, width): (f64, f64, f64), corners: [Option<Seen>; 4], middle: Option<Seen>, cuts: u32) {
        if corners.iter().all(Option::is_none) && middle.is_none() {
            return;
        }
        if let (Some(middle), [Some(a), Some(b), Some(c), Some(d)]) = (middle, corners) {
            let all = [a, b, c, d];
            if all.iter().all(|s| !s.diffuse) && !middle.diffuse {
                return;
            }
            let one = all.iter().all(|s| s.object == middle.object && s.diffuse && s.normal.dot(middle.normal) > 0.7);
            let quad = all.map(|s| s.position);
            if one && flat(&quad, middle.position, middle.normal) {
                pixel.whole(&quad, middle.normal, (width * width) as f32);
                return;
            }
        }
        if cuts == MAX_CUTS {
            return;
        }
        let half = width * 0.5;
        let look = |dx: f64, dy: f64| self.eye.look(x + dx * width, y + dy * width, |_| {});
        let (top, right, bottom, left) = (look(0.5, 0.0), look(1.0, 0.5), look(0.5, 1.0), look(0.0, 0.5));
        let [a, b, c, d] = corners;
        let quarters = [
            ((x, y), [a, top, middle, left]),
            ((x + half, y), [top, b, right, middle]),
            ((x + half, y + half), [middle, right, c, bottom]),
            ((x, y + half), [left, middle, bottom, d]),
        ];
        for ((x, y), corners) in quarters {
            let middle = self.eye.look(x + 0.5 * half, y + 0.5 * half, |_| {});
            self.piece(pixel, (x, y, half), corners, middle, cuts + 1);
        }
    }
}
