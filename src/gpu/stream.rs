//! Stream-out on a driver: the vertex stage runs in a compute shader, and its results are read back in the order of the primitives.

use std::sync::Arc;

use super::GpuError;
use super::device::Gpu;
use super::frame::{GpuFrame, Vertices};
use super::twin::{PULLED_GROUP, STREAM_GROUP, STREAMED_VERTEX, TextureUse, streamed_vertex};
use nephroid_math::lanes::Lanes;
use nephroid_math::vector::v4;
use nephroid_pipeline::frame::{BindGroup, BindGroupId, Contents, Draw, Frame, Pass, PipelineId, stream_draw};
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
    bindings: Vec<(u32, Option<TextureUse>)>,
    /// A frame with the same buffers and a variant of this pipeline whose vertices output their indices.
    indices: Frame,
}

impl Streamed {
    fn new(gpu: &Gpu, frame: &Frame, desc: &RenderPipelineDescriptor) -> Result<Self, GpuError> {
        let program = &desc.program;
        let twin = streamed_vertex(program)?;
        let pipeline = gpu.checked(&format!("making the stream-out of `{}`", program.name), || {
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(program.name),
                source: wgpu::ShaderSource::Wgsl(twin.source.as_str().into()),
            });
            gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(program.name),
                layout: None,
                module: &module,
                entry_point: Some(STREAMED_VERTEX),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &program.wgsl_constants, ..Default::default() },
                cache: None,
            })
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
        Ok(Self { pipeline, bindings: twin.bindings, indices })
    }

    /// The vertex index of every corner of a draw's primitives, in order.
    fn vertex_indices(&self, draw: &Draw, device: &Device, contents: &Contents) -> Result<Vec<u32>, GpuError> {
        let (buffers, streamed) = (contents.buffers.clone(), contents.streamed.clone());
        let draw = Draw { pipeline: PipelineId::at(0), bind_group: BindGroupId::at(0), ..draw.clone() };
        let (_, stream) =
            stream_draw(device, &self.indices, &Pass::default(), &draw, &Contents { buffers, streamed, ..Contents::default() })?;
        Ok(stream.data.chunks_exact(6).map(|v| v[4] as u32 | (v[5] as u32) << 16).collect())
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
        let frame = self.frame();
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
        let frame = self.frame();
        let described = &frame.passes[pass].draws[draw];
        let desc = &frame.pipelines[described.pipeline.index()];
        let program = &desc.program;
        let fail = |why: &str| GpuError::Twin { program: program.name, why: why.to_owned() };
        if program.geometry.is_some() {
            return Err(fail("its geometry stage cannot be streamed out on a driver"));
        }
        if !described.vertex_buffers.is_empty() {
            return Err(fail("vertex buffers cannot be streamed out on a driver"));
        }
        if !self.streamed.contains_key(&described.pipeline) {
            self.streamed.insert(described.pipeline, Streamed::new(self.gpu(), frame, desc)?);
        }
        let streamed = &self.streamed[&described.pipeline];
        let indices = streamed.vertex_indices(described, device, contents)?;
        let group = match streamed.bindings.is_empty() {
            true => None,
            false => Some(self.bind_group(described, &streamed.bindings, &streamed.pipeline.get_bind_group_layout(0))?),
        };
        let stride = frame.stream_floats(described.pipeline);
        let limits = self.gpu().device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / (4 * stride as u64);
        let mut stream = Vec::with_capacity(indices.len() * stride);
        for piece in indices.chunks((most.max(1) as usize).min(MOST_GROUPS as usize * STREAM_GROUP as usize)) {
            stream.extend(self.stream_piece(piece, stride, &streamed.pipeline, group.as_ref())?);
        }
        Ok(stream)
    }

    fn stream_piece(
        &self,
        indices: &[u32],
        stride: usize,
        pipeline: &wgpu::ComputePipeline,
        group: Option<&wgpu::BindGroup>,
    ) -> Result<Vec<f32>, GpuError> {
        let gpu = self.gpu();
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
                layout: &pipeline.get_bind_group_layout(PULLED_GROUP),
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: whole(&from, indices.len() as u64 * 4) },
                    wgpu::BindGroupEntry { binding: 1, resource: whole(&to, bytes) },
                ],
            });
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(pipeline);
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
