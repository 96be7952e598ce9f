//! Typed, strided, possibly sparse views of buffers, checked before a byte is read.

use std::borrow::Cow;

use gltf_json::{
    self as json,
    accessor::{ComponentType, Type},
    validation::Checked,
};

use super::{
    super::{Fault, Place},
    lookup,
};

/// The bytes of all buffers.
#[derive(Default)]
pub(super) struct Buffers<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// Adds the next buffer, cut to its declared length.
    pub(super) fn push(&mut self, data: Cow<'a, [u8]>, declared: u64, place: impl Fn() -> Place) -> Result<(), Fault> {
        let present = data.len() as u64;
        if declared > present {
            return Err(Fault::truncated(place(), "the buffer", declared, present));
        }
        self.buffers.push(data);
        Ok(())
    }

    /// Bytes of all buffers together.
    fn byte_count(&self) -> u64 {
        self.buffers.iter().map(|b| b.len() as u64).sum()
    }

    /// A part of a buffer view from `offset` to its end, and the view's stride.
    fn view(&self, root: &json::Root, view: usize, offset: u64, place: &str) -> Result<(&[u8], Option<usize>), Fault> {
        let at = || Place::Item(format!("{place}.bufferView {view}"));
        let view = lookup(&root.buffer_views, view, &format!("{place}.bufferView"), "bufferViews")?;
        let index = view.buffer.value();
        let Some(buffer) = self.buffers.get(index) else {
            return Err(Fault::out_of_range(
                at(),
                "the buffer",
                index as i64,
                format!("an index of buffers, which has {}", self.buffers.len()),
            ));
        };
        let (from, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let end = from.checked_add(length).filter(|end| *end <= buffer.len() as u64);
        let Some(end) = end else {
            return Err(Fault::truncated(
                at(),
                format!("the range of {length} bytes from {from}"),
                from.saturating_add(length),
                buffer.len() as u64,
            ));
        };
        if offset > length {
            return Err(Fault::truncated(at(), "the byteOffset of the accessor", offset, length));
        }
        Ok((&buffer[(from + offset) as usize..end as usize], view.byte_stride.map(|s| s.0)))
    }
}

/// Equal numbers at equal distances.
#[derive(Clone, Copy)]
struct Array<'a> {
    bytes: &'a [u8],
    stride: usize,
    component: ComponentType,
    normalized: bool,
}

impl Array<'_> {
    /// Component `k` of element `i`. Normalised integers go to −1..=1 or 0..=1 as the specification has it.
    fn number(&self, i: usize, k: usize) -> f64 {
        let at = i * self.stride + k * self.component.size();
        let raw = &self.bytes[at..at + self.component.size()];
        let (value, largest) = match self.component {
            ComponentType::I8 => (f64::from(raw[0] as i8), 127.0),
            ComponentType::U8 => (f64::from(raw[0]), 255.0),
            ComponentType::I16 => (f64::from(i16::from_le_bytes([raw[0], raw[1]])), 32_767.0),
            ComponentType::U16 => (f64::from(u16::from_le_bytes([raw[0], raw[1]])), 65_535.0),
            ComponentType::U32 => (f64::from(u32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]])), 4_294_967_295.0),
            ComponentType::F32 => return f64::from(f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]])),
        };
        if self.normalized { (value / largest).max(-1.0) } else { value }
    }
}

/// An accessor that was found to fit its buffers.
pub(super) struct Accessor<'a> {
    /// Number of elements.
    pub count: usize,
    /// Type of a component.
    pub component: ComponentType,
    /// Whether integers stand for fractions.
    pub normalized: bool,
    dimensions: usize,
    base: Option<Array<'a>>,
    /// Elements that differ from the base, rising, and their values.
    sparse: Option<(Vec<u32>, Array<'a>)>,
}

