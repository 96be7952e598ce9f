//! A frame's textures and buffers on a device: creation, upload and download.

use super::GpuError;
use super::device::Gpu;
use nephroid_pipeline::frame::{Frame, TextureId};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{Buffer, ChannelKind, Texture, TextureDescriptor, TextureShape, format_info};

/// Alignment of rows in buffers, bytes [WebGPU §copying].
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

impl Gpu {
    pub(super) fn create_texture(&self, desc: &TextureDescriptor) -> Result<wgpu::Texture, GpuError> {
        let limits = self.device.limits();
        let volume = desc.shape == TextureShape::D3;
        let largest = if volume { limits.max_texture_dimension_3d } else { limits.max_texture_dimension_2d };
        self.within(&format!("the larger side of texture `{}`", desc.label), desc.width.max(desc.height).into(), largest.into())?;
        if desc.format == TextureFormat::Depth32FloatStencil8 {
            self.require(wgpu::Features::DEPTH32FLOAT_STENCIL8, &desc.label)?;
        }
        let mut usage = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::TEXTURE_BINDING;
        if self.can_draw_to(desc.format) {
            usage |= wgpu::TextureUsages::RENDER_ATTACHMENT;
        }
        self.checked(&format!("making texture `{}`", desc.label), || {
            self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(&desc.label),
                size: wgpu::Extent3d { width: desc.width, height: desc.height, depth_or_array_layers: desc.depth_or_layers },
                mip_level_count: desc.mip_level_count,
                sample_count: 1,
                dimension: if volume { wgpu::TextureDimension::D3 } else { wgpu::TextureDimension::D2 },
                format: desc.format,
                usage,
                view_formats: &[],
            })
        })
    }

    /// Whether the device can draw to a format. Pipelines that draw to the format need the feature; textures that are only read do not.
    fn can_draw_to(&self, format: TextureFormat) -> bool {
        let renderable = format_info(format).is_some_and(|info| info.renderable);
        let features = self.device.features();
        renderable && (format != TextureFormat::Rg11b10Ufloat || features.contains(wgpu::Features::RG11B10UFLOAT_RENDERABLE))
    }

    /// Creates a buffer with these bytes and every usage that frames have for buffers.
    pub(super) fn create_buffer(&self, label: &str, bytes: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let size = (bytes.len().max(1).next_multiple_of(16)) as u64;
        self.within(&format!("buffer `{label}` in bytes"), size, self.device.limits().max_buffer_size)?;
        self.checked(&format!("making buffer `{label}`"), || {
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::COPY_DST
                    | wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::VERTEX
                    | wgpu::BufferUsages::INDEX,
                mapped_at_creation: false,
            });
            self.queue_buffer(&buffer, bytes);
            buffer
        })
    }

    /// Replaces the bytes of a buffer on the device, at most as many as it has.
    pub(super) fn write_buffer(&self, buffer: &wgpu::Buffer, bytes: &[u8]) -> Result<(), GpuError> {
        self.checked("filling a buffer", || self.queue_buffer(buffer, bytes))
    }

    fn queue_buffer(&self, buffer: &wgpu::Buffer, bytes: &[u8]) {
        let whole = bytes.len() / 4 * 4;
        self.queue.write_buffer(buffer, 0, &bytes[..whole]);
        if whole < bytes.len() {
            let mut last = [0; 4];
            last[..bytes.len() - whole].copy_from_slice(&bytes[whole..]);
            self.queue.write_buffer(buffer, whole as u64, &last);
        }
    }

    /// Uploads a texture's contents, all levels and layers, to a texture on the device.
    pub(super) fn upload(&self, to: &wgpu::Texture, from: &Texture) -> Result<(), GpuError> {
        let desc = from.desc();
        self.checked(&format!("filling texture `{}`", desc.label), || {
            for level in 0..desc.mip_level_count {
                for layer in 0..desc.level_size(level).2 {
                    self.upload_surface(to, from, level, layer);
                }
            }
        })
    }

    fn upload_surface(&self, to: &wgpu::Texture, from: &Texture, level: u32, layer: u32) {
        let (desc, info) = (from.desc(), from.info());
        let (width, height, _) = desc.level_size(level);
        let texels = width as usize * height as usize;
        let bytes = from.read_bytes(level, layer);
        let write = |texture: &wgpu::Texture, origin_z: u32, mip_level: u32, aspect: wgpu::TextureAspect, bytes: &[u8]| {
            self.queue.write_texture(
                wgpu::TexelCopyTextureInfo { texture, mip_level, origin: wgpu::Origin3d { x: 0, y: 0, z: origin_z }, aspect },
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some((bytes.len() / height as usize) as u32),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
        };
        if !info.depth && !info.stencil {
            return write(to, layer, level, wgpu::TextureAspect::All, &bytes);
        }
        if info.depth && desc.format == TextureFormat::Depth16Unorm {
            return write(to, layer, level, wgpu::TextureAspect::All, &bytes);
        }
        if info.depth {
            let numbers: Vec<f32> =
                (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| from.texel(level, layer, x, y)[0]).collect();
            let staging = self.device.create_texture(&staging_texture(width, height));
            write(&staging, 0, 0, wgpu::TextureAspect::All, bytemuck::cast_slice(&numbers));
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let view = to.create_view(&attachment_view(level, layer));
            self.depth_copy.write(
                &self.device,
                &mut encoder,
                &staging.create_view(&wgpu::TextureViewDescriptor::default()),
                (&view, desc.format),
            );
            self.queue.submit([encoder.finish()]);
        }
        if info.stencil {
            write(to, layer, level, wgpu::TextureAspect::StencilOnly, &bytes[texels * info.bytes..]);
        }
    }

    /// Reads one surface of a texture on the device into `into`, which must have the texture's description.
    pub(super) fn download(&self, from: &wgpu::Texture, into: &mut Texture, level: u32, layer: u32) -> Result<(), GpuError> {
        let doing = format!("reading texture `{}`", into.desc().label);
        let info = into.info();
        let format = into.desc().format;
        let fail = |why: String| GpuError::Driver { doing: doing.clone(), why };
        if info.depth && matches!(info.kind, ChannelKind::UnormDepth(24)) {
            let (width, height, _) = into.desc().level_size(level);
            let staging = self.checked(&doing, || {
                let staging = self.device.create_texture(&staging_texture(width, height));
                let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                let depth = from
                    .create_view(&wgpu::TextureViewDescriptor { aspect: wgpu::TextureAspect::DepthOnly, ..attachment_view(level, layer) });
                self.depth_copy.read(&self.device, &mut encoder, &depth, &staging.create_view(&wgpu::TextureViewDescriptor::default()));
                self.queue.submit([encoder.finish()]);
                staging
            })?;
            let bytes = self.read_back(&doing, &staging, wgpu::TextureAspect::All, (0, 0), (width, height), 4)?;
            for (i, number) in bytes.chunks_exact(4).enumerate() {
                let depth = f32::from_le_bytes([number[0], number[1], number[2], number[3]]);
                into.set_texel(level, layer, i as u32 % width, i as u32 / width, [depth, 0.0, 0.0, 0.0]);
            }
        } else if info.channels > 0 {
            let size = into.desc().level_size(level);
            let aspect = if info.depth { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All };
            let bytes = self.read_back(&doing, from, aspect, (level, layer), (size.0, size.1), info.bytes)?;
            into.write_bytes(level, layer, &bytes).map_err(|error| fail(error.to_string()))?;
        }
        if format_info(format).is_some_and(|f| f.stencil) {
            let size = into.desc().level_size(level);
            let bytes = self.read_back(&doing, from, wgpu::TextureAspect::StencilOnly, (level, layer), (size.0, size.1), 1)?;
            for (i, value) in bytes.into_iter().enumerate() {
                into.set_stencil(level, layer, i as u32 % size.0, i as u32 / size.0, value);
            }
        }
        Ok(())
    }

    /// Reads the bytes of one surface, rows top down, tightly packed.
    fn read_back(
        &self,
        doing: &str,
        texture: &wgpu::Texture,
        aspect: wgpu::TextureAspect,
        (mip_level, layer): (u32, u32),
        (width, height): (u32, u32),
        texel_bytes: usize,
    ) -> Result<Vec<u8>, GpuError> {
        let row = width as usize * texel_bytes;
        let pitch = (row as u32).next_multiple_of(ROW_ALIGNMENT);
        let size = u64::from(pitch) * u64::from(height);
        self.within(&format!("{doing}: bytes"), size, self.device.limits().max_buffer_size)?;
        let buffer = self.checked(doing, || {
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read back"),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_texture_to_buffer(
                wgpu::TexelCopyTextureInfo { texture, mip_level, origin: wgpu::Origin3d { x: 0, y: 0, z: layer }, aspect },
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None },
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
            self.queue.submit([encoder.finish()]);
            buffer.map_async(wgpu::MapMode::Read, .., |_| {});
            buffer
        })?;
        self.wait()?;
        let mapped = buffer.get_mapped_range(..).map_err(|error| GpuError::Driver { doing: doing.to_owned(), why: error.to_string() })?;
        let rows = mapped.chunks_exact(pitch as usize);
        Ok(rows.flat_map(|bytes| &bytes[..row]).copied().collect())
    }
}

