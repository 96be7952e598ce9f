//! The drawings of the cases: their primitives, state and targets.

use super::drawing::Drawing;
use super::primitives::{Crossing, MOST_ADDED, RandomNumbers, Shape, any_w, corners, crossing, push_flat, push_weighted, to_clip};
use super::program::Vertex;
use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::{
    ADDITIVE, BlendComponent, BlendFactor, BlendOperation, BlendState, Color, CompareFunction, DepthBiasState, DepthStencilState,
    PrimitiveTopology, StencilFaceState, StencilOperation, StencilState, TextureFormat,
};
use nephroid_pipeline::{ChannelKind, FORMATS, format_info};

/// Target sizes, used in turn: a power of two, one that is not, and a screen.
const SIZES: [(u32, u32); 5] = [(64, 64), (100, 60), (64, 64), (100, 60), (1024, 768)];
/// Triangles of a drawing in which each may cover much of a screen.
const ON_A_SCREEN: u32 = 250;

fn size_of(index: u32) -> (u32, u32) {
    SIZES[index as usize % SIZES.len()]
}

/// Whether the triangles of a drawing have w = 1; all others have a random w. Both occur at every target size.
fn is_at_one(index: u32) -> bool {
    (index as usize / SIZES.len()).is_multiple_of(2)
}

/// Triangles of a shape in clip space, listed one after the other.
fn triangles(shape: Shape, source: &mut RandomNumbers, index: u32, count: u32) -> Vec<[[f32; 4]; 3]> {
    let size = size_of(index);
    let mut list = Vec::new();
    while list.len() < count as usize {
        for triangle in corners(shape, source, size) {
            // Two triangles of a fan share corners. A shared corner must have the same w in both, so that the shared edge has the same bits.
            let shared = if is_at_one(index) { 1.0 } else { any_w(source) };
            let own = !is_at_one(index) && shape != Shape::Fan;
            list.push(triangle.map(|at| {
                let w = if own {
                    any_w(source)
                } else if shape == Shape::Fan && !is_at_one(index) {
                    1.0 + at[0] * 0.125
                } else {
                    shared
                };
                to_clip(size, at, source.unit(), w)
            }));
        }
    }
    list.truncate(count as usize);
    list
}

fn count_of(shape: Shape, index: u32) -> u32 {
    match shape {
        Shape::Small(_) | Shape::Sliver => MOST_ADDED,
        _ if size_of(index).0 > 512 => ON_A_SCREEN,
        _ => MOST_ADDED,
    }
}

/// Coverage: every triangle adds a weight of its own.
pub(super) fn coverage(shape: Shape, source: &mut RandomNumbers, index: u32) -> Drawing {
    let list = triangles(shape, source, index, count_of(shape, index));
    weighted(size_of(index), source, &list)
}

fn weighted(size: (u32, u32), source: &mut RandomNumbers, list: &[[[f32; 4]; 3]]) -> Drawing {
    let mut vertices = Vec::with_capacity(list.len() * 3);
    for triangle in list {
        push_weighted(&mut vertices, source, triangle);
    }
    Drawing::adding(size, vertices)
}

/// Coverage of clipped triangles.
pub(super) fn clipping(kind: Crossing, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = size_of(index);
    let count = if size.0 > 512 { ON_A_SCREEN / 2 } else { MOST_ADDED };
    let list: Vec<_> = (0..count).map(|_| crossing(kind, source)).collect();
    weighted(size, source, &list)
}

/// A depth test with `Less` that writes depth.
fn less(format: TextureFormat) -> DepthStencilState {
    DepthStencilState {
        format,
        depth_write_enabled: Some(true),
        depth_compare: Some(CompareFunction::Less),
        stencil: StencilState::default(),
        bias: DepthBiasState::default(),
    }
}

/// Triangles for drawings of depth: of all sizes inside the frustum, or crossing its sides, near and far plane.
fn depth_triangles(source: &mut RandomNumbers, index: u32) -> Vec<[[f32; 4]; 3]> {
    let count = if size_of(index).0 > 512 { ON_A_SCREEN } else { 1000 };
    let shape = [Shape::Uniform, Shape::Small(8.0), Shape::Sliver, Shape::Small(32.0)][index as usize / SIZES.len() % 4];
    let mut list = triangles(shape, source, index, count / 2);
    let kind = [Crossing::Sides(1.9), Crossing::NearAndFar, Crossing::BehindTheEye][index as usize % 3];
    list.extend((0..count / 2).map(|_| crossing(kind, source)));
    list
}

