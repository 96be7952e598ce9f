//! Stream-out on a driver: the vertex stage runs in a compute shader, and its results are read back in the order of the primitives.

use std::collections::btree_map::Entry;
use std::sync::Arc;

use super::GpuError;
use super::device::Gpu;
use super::frame::{DRAWS_PER_BATCH, GpuFrame, Vertices};
use super::layout::{Used, layout, storage_layout};
use super::twin::{PULLED_GROUP, STREAM_GROUP, STREAMED_VERTEX, StreamedTwin, streamed_vertex};
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::frame::{BindEntry, BindGroup, BindGroupId, Contents, Draw, Frame, Pass, PipelineId, stream_draw, stream_draws};
use nephroid_pipeline::shader::{Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader};
use nephroid_pipeline::{Bindings, Device, PrimitiveClass, RenderPipelineDescriptor, StreamOutStatistics};

/// Most workgroups of a dispatch in one dimension.
const MOST_GROUPS: u32 = 65_535;

/// Vertex shader that outputs its vertex index in two halves, which f32 holds exactly.
struct IndexOnly;

impl VertexShader for IndexOnly {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let zero = L::splat(input.token, 0.0);
        output.position = v4(zero, zero, zero, zero + 1.0);
        output.varyings[0] = input.per_vertex(|i| (i & 0xffff) as f32);
        output.varyings[1] = input.per_vertex(|i| (i >> 16) as f32);
    }
}

/// Stream-out of one pipeline. It is kept because thousands of draws share a few pipelines.
pub(super) struct Streamed {
    pipeline: wgpu::ComputePipeline,
    bindings: Vec<Used>,
    group: Option<wgpu::BindGroupLayout>,
    streams: wgpu::BindGroupLayout,
    /// The uniform whose offset each draw gives, as in [`StreamedTwin`].
    dynamic: Option<(u32, usize)>,
    /// A frame with the same buffers and a variant of this pipeline whose vertices output their indices.
    indices: Frame,
}

impl Streamed {
    fn new(gpu: &Gpu, frame: &Frame, desc: &RenderPipelineDescriptor) -> Result<Self, GpuError> {
        let program = &desc.program;
        let StreamedTwin { twin, dynamic } = streamed_vertex(program)?;
        let (pipeline, group, streams) = gpu.checked(&format!("making the stream-out of `{}`", program.name), || {
            let group = (!twin.bindings.is_empty()).then(|| layout(&gpu.device, wgpu::ShaderStages::COMPUTE, &twin.bindings));
            let streams = storage_layout(&gpu.device, wgpu::ShaderStages::COMPUTE, &[true, false]);
            let mut groups = vec![group.as_ref()];
            groups.resize(PULLED_GROUP as usize, None);
            groups.push(Some(&streams));
            let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(program.name),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(program.name),
                source: wgpu::ShaderSource::Wgsl(twin.source.as_str().into()),
            });
            let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(program.name),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(STREAMED_VERTEX),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &program.wgsl_constants, ..Default::default() },
                cache: None,
            });
            (pipeline, group, streams)
        })?;
        let half = |name| Varying { name, components: 1, interpolation: Interpolation::Flat };
        let index_only = Program {
            vertex: Arc::new(IndexOnly),
            fragment: None,
            varyings: vec![half("low"), half("high")],
            bindings: Vec::new(),
            ..(**program).clone()
        };
        let indices = Frame {
            rules: frame.rules,
            buffers: frame.buffers.clone(),
            pipelines: vec![RenderPipelineDescriptor { program: Arc::new(index_only), ..desc.clone() }],
            bind_groups: vec![BindGroup::default()],
            ..Frame::default()
        };
        Ok(Self { pipeline, bindings: twin.bindings, group, streams, dynamic, indices })
    }

    /// The vertex index of every corner of each draw's primitives, in order.
    fn vertex_indices(&self, draws: &[&Draw], device: &Device, contents: &Contents) -> Result<Vec<Vec<u32>>, GpuError> {
        let (buffers, streamed) = (contents.buffers.clone(), contents.streamed.clone());
        let only = |draw: &&Draw| Draw { pipeline: PipelineId::at(0), bind_group: BindGroupId::at(0), ..(*draw).clone() };
        let draws: Vec<Draw> = draws.iter().map(only).collect();
        let contents = Contents { buffers, streamed, ..Contents::default() };
        let streams = stream_draws(device, &self.indices, &Pass::default(), &draws, &contents)?;
        let indices = |data: Vec<f32>| data.chunks_exact(6).map(|v| v[4] as u32 | (v[5] as u32) << 16).collect();
        Ok(streams.into_iter().map(|(_, stream)| indices(stream.data)).collect())
    }

    /// The dynamic uniforms of draws of one bind group as an array, if the program has such a uniform.
    fn per_draw(&self, gpu: &Gpu, frame: &Frame, draws: &[&Draw], contents: &Contents) -> Result<Option<wgpu::Buffer>, GpuError> {
        let Some((binding, stride)) = self.dynamic else { return Ok(None) };
        let entry = draws.first().and_then(|draw| frame.bind_groups[draw.bind_group.index()].entries.get(binding as usize));
        let Some(BindEntry::DynamicUniform(id)) = entry else { return Ok(None) };
        let from = contents.buffer(*id).bytes();
        let mut uniforms = vec![0; stride * draws.len()];
        for (to, draw) in uniforms.chunks_exact_mut(stride).zip(draws) {
            let from = from.get(draw.dynamic_offset as usize..).unwrap_or_default();
            let bytes = from.len().min(stride);
            to[..bytes].copy_from_slice(&from[..bytes]);
        }
        gpu.create_buffer("uniforms of draws", &uniforms).map(Some)
    }
}

