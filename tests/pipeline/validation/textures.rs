//! Rules of textures, of their views, and of samplers.

use nephroid_pipeline::frame::{Contents, Frame};
use nephroid_pipeline::sampler::{AddressMode, Sampler};
use nephroid_pipeline::state::TextureFormat;
use nephroid_pipeline::{SamplerError, Texture, TextureDescriptor, TextureError, TextureShape, TextureViewDescriptor, ViewProblem};

use super::{Row, rule};

fn base() -> TextureDescriptor {
    TextureDescriptor::d2("test", 8, 8, TextureFormat::Rgba8Unorm)
}

fn described(edit: impl FnOnce(&mut TextureDescriptor)) -> Result<(), TextureError> {
    let mut desc = base();
    edit(&mut desc);
    desc.validate().map(drop)
}

fn sized(shape: TextureShape, [width, height, depth_or_layers]: [u32; 3], mip_level_count: u32) -> Result<(), TextureError> {
    described(|desc| *desc = TextureDescriptor { shape, width, height, depth_or_layers, mip_level_count, ..base() })
}

/// Rules of textures and of their data.
pub fn textures() -> Vec<Row> {
    use TextureShape::{Cube, D2, D3};
    let volume = |format| described(|desc| (desc.shape, desc.format) = (D3, format));
    let written = |layer, bytes| Texture::new(base()).expect("a valid texture").write_bytes(0, layer, &vec![0; bytes]);
    let initial = |layers| {
        let mut frame = Frame::default();
        frame.texture_with(TextureDescriptor { depth_or_layers: 2, ..base() }, vec![vec![0; 256].into(); layers]);
        Contents::initial(&frame).map(drop)
    };
    vec![
        rule!("texture-size": sized(D2, [16385, 8, 1], 1)
            => TextureError::Size { width: 16385, height: 8, depth: 1, allowed: 16384, .. }, sized(D2, [16384, 1, 1], 1)),
        rule!("array-layers": sized(D2, [8, 8, 2049], 1) => TextureError::Size { depth: 2049, .. }, sized(D2, [8, 8, 2048], 1)),
        rule!("volume-size": sized(D3, [2049, 8, 8], 1) => TextureError::Size { width: 2049, allowed: 2048, .. },
            sized(D3, [2048, 8, 2048], 1)),
        rule!("cube-texture": sized(Cube, [8, 4, 6], 1) => TextureError::Cube { width: 8, height: 4, depth: 6, .. },
            sized(Cube, [8, 8, 6], 1)),
        rule!("mip-level-count": sized(D2, [8, 5, 1], 5) => TextureError::MipLevels { levels: 5, allowed: 4, .. },
            sized(D2, [8, 5, 1], 4)),
        rule!("volume-mip-level-count": sized(D3, [2, 2, 8], 5) => TextureError::MipLevels { levels: 5, allowed: 4, .. },
            sized(D3, [2, 2, 8], 4)),
        rule!("texture-format": described(|desc| desc.format = TextureFormat::Bc1RgbaUnorm)
            => TextureError::Format { format: TextureFormat::Bc1RgbaUnorm, .. }, described(|desc| desc.format = TextureFormat::R32Uint)),
        rule!("volume-format": volume(TextureFormat::Depth32Float)
            => TextureError::VolumeFormat { format: TextureFormat::Depth32Float, .. }, volume(TextureFormat::R32Float)),
        rule!("texture-data": written(0, 255) => TextureError::Data { seen: 255, expected: 256, .. }, written(0, 256)),
        rule!("texture-surface": written(1, 256) => TextureError::NoSurface { level: 0, layer: 1, .. }, written(0, 256)),
        rule!("initial-layers": initial(1) => TextureError::Layers { seen: 1, expected: 2, .. }, initial(2)),
    ]
}

