//! The table of conformance cases: what each draws, how often, and the expected result of each rasterizer.

use serde::Serialize;

use super::drawing::Drawing;
use super::drawings::{
    Colors, Factors, Grid, Integers, blending, clipping, closed_meshes, counted, coverage, depth, depth_bias, integers, interpolated,
    lines, points, rounding, stencil_counts, stencil_states,
};
use super::primitives::{Crossing, RandomNumbers, Shape};
use crate::Family;
use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::TextureFormat;

/// How close a driver must be to the software GPU under the driver's preset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Expectation {
    /// Identical bits.
    Exact,
    /// Identical bits, except where rounding is free: at most this relative error. The string names the bound.
    Within(f64, &'static str),
    /// Some pixels differ, for the reason given: at most this many per primitive drawn, or [`FEW`] in all.
    Differs(&'static str, f64),
}

/// Number of pixels that may differ in a short run, however few pixels are compared.
pub const FEW: u64 = 5;

/// The kind of primitives that a case draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Triangles.
    Triangles,
    /// Points or sprites.
    Points,
    /// Lines of any width.
    Lines,
}

/// One conformance case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Name: topic and variant.
    pub name: &'static str,
    /// Description in one line.
    pub what: &'static str,
    /// Kind of its primitives.
    pub kind: Kind,
    /// Number of drawings in a full run.
    pub drawings: u32,
    /// Makes the drawing with a given number.
    pub draw: fn(&mut RandomNumbers, u32) -> Drawing,
    /// Expected result of lavapipe.
    pub lavapipe: Expectation,
    /// Expected result of SwiftShader.
    pub swiftshader: Expectation,
}

/// Bound on interpolated attributes of well-shaped triangles of at least 16 pixels, with w within e^±1. Drivers compute planes and the division by w
/// in f32, each in its own order, and may use approximate reciprocals; lavapipe's planes start at the target's origin.
pub const WELL_SHAPED: Expectation = Expectation::Within(2.0e-4, "WELL_SHAPED");

const fn case(name: &'static str, what: &'static str, drawings: u32, draw: fn(&mut RandomNumbers, u32) -> Drawing) -> Case {
    let exact = Expectation::Exact;
    Case { name, what, kind: Kind::Triangles, drawings, draw, lavapipe: exact, swiftshader: exact }
}

impl Case {
    const fn of(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }
    const fn both(self, expectation: Expectation) -> Self {
        Self { lavapipe: expectation, swiftshader: expectation, ..self }
    }

    const fn lavapipe(self, lavapipe: Expectation) -> Self {
        Self { lavapipe, ..self }
    }
    const fn swiftshader(self, swiftshader: Expectation) -> Self {
        Self { swiftshader, ..self }
    }

    /// Expected result of a rasterizer. One that was never measured is expected to follow its rules exactly.
    #[must_use]
    pub fn expected(&self, family: Family) -> Expectation {
        match family {
            Family::Lavapipe => self.lavapipe,
            Family::SwiftShader => self.swiftshader,
            Family::Other => match self.lavapipe {
                Expectation::Differs(..) => Expectation::Exact,
                other => other,
            },
        }
    }

    /// Number of drawings in a run of this share, at least one.
    #[must_use]
    pub fn drawings_of(&self, share: f64) -> u32 {
        ((f64::from(self.drawings) * share).ceil() as u32).clamp(1, self.drawings)
    }