/// The nearest triangle wins; a triangle's number is its colour.
pub(super) fn depth(format: TextureFormat, source: &mut RandomNumbers, index: u32) -> Drawing {
    let list = depth_triangles(source, index);
    let drawing = weighted(size_of(index), source, &list);
    Drawing { depth_stencil: Some(less(format)), color: Some((TextureFormat::R32Float, None)), ..drawing }
}

/// Depth only, with a bias: constant, slope and clamp in turn.
pub(super) fn depth_bias(format: TextureFormat, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = size_of(index);
    // The slope of a sliver is unbounded, and its bias is always clamped.
    let count = if size.0 > 512 { ON_A_SCREEN } else { 1000 };
    let list = triangles([Shape::Uniform, Shape::Small(32.0)][index as usize / 5 % 2], source, index, count);
    let drawing = weighted(size, source, &list);
    let constant = [0, 1, -3, 1000, -70_000, 1 << 20][source.whole(6) as usize];
    let slope_scale = [0.0, 1.0, -0.5, 2.75][source.whole(4) as usize];
    let clamp = [0.0, 0.0, 0.01, -0.003][source.whole(4) as usize];
    let state = DepthStencilState { bias: DepthBiasState { constant, slope_scale, clamp }, ..less(format) };
    Drawing { depth_stencil: Some(state), color: None, ..drawing }
}

const OPERATIONS: [StencilOperation; 8] = [
    StencilOperation::Keep,
    StencilOperation::Zero,
    StencilOperation::Replace,
    StencilOperation::Invert,
    StencilOperation::IncrementClamp,
    StencilOperation::DecrementClamp,
    StencilOperation::IncrementWrap,
    StencilOperation::DecrementWrap,
];
const COMPARISONS: [CompareFunction; 8] = [
    CompareFunction::Never,
    CompareFunction::Less,
    CompareFunction::Equal,
    CompareFunction::LessEqual,
    CompareFunction::Greater,
    CompareFunction::NotEqual,
    CompareFunction::GreaterEqual,
    CompareFunction::Always,
];

fn counting(format: TextureFormat, front: StencilOperation, back: StencilOperation) -> DepthStencilState {
    let face = |pass_op| StencilFaceState { pass_op, ..StencilFaceState::IGNORE };
    let depth = format != TextureFormat::Stencil8;
    DepthStencilState {
        format,
        depth_write_enabled: depth.then_some(false),
        depth_compare: depth.then_some(CompareFunction::Always),
        stencil: StencilState { front: face(front), back: face(back), read_mask: !0, write_mask: !0 },
        bias: DepthBiasState::default(),
    }
}

/// Layers counted past 255 in the stencil: front faces up and back faces down, or both the same way.
pub(super) fn stencil_counts(source: &mut RandomNumbers, index: u32) -> Drawing {
    use StencilOperation::{DecrementClamp, DecrementWrap, IncrementClamp, IncrementWrap, Keep};
    let size = size_of(index);
    let count = if size.0 > 512 { ON_A_SCREEN } else { MOST_ADDED };
    let spread = if index.is_multiple_of(2) { Crossing::Sides(1.3) } else { Crossing::BehindTheEye };
    let list: Vec<_> = (0..count).map(|_| crossing(spread, source)).collect();
    let pairs = [
        (IncrementWrap, IncrementWrap),
        (IncrementWrap, DecrementWrap),
        (IncrementClamp, IncrementClamp),
        (IncrementWrap, Keep),
        (DecrementClamp, IncrementWrap),
        (DecrementWrap, DecrementWrap),
    ];
    let (front, back) = pairs[index as usize % pairs.len()];
    let format = source.choice(&[TextureFormat::Stencil8, TextureFormat::Depth32FloatStencil8]);
    Drawing { depth_stencil: Some(counting(format, front, back)), color: None, ..weighted(size, source, &list) }
}

