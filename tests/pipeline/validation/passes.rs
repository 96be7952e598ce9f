//! Rules of bindings and of attachments.

use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::state::{Color, CompareFunction, TextureFormat};
use nephroid_pipeline::{
    AttachmentProblem, Binding, BindingKind, BindingProblem, Bindings, BoundKind, Buffer, ColorAttachment, DepthStencilAttachment, Draw,
    LoadOp, Pass, PassError, SamplerError, Texture, TextureDescriptor, run_pass,
};

use super::{Row, rule};
use crate::passes::{Ones, device, pipeline, plain_program, target};

/// What is wrong with entries and a dynamic offset for a program that reads `kinds`.
pub fn bound(kinds: &[BindingKind], entries: &[Binding<'_>], dynamic_offset: usize) -> Result<(), BindingProblem> {
    Bindings::new(entries, dynamic_offset).mismatch(kinds).map_or(Ok(()), Err)
}

/// Rules of what is bound.
pub fn bindings() -> Vec<Row> {
    use BindingKind as Kind;
    let buffer = Buffer::from_slice(&[0u8; 1024]);
    let odd = Buffer::from_slice(&[0u8; 6]);
    let texture = |format| Texture::new(TextureDescriptor::d2("test", 1, 1, format)).expect("a valid texture");
    let textures = [TextureFormat::R32Float, TextureFormat::Depth32Float, TextureFormat::Stencil8].map(texture);
    let [color, depth, stencil] = [0, 1, 2].map(|i: usize| [Binding::Texture(textures[i].view())]);
    let storage = [Binding::Storage(&buffer)];
    let uniform = |offset, dynamic| [Binding::Uniform { buffer: &buffer, offset, dynamic }];
    let plain = [Binding::Sampler(Sampler::default())];
    let comparing = [Binding::Sampler(Sampler::comparison(CompareFunction::Less))];
    let endless = [Binding::Sampler(Sampler { lod_min_clamp: -1.0, ..Sampler::default() })];
    vec![
        rule!("binding-count": bound(&[Kind::Storage(16); 2], &storage, 0) => BindingProblem::Count { given: 1, expected: 2 },
            bound(&[Kind::Storage(16)], &storage, 0)),
        rule!("binding-kind": bound(&[Kind::Uniform(16)], &storage, 0)
            => BindingProblem::Kind { binding: 0, found: BoundKind::Storage, expected: Kind::Uniform(16) },
            bound(&[Kind::Uniform(16)], &uniform(0, false), 0)),
        rule!("binding-dynamic": bound(&[Kind::DynamicUniform(16)], &uniform(0, false), 0)
            => BindingProblem::Kind { found: BoundKind::Uniform, .. }, bound(&[Kind::DynamicUniform(16)], &uniform(0, true), 0)),
        rule!("sampler-comparison": bound(&[Kind::Sampler], &comparing, 0)
            => BindingProblem::Kind { found: BoundKind::ComparisonSampler, expected: Kind::Sampler, .. },
            bound(&[Kind::Sampler], &plain, 0)),
        rule!("comparison-sampler": bound(&[Kind::ComparisonSampler], &plain, 0)
            => BindingProblem::Kind { found: BoundKind::Sampler, expected: Kind::ComparisonSampler, .. },
            bound(&[Kind::ComparisonSampler], &comparing, 0)),
        rule!("uniform-offset": bound(&[Kind::Uniform(16)], &uniform(16, false), 0)
            => BindingProblem::UniformOffset { binding: 0, offset: 16 }, bound(&[Kind::Uniform(16)], &uniform(256, false), 0)),
        rule!("dynamic-offset": bound(&[Kind::DynamicUniform(16)], &uniform(0, true), 128)
            => BindingProblem::UniformOffset { binding: 0, offset: 128 }, bound(&[Kind::DynamicUniform(16)], &uniform(0, true), 256)),
        rule!("binding-size": bound(&[Kind::DynamicUniform(272)], &uniform(256, true), 512)
            => BindingProblem::Size { binding: 0, bytes: 256, expected: 272 }, bound(&[Kind::DynamicUniform(256)], &uniform(256, true), 512)),
        rule!("storage-size": bound(&[Kind::Storage(4)], &[Binding::Storage(&odd)], 0)
            => BindingProblem::StorageSize { binding: 0, bytes: 6 }, bound(&[Kind::Storage(4)], &storage, 0)),
        rule!("depth-texture": bound(&[Kind::DepthTexture], &color, 0)
            => BindingProblem::NoDepth { binding: 0, format: TextureFormat::R32Float }, bound(&[Kind::DepthTexture], &depth, 0)),
        rule!("stencil-texture": bound(&[Kind::Texture], &stencil, 0)
            => BindingProblem::TextureFormat { binding: 0, format: TextureFormat::Stencil8 }, bound(&[Kind::Texture], &depth, 0)),
        rule!("bound-sampler": bound(&[Kind::Sampler], &endless, 0)
            => BindingProblem::Sampler { binding: 0, error: SamplerError::LodMinClamp { .. } }, bound(&[Kind::Sampler], &plain, 0)),
    ]
}

/// A pass without draws over attachments of these formats and sizes.
fn attached(color: &[(TextureFormat, u32)], depth: Option<(TextureFormat, u32)>, clear_depth: f32) -> Result<(), AttachmentProblem> {
    let texture =
        |&(format, side): &(TextureFormat, u32)| Texture::new(TextureDescriptor::d2("test", side, side, format)).expect("a valid texture");
    let mut color: Vec<Texture> = color.iter().map(texture).collect();
    let mut depth = depth.as_ref().map(texture);
    let load = LoadOp::Clear(Color::BLACK);
    let mut pass = Pass {
        color: color.iter_mut().map(|texture| Some(ColorAttachment { view: texture.view_mut(), load })).collect(),
        depth_stencil: depth.as_mut().map(|texture| DepthStencilAttachment {
            view: texture.view_mut(),
            depth_load: LoadOp::Clear(clear_depth),
            stencil_load: LoadOp::Load,
        }),
        ..Pass::default()
    };
    problem_of(run_pass(device(), &mut pass, None).map(drop))
}

/// A pass of one draw without attachments.
fn unattached(rasterizer_discard: bool) -> Result<(), AttachmentProblem> {
    let pipeline = pipeline(plain_program(Ones), |desc| {
        desc.targets = vec![target(TextureFormat::R32Float)];
        desc.rasterizer_discard = rasterizer_discard;
    });
    let buffer = Buffer::from_slice(&[0.0f32; 8]);
    let entries = [Binding::Storage(&buffer)];
    let draws = vec![Draw::new(&pipeline, Bindings::new(&entries, 0), 0..1, (1, 1))];
    problem_of(run_pass(device(), &mut Pass { draws, ..Pass::default() }, None).map(drop))
}

fn problem_of(result: Result<(), PassError>) -> Result<(), AttachmentProblem> {
    match result {
        Ok(()) => Ok(()),
        Err(PassError::Attachments { problem, .. }) => Err(problem),
        Err(other) => panic!("not about attachments: {other}"),
    }
}

/// Rules of attachments.
pub fn attachments() -> Vec<Row> {
    use TextureFormat::{Depth32Float, R8Unorm, Stencil8};
    let color = (R8Unorm, 8);
    vec![
        rule!("attachment-count": attached(&[color; 9], None, 1.0) => AttachmentProblem::Count { count: 9 },
            attached(&[color; 8], None, 1.0)),
        rule!("attachment-none": unattached(false) => AttachmentProblem::None, unattached(true)),
        rule!("attachment-size": attached(&[color], Some((Depth32Float, 4)), 1.0)
            => AttachmentProblem::Size { first: (8, 8), other: (4, 4) }, attached(&[color], Some((Depth32Float, 8)), 1.0)),
        rule!("attachment-color": attached(&[color, (Depth32Float, 8)], None, 1.0)
            => AttachmentProblem::NotColor { format: Depth32Float }, attached(&[color, color], None, 1.0)),
        rule!("attachment-depth-stencil": attached(&[], Some(color), 1.0) => AttachmentProblem::NotDepthStencil { format: R8Unorm },
            attached(&[], Some((Stencil8, 8)), 1.0)),
        rule!("clear-depth": attached(&[], Some((Depth32Float, 8)), 1.5) => AttachmentProblem::ClearDepth { depth: 1.5 },
            attached(&[], Some((Depth32Float, 8)), 1.0)),
    ]
}