impl<'a> Accessor<'a> {
    /// Looks up an accessor and checks type and range. `place` names who uses it.
    pub(super) fn new(root: &json::Root, buffers: &'a Buffers<'_>, index: usize, wanted: Type, place: &str) -> Result<Self, Fault> {
        let accessor = lookup(&root.accessors, index, place, "accessors")?;
        let place = format!("accessors[{index}] ({place})");
        let at = || Place::Item(place.clone());
        let Checked::Valid(component) = accessor.component_type else {
            return Err(Fault::syntax(at(), "a componentType of 5120, 5121, 5122, 5123, 5125 or 5126", "another"));
        };
        if accessor.type_ != Checked::Valid(wanted) {
            return Err(Fault::syntax(at(), format!("the type {wanted:?}"), format!("{:?}", accessor.type_)));
        }
        let dimensions = wanted.multiplicity();
        let component = component.0;
        let element_size = dimensions * component.size();
        let count_declared = accessor.count.0;
        let array = |view: usize, offset: u64, component: ComponentType, size: usize, count: u64, normalized: bool| {
            let (bytes, stride) = buffers.view(root, view, offset, &place)?;
            let stride = stride.filter(|s| *s != 0).unwrap_or(size);
            if stride < size {
                return Err(Fault::syntax(at(), format!("a byteStride of at least {size}, the size of an element"), stride.to_string()));
            }
            // The last element ends where it ends, not a stride later.
            let needed = if count == 0 { 0 } else { (count - 1).saturating_mul(stride as u64).saturating_add(size as u64) };
            if needed > bytes.len() as u64 {
                return Err(Fault::truncated(at(), format!("{count} elements"), needed, bytes.len() as u64));
            }
            Ok(Array { bytes, stride, component, normalized })
        };

        let offset = accessor.byte_offset.unwrap_or_default().0;
        let base = match accessor.buffer_view {
            Some(view) => Some(array(view.value(), offset, component, element_size, count_declared, accessor.normalized)?),
            // All zero but for the sparse ones: nothing in a buffer bounds the count, so the whole file must.
            None if accessor.sparse.is_some() && count_declared <= buffers.byte_count() => None,
            None => {
                return Err(Fault::syntax(
                    at(),
                    "a bufferView (data may be in an extension that is not supported)",
                    format!("none, with a count of {count_declared}"),
                ));
            }
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => {
                let Checked::Valid(index_type) = sparse.indices.component_type else {
                    return Err(Fault::syntax(at(), "a componentType of 5121, 5123 or 5125 for sparse indices", "another"));
                };
                let (count, index_type) = (sparse.count.0, index_type.0);
                let indices =
                    array(sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0, index_type, index_type.size(), count, false)?;
                let values = array(
                    sparse.values.buffer_view.value(),
                    sparse.values.byte_offset.0,
                    component,
                    element_size,
                    count,
                    accessor.normalized,
                )?;
                let indices: Vec<u32> = (0..count as usize).map(|i| indices.number(i, 0) as u32).collect();
                if let Some(pair) = indices.windows(2).find(|w| w[0] >= w[1]) {
                    return Err(Fault::syntax(at(), "sparse indices that rise", format!("{} after {}", pair[1], pair[0])));
                }
                if let Some(&last) = indices.last().filter(|i| u64::from(**i) >= count_declared) {
                    return Err(Fault::out_of_range(at(), "a sparse index", i64::from(last), format!("below the count, {count_declared}")));
                }
                Some((indices, values))
            }
        };
        // The checks above bound the count by bytes in memory.
        Ok(Self { count: count_declared as usize, component, normalized: accessor.normalized, dimensions, base, sparse })
    }

    /// Component `k` of element `i`, both in range.
    pub(super) fn number(&self, i: usize, k: usize) -> f64 {
        debug_assert!(i < self.count && k < self.dimensions, "element {i}, component {k}");
        if let Some((indices, values)) = &self.sparse
            && let Ok(found) = indices.binary_search(&(i as u32))
        {
            return values.number(found, k);
        }
        self.base.map_or(0.0, |base| base.number(i, k))
    }

    /// All components of element `i`.
    pub(super) fn vector<const N: usize>(&self, i: usize) -> [f32; N] {
        std::array::from_fn(|k| self.number(i, k) as f32)
    }
}