/// Closed tetrahedra: front faces count up and back faces count down, so the stencil ends unchanged.
pub(super) fn closed_meshes(source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = size_of(index);
    let count = if size.0 > 512 { ON_A_SCREEN } else { MOST_ADDED } / 4;
    let mut list = Vec::new();
    for _ in 0..count {
        let hub = [source.between(-1.2, 1.2), source.between(-1.2, 1.2)];
        let v: [[f32; 4]; 4] = std::array::from_fn(|_| {
            let w = if is_at_one(index) { 1.0 } else { source.between(0.5, 4.0) };
            let xy = hub.map(|h| (h + source.between(-0.6, 0.6)) * w);
            [xy[0], xy[1], source.unit() * w, w]
        });
        list.extend([[v[0], v[1], v[2]], [v[0], v[2], v[3]], [v[0], v[3], v[1]], [v[1], v[3], v[2]]]);
    }
    let state = counting(
        source.choice(&[TextureFormat::Stencil8, TextureFormat::Depth32FloatStencil8]),
        StencilOperation::IncrementWrap,
        StencilOperation::DecrementWrap,
    );
    Drawing { depth_stencil: Some(state), color: None, ..weighted(size, source, &list) }
}

/// Random comparisons, operations and masks, together with a depth test.
pub(super) fn stencil_states(source: &mut RandomNumbers, index: u32) -> Drawing {
    let list = depth_triangles(source, index);
    let face = |s: &mut RandomNumbers| StencilFaceState {
        compare: s.choice(&COMPARISONS),
        fail_op: s.choice(&OPERATIONS),
        depth_fail_op: s.choice(&OPERATIONS),
        pass_op: s.choice(&OPERATIONS),
    };
    let masks = [0xff, 0xff, 0x0f, 0xaa];
    let stencil =
        StencilState { front: face(source), back: face(source), read_mask: source.choice(&masks), write_mask: source.choice(&masks) };
    let state = DepthStencilState {
        depth_compare: Some(source.choice(&COMPARISONS)),
        depth_write_enabled: Some(source.whole(2) == 0),
        stencil,
        ..less(TextureFormat::Depth32FloatStencil8)
    };
    Drawing {
        depth_stencil: Some(state),
        color: None,
        stencil_reference: source.whole(256),
        clear_depth: 0.5,
        ..weighted(size_of(index), source, &list)
    }
}

const FACTORS: [BlendFactor; 13] = [
    BlendFactor::Zero,
    BlendFactor::One,
    BlendFactor::Src,
    BlendFactor::OneMinusSrc,
    BlendFactor::SrcAlpha,
    BlendFactor::OneMinusSrcAlpha,
    BlendFactor::Dst,
    BlendFactor::OneMinusDst,
    BlendFactor::DstAlpha,
    BlendFactor::OneMinusDstAlpha,
    BlendFactor::SrcAlphaSaturated,
    BlendFactor::Constant,
    BlendFactor::OneMinusConstant,
];
const BLENDS: [BlendOperation; 5] =
    [BlendOperation::Add, BlendOperation::Subtract, BlendOperation::ReverseSubtract, BlendOperation::Min, BlendOperation::Max];

/// Whether source and destination have the same blend factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Factors {
    /// They have different factors.
    Two,
    /// They have the same factor.
    One,
}

fn any_blend(factors: Factors, source: &mut RandomNumbers) -> BlendComponent {
    let operation = source.choice(&BLENDS);
    if matches!(operation, BlendOperation::Min | BlendOperation::Max) {
        return BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation };
    }
    let src = source.whole(FACTORS.len() as u32) as usize;
    let dst = match factors {
        Factors::One => src,
        Factors::Two => (src + 1 + source.whole(FACTORS.len() as u32 - 1) as usize) % FACTORS.len(),
    };
    BlendComponent { src_factor: FACTORS[src], dst_factor: FACTORS[dst], operation }
}

/// Values of colour components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Colors {
    /// Quarters from 0 to 1: products of a few of them are exact.
    Quarters,
    /// Any number in −1..2.
    Any,
    /// Multiples of 1/255.
    Bytes,
}

