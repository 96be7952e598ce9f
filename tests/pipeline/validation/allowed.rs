//! What is allowed beyond WebGPU, on purpose.

use nephroid_pipeline::state::{ADD, BlendComponent, BlendFactor, BlendOperation, Color, TextureFormat, Viewport};
use nephroid_pipeline::{
    Binding, BindingKind, Bindings, Buffer, ColorAttachment, Draw, LoadOp, Pass, PassError, Texture, TextureDescriptor, run_pass,
};

use super::Row;
use super::draws::{drawable, drawn};
use super::passes::bound;
use super::pipelines::{blended, made};
use crate::passes::{Vertices, device, target, vertex};

fn row(rule: &'static str, result: Result<(), impl ToString>) -> Row {
    Row { rule, seen: String::new(), expected: true, refused: result.err().map(|error| error.to_string()) }
}

/// What is allowed beyond WebGPU.
pub fn allowed() -> Vec<Row> {
    let vertices = Vertices::new(&[vertex([0.0; 4], [0.0; 4]); 3]);
    let entries = vertices.entries();
    let pipeline = drawable(|_| ());
    let good = || Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, (8, 8));
    let second = BlendComponent { src_factor: BlendFactor::Src1, dst_factor: BlendFactor::Zero, operation: BlendOperation::Add };
    let viewport = Viewport { width: 32767.0, ..Viewport::full(8, 8) };
    let large = Buffer::from_slice(&[0u8; 1 << 17]);
    let uniform = [Binding::Uniform { buffer: &large, offset: 0, dynamic: true }, entries[0]];
    let texture = |width, layers| {
        TextureDescriptor { depth_or_layers: layers, ..TextureDescriptor::d2("large", width, 8, TextureFormat::R8Unorm) }
            .validate()
            .map(drop)
    };
    vec![
        row("wide-lines", made(|desc| desc.line_width = 1024.0)),
        row("rasterizer-discard", made(|desc| (desc.targets, desc.rasterizer_discard) = (Vec::new(), true))),
        row("unclipped-depth", made(|desc| desc.primitive.unclipped_depth = true)),
        row("float32-blending", made(|desc| desc.targets = vec![blended(TextureFormat::Rgba32Float, ADD)])),
        row("dual-source", made(|desc| desc.targets = vec![blended(TextureFormat::Rgba8Unorm, second)])),
        row("color-bytes", made(|desc| desc.targets = vec![target(TextureFormat::Rgba32Float); 8])),
        row("large-textures", texture(16384, 1)),
        row("many-layers", texture(8, 2048)),
        row("wide-viewports", drawn(Draw { viewport, ..good() })),
        row("blend-constant", drawn(Draw { blend_constant: [f32::INFINITY; 4], ..good() })),
        row("more-bindings", bound(&[BindingKind::DynamicUniform(16)], &uniform, 256)),
        row("large-uniform-buffers", bound(&[BindingKind::DynamicUniform(16)], &uniform, 1 << 16)),
        row("clear-color", cleared(Color { r: f64::NAN, ..Color::BLACK })),
        row("query-reuse", query_reused(&good())),
    ]
}

fn cleared(color: Color) -> Result<(), PassError> {
    let mut texture = Texture::new(TextureDescriptor::d2("test", 8, 8, TextureFormat::R32Float)).expect("a valid texture");
    let color = vec![Some(ColorAttachment { view: texture.view_mut(), load: LoadOp::Clear(color) })];
    run_pass(device(), &mut Pass { color, ..Pass::default() }, None).map(drop)
}

/// Two draws of one query with another draw between.
fn query_reused(draw: &Draw<'_>) -> Result<(), PassError> {
    let mut texture = Texture::new(TextureDescriptor::d2("test", 8, 8, TextureFormat::Rgba8Unorm)).expect("a valid texture");
    let counted = || Draw { query: Some(0), ..draw.clone() };
    let mut pass = Pass {
        color: vec![Some(ColorAttachment { view: texture.view_mut(), load: LoadOp::Load })],
        draws: vec![counted(), draw.clone(), counted()],
        query_count: 1,
        ..Pass::default()
    };
    run_pass(device(), &mut pass, None).map(drop)
}
