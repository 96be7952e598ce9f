//! The fast path of sprites with a separable kernel that are added to f32 targets: `O += f_X(x)·f_Y(y)` in every channel of every target.
//!
//! A shader call gives the factors of several sprites, one for each of their columns and rows. A block's sixteen products are then one multiplication:
//! the factors of its four columns repeated in each row, times the factors of its four rows spread over the columns.

use fearless_simd::{Simd, SimdBase, SimdMask, f32x4, f32x16, mask32x16};
use fearless_simd_macros::simd;

use crate::api::draw::Draw;
use crate::api::resolved::{IGNORE, TEST};
use crate::api::shader::fragment::ShadeSource;
use crate::api::shader::stages::{Execution, FACTOR_ITEMS, FACTORS, FactorBatch, FactorItem, FragmentStage};
use crate::api::state::MAX_COLOR_TARGETS;
use crate::api::surface::{TILE, TILE_PIXELS, offset_in_tile};
use crate::primitive::tile_primitive::TilePrimitive;
use crate::tile::blend::add_in;
use crate::tile::block_depth::{BlockDepth, test_depth};
use crate::tile::targets::{DrawState, TileTargets};

/// Most planes of all targets together.
const PLANES: usize = 4 * MAX_COLOR_TARGETS;

/// What all sprites of a draw share in a tile.
pub(crate) struct SplatDraw<'a> {
    pub draw: &'a Draw<'a>,
    pub state: &'a DrawState<'a>,
    pub fragment: &'a dyn FragmentStage,
    pub source: ShadeSource<'a>,
    pub execution: Execution,
    /// First pixel of the tile.
    pub origin: [i32; 2],
    /// Whether fragments of equal depth fail the test.
    pub strict: bool,
}

/// Draws sprites, tested against the depth if `depth` is [`TEST`]. Returns the number of fragments that passed.
#[inline(always)]
pub(crate) fn draw<S: Simd>(
    simd: S,
    depth: u8,
    splats: &SplatDraw<'_>,
    primitives: &[TilePrimitive],
    targets: &mut TileTargets<'_>,
    factors: &mut Vec<f32>,
) -> u64 {
    if depth == TEST {
        add::<S, TEST>(simd, splats, primitives, targets, factors)
    } else {
        add::<S, IGNORE>(simd, splats, primitives, targets, factors)
    }
}

#[simd]
#[inline(never)]
fn add<S: Simd, const DEPTH: u8>(
    simd: S,
    splats: &SplatDraw<'_>,
    primitives: &[TilePrimitive],
    targets: &mut TileTargets<'_>,
    factors: &mut Vec<f32>,
) -> u64 {
    let mut planes = [(0, 0); PLANES];
    let mut used = 0;
    for (target, plan) in splats.state.pipeline.targets.iter().enumerate() {
        for channel in 0..plan.as_ref().map_or(0, |plan| plan.channels) {
            planes[used] = (target, channel);
            used += 1;
        }
    }
    let planes = &planes[..used];
    let stride = 2 * planes.len() * FACTORS;
    if factors.len() < FACTOR_ITEMS * stride {
        factors.resize(FACTOR_ITEMS * stride, 0.0);
    }
    let mut sprite = Sprite::default();
    let mut passed = 0;
    for primitives in primitives.chunks(FACTOR_ITEMS) {
        let mut items = [FactorItem::default(); FACTOR_ITEMS];
        for (item, primitive) in items.iter_mut().zip(primitives) {
            let [x0, y0, x1, y1] = primitive.bounds;
            let first = [x0 & !3, y0 & !3];
            let count = |axis: usize, last: u8| usize::from((last | 3) + 1 - first[axis]);
            *item = FactorItem {
                primitive: primitive.attributes,
                first: [0, 1].map(|axis| splats.origin[axis] + i32::from(first[axis])),
                count: [count(0, x1), count(1, y1)],
            };
        }
        let batch = &mut FactorBatch { source: splats.source, items: &items[..primitives.len()], planes, factors: &mut *factors };
        splats.fragment.factors(splats.execution, &splats.draw.bindings, batch);
        for (primitive, factors) in primitives.iter().zip(factors.chunks_exact(stride)) {
            passed += sprite.cover::<S, DEPTH>(simd, splats, primitive, targets.depth.as_deref_mut());
            let (across, down) = factors.split_at(planes.len() * FACTORS);
            let axes = across.chunks_exact(FACTORS).zip(down.chunks_exact(FACTORS));
            for (&(target, channel), (across, down)) in planes.iter().zip(axes) {
                let Some(pixels) = targets.color[target].as_deref_mut() else { continue };
                sprite.add_plane(simd, &mut pixels[channel * TILE_PIXELS..][..TILE_PIXELS], across, down);
            }
        }
    }
    passed
}

