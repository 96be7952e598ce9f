//! Rules of frames: what their passes and bind groups refer to.

use std::sync::Arc;

use nephroid_pipeline::frame::{
    AttachmentView, BindEntry, BindGroupId, BindGroupProblem, BufferId, ColorAttachment, Draw, Frame, FrameError, Pass, PipelineId,
    ReferenceProblem, StreamOut, TextureId, TextureView, check_references,
};
use nephroid_pipeline::sampler::Sampler;
use nephroid_pipeline::shader::Interpolation;
use nephroid_pipeline::state::{Color, TextureFormat};
use nephroid_pipeline::{
    Buffer, LoadOp, RenderPipelineDescriptor, SamplerError, TextureDescriptor, TextureError, TextureViewDescriptor, ViewProblem,
};

use super::{Row, rule};
use crate::passes::{FlatColor, Ones, plain_program, pull_program, target};

/// Texture 0 is drawn to, texture 1 is not; the bind group reads buffer 0, and buffer 1 is free; two pipelines stream out 4 and 8 floats.
fn frame() -> Frame {
    let mut frame = Frame::default();
    for label in ["target", "other"] {
        let desc = TextureDescriptor { mip_level_count: 2, ..TextureDescriptor::d2(label, 8, 8, TextureFormat::R32Float) };
        frame.texture(desc);
        frame.buffer(label, Arc::new(Buffer::from_slice(&[0.0f32; 64])));
    }
    for program in [plain_program(Ones), pull_program(FlatColor, Interpolation::Flat)] {
        let targets = vec![target(TextureFormat::R32Float)];
        frame.pipeline(RenderPipelineDescriptor { targets, ..RenderPipelineDescriptor::new("test", Arc::new(program)) });
    }
    let group = frame.bind_group(vec![BindEntry::Storage(BufferId::at(0))]);
    let load = LoadOp::Clear(Color::BLACK);
    frame.passes.push(Pass {
        label: "test".into(),
        color: vec![Some(ColorAttachment { view: TextureId::at(0).into(), load })],
        draws: vec![Draw::new(PipelineId::at(0), group, 0..3)],
        ..Pass::default()
    });
    frame
}

fn checked(edit: impl FnOnce(&mut Frame)) -> Result<(), FrameError> {
    let mut frame = frame();
    edit(&mut frame);
    check_references(&frame)
}

/// The frame's pass, edited; only what is wrong with it.
fn pass(edit: impl FnOnce(&mut Pass)) -> Result<(), ReferenceProblem> {
    match checked(|frame| edit(&mut frame.passes[0])) {
        Ok(()) => Ok(()),
        Err(FrameError::Reference { problem, .. }) => Err(problem),
        Err(other) => panic!("not about what the pass refers to: {other}"),
    }
}

fn draw(edit: impl FnOnce(&mut Draw)) -> Result<(), ReferenceProblem> {
    pass(|pass| edit(&mut pass.draws[0]))
}

fn entry(entry: BindEntry) -> Result<(), FrameError> {
    checked(|frame| frame.bind_groups[0].entries.push(entry))
}

fn attached(views: &[(u32, u32, u32)]) -> Result<(), ReferenceProblem> {
    let load = LoadOp::Clear(Color::BLACK);
    let views = views.iter().map(|&(texture, level, layer)| AttachmentView { texture: TextureId::at(texture), level, layer });
    pass(|pass| pass.color = views.map(|view| Some(ColorAttachment { view, load })).collect())
}

/// Rules of bind groups.
pub fn bind_groups() -> Vec<Row> {
    let view = |base_mip_level| {
        let range = TextureViewDescriptor { base_mip_level, ..TextureViewDescriptor::default() };
        entry(BindEntry::texture(TextureView { texture: TextureId::at(1), range }))
    };
    let sampler = |lod_min_clamp| entry(BindEntry::Sampler(Sampler { lod_min_clamp, ..Sampler::default() }));
    vec![
        rule!("frame-bound-buffer": entry(BindEntry::Uniform(BufferId::at(2), 0))
            => FrameError::BindGroup { group: 0, binding: 1, problem: BindGroupProblem::NoBuffer { buffer: 2 } },
            entry(BindEntry::Uniform(BufferId::at(1), 0))),
        rule!("frame-bound-texture": entry(BindEntry::texture(TextureId::at(2)))
            => FrameError::BindGroup { group: 0, binding: 1, problem: BindGroupProblem::NoTexture { texture: 2 } },
            entry(BindEntry::texture(TextureId::at(1)))),
        rule!("frame-view": view(2) => FrameError::Texture(TextureError::View { levels: 2, problem: ViewProblem::MipLevels, .. }), view(1)),
        rule!("frame-sampler": sampler(-1.0)
            => FrameError::BindGroup { problem: BindGroupProblem::Sampler(SamplerError::LodMinClamp { .. }), .. }, sampler(0.0)),
    ]
}

