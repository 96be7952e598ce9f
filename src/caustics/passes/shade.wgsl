// Conversion of irradiance to radiance: the twin of `shade.rs`.

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> environment: EnvironmentUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var normals: texture_2d<f32>;
@group(0) @binding(4) var albedos: texture_2d<f32>;
@group(0) @binding(5) var direct: texture_2d<f32>;
@group(0) @binding(6) var caustic: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let here = textureLoad(positions, at, 0);
    let p = here.xyz;
    let kind = here.w;
    let n = textureLoad(normals, at, 0).xyz;
    let albedo = textureLoad(albedos, at, 0).rgb;
    // Ambient light reaches points under water from the surface, so the water attenuates it.
    let depth = select(0.0, camera.water.x - p.y, under_water(camera, p));
    let ambient = environment.ambient.rgb * beer_lambert_rgb(environment.sigma_t.rgb, max(depth, 0.0));
    let irradiance = ambient + textureLoad(direct, at, 0).rgb + textureLoad(caustic, at, 0).rgb;
    let diffuse = albedo * irradiance * 0.31830987;

    let view = view_direction(camera, p);
    let mirrored = sky(environment, reflect_ray(view, n));
    // Glass as a thin shell: Fresnel reflection over the sky straight behind it.
    let share = fresnel_reflectance(clamp(-dot(n, view), 0.0, 1.0), 1.0, 1.5);
    let glass = mirrored * share + sky(environment, view) * (1.0 - share);
    var radiance = select(select(diffuse, glass, kind == 3.0), albedo * mirrored, kind == 2.0);
    if !(kind > 0.0) {
        radiance = vec3<f32>(0.0);
    }
    return vec4<f32>(radiance, 1.0);
}