/// Width of a cell in pixels, and number of triangles in it.
const CELL: u32 = 20;
const LAYERS: u32 = 3;

/// Random factors and operations; few layers over each pixel.
pub(super) fn blending(format: TextureFormat, colors: Colors, factors: Factors, source: &mut RandomNumbers, index: u32) -> Drawing {
    let blend = BlendState { color: any_blend(factors, source), alpha: any_blend(factors, source) };
    blended(format, colors, Some(blend), source, index)
}

/// Rounding of a format: no blending, or plain addition.
pub(super) fn rounding(format: TextureFormat, colors: Colors, add: bool, source: &mut RandomNumbers, index: u32) -> Drawing {
    blended(format, colors, add.then_some(ADDITIVE), source, index)
}

fn blended(format: TextureFormat, colors: Colors, blend: Option<BlendState>, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = blending_size(index);
    let number = |s: &mut RandomNumbers| match colors {
        Colors::Quarters => s.whole(5) as f32 * 0.25,
        Colors::Any => s.between(-1.0, 2.0),
        Colors::Bytes => s.whole(256) as f32 / 255.0,
    };
    let color = |s: &mut RandomNumbers| [number(s), number(s), number(s), number(s)];
    let vertices = in_cells(size, source, color);
    let [r, g, b, a] = color(source).map(f64::from);
    Drawing { color: Some((format, blend)), clear: Color { r, g, b, a }, blend_constant: color(source), ..Drawing::adding(size, vertices) }
}

fn blending_size(index: u32) -> (u32, u32) {
    [(64, 64), (100, 60)][index as usize % 2]
}

/// Three triangles per cell, each of one colour: squares of squares stay far from overflow and from subnormal numbers.
fn in_cells(size: (u32, u32), source: &mut RandomNumbers, color: impl Fn(&mut RandomNumbers) -> [f32; 4]) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    let cells = (size.0 / CELL, size.1 / CELL);
    for number in 0..LAYERS * cells.0 * cells.1 {
        let cell = [number % cells.0 * CELL, number / cells.0 % cells.1 * CELL].map(|v| v as f32);
        let shade = color(source);
        let triangle = [0; 3].map(|_| to_clip(size, cell.map(|v| v + source.unit() * CELL as f32), 0.5, 1.0));
        push_flat(&mut vertices, &triangle, shade);
    }
    vertices
}

/// Range of the integers that are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Integers {
    /// Integers that the target can hold.
    InRange,
    /// Any 32-bit integers, written to targets of fewer bits.
    OutOfRange,
}

/// Integer targets of all formats in turn. Colours are bit patterns.
pub(super) fn integers(which: Integers, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = blending_size(index);
    let targets = FORMATS.into_iter().filter_map(|format| Some((format, format_info(format)?.kind)));
    let wide = |kind: ChannelKind| kind.channel_bits(0) == 32;
    let targets: Vec<_> = targets.filter(|(_, kind)| kind.is_integer() && (which == Integers::InRange || !wide(*kind))).collect();
    let (format, kind) = targets[index as usize % targets.len()];
    let number = |s: &mut RandomNumbers, channel: usize| {
        let bits = if which == Integers::InRange { kind.channel_bits(channel) } else { 32 };
        let (low, high) = match kind {
            ChannelKind::Sint(_) => (-1i64 << (bits - 1), (1i64 << (bits - 1)) - 1),
            _ => (0, (1i64 << bits) - 1),
        };
        // Near either end of the range, or anywhere.
        let any = i64::from(s.whole(1 << 16)) << 16 | i64::from(s.whole(1 << 16));
        let number = match s.whole(3) {
            0 => low + any % 4,
            1 => high - any % 4,
            _ => low + any % (high - low + 1),
        };
        f32::from_bits(number as u32)
    };
    let vertices = in_cells(size, source, |s| [number(s, 0), number(s, 1), number(s, 2), number(s, 3)]);
    let clear = Color { r: 3.0, g: 2.0, b: 1.0, a: 0.0 };
    Drawing { color: Some((format, None)), clear, ..Drawing::adding(size, vertices) }
}

