//! Samplers: filtering between texels and mip levels, and addressing beyond the edges of a texture.
//!
//! The scalar code, lane by lane, is the definition. The most frequent case (linear filtering of a 2D texture without mips, clamped to its edge)
//! computes texel indices and weights for all lanes together and gathers lane by lane ([`bilinear`]), with the same bits. Integer textures are read
//! at the nearest texel of the nearest level, whatever the sampler says: bit patterns have no mean, and WGSL reads integer textures with
//! `textureLoad` only, which is [`load`] here. Weights are f32, without the rounding to 8 bits that GPUs apply (`subTexelPrecisionBits`): linear
//! filtering is exact here and within 2^-8 on GPUs.

pub use wgpu_types::{AddressMode, FilterMode};

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V2, V3, V4, v2, v4};

use crate::api::compare::{compare, compare_lanes};
use crate::api::format::facts::ChannelKind;
use crate::api::state::CompareFunction;
use crate::api::surface::{Surface, TILE_PIXELS};
use crate::api::texture_descriptor::TextureShape;
use crate::api::texture_view::TextureView;

/// How a texture is sampled.
///
/// WebGPU: [`GPUSamplerDescriptor`](https://www.w3.org/TR/webgpu/#dictdef-gpusamplerdescriptor). Clamp to border is not offered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Addressing of coordinates outside of 0..=1, per axis. Default: clamp to edge.
    pub address_mode: [AddressMode; 3],
    /// Filter for magnification, where a texel covers more than a pixel. Default: nearest.
    pub mag_filter: FilterMode,
    /// Filter for minification, where a pixel covers more than a texel. Default: nearest.
    pub min_filter: FilterMode,
    /// Filter between mip levels. Default: nearest.
    pub mipmap_filter: FilterMode,
    /// Least level of detail, finite, 0 or more. Default: 0.
    pub lod_min_clamp: f32,
    /// Greatest level of detail, finite, at least `lod_min_clamp`. Default: 32.
    pub lod_max_clamp: f32,
    /// For comparison sampling: `reference OP texel`. Default: none.
    pub compare: Option<CompareFunction>,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            address_mode: [AddressMode::ClampToEdge; 3],
            mag_filter: FilterMode::Nearest,
            min_filter: FilterMode::Nearest,
            mipmap_filter: FilterMode::Nearest,
            lod_min_clamp: 0.0,
            lod_max_clamp: 32.0,
            compare: None,
        }
    }
}

impl Sampler {
    /// Linear filtering within and between levels, with the given addressing on all axes.
    #[must_use]
    pub fn linear(address_mode: AddressMode) -> Self {
        Self {
            address_mode: [address_mode; 3],
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: FilterMode::Linear,
            ..Self::default()
        }
    }
    /// Linear comparison sampling, clamped at the edges: percentage-closer filtering over 2x2 texels.
    #[must_use]
    pub fn comparison(function: CompareFunction) -> Self {
        Self { compare: Some(function), mipmap_filter: FilterMode::Nearest, ..Self::linear(AddressMode::ClampToEdge) }
    }
}

/// The texel inside `0..size` that a texel index beyond the edge reads.
fn wrap(mode: AddressMode, index: i64, size: i64) -> u32 {
    (match mode {
        AddressMode::Repeat => index.rem_euclid(size),
        AddressMode::MirrorRepeat => {
            let period = index.rem_euclid(2 * size);
            if period < size { period } else { 2 * size - 1 - period }
        }
        AddressMode::ClampToEdge | AddressMode::ClampToBorder => index.clamp(0, size - 1),
    }) as u32
}

/// The one or two texels read along an axis, and the weight of the second.
struct AxisTaps {
    texel: [u32; 2],
    weight: f32,
}

fn axis_taps(filter: FilterMode, mode: AddressMode, coordinate: f32, size: u32) -> AxisTaps {
    // NaN and very large coordinates read an edge texel instead of overflowing.
    let scaled = (coordinate * size as f32).clamp(-1.0e9, 1.0e9);
    let scaled = if scaled.is_nan() { 0.0 } else { scaled };
    match filter {
        FilterMode::Nearest => {
            let texel = wrap(mode, scaled.floor() as i64, i64::from(size));
            AxisTaps { texel: [texel; 2], weight: 0.0 }
        }
        FilterMode::Linear => {
            let base = (scaled - 0.5).floor();
            let texel = [base as i64, base as i64 + 1].map(|i| wrap(mode, i, i64::from(size)));
            AxisTaps { texel, weight: scaled - 0.5 - base }
        }
    }
}

