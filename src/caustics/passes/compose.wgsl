// A layer of the result's size: the twin of `Plain` in `compose.rs`.

@group(0) @binding(0) var<uniform> layer: LayerUniform;
@group(0) @binding(1) var texels: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return textureLoad(texels, vec2<i32>(position.xy), 0) * layer.scale;
}