/// Rules of views: to read, and to draw to.
pub fn views() -> Vec<Row> {
    let desc = |shape, height, layers| TextureDescriptor { height, depth_or_layers: layers, mip_level_count: 3, shape, ..base() };
    let view = |desc: TextureDescriptor, view: TextureViewDescriptor| desc.view_range(&view).map(drop);
    let whole = TextureViewDescriptor::default();
    let levels = |base_mip_level, count| {
        view(desc(TextureShape::D2, 8, 2), TextureViewDescriptor { base_mip_level, mip_level_count: Some(count), ..whole })
    };
    let layers = |base_array_layer, count| {
        view(desc(TextureShape::D2, 8, 2), TextureViewDescriptor { base_array_layer, array_layer_count: Some(count), ..whole })
    };
    let shaped = |of: TextureDescriptor, shape| view(of, TextureViewDescriptor { shape: Some(shape), ..whole });
    let split = |attached: &[(u32, u32)]| {
        let mut texture = Texture::new(desc(TextureShape::D2, 8, 2)).expect("a valid texture");
        texture.split(attached).map(drop)
    };
    let read_beside = |level| {
        let mut texture = Texture::new(desc(TextureShape::D2, 8, 1)).expect("a valid texture");
        let (_attached, rest) = texture.split(&[(1, 0)]).expect("the surface is there");
        rest.view(&TextureViewDescriptor::level(level)).map(drop)
    };
    let (d2, d3) = (TextureShape::D2, TextureShape::D3);
    vec![
        rule!("view-mip-levels": levels(1, 3) => TextureError::View { levels: 3, problem: ViewProblem::MipLevels, .. }, levels(1, 2)),
        rule!("view-no-mip-level": levels(1, 0) => TextureError::View { problem: ViewProblem::MipLevels, .. }, levels(1, 1)),
        rule!("view-array-layers": layers(1, 2) => TextureError::View { layers: 2, problem: ViewProblem::ArrayLayers, .. }, layers(1, 1)),
        rule!("view-shape": shaped(desc(d3, 8, 6), d2)
            => TextureError::View { problem: ViewProblem::Shape { texture: TextureShape::D3, view: TextureShape::D2 }, .. },
            shaped(desc(d3, 8, 6), d3)),
        rule!("view-cube-layers": shaped(desc(d2, 8, 7), TextureShape::Cube)
            => TextureError::View { problem: ViewProblem::CubeLayers { layers: 7 }, .. }, shaped(desc(d2, 8, 6), TextureShape::Cube)),
        rule!("view-cube-size": shaped(desc(d2, 4, 6), TextureShape::Cube)
            => TextureError::View { problem: ViewProblem::CubeSize { width: 8, height: 4 }, .. },
            shaped(desc(d2, 8, 6), TextureShape::Cube)),
        rule!("attachment-surface": split(&[(3, 0)]) => TextureError::NoSurface { level: 3, layer: 0, .. }, split(&[(2, 0)])),
        rule!("attachment-twice": split(&[(1, 0), (1, 0)]) => TextureError::AttachedTwice { level: 1, layer: 0, .. },
            split(&[(1, 0), (1, 1)])),
        rule!("read-and-drawn-to": read_beside(1) => TextureError::DrawnTo { level: 1, layer: 0, .. }, read_beside(0)),
    ]
}

/// Rules of samplers.
pub fn samplers() -> Vec<Row> {
    let lod = |lod_min_clamp, lod_max_clamp| Sampler { lod_min_clamp, lod_max_clamp, ..Sampler::default() }.validate();
    let mode = |mode| Sampler { address_mode: [AddressMode::Repeat, mode, AddressMode::Repeat], ..Sampler::default() }.validate();
    vec![
        rule!("lod-min-clamp": lod(-0.5, 1.0) => SamplerError::LodMinClamp { lod_min_clamp: -0.5 }, lod(0.0, 1.0)),
        rule!("lod-max-clamp": lod(2.0, 1.0) => SamplerError::LodMaxClamp { lod_min_clamp: 2.0, lod_max_clamp: 1.0 }, lod(2.0, 2.0)),
        rule!("lod-finite": lod(0.0, f32::INFINITY) => SamplerError::LodMaxClamp { lod_max_clamp: f32::INFINITY, .. },
            lod(0.0, f32::MAX)),
        rule!("address-mode": mode(AddressMode::ClampToBorder) => SamplerError::AddressMode { axis: 1 }, mode(AddressMode::MirrorRepeat)),
    ]
}
