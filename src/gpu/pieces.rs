//! Pulled vertices of many draws in few buffers: a buffer and a bind group for each draw would cost more than drawing.

use std::collections::BTreeMap;
use std::ops::Range;

use super::GpuError;
use super::device::Gpu;

/// Vertices of a draw in one of the buffers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Number of the buffer.
    pub piece: usize,
    /// Vertices in units of the draw's stride.
    pub vertices: Range<u32>,
}

/// Buffers under construction.
pub(super) struct Pieces {
    /// Floats that a buffer may hold.
    capacity: usize,
    data: Vec<Vec<f32>>,
    /// By floats per vertex: the buffer that is being filled. Vertices of a buffer have one size, so that a vertex's number is its place.
    open: BTreeMap<usize, usize>,
}

impl Pieces {
    /// No buffers yet; each will have at most as many bytes as a binding of the device.
    pub fn new(gpu: &Gpu) -> Self {
        let limits = gpu.device.limits();
        Self::with_capacity((limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 4) as usize)
    }

    fn with_capacity(floats: usize) -> Self {
        Self { capacity: floats, data: Vec::new(), open: BTreeMap::new() }
    }

    /// Adds the vertices of a draw, `stride` floats each, and returns where they are. Primitives of `corners` vertices are not divided.
    pub fn add(&mut self, mut data: &[f32], stride: usize, corners: usize) -> Vec<Part> {
        let primitive = stride * corners;
        let mut parts = Vec::new();
        while !data.is_empty() {
            let room = |pieces: &Self, piece: usize| (pieces.capacity - pieces.data[piece].len()) / primitive * primitive;
            let piece = match self.open.get(&stride).filter(|&&piece| room(self, piece) > 0) {
                Some(&piece) => piece,
                None => {
                    self.data.push(Vec::new());
                    self.open.insert(stride, self.data.len() - 1);
                    self.data.len() - 1
                }
            };
            // A primitive that no binding can hold is left to the device's own limit.
            let (fits, rest) = data.split_at(room(self, piece).max(primitive).min(data.len()));
            let first = (self.data[piece].len() / stride) as u32;
            self.data[piece].extend_from_slice(fits);
            parts.push(Part { piece, vertices: first..first + (fits.len() / stride) as u32 });
            data = rest;
        }
        parts
    }

    /// The buffers on the device, each in a bind group.
    ///
    /// # Errors
    /// If the device has no memory for them.
    pub fn upload(self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> Result<Vec<wgpu::BindGroup>, GpuError> {
        let bound = |data: Vec<f32>| {
            let buffer = gpu.create_buffer("pulled vertices", bytemuck::cast_slice(&data))?;
            gpu.checked("binding pulled vertices", || {
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout,
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
                })
            })
        };
        self.data.into_iter().map(bound).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_share_buffers_and_primitives_stay_whole() {
        let mut pieces = Pieces::with_capacity(20);
        let numbers: Vec<f32> = (0..36).map(|k| k as f32).collect();
        // Triangles of 2 floats per vertex take 6 floats; three fit.
        assert_eq!(pieces.add(&numbers[..12], 2, 3), [Part { piece: 0, vertices: 0..6 }]);
        assert_eq!(pieces.add(&numbers[..12], 2, 3), [Part { piece: 0, vertices: 6..9 }, Part { piece: 1, vertices: 0..3 }]);
        // Vertices of another size have a buffer of their own.
        assert_eq!(pieces.add(&numbers[..9], 3, 3), [Part { piece: 2, vertices: 0..3 }]);
        assert_eq!(pieces.add(&[], 2, 3), []);
        assert_eq!(pieces.data[0], [&numbers[..12], &numbers[..6]].concat());
        assert_eq!(pieces.data[1], numbers[6..12]);
        assert_eq!(pieces.add(&numbers[..36], 2, 3).iter().map(|part| part.vertices.len()).sum::<usize>(), 18);
        assert!(pieces.data.iter().all(|data| data.len() <= 20));
    }
}