/// Description of the r32float texture through which depth is copied.
fn staging_texture(width: u32, height: u32) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some("depth copy"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::R32Float,
        usage: wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    }
}

/// One level of one layer, all aspects.
pub(super) fn attachment_view(level: u32, layer: u32) -> wgpu::TextureViewDescriptor<'static> {
    wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_mip_level: level,
        mip_level_count: Some(1),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..wgpu::TextureViewDescriptor::default()
    }
}

/// A frame's textures and buffers on a device.
#[derive(Debug)]
pub(super) struct Resources {
    pub textures: Vec<wgpu::Texture>,
    pub buffers: Vec<wgpu::Buffer>,
}

impl Resources {
    /// Creates the textures, filled with zeros, and the buffers.
    ///
    /// # Errors
    /// If the device lacks a feature or memory, or a limit is exceeded.
    pub fn new(gpu: &Gpu, frame: &Frame) -> Result<Self, GpuError> {
        let textures = frame.textures.iter().map(|t| gpu.create_texture(&t.desc)).collect::<Result<_, _>>()?;
        let bytes = |data: &Buffer, label: &str| gpu.create_buffer(label, data.bytes());
        let buffers = frame.buffers.iter().map(|b| bytes(&b.data, &b.label)).collect::<Result<_, _>>()?;
        Ok(Self { textures, buffers })
    }

    pub fn texture(&self, id: TextureId) -> &wgpu::Texture {
        &self.textures[id.index()]
    }
}