/// Rules of attachments and of what a pass reads and writes.
pub fn passes() -> Vec<Row> {
    let reads = |texture, base_mip_level| {
        let range = TextureViewDescriptor::level(base_mip_level);
        let read = BindEntry::texture(TextureView { texture: TextureId::at(texture), range });
        checked(|frame| frame.bind_groups[0].entries.push(read))
    };
    let groups = |group| draw(|draw| draw.bind_group = BindGroupId::at(group));
    vec![
        rule!("frame-attachment-texture": attached(&[(0, 0, 0), (2, 0, 0)])
            => ReferenceProblem::NoTexture { attachment: 1, texture: 2 }, attached(&[(0, 0, 0), (1, 0, 0)])),
        rule!("frame-attachment-surface": attached(&[(0, 2, 0)])
            => ReferenceProblem::NoSurface { attachment: 0, level: 2, layer: 0, .. }, attached(&[(0, 1, 0)])),
        rule!("frame-attached-twice": attached(&[(0, 1, 0), (0, 1, 0)]) => ReferenceProblem::AttachedTwice { level: 1, layer: 0, .. },
            attached(&[(0, 1, 0), (1, 1, 0)])),
        rule!("frame-read-and-drawn-to": reads(0, 0)
            => FrameError::Reference { problem: ReferenceProblem::ReadAndDrawnTo { .. }, .. }, reads(0, 1)),
        rule!("frame-pipeline": draw(|draw| draw.pipeline = PipelineId::at(2)) => ReferenceProblem::NoPipeline { draw: 0, pipeline: 2 },
            draw(|draw| draw.pipeline = PipelineId::at(1))),
        rule!("frame-bind-group": groups(1) => ReferenceProblem::NoBindGroup { draw: 0, bind_group: 1 }, groups(0)),
        rule!("frame-buffer": draw(|draw| draw.vertex_buffers = vec![(BufferId::at(2), 0)])
            => ReferenceProblem::NoBuffer { draw: 0, buffer: 2 }, draw(|draw| draw.vertex_buffers = vec![(BufferId::at(1), 0)])),
    ]
}

/// Rules of stream-out.
pub fn streams() -> Vec<Row> {
    let to = |buffer| StreamOut { buffer: BufferId::at(buffer), append: false };
    let targets = |buffers: &[u32]| pass(|pass| pass.stream_out = buffers.iter().map(|&buffer| to(buffer)).collect());
    let streaming = |target| {
        pass(|pass| {
            pass.stream_out = vec![to(1)];
            pass.draws[0].stream_out = Some(target);
        })
    };
    let two = |pipeline| {
        pass(|pass| {
            pass.stream_out = vec![to(1)];
            pass.draws.push(Draw { pipeline: PipelineId::at(pipeline), ..pass.draws[0].clone() });
            pass.draws.iter_mut().for_each(|draw| draw.stream_out = Some(0));
        })
    };
    let counted = |indexed: bool| {
        draw(|draw| {
            draw.streamed = Some(BufferId::at(1));
            if indexed {
                *draw = draw.clone().indexed(BufferId::at(1));
            }
        })
    };
    let fetching = |buffer| {
        pass(|pass| {
            pass.stream_out = vec![to(1)];
            pass.draws[0].vertex_buffers = vec![(BufferId::at(buffer), 0)];
        })
    };
    vec![
        rule!("frame-stream-out-buffer": targets(&[2]) => ReferenceProblem::NoStreamOutBuffer { target: 0, buffer: 2 }, targets(&[1])),
        rule!("frame-streamed-out-twice": targets(&[1, 1]) => ReferenceProblem::StreamedOutTwice { .. }, targets(&[1])),
        rule!("frame-read-and-streamed-out": targets(&[0]) => ReferenceProblem::ReadAndStreamedOut { .. }, targets(&[1])),
        rule!("frame-stream-out-target": streaming(1) => ReferenceProblem::NoStreamOutTarget { draw: 0, target: 1, count: 1 },
            streaming(0)),
        rule!("frame-stream-out-vertices": two(1) => ReferenceProblem::StreamOutVertices { first: 4, other: 8, .. }, two(0)),
        rule!("frame-indexed-stream-out": counted(true) => ReferenceProblem::IndexedStreamOut { draw: 0 }, counted(false)),
        rule!("frame-draw-reads-stream-out": fetching(1) => ReferenceProblem::DrawReadsStreamOut { draw: 0, .. }, fetching(0)),
    ]
}
