// Conversion of irradiance to radiance: the twin of `shade.rs`.

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> environment: EnvironmentUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var albedos: texture_2d<f32>;
@group(0) @binding(4) var direct: texture_2d<f32>;
@group(0) @binding(5) var caustic: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let here = textureLoad(positions, at, 0);
    let p = here.xyz;
    let surface = textureLoad(albedos, at, 0);
    let albedo = surface.rgb;
    // Ambient light reaches points under water from the surface, so the water attenuates it.
    let depth = select(0.0, camera.level.x - p.y, surface.w > 0.0);
    let ambient = environment.ambient.rgb * beer_lambert_rgb(environment.sigma_t.rgb, max(depth, 0.0));
    let irradiance = ambient + textureLoad(direct, at, 0).rgb + textureLoad(caustic, at, 0).rgb;
    var radiance = albedo * irradiance * 0.31830987;
    if !(here.w > 0.0) {
        radiance = vec3<f32>(0.0);
    }
    return vec4<f32>(radiance, 1.0);
}
