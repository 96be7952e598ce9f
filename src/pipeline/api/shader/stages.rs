//! Execution of shaders: a batch of vertices or of 4x4 blocks per call, with sixteen lanes or one.
//!
//! The pipeline calls a stage once per batch through a trait object; inside a batch all code is monomorphic.

use fearless_simd::{Level, Simd, SimdMask, f32x16, mask32x16};
use fearless_simd_macros::simd;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::level::wide_dispatch;
use nephroid_math::vector::v4;

use crate::api::bindings::Bindings;
use crate::api::shader::clip_vertices::{ClipVertices, GROUP};
use crate::api::shader::fragment::{FragmentInput, FragmentOutput, FragmentShader, ShadeSource, Weighted};
use crate::api::shader::separable::Axis;
use crate::api::shader::vertex::{VertexInput, VertexOutput, VertexShader};
use crate::api::state::{MAX_COLOR_TARGETS, MAX_VARYINGS};
use crate::api::surface::TILE;

/// Lanes per shader call. Both widths give the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShaderWidth {
    /// One lane at a time: the definition.
    One,
    /// Sixteen lanes.
    #[default]
    Sixteen,
}

/// How a batch is run.
#[derive(Clone, Copy, Debug)]
pub struct Execution {
    /// SIMD level.
    pub level: Level,
    /// Lanes per shader call.
    pub width: ShaderWidth,
}

/// Vertices to shade, sixteen per group, and the buffers for their results.
pub struct VertexBatch<'a> {
    pub(crate) vertex_index: &'a [u32],
    pub(crate) instance_index: u32,
    /// `[group of 16][location][component][16]`.
    pub(crate) attributes: &'a [f32],
    pub(crate) locations: usize,
    pub(crate) scalars: usize,
    pub(crate) vertices: &'a mut ClipVertices,
    /// `[vertex][scalar]`.
    pub(crate) varyings: &'a mut [f32],
}

/// A vertex stage as the pipeline calls it. Every [`VertexShader`] implements it.
pub trait VertexStage: Send + Sync {
    /// Shades a batch.
    fn run(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut VertexBatch<'_>);
}

impl<T: VertexShader> VertexStage for T {
    fn run(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut VertexBatch<'_>) {
        match execution.width {
            ShaderWidth::One => vertex_groups::<f32, T>((), self, bindings, batch),
            ShaderWidth::Sixteen => wide_dispatch!(
                execution.level,
                simd => vertex_batch16(simd, self, bindings, batch),
                vertex_groups::<f32, T>((), self, bindings, batch)
            ),
        }
    }
}

#[simd]
fn vertex_batch16<S: Simd, T: VertexShader>(simd: S, shader: &T, bindings: &Bindings<'_>, batch: &mut VertexBatch<'_>) {
    vertex_groups::<f32x16<S>, T>(simd, shader, bindings, batch);
}

#[inline(always)]
fn vertex_groups<L: Lanes, T: VertexShader>(token: L::Token, shader: &T, bindings: &Bindings<'_>, batch: &mut VertexBatch<'_>) {
    let zero = L::splat(token, 0.0);
    let one = L::splat(token, 1.0);
    let mut output = VertexOutput { position: v4(zero, zero, zero, one), point_size: one, varyings: [zero; MAX_VARYINGS] };
    let mut attributes = [v4(zero, zero, zero, one); 16];
    let count = batch.vertex_index.len();
    let mut first = 0;
    while first < count {
        let lanes = L::LEN.min(count - first);
        let mut indices = [0; 16];
        indices[..lanes].copy_from_slice(&batch.vertex_index[first..first + lanes]);
        // Idle lanes repeat the last vertex, so that they read only what exists.
        let last = indices[lanes - 1];
        indices[lanes..].fill(last);
        for (location, attribute) in attributes.iter_mut().enumerate().take(batch.locations) {
            let start = (first / 16 * batch.locations + location) * 64 + first % 16;
            let components = &batch.attributes[start..];
            *attribute = v4(
                L::load(token, components),
                L::load(token, &components[16..]),
                L::load(token, &components[32..]),
                L::load(token, &components[48..]),
            );
        }
        let input = VertexInput {
            token,
            vertex_index: &indices[..L::LEN],
            instance_index: batch.instance_index,
            attributes: &attributes[..batch.locations],
        };
        shader.vertex(bindings, &input, &mut output);
        let group = &mut batch.vertices.groups[first / GROUP];
        let [x, y, z, w] = &mut group.position;
        output.position.x.store(&mut x[first % GROUP..]);
        output.position.y.store(&mut y[first % GROUP..]);
        output.position.z.store(&mut z[first % GROUP..]);
        output.position.w.store(&mut w[first % GROUP..]);
        output.point_size.store(&mut group.point_size[first % GROUP..]);
        let varyings = &mut batch.varyings[first * batch.scalars..(first + lanes) * batch.scalars];
        for (scalar, value) in output.varyings.iter().enumerate().take(batch.scalars) {
            let values = value.to_array();
            for (vertex, value) in varyings.chunks_exact_mut(batch.scalars).zip(values) {
                vertex[scalar] = value;
            }
        }
        first += lanes;
    }
}

/// Most primitives that may share a block which is shaded once.
const MOST_MERGED: usize = 8;

/// A 4x4 block that is to be shaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShadeItem {
    /// Column of the block's first pixel.
    pub x: u32,
    /// Row of the block's first pixel.
    pub y: u32,
    /// The primitive's index in the chunk's interpolation data.
    pub primitive: u32,
    /// Covered pixels, bit = lane.
    pub mask: u16,
    /// Other primitives that share the block, each with its pixels.
    others: [(u16, u32); MOST_MERGED - 1],
    merged: u8,
}

