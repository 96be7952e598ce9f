// Direct irradiance times a factor: the twin of `shaders.rs`.

struct TwofoldUniform {
    factor: vec4<f32>,
}

@group(0) @binding(0) var<uniform> numbers: TwofoldUniform;
@group(0) @binding(1) var direct: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let here = textureLoad(direct, vec2<i32>(position.xy), 0).rgb;
    return vec4<f32>(here * numbers.factor.x, 1.0);
}
