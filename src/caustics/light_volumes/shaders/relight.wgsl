// Conversion of summed intensities or vectors to irradiance: the twin of `Relight`.

struct RelightUniform {
    to_light: vec4<f32>,
}

@group(0) @binding(0) var<uniform> light: RelightUniform;
@group(0) @binding(1) var normals: texture_2d<f32>;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var red: texture_2d<f32>;
@group(0) @binding(4) var green: texture_2d<f32>;
@group(0) @binding(5) var blue: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let n = textureLoad(normals, at, 0).xyz;
    let first = textureLoad(red, at, 0).xyz;
    var irradiance = first * dot(n, light.to_light.xyz);
    if light.to_light.w > 0.0 {
        irradiance = vec3<f32>(dot(n, first), dot(n, textureLoad(green, at, 0).xyz), dot(n, textureLoad(blue, at, 0).xyz));
    }
    let exists = textureLoad(positions, at, 0).w == 1.0;
    return vec4<f32>(select(vec3<f32>(0.0), max(irradiance, vec3<f32>(0.0)), exists), 0.0);
}