/// Blocks along each side of a tile.
const BLOCKS: usize = TILE / 4;

/// The blocks of a sprite in a tile.
struct Sprite {
    /// First column and row of the first block.
    first: [usize; 2],
    /// Columns and rows of blocks.
    blocks: [usize; 2],
    /// Pixels of each block that passed, row by row.
    passed: [u16; BLOCKS * BLOCKS],
}

impl Default for Sprite {
    fn default() -> Self {
        Self { first: [0; 2], blocks: [0; 2], passed: [0; BLOCKS * BLOCKS] }
    }
}

impl Sprite {
    /// Takes the next sprite: which of its pixels are covered, and pass the depth test. Returns their number.
    #[inline(always)]
    fn cover<S: Simd, const DEPTH: u8>(
        &mut self,
        simd: S,
        splats: &SplatDraw<'_>,
        primitive: &TilePrimitive,
        mut depth: Option<&mut [f32]>,
    ) -> u64 {
        let [x0, y0, x1, y1] = primitive.bounds.map(i32::from);
        let (left, top) = (x0 & !3, y0 & !3);
        self.first = [left as usize, top as usize];
        self.blocks = [((x1 - left) / 4 + 1) as usize, ((y1 - top) / 4 + 1) as usize];
        let z = BlockDepth::new(simd, primitive, splats.origin, splats.draw, splats.state.pipeline, None);
        let mut count = 0;
        let mut blocks = self.passed.iter_mut();
        for by in (top..=y1).step_by(4) {
            let rows = u32::from(four(y0 - by, y1 - by));
            // Bit j of four rows becomes the four bits of row j.
            let rows = ((rows & 1) | (rows & 2) << 3 | (rows & 4) << 6 | (rows & 8) << 9) * 15;
            for bx in (left..=x1).step_by(4) {
                let mut pass = rows & (u32::from(four(x0 - bx, x1 - bx)) * 0x1111);
                if let (Some(depth), TEST) = (&mut depth, DEPTH) {
                    let covered = mask32x16::from_bitmask(simd, u64::from(pass));
                    let offset = offset_in_tile(bx as usize, by as usize);
                    pass = test_depth::<S, DEPTH>(&z, depth, bx, by, offset, covered, splats.strict, simd).to_bitmask() as u32;
                }
                count += u64::from(pass.count_ones());
                if let Some(block) = blocks.next() {
                    *block = pass as u16;
                }
            }
        }
        count
    }

    /// Adds the products of both axes' factors to one plane.
    #[inline(always)]
    fn add_plane<S: Simd>(&self, simd: S, plane: &mut [f32], across: &[f32], down: &[f32]) {
        for row in 0..self.blocks[1] {
            let factors = spread(simd, &down[4 * row..][..4]);
            for column in 0..self.blocks[0] {
                let values = f32x16::block_splat(f32x4::from_slice(simd, &across[4 * column..][..4])) * factors;
                let offset = offset_in_tile(self.first[0] + 4 * column, self.first[1] + 4 * row);
                let pass = mask32x16::from_bitmask(simd, u64::from(self.passed[row * self.blocks[0] + column]));
                add_in(simd, pass, values, &mut plane[offset..][..16]);
            }
        }
    }
}

/// The numbers from `first` to `last` that are among 0, 1, 2 and 3, as bits.
#[inline(always)]
fn four(first: i32, last: i32) -> u8 {
    (0xf << first.max(0)) as u8 & 0xf >> (3 - last.min(3))
}

/// Four numbers, each in the four lanes of its row.
#[inline(always)]
fn spread<S: Simd>(simd: S, rows: &[f32]) -> f32x16<S> {
    let row = |j: usize| f32x4::splat(simd, rows[j]);
    let upper = simd.combine_f32x4(row(0), row(1));
    simd.combine_f32x8(upper, simd.combine_f32x4(row(2), row(3)))
}