/// Well-shaped triangles with attributes in 1..2, one per cell of 32 or 128 pixels.
pub(super) fn interpolated(interpolation: Interpolation, varied: bool, source: &mut RandomNumbers, index: u32) -> Drawing {
    let cell = if index.is_multiple_of(2) { 128.0 } else { 32.0 };
    let size = (512, 512);
    let mut vertices = Vec::new();
    let across = (512.0 / cell) as u32;
    for number in 0..across * across {
        let corner = [(number % across) as f32 * cell, (number / across) as f32 * cell];
        let turn = source.unit() * std::f32::consts::TAU;
        for k in 0..3 {
            let angle = turn + (k as f32 + source.between(-0.15, 0.15)) * (std::f32::consts::TAU / 3.0);
            let reach = cell * source.between(0.35, 0.5);
            let at = [corner[0] + cell * 0.5 + reach * libm::cosf(angle), corner[1] + cell * 0.5 + reach * libm::sinf(angle)];
            let w = if varied { libm::expf(source.between(-1.0, 1.0)) } else { 1.0 };
            let color = [0; 4].map(|_| source.between(1.0, 2.0));
            vertices.push(Vertex { position: to_clip(size, at.map(|v| v.clamp(0.0, 512.0)), 0.5, w), color });
        }
    }
    Drawing { interpolation, color: Some((TextureFormat::Rgba32Float, None)), ..Drawing::adding(size, vertices) }
}

/// Positions of points and of the ends of lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Grid {
    /// Anywhere inside the target.
    Free,
    /// Anywhere up to a tenth of the target's size outside.
    Around,
    /// Multiples of 1/16 pixel.
    Sixteenths,
    /// Odd multiples of 1/512 pixel.
    Ties512,
    /// Pixel centres.
    Centres,
}

fn place(grid: Grid, source: &mut RandomNumbers, size: (u32, u32)) -> [f32; 2] {
    let full = [size.0 as f32, size.1 as f32];
    full.map(|extent| match grid {
        Grid::Free => source.unit() * extent,
        Grid::Around => source.between(-0.1, 1.1) * extent,
        Grid::Sixteenths => (source.unit() * extent * 16.0).floor() / 16.0,
        Grid::Ties512 => ((source.unit() * extent * 256.0).floor() + 0.5) / 256.0,
        Grid::Centres => (source.unit() * extent).floor() + 0.5,
    })
}

/// Points, each with its weight. Points larger than a pixel are squares.
pub(super) fn points(grid: Grid, edge: f32, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = size_of(index);
    let mut vertices = Vec::new();
    for _ in 0..1000 {
        let at = place(grid, source, size);
        push_weighted(&mut vertices, source, &[to_clip(size, at, 0.5, 1.0)]);
    }
    Drawing { topology: PrimitiveTopology::PointList, point_size: edge, ..Drawing::adding(size, vertices) }
}

/// Lines, each with its weight. `aligned`: along rows or columns.
pub(super) fn lines(grid: Grid, aligned: bool, width: f32, source: &mut RandomNumbers, index: u32) -> Drawing {
    let size = size_of(index);
    let mut vertices = Vec::new();
    for _ in 0..500 {
        // Unless lines are meant to be clipped, their rectangles stay inside the target.
        let margin = if grid == Grid::Around { 0.0 } else { (width * 0.5).ceil() + 1.0 };
        let within = (size.0 - 2 * margin as u32, size.1 - 2 * margin as u32);
        let inside = |s: &mut RandomNumbers| place(grid, s, within).map(|v| v + margin);
        let (a, mut b) = (inside(source), inside(source));
        if aligned {
            let along = source.whole(2) as usize;
            b[along] = a[along];
        }
        push_weighted(&mut vertices, source, &[a, b].map(|at| to_clip(size, at, 0.5, 1.0)));
    }
    Drawing { topology: PrimitiveTopology::LineList, line_width: width, ..Drawing::adding(size, vertices) }
}

/// Counts fragments that pass a depth test.
pub(super) fn counted(source: &mut RandomNumbers, index: u32) -> Drawing {
    Drawing { query: true, ..depth(TextureFormat::Depth32Float, source, index) }
}
