//! Vertex fetch: decodes every WebGPU vertex format to the planar form that vertex shaders read.

use crate::api::draw::VertexBuffer;
use crate::api::format::small_float::f16_to_f32;
use crate::api::state::{VertexBufferLayout, VertexFormat, VertexStepMode};

/// The encoding of a component.
#[derive(Clone, Copy)]
enum Component {
    Uint(usize),
    Sint(usize),
    Unorm(usize),
    Snorm(usize),
    Half,
    Float,
    /// 64-bit float, rounded to f32.
    Double,
}

/// Number and encoding of a format's components; `None` for packed formats, which are handled separately.
fn components(format: VertexFormat) -> Option<(usize, Component)> {
    use Component::*;
    use VertexFormat as F;
    Some(match format {
        F::Uint8 => (1, Uint(1)),
        F::Uint8x2 => (2, Uint(1)),
        F::Uint8x4 => (4, Uint(1)),
        F::Sint8 => (1, Sint(1)),
        F::Sint8x2 => (2, Sint(1)),
        F::Sint8x4 => (4, Sint(1)),
        F::Unorm8 => (1, Unorm(1)),
        F::Unorm8x2 => (2, Unorm(1)),
        F::Unorm8x4 => (4, Unorm(1)),
        F::Snorm8 => (1, Snorm(1)),
        F::Snorm8x2 => (2, Snorm(1)),
        F::Snorm8x4 => (4, Snorm(1)),
        F::Uint16 => (1, Uint(2)),
        F::Uint16x2 => (2, Uint(2)),
        F::Uint16x4 => (4, Uint(2)),
        F::Sint16 => (1, Sint(2)),
        F::Sint16x2 => (2, Sint(2)),
        F::Sint16x4 => (4, Sint(2)),
        F::Unorm16 => (1, Unorm(2)),
        F::Unorm16x2 => (2, Unorm(2)),
        F::Unorm16x4 => (4, Unorm(2)),
        F::Snorm16 => (1, Snorm(2)),
        F::Snorm16x2 => (2, Snorm(2)),
        F::Snorm16x4 => (4, Snorm(2)),
        F::Float16 => (1, Half),
        F::Float16x2 => (2, Half),
        F::Float16x4 => (4, Half),
        F::Float32 => (1, Float),
        F::Float32x2 => (2, Float),
        F::Float32x3 => (3, Float),
        F::Float32x4 => (4, Float),
        F::Uint32 => (1, Uint(4)),
        F::Uint32x2 => (2, Uint(4)),
        F::Uint32x3 => (3, Uint(4)),
        F::Uint32x4 => (4, Uint(4)),
        F::Sint32 => (1, Sint(4)),
        F::Sint32x2 => (2, Sint(4)),
        F::Sint32x3 => (3, Sint(4)),
        F::Sint32x4 => (4, Sint(4)),
        F::Float64 => (1, Double),
        F::Float64x2 => (2, Double),
        F::Float64x3 => (3, Double),
        F::Float64x4 => (4, Double),
        F::Unorm10_10_10_2 | F::Unorm8x4Bgra => return None,
    })
}

impl Component {
    fn size(self) -> usize {
        match self {
            Self::Uint(size) | Self::Sint(size) | Self::Unorm(size) | Self::Snorm(size) => size,
            Self::Half => 2,
            Self::Float => 4,
            Self::Double => 8,
        }
    }

    /// The component as f32; for integers, the bit pattern.
    fn decode(self, bytes: &[u8]) -> f32 {
        let size = self.size();
        let mut wide = [0u8; 8];
        wide[..size].copy_from_slice(&bytes[..size]);
        let unsigned = u64::from_le_bytes(wide);
        let shift = 64 - 8 * size as u32;
        let signed = ((unsigned << shift) as i64) >> shift;
        match self {
            Self::Uint(_) => f32::from_bits(unsigned as u32),
            Self::Sint(_) => f32::from_bits(signed as i32 as u32),
            Self::Unorm(size) => unsigned as f32 / ((1u64 << (8 * size)) - 1) as f32,
            Self::Snorm(size) => (signed as f32 / ((1u64 << (8 * size - 1)) - 1) as f32).max(-1.0),
            Self::Half => f16_to_f32(unsigned as u16),
            Self::Float => f32::from_bits(unsigned as u32),
            Self::Double => f64::from_bits(unsigned) as f32,
        }
    }
}

/// The four numbers of an attribute. Components that the format lacks are 0, 0, 0, 1 (for integer formats the integer 1).
pub(crate) fn decode_attribute(format: VertexFormat, bytes: &[u8]) -> [f32; 4] {
    match format {
        VertexFormat::Unorm8x4Bgra => [2, 1, 0, 3].map(|i: usize| f32::from(bytes[i]) / 255.0),
        VertexFormat::Unorm10_10_10_2 => {
            let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let ten = |shift: u32| (word >> shift & 0x3ff) as f32 / 1023.0;
            [ten(0), ten(10), ten(20), (word >> 30) as f32 / 3.0]
        }
        _ => {
            let Some((count, component)) = components(format) else { return [0.0, 0.0, 0.0, 1.0] };
            let one = if matches!(component, Component::Uint(_) | Component::Sint(_)) { f32::from_bits(1) } else { 1.0 };
            let mut out = [0.0, 0.0, 0.0, one];
            for (i, slot) in out.iter_mut().enumerate().take(count) {
                *slot = component.decode(&bytes[i * component.size()..]);
            }
            out
        }
    }
}

/// Reads the attributes of vertices into `[group of 16][location][component][16]`. Reads beyond the end of a buffer give zeros [WebGPU robust
/// access].
pub(crate) fn fetch_attributes(
    layouts: &[VertexBufferLayout],
    buffers: &[VertexBuffer<'_>],
    locations: usize,
    vertices: &[u32],
    instance: u32,
    out: &mut Vec<f32>,
) {
    out.clear();
    if locations == 0 {
        return;
    }
    out.resize(vertices.len().div_ceil(16) * locations * 64, 0.0);
    for (layout, source) in layouts.iter().zip(buffers) {
        let bytes = source.buffer.bytes();
        for attribute in &layout.attributes {
            let size = attribute.format.size() as usize;
            for (i, &vertex) in vertices.iter().enumerate() {
                let element = if layout.step_mode == VertexStepMode::Instance { instance } else { vertex };
                let start = source.offset as u64 + u64::from(element) * layout.array_stride + attribute.offset;
                let end = start.saturating_add(size as u64);
                let value = match usize::try_from(end) {
                    Ok(end) if end <= bytes.len() => decode_attribute(attribute.format, &bytes[end - size..end]),
                    _ => [0.0; 4],
                };
                let base = (i / 16 * locations + attribute.shader_location as usize) * 64 + i % 16;
                for (component, number) in value.into_iter().enumerate() {
                    out[base + component * 16] = number;
                }
            }
        }
    }
}