    /// The drawing with this number.
    #[must_use]
    pub fn drawing(&self, seed: u32, index: u32) -> Drawing {
        // The case's name seeds its random numbers, so a case keeps its primitives wherever it stands in the table.
        let named = self.name.bytes().fold(seed ^ 0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
        (self.draw)(&mut RandomNumbers::new(named, index), index)
    }
}

const ONE_FACTOR: Expectation = Expectation::Differs(
    "llvmpipe adds source and destination before it multiplies them by their common factor, in f32; D3D and we multiply first",
    20.0,
);
const BYTES: Expectation =
    Expectation::Differs("llvmpipe blends 8-bit colours in integers and rounds every product to a multiple of 1/255", 8.0);
const CURVE: Expectation =
    Expectation::Differs("drivers approximate the sRGB curve, and are one code off where it is near the middle of two", 8.0);
const TEN_BITS: Expectation =
    Expectation::Differs("llvmpipe rounds 10-bit colours to 16 bits and cuts the lowest 6: up to one step away", 12.0);
const HALF_FIRST: Expectation = Expectation::Differs("SwiftShader rounds to 16-bit floats and cuts the rest of their fraction", 29.0);
const UNDEFINED: Expectation = Expectation::Differs(
    "Vulkan leaves integers that a target cannot hold undefined: SwiftShader cuts some of their bits, Direct3D, llvmpipe and we clamp",
    29.0,
);
const POINT_TIES: Expectation = Expectation::Differs(
    "llvmpipe of Mesa 22.3 moves some points that lie half-way between two sub-pixel positions; Mesa 25 does not",
    0.03,
);
const CLIPPED_CORNER: Expectation = Expectation::Differs(
    "a corner that clipping made lies within rounding of half a sub-pixel step, and SwiftShader snaps it the other way; which of its operations rounds differently is not known",
    1.0e-4,
);
const LINE_CORNERS: Expectation =
    Expectation::Differs("the corners of a line's rectangle are computed in f32, by us in f64: one near a tie snaps the other way", 0.015);
const LINE_CLIPPED: Expectation = Expectation::Differs(
    "SwiftShader clips the rectangle around a line, we clip the segment and leave the rest to the scissor; corners as above",
    2.5,
);
const WIDE: Expectation =
    Expectation::Differs("WebGPU has no wide lines: their corners are rounded once more on the way through clip space", 0.5);

/// All cases.
pub const CASES: &[Case] = &[
    case("coverage: uniform", "corners anywhere in the target", 80, |s, i| coverage(Shape::Uniform, s, i)),
    case("coverage: up to 8 px", "corners in a square of 8 pixels", 80, |s, i| coverage(Shape::Small(8.0), s, i)),
    case("coverage: up to 1.5 px", "corners in a square of 1.5 pixels", 80, |s, i| coverage(Shape::Small(1.5), s, i)),
    case("coverage: slivers", "one corner within half a pixel of the opposite edge", 80, |s, i| coverage(Shape::Sliver, s, i)),
    case("coverage: half-pixel grid", "edges and corners through pixel centres", 80, |s, i| coverage(Shape::HalfPixelGrid, s, i)),
    case("coverage: 1/16 grid", "what 4 and 8 sub-pixel bits have in common", 80, |s, i| coverage(Shape::Grid16, s, i)),
    case("coverage: 1/512 ties", "half-way between 1/256 pixels", 80, |s, i| coverage(Shape::Ties512, s, i)),
    case("coverage: 1/32 ties", "half-way between 1/16 pixels", 80, |s, i| coverage(Shape::Ties32, s, i)),
    case("coverage: axis-aligned", "legs through rows and columns of pixel centres", 80, |s, i| coverage(Shape::AxisAligned, s, i)),
    case("coverage: fans", "eight triangles around a point, edges shared", 80, |s, i| coverage(Shape::Fan, s, i)),
    case("clipping: borders", "corners up to 1.9 half-widths from the centre", 50, |s, i| clipping(Crossing::Sides(1.9), s, i)),
    case("clipping: spread 5", "corners up to 5 half-widths away", 50, |s, i| clipping(Crossing::Sides(5.0), s, i)),
    case("clipping: spread 200", "corners up to 200 half-widths away", 50, |s, i| clipping(Crossing::Sides(200.0), s, i))
        .swiftshader(CLIPPED_CORNER),
    case("clipping: spread 20000", "corners up to 20000 half-widths away", 50, |s, i| clipping(Crossing::Sides(20_000.0), s, i))
        .swiftshader(CLIPPED_CORNER),
    case("clipping: near and far", "depth from -0.5 to 1.5", 50, |s, i| clipping(Crossing::NearAndFar, s, i)),
    case("clipping: behind the eye", "a perspective camera, w from -1 to 4", 50, |s, i| clipping(Crossing::BehindTheEye, s, i)),
    case("depth: depth32float", "less, written; inside and clipped", 120, |s, i| depth(TextureFormat::Depth32Float, s, i)),
    case("depth: depth16unorm", "less, written; inside and clipped", 60, |s, i| depth(TextureFormat::Depth16Unorm, s, i)),
    case("depth: bias, depth32float", "constant, slope and clamp", 80, |s, i| depth_bias(TextureFormat::Depth32Float, s, i)),
    case("depth: bias, depth16unorm", "constant, slope and clamp", 40, |s, i| depth_bias(TextureFormat::Depth16Unorm, s, i)),
    case("stencil: layers past 255", "wrapping and clamping, two-sided, stencil8 and depth32float-stencil8", 50, stencil_counts)
        .swiftshader(CLIPPED_CORNER),
    case("stencil: closed meshes", "tetrahedra, front faces up and back faces down", 50, closed_meshes),
    case("stencil: states", "comparisons, operations and masks at random, with a depth test", 100, stencil_states),
    case("blending: rgba32float, exact", "all factors and operations, quarters", 300, |s, i| {
        blending(TextureFormat::Rgba32Float, Colors::Quarters, Factors::Two, s, i)
    }),
    case("blending: rgba32float, any", "all factors and operations, any numbers", 300, |s, i| {
        blending(TextureFormat::Rgba32Float, Colors::Any, Factors::Two, s, i)
    }),
    case("blending: rgba32float, one factor", "source and destination multiplied by the same factor, any numbers", 300, |s, i| {
        blending(TextureFormat::Rgba32Float, Colors::Any, Factors::One, s, i)
    })
    .lavapipe(ONE_FACTOR),
    case("blending: r32float, sum", "plain addition of any numbers", 300, |s, i| {
        rounding(TextureFormat::R32Float, Colors::Any, true, s, i)
    }),
    case("blending: rgba16float, sum", "plain addition, rounded after every fragment", 300, |s, i| {
        rounding(TextureFormat::Rgba16Float, Colors::Any, true, s, i)
    }),
    case("blending: rgba16float, any", "all factors and operations, any numbers", 300, |s, i| {
        blending(TextureFormat::Rgba16Float, Colors::Any, Factors::Two, s, i)
    }),
    case("blending: rgba8unorm, written", "any numbers, no blending", 300, |s, i| {
        rounding(TextureFormat::Rgba8Unorm, Colors::Any, false, s, i)
    }),
    case("blending: rgba8unorm, sum", "plain addition of multiples of 1/255", 300, |s, i| {
        rounding(TextureFormat::Rgba8Unorm, Colors::Bytes, true, s, i)
    }),
    case("blending: rgba8unorm, any", "all factors and operations, multiples of 1/255", 300, |s, i| {
        blending(TextureFormat::Rgba8Unorm, Colors::Bytes, Factors::Two, s, i)
    })
    .lavapipe(BYTES),
    case("formats: bgra8unorm, written", "any numbers, no blending", 100, |s, i| {
        rounding(TextureFormat::Bgra8Unorm, Colors::Any, false, s, i)
    }),
    case("formats: bgra8unorm, sum", "plain addition of multiples of 1/255", 100, |s, i| {
        rounding(TextureFormat::Bgra8Unorm, Colors::Bytes, true, s, i)
    }),
    case("formats: bgra8unorm-srgb, written", "any numbers, no blending", 100, |s, i| {
        rounding(TextureFormat::Bgra8UnormSrgb, Colors::Any, false, s, i)
    })
    .both(CURVE),
    case("formats: rgb10a2unorm, written", "any numbers, no blending", 100, |s, i| {
        rounding(TextureFormat::Rgb10a2Unorm, Colors::Any, false, s, i)
    })
    .lavapipe(TEN_BITS),
    case("formats: rg11b10ufloat, written", "any numbers, no blending", 100, |s, i| {
        rounding(TextureFormat::Rg11b10Ufloat, Colors::Any, false, s, i)
    })
    .swiftshader(HALF_FIRST),
    case("formats: rg11b10ufloat, sum", "plain addition, rounded after every fragment", 100, |s, i| {
        rounding(TextureFormat::Rg11b10Ufloat, Colors::Any, true, s, i)
    })
    .swiftshader(HALF_FIRST),
    case("formats: integers", "all integer formats, numbers that they hold", 700, |s, i| integers(Integers::InRange, s, i)),
    case("formats: integers, out of range", "formats below 32 bits, any numbers of 32 bits", 500, |s, i| {
        integers(Integers::OutOfRange, s, i)
    })
    .swiftshader(UNDEFINED),
    case("interpolation: flat", "the first corner's colour", 20, |s, i| interpolated(Interpolation::Flat, true, s, i)),
    case("interpolation: linear", "without perspective, w within e^±1", 20, |s, i| interpolated(Interpolation::Linear, true, s, i))
        .both(WELL_SHAPED),
    case("interpolation: w = 1", "with perspective that does nothing", 20, |s, i| interpolated(Interpolation::Perspective, false, s, i))
        .both(WELL_SHAPED),
    case("interpolation: perspective", "w within e^±1", 20, |s, i| interpolated(Interpolation::Perspective, true, s, i)).both(WELL_SHAPED),
    case("points: anywhere", "one pixel, up to a tenth outside", 40, |s, i| points(Grid::Around, 1.0, s, i)).of(Kind::Points),
    case("points: 1/512 ties", "one pixel, half-way between 1/256 pixels", 20, |s, i| points(Grid::Ties512, 1.0, s, i))
        .of(Kind::Points)
        .lavapipe(POINT_TIES),
    case("points: sprites of 7.25 px", "drawn as two triangles", 20, |s, i| points(Grid::Free, 7.25, s, i)).of(Kind::Points),
    case("lines: 1/16 grid", "one pixel wide", 40, |s, i| lines(Grid::Sixteenths, false, 1.0, s, i))
        .of(Kind::Lines)
        .swiftshader(LINE_CORNERS),
    case("lines: pixel centres", "one pixel wide", 40, |s, i| lines(Grid::Centres, false, 1.0, s, i))
        .of(Kind::Lines)
        .swiftshader(LINE_CORNERS),
    case("lines: axis-aligned", "one pixel wide, along rows and columns", 40, |s, i| lines(Grid::Free, true, 1.0, s, i))
        .of(Kind::Lines)
        .lavapipe(LINE_CORNERS),
    case("lines: anywhere", "one pixel wide, inside", 40, |s, i| lines(Grid::Free, false, 1.0, s, i)).of(Kind::Lines).both(LINE_CORNERS),
    case("lines: clipped", "one pixel wide, up to a tenth outside", 40, |s, i| lines(Grid::Around, false, 1.0, s, i))
        .of(Kind::Lines)
        .lavapipe(LINE_CORNERS)
        .swiftshader(LINE_CLIPPED),
    case("lines: 5 px wide", "drawn as two triangles", 20, |s, i| lines(Grid::Free, false, 5.0, s, i)).of(Kind::Lines).both(WIDE),
    case("counts: depth test", "fragments that pass are counted", 20, counted),
];
