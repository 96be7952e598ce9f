// What mirrors and glass show: the twin of `glass.rs`.

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> environment: EnvironmentUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var normals: texture_2d<f32>;
@group(0) @binding(4) var albedos: texture_2d<f32>;
@group(0) @binding(5) var back_positions: texture_2d<f32>;
@group(0) @binding(6) var back_normals: texture_2d<f32>;
@group(0) @binding(7) var absorptions: texture_2d<f32>;
@group(0) @binding(8) var receiver_positions: texture_2d<f32>;
@group(0) @binding(9) var receiver_normals: texture_2d<f32>;
@group(0) @binding(10) var receiver_radiances: texture_2d<f32>;
@group(0) @binding(11) var<uniform> wide_camera: CameraUniform;
@group(0) @binding(12) var wide_positions: texture_2d<f32>;
@group(0) @binding(13) var wide_normals: texture_2d<f32>;
@group(0) @binding(14) var wide_radiances: texture_2d<f32>;
@group(0) @binding(15) var<uniform> bounds: ReceiverBounds;

// Radiance that arrives along a ray. w: 1, or 2 where it is not known whether the ray meets a receiver.
fn arriving(origin: vec3<f32>, direction: vec3<f32>) -> vec4<f32> {
    let near = search(camera, bounds, receiver_positions, receiver_normals, receiver_radiances, origin, direction);
    if near.exists {
        return vec4<f32>(near.radiance, 1.0);
    }
    let wide = search(wide_camera, bounds, wide_positions, wide_normals, wide_radiances, origin, direction);
    if wide.exists {
        return vec4<f32>(wide.radiance, 1.0);
    }
    return vec4<f32>(sky(environment, direction), select(1.0, 2.0, near.doubtful || wide.doubtful));
}

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let here = textureLoad(positions, at, 0);
    let is_mirror = here.w == 2.0;
    let is_glass = here.w == 3.0;
    if !(is_mirror || is_glass) {
        return vec4<f32>(textureLoad(receiver_radiances, at, 0).rgb, 1.0);
    }
    let p = here.xyz;
    let normal = textureLoad(normals, at, 0);
    let n = normal.xyz;
    let view = view_direction(camera, p);
    let mirrored = arriving(p, reflect_ray(view, n));
    if is_mirror {
        let tint = textureLoad(albedos, at, 0).rgb;
        return vec4<f32>(mirrored.rgb * tint, select(1.0, mirrored.w, dot(tint, tint) > 0.0));
    }
    let outside = select(1.0, environment.inscatter.w, textureLoad(albedos, at, 0).w > 0.0);
    let eta = outside / max(normal.w, 1.0);
    let back = textureLoad(back_positions, at, 0);
    let thickness = select(0.0, length(back.xyz - p), back.w > 0.0);
    let reflected = fresnel_reflectance_by(-dot(n, view), eta);
    var radiance = mirrored.rgb * reflected;
    var mark = select(1.0, mirrored.w, reflected > 0.0);
    let absorption = textureLoad(absorptions, at, 0).rgb;
    var exits = pass_body(Entry(p, n, view, thickness, eta));
    for (var i = 0; i < 2; i++) {
        let exit = exits[i];
        let share = exit.share * (1.0 - reflected);
        if share > 0.0 {
            let beyond = arriving(exit.position, exit.direction);
            radiance += beyond.rgb * exp(-(absorption * exit.length)) * share;
            mark = max(mark, beyond.w);
        }
    }
    return vec4<f32>(radiance, mark);
}
