//! The footprints of pixels on the surfaces that they show: finds the pixels that see the point where a photon landed.
//!
//! Rays through the corners of a pixel meet a surface in a quadrilateral of two triangles. With those of its neighbours, it covers the visible part
//! of the surface. A photon that lands in a triangle counts for the triangle's pixel, divided by the triangle's area: the pixel's value is the mean
//! irradiance over its footprint. There is no search radius and no kernel, so there is no blur beyond the pixel and no bias except from the flatness
//! of the triangles. Points that the water shows more than once lie in more than one triangle.
//!
//! If the corners of a pixel meet different surfaces, the pixel is cut into quarters, down to an eighth of its width. The parts whose corners meet
//! one surface stand for the pixel.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb as Bounds;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::eye::{Eye, Seen};
use super::tree::NONE;

/// Most subdivisions of a pixel at an edge.
const MAX_CUTS: u32 = 3;

/// Least share of a pixel that such parts must cover.
const LEAST_SHARE: f32 = 0.2;

/// Largest distance of the corners of a piece from the plane of its middle, as a share of their distance from the middle.
const FLATNESS: f32 = 0.2;

/// Most pieces in a leaf of the hierarchy.
const LEAF: u32 = 4;

/// A piece of a pixel's footprint: two triangles that share a diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cell {
    /// The corner from which offsets are measured; both triangles have it.
    corner: Vec3,
    triangles: [Half; 2],
    pixel: u32,
    /// Largest distance from the plane at which light counts as landing on the piece, m.
    thickness: f32,
}

/// A triangle of a piece.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Half {
    /// Vectors whose dot products with an offset from the corner are the weights of the other two corners.
    along: [Vec3; 2],
    /// Unit normal on the visible side.
    normal: Vec3,
    /// Share of the pixel over the triangle's area, 1/m²; 0 for a degenerate triangle.
    weight: f32,
}

/// Footprints of all pixels of a picture, indexed by position.
pub(super) struct Cells {
    /// Width of the picture, pixels.
    pub columns: u32,
    /// Height of the picture, pixels.
    pub rows: u32,
    /// Whether a pixel shows a diffuse surface, on which light can land.
    pub valid: Vec<bool>,
    /// The point that the middle of each pixel shows.
    pub seen: Vec<Option<Seen>>,
    /// Area of each pixel's footprint, m²; 0 for pixels that are not valid.
    pub areas: Vec<f64>,
    /// Pieces in the order of the hierarchy.
    cells: Vec<Cell>,
    bvh: Bvh2,
}

/// Points that another picture shows: the tracer measures at the points that a technique has drawn.
#[derive(Clone, Debug)]
pub struct Points {
    /// Width of the picture, pixels.
    pub columns: u32,
    /// Height of the picture, pixels.
    pub rows: u32,
    /// World-space position of the surface point of each pixel, m; `None` for a pixel without one.
    pub positions: Vec<Option<Vec3>>,
    /// Unit normals of the same points.
    pub normals: Vec<Vec3>,
}

impl Cells {
    /// Footprints of the camera's own pixels.
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

    /// Footprints of pixels whose middles are the given points. A corner is the mean of the four points around it. Pixels at the border, and next to
    /// another surface, have no footprint.
    pub fn of_points(points: &Points) -> Self {
        let (columns, rows) = (points.columns as usize, points.rows as usize);
        let pixel = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let mut pixel = Pixel::default();
            let Some(center) = points.positions[index] else { return pixel };
            let normal = points.normals[index].normalize_or_zero();
            pixel.seen = Some(Seen { position: center, normal, object: 0, triangle: NONE, diffuse: true });
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
        let (mut cells, mut boxes) = (Vec::new(), Vec::new());
        let mut valid = Vec::with_capacity(pixels.len());
        let mut areas = Vec::with_capacity(pixels.len());
        for (number, pixel) in pixels.iter().enumerate() {
            let share = pixel.share();
            valid.push(share >= LEAST_SHARE);
            let mut area = 0.0;
            if share >= LEAST_SHARE {
                for part in &pixel.parts {
                    area += f64::from(part.areas[0]) + f64::from(part.areas[1]);
                    boxes.push(part.bounds());
                    cells.push(part.cell(number as u32, share));
                }
            }
            areas.push(area);
        }
        let indices = (0..boxes.len() as u32).collect();
        let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::VeryLow, &boxes, indices, SortPrecision::U64, 0);
        collapse(&mut bvh, LEAF, 1.0);
        let cells = bvh.primitive_indices.iter().map(|&index| cells[index as usize]).collect();
        let seen = pixels.into_iter().map(|pixel| pixel.seen).collect();
        Self { columns, rows, valid, seen, areas, cells, bvh }
    }

    /// Calls `visit` with pixel and weight for every triangle around point `p` on a surface with normal `normal`, if light along `direction` reaches
    /// the triangle's visible side. A weight is a share of the pixel over an area, 1/m².
    pub fn find(&self, p: Vec3, direction: Vec3, normal: Vec3, mut visit: impl FnMut(u32, f32)) {
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        self.bvh.point_traverse(Vec3A::from(p), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            for cell in &self.cells[node.first_index as usize..(node.first_index + node.prim_count) as usize] {
                let offset = p - cell.corner;
                for half in &cell.triangles {
                    if half.weight > 0.0 && half.holds(offset, cell.thickness) && half.normal.dot(normal) > 0.5 {
                        visit(cell.pixel, half.weight);
                    }
                }
            }
            true
        });
    }
}

