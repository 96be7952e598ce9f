//! Generators of primitives: random ones, and those that are difficult for rasterizers.
//!
//! Positions are made in pixels and converted to clip space last. All numbers are functions of (seed, case, drawing).

use super::program::Vertex;
use nephroid_math::rng::{rng, unit_from_bits};

/// Random numbers for one drawing.
#[derive(Clone, Debug)]
pub struct RandomNumbers {
    seed: u32,
    stream: u32,
    index: u32,
}

impl RandomNumbers {
    /// The random numbers of a drawing of a case.
    #[must_use]
    pub fn new(seed: u32, drawing: u32) -> Self {
        Self { seed, stream: drawing, index: 0 }
    }
    fn word(&mut self) -> u32 {
        self.index += 1;
        rng(self.seed, self.stream, self.index)
    }
    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        unit_from_bits(self.word())
    }
    /// Uniform in `low..high`.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + self.unit() * (high - low)
    }
    /// A whole number in `0..count`; `count` is at least 1.
    pub fn whole(&mut self, count: u32) -> u32 {
        (self.word() >> 8) % count
    }
    /// An element of a list that is not empty.
    pub fn choice<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.whole(list.len() as u32) as usize]
    }
}

/// Shape of triangles inside the frustum; positions in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Corners anywhere.
    Uniform,
    /// Corners in a square of this edge.
    Small(f32),
    /// Two corners anywhere, the third within half a pixel of the line through them.
    Sliver,
    /// Corners on multiples of half a pixel, so that edges pass through centres.
    HalfPixelGrid,
    /// Corners at odd multiples of 1/512 pixel: ties of 8 sub-pixel bits.
    Ties512,
    /// Corners at odd multiples of 1/32 pixel: ties of 4 sub-pixel bits.
    Ties32,
    /// Corners on multiples of 1/16 pixel, which 4 and 8 sub-pixel bits have in common.
    Grid16,
    /// Legs along rows and columns, corners at pixel centres.
    AxisAligned,
    /// Eight triangles around a point, each sharing an edge with the next.
    Fan,
}

/// Corners of triangles of a shape, in pixels: one triangle, or the eight of a fan.
pub fn corners(shape: Shape, source: &mut RandomNumbers, size: (u32, u32)) -> Vec<[[f32; 2]; 3]> {
    let (width, height) = (size.0 as f32, size.1 as f32);
    let anywhere = |s: &mut RandomNumbers| [s.unit() * width, s.unit() * height];
    let grid = |s: &mut RandomNumbers, steps: f32, offset: f32| anywhere(s).map(|v| ((v * steps).floor() + offset) / steps);
    let three = |s: &mut RandomNumbers, f: &dyn Fn(&mut RandomNumbers) -> [f32; 2]| vec![[f(s), f(s), f(s)]];
    match shape {
        Shape::Uniform => three(source, &anywhere),
        Shape::HalfPixelGrid => three(source, &|s| grid(s, 2.0, 0.0)),
        Shape::Grid16 => three(source, &|s| grid(s, 16.0, 0.0)),
        Shape::Ties512 => three(source, &|s| grid(s, 256.0, 0.5)),
        Shape::Ties32 => three(source, &|s| grid(s, 16.0, 0.5)),
        Shape::Small(edge) => {
            let at = [source.unit() * (width - edge), source.unit() * (height - edge)];
            three(source, &|s| at.map(|v| v + s.unit() * edge))
        }
        Shape::Sliver => {
            let (a, b) = (anywhere(source), anywhere(source));
            let along = source.unit();
            let off = source.between(-0.5, 0.5);
            let c = [0, 1].map(|k| a[k] + along * (b[k] - a[k]));
            // Beside the longer side, and inside the target.
            let c = if (b[0] - a[0]).abs() > (b[1] - a[1]).abs() {
                [c[0], (c[1] + off).clamp(0.0, height)]
            } else {
                [(c[0] + off).clamp(0.0, width), c[1]]
            };
            vec![[a, b, c]]
        }
        Shape::AxisAligned => {
            let centre = |s: &mut RandomNumbers| anywhere(s).map(|v| v.floor() + 0.5);
            let (a, b) = (centre(source), centre(source));
            vec![if source.unit() < 0.5 { [a, b, [a[0], b[1]]] } else { [a, [b[0], a[1]], b] }]
        }
        Shape::Fan => {
            let hub = anywhere(source);
            let reach = source.between(1.0, height.min(width) * 0.5);
            let ring: [[f32; 2]; 8] = std::array::from_fn(|k| {
                let angle = (k as f32 + source.unit()) * (std::f32::consts::TAU / 8.0);
                let [x, y] = [hub[0] + reach * libm::cosf(angle), hub[1] + reach * libm::sinf(angle)];
                [x.clamp(0.0, width), y.clamp(0.0, height)]
            });
            (0..8).map(|k| [hub, ring[k], ring[(k + 1) % 8]]).collect()
        }
    }
}

/// Position of triangles relative to the planes of the frustum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// Corners within this many half-widths of the frustum's centre, at w = 1.
    Sides(f32),
    /// Depth from before the near plane to behind the far plane.
    NearAndFar,
    /// A perspective camera with corners before and behind the eye.
    BehindTheEye,
}

/// Clip positions of a triangle that crosses planes of the frustum.
pub fn crossing(kind: Crossing, source: &mut RandomNumbers) -> [[f32; 4]; 3] {
    std::array::from_fn(|_| match kind {
        Crossing::Sides(reach) => {
            let xy = [source.between(-reach, reach), source.between(-reach, reach)];
            [xy[0], xy[1], source.unit(), 1.0]
        }
        Crossing::NearAndFar => {
            let xy = [source.between(-1.0, 1.0), source.between(-1.0, 1.0)];
            [xy[0], xy[1], source.between(-0.5, 1.5), 1.0]
        }
        Crossing::BehindTheEye => {
            let w = source.between(-1.0, 4.0);
            let (near, far) = (0.1, 100.0);
            [source.between(-3.0, 3.0), source.between(-3.0, 3.0), (w - near) * (far / (far - near)), w]
        }
    })
}

/// The clip-space position of a point in pixels with depth.
#[must_use]
pub fn to_clip(size: (u32, u32), [x, y]: [f32; 2], depth: f32, w: f32) -> [f32; 4] {
    let ndc = [x * 2.0 / size.0 as f32 - 1.0, 1.0 - y * 2.0 / size.1 as f32];
    [ndc[0] * w, ndc[1] * w, depth * w, w]
}

/// A random w from e⁻³ to e⁵.
pub fn any_w(source: &mut RandomNumbers) -> f32 {
    libm::expf(source.between(-3.0, 5.0))
}

/// Greatest weight of a primitive: sums of [`MOST_ADDED`] such weights are exact in f32.
pub const GREATEST_WEIGHT: u32 = 8192;
/// Largest number of primitives in a drawing that adds weights.
pub const MOST_ADDED: u32 = 2000;

/// Appends a primitive whose colour is a random weight from 1 to [`GREATEST_WEIGHT`].
pub fn push_weighted(vertices: &mut Vec<Vertex>, source: &mut RandomNumbers, positions: &[[f32; 4]]) {
    let weight = (source.whole(GREATEST_WEIGHT) + 1) as f32;
    push_flat(vertices, positions, [weight, 0.0, 0.0, 0.0]);
}

/// Appends a primitive of one colour.
pub fn push_flat(vertices: &mut Vec<Vertex>, positions: &[[f32; 4]], color: [f32; 4]) {
    vertices.extend(positions.iter().map(|&position| Vertex { position, color }));
}