/// Position of a sample: coordinates in the image, and the layer (or the third coordinate of a volume).
#[derive(Clone, Copy)]
struct Site {
    u: f32,
    v: f32,
    w: f32,
    layer: u32,
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Filters one level; `read` converts each texel to the values that are filtered.
fn sample_one_level(
    texture: &TextureView<'_>,
    sampler: &Sampler,
    site: Site,
    level: u32,
    filter: FilterMode,
    read: &dyn Fn([f32; 4]) -> [f32; 4],
) -> [f32; 4] {
    let (width, height, depth) = texture.level_size(level);
    let x = axis_taps(filter, sampler.address_mode[0], site.u, width);
    let y = axis_taps(filter, sampler.address_mode[1], site.v, height);
    let plane = |layer: u32| {
        let fetch = |x: u32, y: u32| read(texture.texel(level, layer, x, y));
        let first = fetch(x.texel[0], y.texel[0]);
        if filter == FilterMode::Nearest {
            return first;
        }
        let (b, c, d) = (fetch(x.texel[1], y.texel[0]), fetch(x.texel[0], y.texel[1]), fetch(x.texel[1], y.texel[1]));
        std::array::from_fn(|i| lerp(lerp(first[i], b[i], x.weight), lerp(c[i], d[i], x.weight), y.weight))
    };
    if texture.shape() != TextureShape::D3 {
        return plane(site.layer);
    }
    let z = axis_taps(filter, sampler.address_mode[2], site.w, depth);
    let (near, far) = (plane(z.texel[0]), plane(z.texel[1]));
    std::array::from_fn(|i| lerp(near[i], far[i], z.weight))
}

/// Filters within and between levels.
fn sample_site(texture: &TextureView<'_>, sampler: &Sampler, site: Site, lod: f32, read: &dyn Fn([f32; 4]) -> [f32; 4]) -> [f32; 4] {
    let last = texture.mip_level_count() - 1;
    let lod = if lod.is_nan() { 0.0 } else { lod };
    let lod = lod.clamp(sampler.lod_min_clamp, sampler.lod_max_clamp);
    let integers = texture.info().kind.is_integer();
    let filter = if lod <= 0.0 { sampler.mag_filter } else { sampler.min_filter };
    let filter = if integers { FilterMode::Nearest } else { filter };
    let lod = lod.clamp(0.0, last as f32);
    if sampler.mipmap_filter == FilterMode::Nearest || integers {
        return sample_one_level(texture, sampler, site, (lod + 0.5).floor() as u32, filter, read);
    }
    let base = lod.floor();
    let fine = sample_one_level(texture, sampler, site, base as u32, filter, read);
    if lod == base {
        return fine;
    }
    let coarse = sample_one_level(texture, sampler, site, base as u32 + 1, filter, read);
    std::array::from_fn(|i| lerp(fine[i], coarse[i], lod - base))
}

/// Cube face of a direction and coordinates on that face, by the table of the WebGPU and Vulkan specifications.
fn cube_site(direction: [f32; 3]) -> Site {
    let [x, y, z] = direction;
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let (layer, sc, tc, ma) = if az >= ax && az >= ay {
        if z >= 0.0 { (4, x, -y, az) } else { (5, -x, -y, az) }
    } else if ay >= ax {
        if y >= 0.0 { (2, x, z, ay) } else { (3, x, -z, ay) }
    } else if x >= 0.0 {
        (0, -z, -y, ax)
    } else {
        (1, z, -y, ax)
    };
    Site { u: 0.5 * (sc / ma + 1.0), v: 0.5 * (tc / ma + 1.0), w: 0.0, layer }
}

#[inline(always)]
fn gather<L: Lanes>(token: L::Token, mut f: impl FnMut(usize) -> [f32; 4]) -> V4<L> {
    let mut lanes = [[0.0; 4]; 16];
    for (i, lane) in lanes.iter_mut().enumerate().take(L::LEN) {
        *lane = f(i);
    }
    v4(
        L::from_fn(token, |i| lanes[i][0]),
        L::from_fn(token, |i| lanes[i][1]),
        L::from_fn(token, |i| lanes[i][2]),
        L::from_fn(token, |i| lanes[i][3]),
    )
}

/// Whether [`bilinear`] gives the sampler's result for this texture.
#[inline(always)]
fn is_bilinear(texture: &TextureView<'_>, sampler: &Sampler) -> bool {
    let linear = sampler.mag_filter == FilterMode::Linear && sampler.min_filter == FilterMode::Linear;
    let clamped = sampler.address_mode[0] == AddressMode::ClampToEdge && sampler.address_mode[1] == AddressMode::ClampToEdge;
    let kind = texture.info().kind;
    let plain = texture.mip_level_count() == 1 && texture.shape() == TextureShape::D2;
    linear && clamped && plain && !matches!(kind, ChannelKind::UnormDepth(_)) && !kind.is_integer()
}

/// The two texels read along an axis, per lane, and the weight of the second.
#[inline(always)]
fn linear_taps<L: Lanes>(coordinate: L, size: u32) -> (L, L, L) {
    let scaled = coordinate * size as f32;
    let scaled = Lanes::clamp(L::select(scaled.equals(scaled), scaled, scaled.like(0.0)), -1.0e9, 1.0e9);
    let base = (scaled - 0.5).floor();
    let last = (size - 1) as f32;
    (Lanes::clamp(base, 0.0, last), Lanes::clamp(base + 1.0, 0.0, last), scaled - 0.5 - base)
}

/// The 2x2 texels around each lane's position, per channel, and the weights of the right column and of the lower row.
struct Footprint<L> {
    /// `[channel][upper left, upper right, lower left, lower right]`
    texels: [[L; 4]; 4],
    right: L,
    lower: L,
}

/// Reads the texels of a surface with at least `CHANNELS` channels.
#[inline(always)]
fn footprint<L: Lanes, const CHANNELS: usize>(surface: &Surface, uv: V2<L>) -> Footprint<L> {
    let token = uv.x.token();
    let (x0, x1, right) = linear_taps(uv.x, surface.width);
    let (y0, y1, lower) = linear_taps(uv.y, surface.height);
    let mut gathered = [[[0.0; 16]; 4]; CHANNELS];
    let columns = [surface.column_indices(x0), surface.column_indices(x1)];
    let rows = [surface.row_indices(y0), surface.row_indices(y1)];
    for lane in 0..L::LEN {
        for corner in 0..4 {
            let start = (columns[corner & 1][lane] + rows[corner >> 1][lane]) as usize;
            let texel = &surface.planes[start..start + (CHANNELS - 1) * TILE_PIXELS + 1];
            for channel in 0..CHANNELS {
                gathered[channel][corner][lane] = texel[channel * TILE_PIXELS];
            }
        }
    }
    let zero = L::splat(token, 0.0);
    let mut texels = [[zero; 4]; 4];
    for channel in 0..CHANNELS {
        for corner in 0..4 {
            texels[channel][corner] = L::load(token, &gathered[channel][corner]);
        }
    }
    Footprint { texels, right, lower }
}

impl<L: Lanes> Footprint<L> {
    #[inline(always)]
    fn filter(&self, t: [L; 4]) -> L {
        let upper = t[0] + (t[1] - t[0]) * self.right;
        let below = t[2] + (t[3] - t[2]) * self.right;
        upper + (below - upper) * self.lower
    }
}

/// Linear filtering of level 0, clamped to the edge.
#[inline(always)]
fn bilinear<L: Lanes>(texture: &TextureView<'_>, uv: V2<L>, layer: u32) -> V4<L> {
    let surface = texture.surface(0, layer);
    let footprint = match surface.channels {
        1 => footprint::<L, 1>(surface, uv),
        2 => footprint::<L, 2>(surface, uv),
        3 => footprint::<L, 3>(surface, uv),
        _ => footprint::<L, 4>(surface, uv),
    };
    let zero = uv.x.like(0.0);
    let mut out = [zero, zero, zero, uv.x.like(1.0)];
    for (channel, out) in out.iter_mut().enumerate().take(surface.channels) {
        *out = footprint.filter(footprint.texels[channel]);
    }
    v4(out[0], out[1], out[2], out[3])
}

/// Samples a 2D texture (or one layer of it) at `uv` and level of detail `lod`.
#[inline(always)]
pub fn sample_level<L: Lanes>(texture: &TextureView<'_>, sampler: &Sampler, uv: V2<L>, layer: u32, lod: L) -> V4<L> {
    if is_bilinear(texture, sampler) {
        return bilinear(texture, uv, layer);
    }
    gather(lod.token(), |i| {
        let site = Site { u: uv.x.lane(i), v: uv.y.lane(i), w: 0.0, layer };
        sample_site(texture, sampler, site, lod.lane(i), &|texel| texel)
    })
}

/// Level of detail from the derivatives of `uv` per pixel: `log2(max(|∂uv/∂x · size|, |∂uv/∂y · size|))`, −32 where both are 0
/// [Vulkan spec, image level-of-detail operation, isotropic].
#[inline(always)]
pub fn level_of_detail<L: Lanes>(texture: &TextureView<'_>, ddx: V2<L>, ddy: V2<L>) -> L {
    let (width, height, _) = texture.level_size(0);
    let (width, height) = (width as f32, height as f32);
    let (across, down) = (v2(ddx.x * width, ddx.y * height), v2(ddy.x * width, ddy.y * height));
    let rho_squared = Lanes::max(across.dot(across), down.dot(down));
    rho_squared.map(|r| if r > 0.0 { 0.5 * libm::log2f(r) } else { -32.0 })
}

/// Samples a 2D texture at `uv` and the [`level_of_detail`] that its derivatives per pixel give [WGSL `textureSampleGrad`]. For varyings,
/// [`FragmentInput::sample`](crate::shader::FragmentInput::sample) computes the derivatives.
#[inline(always)]
pub fn sample_grad<L: Lanes>(texture: &TextureView<'_>, sampler: &Sampler, uv: V2<L>, layer: u32, ddx: V2<L>, ddy: V2<L>) -> V4<L> {
    sample_level(texture, sampler, uv, layer, level_of_detail(texture, ddx, ddy))
}

/// Samples a cube map in a direction (of any length) at level of detail `lod`. Filtering stays within a face.
#[inline(always)]
pub fn sample_cube<L: Lanes>(texture: &TextureView<'_>, sampler: &Sampler, direction: V3<L>, lod: L) -> V4<L> {
    gather(lod.token(), |i| {
        let site = cube_site([direction.x.lane(i), direction.y.lane(i), direction.z.lane(i)]);
        sample_site(texture, &Sampler { address_mode: [AddressMode::ClampToEdge; 3], ..*sampler }, site, lod.lane(i), &|texel| texel)
    })
}

/// Samples a volume at `uvw` and level of detail `lod`.
#[inline(always)]
pub fn sample_3d<L: Lanes>(texture: &TextureView<'_>, sampler: &Sampler, uvw: V3<L>, lod: L) -> V4<L> {
    gather(lod.token(), |i| {
        let site = Site { u: uvw.x.lane(i), v: uvw.y.lane(i), w: uvw.z.lane(i), layer: 0 };
        sample_site(texture, sampler, site, lod.lane(i), &|texel| texel)
    })
}

/// Filtered result of the comparison `reference OP texel` at level 0, in 0..=1: the weight of the texels that pass.
///
/// `sampler.compare` must be set; without it every texel passes.
#[inline(always)]
pub fn sample_compare<L: Lanes>(texture: &TextureView<'_>, sampler: &Sampler, uv: V2<L>, layer: u32, reference: L) -> L {
    let function = sampler.compare.unwrap_or(CompareFunction::Always);
    if is_bilinear(texture, sampler) {
        let footprint = footprint::<L, 1>(texture.surface(0, layer), uv);
        let mut passed = footprint.texels[0];
        for texel in &mut passed {
            *texel = L::select(compare_lanes(function, reference, *texel), reference.like(1.0), reference.like(0.0));
        }
        return footprint.filter(passed);
    }
    L::from_fn(reference.token(), |i| {
        let site = Site { u: uv.x.lane(i), v: uv.y.lane(i), w: 0.0, layer };
        // Values of a unorm texture are in 0..=1, so the reference is clamped to that range, too [Vulkan spec, depth compare operation].
        let unorm = matches!(texture.info().kind, ChannelKind::UnormDepth(_));
        let depth = if unorm { reference.lane(i).clamp(0.0, 1.0) } else { reference.lane(i) };
        let passes = |texel: [f32; 4]| [f32::from(u8::from(compare(function, depth, texel[0]))), 0.0, 0.0, 0.0];
        sample_site(texture, sampler, site, 0.0, &passes)[0]
    })
}

/// Texel at integer coordinates; zeros outside of the texture [WebGPU robust access].
#[inline(always)]
pub fn load<L: Lanes>(texture: &TextureView<'_>, x: L, y: L, layer: u32, level: u32) -> V4<L> {
    let surface = texture.surface(level, layer);
    let zero = x.like(0.0);
    let exists = x.ge(zero) & y.ge(zero) & x.lt(x.like(surface.width as f32)) & y.lt(x.like(surface.height as f32));
    let columns = surface.column_indices(L::select(exists, x, zero));
    let rows = surface.row_indices(L::select(exists, y, zero));
    let mut lanes = [[0.0; 16]; 4];
    for lane in 0..L::LEN {
        let texel = texture.texel_at(surface, (columns[lane] + rows[lane]) as usize);
        for (lanes, value) in lanes.iter_mut().zip(texel) {
            lanes[lane] = value;
        }
    }
    let token = x.token();
    V4::select(
        exists,
        v4(L::load(token, &lanes[0]), L::load(token, &lanes[1]), L::load(token, &lanes[2]), L::load(token, &lanes[3])),
        v4(zero, zero, zero, zero),
    )
}