impl ShadeItem {
    /// A block of one primitive.
    #[must_use]
    pub fn new(x: u32, y: u32, primitive: u32, mask: u16) -> Self {
        Self { x, y, primitive, mask, ..Self::default() }
    }

    /// Adds pixels of another primitive in the same block, if there is room.
    #[inline(always)]
    pub(crate) fn merge(&mut self, primitive: u32, mask: u16) -> bool {
        let fits = self.mask & mask == 0 && usize::from(self.merged) < MOST_MERGED - 1;
        if fits {
            self.others[usize::from(self.merged)] = (mask, primitive);
            self.merged += 1;
            self.mask |= mask;
        }
        fits
    }

    /// The primitives beyond the first, each with its pixels.
    #[inline(always)]
    fn others(&self) -> &[(u16, u32)] {
        &self.others[..usize::from(self.merged)]
    }
}

/// Blocks to shade, and the buffers for their results.
pub struct ShadeBatch<'a> {
    pub(crate) source: ShadeSource<'a>,
    pub(crate) items: &'a [ShadeItem],
    /// Depth, `[item][16]`.
    pub(crate) z: &'a mut [[f32; 16]],
    /// Colours, `[item][target][component][16]`.
    pub(crate) colors: &'a mut [f32],
    pub(crate) targets: usize,
    /// Kept pixels per item, from the shader's discards.
    pub(crate) keep: &'a mut [u16],
    /// Whether the program may discard; if not, `keep` is ignored.
    pub(crate) may_discard: bool,
    pub(crate) writes_depth: bool,
}

/// Pixels along each axis for which a sprite's factors have room: those of a tile.
pub(crate) const FACTORS: usize = TILE;

/// Most sprites of a [`FactorBatch`].
pub(crate) const FACTOR_ITEMS: usize = 16;

/// A sprite, or the part of it in a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FactorItem {
    /// The primitive's index in the chunk's interpolation data.
    pub primitive: u32,
    /// First column and row, pixels of the target.
    pub first: [i32; 2],
    /// Number of columns and rows, at most [`FACTORS`].
    pub count: [usize; 2],
}

/// Sprites whose factors are wanted, and the buffer for them.
pub struct FactorBatch<'a> {
    pub(crate) source: ShadeSource<'a>,
    pub(crate) items: &'a [FactorItem],
    /// Target and channel of each plane.
    pub(crate) planes: &'a [(usize, usize)],
    /// `[item][axis][plane][`[`FACTORS`]`]`; numbers beyond an item's count are of no meaning.
    pub(crate) factors: &'a mut [f32],
}