impl Half {
    /// Whether a point, given from the shared corner, is above or below the triangle and near its plane.
    #[inline]
    fn holds(&self, offset: Vec3, thickness: f32) -> bool {
        let (u, v) = (offset.dot(self.along[0]), offset.dot(self.along[1]));
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && offset.dot(self.normal).abs() <= thickness
    }
}

/// Whether corners lie near the plane through `center`, and around it.
fn flat(quad: &[Vec3; 4], center: Vec3, normal: Vec3) -> bool {
    let far = quad.iter().fold(0.0_f32, |most, q| most.max(q.distance(center)));
    let near = quad.iter().fold(f32::INFINITY, |least, q| least.min(q.distance(center)));
    near * 8.0 > far && quad.iter().all(|q| (*q - center).dot(normal).abs() <= FLATNESS * far)
}

/// The pieces of one pixel.
#[derive(Clone, Default)]
struct Pixel {
    seen: Option<Seen>,
    parts: Vec<Part>,
}

/// A piece, as a quadrilateral with triangles (0, 1, 2) and (0, 2, 3).
#[derive(Clone, Copy)]
struct Part {
    corners: [Vec3; 4],
    normals: [Vec3; 2],
    areas: [f32; 2],
    /// Share of the pixel that each triangle covers.
    half: f32,
}

impl Part {
    /// Largest distance from the plane at which light counts: curved surfaces bulge between the corners.
    fn thickness(&self) -> f32 {
        let [a, _, c, _] = self.corners;
        FLATNESS * a.distance(c).max(self.corners[1].distance(self.corners[3]))
    }

    /// Bounds of all points that count as landing on the piece.
    fn bounds(&self) -> Bounds {
        let corners = self.corners.map(Vec3A::from);
        let (min, max) = corners.iter().fold((corners[0], corners[0]), |(min, max), &c| (min.min(c), max.max(c)));
        let normal = Vec3A::from(self.normals[0].abs().max(self.normals[1].abs()));
        let slack = normal * self.thickness() + max.abs().max(min.abs()) * 1.0e-6;
        Bounds::new(min - slack, max + slack)
    }

    /// The piece in the form for queries, for a pixel of which the share `share` is covered in all.
    fn cell(&self, pixel: u32, share: f32) -> Cell {
        let triangles = [0, 1].map(|k| {
            let (normal, area) = (self.normals[k], self.areas[k]);
            if area <= 0.0 {
                return Half::default();
            }
            let (b, c) = (self.corners[k + 1] - self.corners[0], self.corners[k + 2] - self.corners[0]);
            let scale = 1.0 / (2.0 * area);
            Half { along: [c.cross(normal) * scale, normal.cross(b) * scale], normal, weight: self.half / share / area }
        });
        Cell { corner: self.corners[0], triangles, pixel, thickness: self.thickness() }
    }
}

impl Pixel {
    /// Adds a piece with corners in order around it, seen from `seen_side`.
    fn whole(&mut self, quad: &[Vec3; 4], seen_side: Vec3, share: f32) {
        let turned = (quad[2] - quad[0]).cross(quad[3] - quad[1]).dot(seen_side) < 0.0;
        let corners = if turned { [quad[0], quad[3], quad[2], quad[1]] } else { *quad };
        let mut part = Part { corners, normals: [Vec3::ZERO; 2], areas: [0.0; 2], half: 0.5 * share };
        for triangle in 0..2 {
            let [a, b, c] = [0, triangle + 1, triangle + 2].map(|k| corners[k]);
            let cross = (b - a).cross(c - a);
            let double = cross.length();
            let longest = (b - a).length_squared().max((c - a).length_squared());
            // Where the water folds the view, triangles may be degenerate or upside down.
            if double > 1.0e-4 * longest && cross.dot(seen_side) > 0.0 {
                part.normals[triangle] = cross / double;
                part.areas[triangle] = 0.5 * double;
            }
        }
        if part.areas != [0.0; 2] {
            self.parts.push(part);
        }
    }

    /// Share of the pixel that is covered.
    fn share(&self) -> f32 {
        self.parts.iter().map(|part| part.areas.map(|area| if area > 0.0 { part.half } else { 0.0 })).map(|[a, b]| a + b).sum()
    }
}

/// Rays through the corners of a row of pixels. Neighbouring pixels share them.
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

    /// Adds a square piece if all its rays meet one surface; otherwise adds its quarters.
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
