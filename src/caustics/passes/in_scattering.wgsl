// Adds in-scattered radiance to the picture: the twin of `in_scattering.rs`.

@group(0) @binding(0) var in_scattered: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(textureLoad(in_scattered, vec2<i32>(position.xy), 0).rgb, 0.0);
}
