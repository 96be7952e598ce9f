//! Layouts of bind groups, as the entry points of a twin use them.

use naga::valid::ModuleInfo;

use nephroid_pipeline::BindingKind;

/// A binding of group 0 that the entry points of a pipeline use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Used {
    pub number: u32,
    pub ty: wgpu::BindingType,
}

impl Used {
    /// Whether each draw gives the binding's offset.
    pub fn is_dynamic(&self) -> bool {
        matches!(self.ty, wgpu::BindingType::Buffer { has_dynamic_offset: true, .. })
    }
}

/// Bindings of group 0 that some entry points use, by number. `kinds` are those of the program.
///
/// # Errors
/// If a binding is of a kind that frames do not have.
pub(super) fn used_bindings(
    module: &naga::Module,
    info: &ModuleInfo,
    entries: &[usize],
    kinds: &[BindingKind],
) -> Result<Vec<Used>, String> {
    let mut used: Vec<Used> = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        let Some(binding) = variable.binding.as_ref().filter(|b| b.group == 0) else { continue };
        if entries.iter().all(|&index| info.get_entry_point(index)[handle].is_empty()) {
            continue;
        }
        let number = binding.binding;
        let ty = match variable.space {
            naga::AddressSpace::Uniform => {
                let has_dynamic_offset = matches!(kinds.get(number as usize), Some(BindingKind::DynamicUniform(_)));
                wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset, min_binding_size: None }
            }
            naga::AddressSpace::Storage { access } => storage(!access.contains(naga::StorageAccess::STORE)),
            _ => {
                let is_sampled =
                    entries.iter().any(|&index| info.get_entry_point(index).sampling_set.iter().any(|key| key.image == handle));
                handle_type(&module.types[variable.ty].inner, is_sampled)
                    .ok_or_else(|| format!("binding {number} of its twin is neither a buffer, a texture nor a sampler"))?
            }
        };
        if used.iter().all(|known| known.number != number) {
            used.push(Used { number, ty });
        }
    }
    used.sort_by_key(|binding| binding.number);
    Ok(used)
}

/// A storage buffer.
pub(super) fn storage(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Storage { read_only }, has_dynamic_offset: false, min_binding_size: None }
}

/// A layout whose bindings have these types.
pub(super) fn layout(device: &wgpu::Device, stages: wgpu::ShaderStages, used: &[Used]) -> wgpu::BindGroupLayout {
    let entry = |binding: &Used| wgpu::BindGroupLayoutEntry { binding: binding.number, visibility: stages, ty: binding.ty, count: None };
    let entries: Vec<_> = used.iter().map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// The layout of a group of storage buffers alone, numbered from 0; `read_only` says which of them are.
pub(super) fn storage_layout(device: &wgpu::Device, stages: wgpu::ShaderStages, read_only: &[bool]) -> wgpu::BindGroupLayout {
    let used: Vec<Used> = (0..).zip(read_only).map(|(number, &read_only)| Used { number, ty: storage(read_only) }).collect();
    layout(device, stages, &used)
}

/// The type of a texture or sampler binding. `is_sampled` says whether a texture is read through a sampler.
fn handle_type(inner: &naga::TypeInner, is_sampled: bool) -> Option<wgpu::BindingType> {
    let (dim, arrayed, class) = match *inner {
        naga::TypeInner::Sampler { comparison } => {
            let kind = if comparison { wgpu::SamplerBindingType::Comparison } else { wgpu::SamplerBindingType::Filtering };
            return Some(wgpu::BindingType::Sampler(kind));
        }
        naga::TypeInner::Image { dim, arrayed, class } => (dim, arrayed, class),
        _ => return None,
    };
    let view_dimension = match (dim, arrayed) {
        (naga::ImageDimension::D1, _) => wgpu::TextureViewDimension::D1,
        (naga::ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
        (naga::ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
        (naga::ImageDimension::D3, _) => wgpu::TextureViewDimension::D3,
        (naga::ImageDimension::Cube, false) => wgpu::TextureViewDimension::Cube,
        (naga::ImageDimension::Cube, true) => wgpu::TextureViewDimension::CubeArray,
    };
    let sample_type = match class {
        naga::ImageClass::Depth { multi: false } => wgpu::TextureSampleType::Depth,
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Sint, multi: false } => wgpu::TextureSampleType::Sint,
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi: false } => wgpu::TextureSampleType::Uint,
        naga::ImageClass::Sampled { multi: false, .. } => wgpu::TextureSampleType::Float { filterable: is_sampled },
        _ => return None,
    };
    Some(wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}