impl GpuFrame<'_> {
    /// Streams out a pass's primitives to the device's buffers and to those of `contents`, before the pass is drawn. The driver runs the vertex
    /// stage, unless `vertices` is `Pulled` or the draw has a geometry stage or vertex buffers, which the software GPU runs.
    ///
    /// # Errors
    /// If a program has no WGSL twin, or the driver fails.
    pub fn stream_pass(
        &mut self,
        pass: usize,
        vertices: Vertices,
        device: &Device,
        contents: &mut Contents,
    ) -> Result<Vec<StreamOutStatistics>, GpuError> {
        let frame = self.frame;
        let described = &frame.passes[pass];
        let mut statistics = Vec::with_capacity(described.stream_out.len());
        for (target, stream) in described.stream_out.iter().enumerate() {
            let room = contents.stream_room(stream.buffer, stream.append) / size_of::<f32>();
            let (mut data, mut counts, mut streamed_vertices) = (Vec::new(), StreamOutStatistics::default(), 0);
            for (number, draw) in described.draws.iter().enumerate().filter(|(_, draw)| draw.stream_out == Some(target as u32)) {
                let desc = &frame.pipelines[draw.pipeline.index()];
                let expanded = vertices == Vertices::Pulled || desc.program.geometry.is_some() || !draw.vertex_buffers.is_empty();
                let (class, streamed) = match expanded {
                    true => {
                        let (class, target) = stream_draw(device, frame, described, draw, contents)?;
                        (class, target.data)
                    }
                    false => (PrimitiveClass::of(desc.primitive.topology), self.stream_out(pass, number, device, contents)?),
                };
                let floats = frame.stream_floats(draw.pipeline);
                let primitive = floats * class.corners();
                let needed = streamed.len() / primitive;
                // After the first primitive that does not fit, nothing more is written.
                let full = counts.primitives_written < counts.primitive_storage_needed;
                let written = if full { 0 } else { needed.min((room - data.len()) / primitive) };
                data.extend_from_slice(&streamed[..written * primitive]);
                counts.primitives_written += written as u64;
                counts.primitive_storage_needed += needed as u64;
                streamed_vertices += (written * class.corners()) as u32;
            }
            contents.write_streamed(stream.buffer, stream.append, &data, streamed_vertices);
            self.upload_buffer(stream.buffer, contents.buffer(stream.buffer))?;
            statistics.push(counts);
        }
        Ok(statistics)
    }

    /// Runs the vertex stage of one draw on the driver and returns the stream-out: for each vertex of each primitive, clip position (4) and varyings.
    /// `device` assembles the primitives from the buffers of `contents`.
    ///
    /// # Errors
    /// If the draw has a geometry stage or vertex buffers, which the compute shader does not support, or if the driver fails.
    pub fn stream_out(&mut self, pass: usize, draw: usize, device: &Device, contents: &Contents) -> Result<Vec<f32>, GpuError> {
        Ok(self.stream_out_draws(pass, &[draw], device, contents)?.swap_remove(0))
    }

    /// [`Self::stream_out`] of several draws: the stream of each. Neighbouring draws of one pipeline and bind group run together.
    ///
    /// # Errors
    /// As [`Self::stream_out`].
    pub fn stream_out_draws(
        &mut self,
        pass: usize,
        numbers: &[usize],
        device: &Device,
        contents: &Contents,
    ) -> Result<Vec<Vec<f32>>, GpuError> {
        let frame = self.frame;
        let draws: Vec<&Draw> = numbers.iter().map(|&number| &frame.passes[pass].draws[number]).collect();
        let mut streams = Vec::with_capacity(draws.len());
        for alike in draws.chunk_by(|a, b| (a.pipeline, a.bind_group) == (b.pipeline, b.bind_group)) {
            for batch in alike.chunks(DRAWS_PER_BATCH) {
                self.stream_batch(batch, device, contents, &mut streams)?;
            }
        }
        Ok(streams)
    }

    /// Appends the streams of draws that have one pipeline and one bind group.
    fn stream_batch(&mut self, draws: &[&Draw], device: &Device, contents: &Contents, streams: &mut Vec<Vec<f32>>) -> Result<(), GpuError> {
        let (gpu, frame, first) = (self.gpu, self.frame, draws[0]);
        let desc = &frame.pipelines[first.pipeline.index()];
        let fail = |why: &str| GpuError::Twin { program: desc.program.name, why: why.to_owned() };
        if desc.program.geometry.is_some() {
            return Err(fail("its geometry stage cannot be streamed out on a driver"));
        }
        if draws.iter().any(|draw| !draw.vertex_buffers.is_empty()) {
            return Err(fail("vertex buffers cannot be streamed out on a driver"));
        }
        if let Entry::Vacant(new) = self.streamed.entry(first.pipeline) {
            new.insert(Streamed::new(gpu, frame, desc)?);
        }
        let streamed = &self.streamed[&first.pipeline];
        let indices = streamed.vertex_indices(draws, device, contents)?;
        let per_draw = streamed.per_draw(gpu, frame, draws, contents)?;
        let group = match &streamed.group {
            None => None,
            Some(layout) => Some(self.bind_group(first, &streamed.bindings, layout, per_draw.as_ref())?),
        };
        let stride = frame.stream_floats(first.pipeline);
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / (4 * stride.max(2) as u64);
        let numbered: Vec<[u32; 2]> =
            (0..).zip(&indices).flat_map(|(draw, indices)| indices.iter().map(move |&index| [index, draw])).collect();
        let mut stream = Vec::with_capacity(numbered.len() * stride);
        for piece in numbered.chunks((most.max(1) as usize).min(MOST_GROUPS as usize * STREAM_GROUP as usize)) {
            stream.extend(self.stream_piece(piece, stride, streamed, group.as_ref())?);
        }
        let mut rest = &stream[..];
        for of_draw in &indices {
            let (own, others) = rest.split_at(of_draw.len() * stride);
            streams.push(own.to_vec());
            rest = others;
        }
        Ok(())
    }

    fn stream_piece(
        &self,
        indices: &[[u32; 2]],
        stride: usize,
        streamed: &Streamed,
        group: Option<&wgpu::BindGroup>,
    ) -> Result<Vec<f32>, GpuError> {
        let gpu = self.gpu;
        let from = gpu.create_buffer("vertex indices", bytemuck::cast_slice(indices))?;
        let bytes = (indices.len() * stride * 4) as u64;
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("stream-out"), size: bytes, usage, mapped_at_creation: false })
        };
        let read = gpu.checked("streaming out", || {
            let to = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
            let read = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
            let whole = |buffer, size| {
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: std::num::NonZeroU64::new(size) })
            };
            let streams = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &streamed.streams,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: whole(&from, indices.len() as u64 * 8) },
                    wgpu::BindGroupEntry { binding: 1, resource: whole(&to, bytes) },
                ],
            });
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&streamed.pipeline);
            if let Some(group) = group {
                pass.set_bind_group(0, group, &[]);
            }
            pass.set_bind_group(PULLED_GROUP, &streams, &[]);
            pass.dispatch_workgroups((indices.len() as u32).div_ceil(STREAM_GROUP), 1, 1);
            drop(pass);
            encoder.copy_buffer_to_buffer(&to, 0, &read, 0, bytes);
            gpu.queue.submit([encoder.finish()]);
            read.map_async(wgpu::MapMode::Read, .., |_| {});
            read
        })?;
        gpu.wait()?;
        let mapped =
            read.get_mapped_range(..).map_err(|error| GpuError::Driver { doing: "streaming out".into(), why: error.to_string() })?;
        let floats = mapped.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        Ok(floats.collect())
    }
}
