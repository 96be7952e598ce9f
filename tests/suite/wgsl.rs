//! The WGSL twins: parsed, validated, and their structs compared field by field with the Rust structs. Needs no driver.

use std::sync::Arc;

use nephroid::caustics::caustic_volumes::shaders::VolumeUniform;
use nephroid::caustics::splatting::{pyramid, splats::Source};
use nephroid::caustics::{Layout, RenderOptions, Renderer, layout};
use nephroid::pipeline::BindingKind;
use nephroid::pipeline::shader::Program;

use crate::support::{self, scene_of_size, shared_passes, techniques, with_coarse_parts};

/// Every program of every frame, in every variant of every technique; together the scenes have everything that a program is made for; and of the
/// passes that no technique draws yet, or none in a variant.
fn programs() -> Vec<Arc<Program>> {
    let mut programs: Vec<Arc<Program>> = vec![nephroid::passes::in_scattering::program(), pyramid::pick()];
    programs.extend([Source::Textures, Source::Records].map(pyramid::program));
    for name in ["pool.ron", "pots.ron", "columns.ron", "analytic/flat_water.ron", "analytic/sine_water.ron", "ball.ron"] {
        for (technique, variant) in support::variants() {
            let mut scene = with_coarse_parts(scene_of_size(name, (16, 16)));
            scene.time_s = 0.0;
            variant.apply(&mut scene);
            scene.techniques.coarsen();
            technique.coarsen(&mut scene);
            let options = RenderOptions { technique: technique.name().to_owned(), techniques: techniques(), ..RenderOptions::default() };
            let mut renderer = Renderer::new(&scene, &options).expect("a renderer");
            for pipeline in renderer.build(&scene).expect("a frame").frame.pipelines {
                if !programs.iter().any(|p| p.name == pipeline.program.name && p.wgsl_constants == pipeline.program.wgsl_constants) {
                    programs.push(pipeline.program);
                }
            }
        }
    }
    for pipeline in shared_passes::frame().pipelines {
        if !programs.iter().any(|p| p.name == pipeline.program.name) {
            programs.push(pipeline.program);
        }
    }
    programs
}

fn parse(name: &str, source: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    module
}

fn struct_of<'m>(module: &'m naga::Module, wanted: &str) -> Option<(usize, &'m [naga::StructMember])> {
    module.types.iter().find_map(|(_, ty)| match &ty.inner {
        naga::TypeInner::Struct { members, span } if ty.name.as_deref() == Some(wanted) => Some((*span as usize, &members[..])),
        _ => None,
    })
}

/// What differs between a Rust struct and its twin, if the module has it.
fn layout_difference(module: &naga::Module, Layout { name, size, fields }: &Layout) -> Option<String> {
    let (span, members) = struct_of(module, name)?;
    let seen: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize)).collect();
    if seen != *fields {
        return Some(format!("{name}: Rust has {fields:?}, WGSL {seen:?}"));
    }
    (span != *size).then(|| format!("{name}: Rust has {size} bytes, WGSL {span}"))
}

/// What a binding is, in the words of both sides; a storage buffer with the size of an element.
fn binding_difference(module: &naga::Module, program: &Program) -> Option<String> {
    module.global_variables.iter().find_map(|(_, variable)| {
        let binding = variable.binding.as_ref()?;
        let inner = &module.types[variable.ty].inner;
        let kind = program.bindings.get(binding.binding as usize)?;
        let fits = match (kind, variable.space, inner) {
            (BindingKind::Uniform(size) | BindingKind::DynamicUniform(size), naga::AddressSpace::Uniform, inner) => {
                inner.size(module.to_ctx()) as usize == *size
            }
            (BindingKind::Storage(size), naga::AddressSpace::Storage { .. }, naga::TypeInner::Array { stride, .. }) => {
                *stride as usize == *size
            }
            (BindingKind::Texture | BindingKind::DepthTexture, naga::AddressSpace::Handle, naga::TypeInner::Image { class, .. }) => {
                matches!(class, naga::ImageClass::Depth { .. }) == (*kind == BindingKind::DepthTexture)
            }
            (
                BindingKind::Sampler | BindingKind::ComparisonSampler,
                naga::AddressSpace::Handle,
                naga::TypeInner::Sampler { comparison },
            ) => *comparison == (*kind == BindingKind::ComparisonSampler),
            _ => false,
        };
        (!fits || binding.group != 0)
            .then(|| format!("{}: binding {} is {kind:?} in Rust and {inner:?} in WGSL", program.name, binding.binding))
    })
}

#[test]
fn twins_are_valid_and_their_structs_have_the_rust_layout() {
    let programs = programs();
    assert!(programs.len() >= 8, "{}", programs.len());
    let layouts = techniques().layouts();
    let mut compared = std::collections::BTreeSet::new();
    for program in &programs {
        let source = program.wgsl.unwrap_or_else(|| panic!("{} has no WGSL twin", program.name));
        let module = parse(program.name, source);
        for layout in &layouts {
            if struct_of(&module, layout.name).is_some() {
                compared.insert(layout.name);
                assert_eq!(layout_difference(&module, layout), None, "{}", program.name);
            }
        }
        assert_eq!(binding_difference(&module, program), None);
        for (constant, _) in &program.wgsl_constants {
            let known = module.overrides.iter().any(|(_, o)| o.name.as_deref() == Some(constant));
            assert!(known, "{}: the twin has no constant `{constant}`", program.name);
        }
        assert_eq!(module.overrides.len(), program.wgsl_constants.len(), "{}", program.name);
        let has = |stage| module.entry_points.iter().any(|e| e.stage == stage);
        assert_eq!(has(naga::ShaderStage::Vertex), program.geometry.is_none(), "{}: vs", program.name);
        assert_eq!(has(naga::ShaderStage::Fragment), program.fragment.is_some(), "{}: fs", program.name);
    }
    assert_eq!(compared.len(), layouts.len(), "compared only {compared:?}");
}

#[test]
fn layout_comparison_notices_a_swapped_field_and_a_missing_one() {
    let layout = layout!(VolumeUniform: shape, sigma_t);
    let source = |fields: &str| format!("struct VolumeUniform {{ {fields} }}\n@group(0) @binding(0) var<uniform> v: VolumeUniform;");
    let same = parse("same", &source("shape: vec4<f32>, sigma_t: vec4<f32>,"));
    assert_eq!(layout_difference(&same, &layout), None);
    for fields in ["sigma_t: vec4<f32>, shape: vec4<f32>,", "shape: vec4<f32>,", "shape: vec4<f32>, sigma_t: vec4<f32>, more: vec4<f32>,"] {
        assert!(layout_difference(&parse("other", &source(fields)), &layout).is_some(), "{fields}");
    }
}