/// A fragment stage as the pipeline calls it. Every [`FragmentShader`] implements it.
pub trait FragmentStage: Send + Sync {
    /// Value of [`FragmentShader::PER_PRIMITIVE`].
    fn per_primitive(&self) -> bool;
    /// Value of [`FragmentShader::MERGES_FRAGMENTS`].
    fn merges_fragments(&self) -> bool;
    /// Value of [`FragmentShader::SEPARABLE`].
    fn separable(&self) -> bool;
    /// Shades a batch.
    fn run(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut ShadeBatch<'_>);
    /// Computes the factors of a batch's sprites along both axes; valid if [`Self::separable`].
    fn factors(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut FactorBatch<'_>);
    /// The colours of a primitive, one per target; valid if [`Self::per_primitive`].
    fn primitive_color(&self, bindings: &Bindings<'_>, source: &ShadeSource<'_>, primitive: u32) -> [[f32; 4]; MAX_COLOR_TARGETS];
}

impl<T: FragmentShader> FragmentStage for T {
    fn per_primitive(&self) -> bool {
        T::PER_PRIMITIVE
    }
    fn merges_fragments(&self) -> bool {
        T::MERGES_FRAGMENTS
    }
    fn run(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut ShadeBatch<'_>) {
        match execution.width {
            ShaderWidth::One => fragment_pixels(self, bindings, batch),
            ShaderWidth::Sixteen => wide_dispatch!(
                execution.level,
                simd => fragment_blocks(simd, self, bindings, batch),
                fragment_pixels(self, bindings, batch)
            ),
        }
    }
    fn separable(&self) -> bool {
        T::SEPARABLE
    }
    fn factors(&self, execution: Execution, bindings: &Bindings<'_>, batch: &mut FactorBatch<'_>) {
        if !T::SEPARABLE {
            return;
        }
        match execution.width {
            ShaderWidth::One => axis_factors::<f32, T>((), self, bindings, batch),
            ShaderWidth::Sixteen => wide_dispatch!(
                execution.level,
                simd => axis_factors16(simd, self, bindings, batch),
                axis_factors::<f32, T>((), self, bindings, batch)
            ),
        }
    }
    fn primitive_color(&self, bindings: &Bindings<'_>, source: &ShadeSource<'_>, primitive: u32) -> [[f32; 4]; MAX_COLOR_TARGETS] {
        let attributes = &source.primitives[primitive as usize];
        let [x, y] = attributes.anchor;
        let input = FragmentInput::<f32>::new((), (0, 0), (x, y, 0.0), source, Weighted::new(attributes, x, y), &[]);
        let mut output = FragmentOutput { color: [v4(0.0, 0.0, 0.0, 0.0); MAX_COLOR_TARGETS], depth: 0.0, keep: true };
        self.fragment(bindings, &input, &mut output);
        output.color.map(|c| [c.x, c.y, c.z, c.w])
    }
}

#[simd]
fn fragment_blocks<S: Simd, T: FragmentShader>(simd: S, shader: &T, bindings: &Bindings<'_>, batch: &mut ShadeBatch<'_>) {
    let zero = <f32x16<S> as Lanes>::splat(simd, 0.0);
    let all = Lanes::equals(zero, zero);
    let mut output = FragmentOutput { color: [v4(zero, zero, zero, zero); MAX_COLOR_TARGETS], depth: zero, keep: all };
    let column = <f32x16<S> as Lanes>::from_fn(simd, |i| (i & 3) as f32);
    let row = <f32x16<S> as Lanes>::from_fn(simd, |i| (i >> 2) as f32);
    for (i, item) in batch.items.iter().enumerate() {
        let z = <f32x16<S> as Lanes>::load(simd, &batch.z[i]);
        let (x, y) = (column + item.x as f32, row + item.y as f32);
        let own = Weighted::new(&batch.source.primitives[item.primitive as usize], x, y);
        let mut others = [(all, own); MOST_MERGED - 1];
        let merged = if T::MERGES_FRAGMENTS { item.others() } else { &[] };
        for ((lanes, weighted), &(mask, primitive)) in others.iter_mut().zip(merged) {
            *lanes = mask32x16::from_bitmask(simd, u64::from(mask));
            *weighted = Weighted::new(&batch.source.primitives[primitive as usize], x, y);
        }
        let input = FragmentInput::new(simd, (item.x, item.y), (x, y, z), &batch.source, own, &others[..merged.len()]);
        output.keep = all;
        shader.fragment(bindings, &input, &mut output);
        batch.keep[i] = if batch.may_discard { output.keep.bits() as u16 } else { u16::MAX };
        if batch.keep[i] & item.mask == 0 {
            continue; // The colours of a discarded block are never read.
        }
        for (target, color) in output.color.iter().enumerate().take(batch.targets) {
            let out = &mut batch.colors[(i * batch.targets + target) * 64..][..64];
            Lanes::store(color.x, out);
            Lanes::store(color.y, &mut out[16..]);
            Lanes::store(color.z, &mut out[32..]);
            Lanes::store(color.w, &mut out[48..]);
        }
        if batch.writes_depth {
            Lanes::store(output.depth, &mut batch.z[i]);
        }
    }
}

fn fragment_pixels<T: FragmentShader>(shader: &T, bindings: &Bindings<'_>, batch: &mut ShadeBatch<'_>) {
    let mut output = FragmentOutput { color: [v4(0.0, 0.0, 0.0, 0.0); MAX_COLOR_TARGETS], depth: 0.0, keep: true };
    for (i, item) in batch.items.iter().enumerate() {
        batch.keep[i] = 0;
        for lane in (0..16).filter(|lane| item.mask >> lane & 1 == 1) {
            let (x, y) = (item.x + (lane & 3), item.y + (lane >> 2));
            let lane = lane as usize;
            let other = item.others().iter().find(|(mask, _)| mask >> lane & 1 == 1);
            let attributes = &batch.source.primitives[other.map_or(item.primitive, |(_, primitive)| *primitive) as usize];
            let at = (x as f32, y as f32, batch.z[i][lane]);
            let input = FragmentInput::<f32>::new((), (x, y), at, &batch.source, Weighted::new(attributes, at.0, at.1), &[]);
            output.keep = true;
            shader.fragment(bindings, &input, &mut output);
            for (target, c) in output.color.iter().enumerate().take(batch.targets) {
                for (component, value) in [c.x, c.y, c.z, c.w].into_iter().enumerate() {
                    batch.colors[((i * batch.targets + target) * 4 + component) * 16 + lane] = value;
                }
            }
            batch.keep[i] |= u16::from(output.keep || !batch.may_discard) << lane;
            if batch.writes_depth {
                batch.z[i][lane] = output.depth;
            }
        }
    }
}

#[simd]
fn axis_factors16<S: Simd, T: FragmentShader>(simd: S, shader: &T, bindings: &Bindings<'_>, batch: &mut FactorBatch<'_>) {
    axis_factors::<f32x16<S>, T>(simd, shader, bindings, batch);
}

#[inline(always)]
fn axis_factors<L: Lanes, T: FragmentShader>(token: L::Token, shader: &T, bindings: &Bindings<'_>, batch: &mut FactorBatch<'_>) {
    let zero = L::splat(token, 0.0);
    let mut values = [v4(zero, zero, zero, zero); MAX_COLOR_TARGETS];
    let lanes = L::from_fn(token, |lane| lane as f32 + 0.5);
    let planes = batch.planes.len();
    // Sprites of a tile lie far apart in the chunk's data. Everything is fetched first, so that the cache misses overlap.
    let scalars = batch.source.interpolation.len();
    let mut starts = [0; FACTOR_ITEMS];
    for (start, item) in starts.iter_mut().zip(batch.items) {
        *start = batch.source.primitives[item.primitive as usize].varyings[0] as usize;
    }
    let mut flats = [0.0; FACTOR_ITEMS * MAX_VARYINGS];
    for (flat, &start) in flats.chunks_exact_mut(scalars.max(1)).zip(&starts[..batch.items.len()]) {
        flat[..scalars].copy_from_slice(&batch.source.varyings[start..start + scalars]);
    }
    let flats = flats.chunks_exact(scalars.max(1)).map(|flat| &flat[..scalars]);
    let factors = batch.factors.chunks_exact_mut(2 * planes * FACTORS);
    for ((item, flat), factors) in batch.items.iter().zip(flats).zip(factors) {
        for (axis, factors) in [Axis::X, Axis::Y].into_iter().zip(factors.chunks_exact_mut(planes * FACTORS)) {
            let number = axis as usize;
            for start in (0..item.count[number]).step_by(L::LEN) {
                // Exact: halves of integers far below 2^23.
                shader.factor(bindings, flat, axis, lanes + (item.first[number] + start as i32) as f32, &mut values);
                for (&(target, channel), factors) in batch.planes.iter().zip(factors.chunks_exact_mut(FACTORS)) {
                    let color = values[target];
                    [color.x, color.y, color.z, color.w][channel].store(&mut factors[start..]);
                }
            }
        }
    }
}
