// Steps of the light from the differentials of the photons' rays.

@group(0) @binding(7) var steps_x: texture_2d<f32>;
@group(0) @binding(8) var steps_y: texture_2d<f32>;

// A step, along the ray onto the plane of the receiver; `alone` if it is not known.
fn step_in(steps: texture_2d<f32>, photon: Photon, ray: vec3<f32>, alone: vec2<f32>) -> vec2<f32> {
    let step = textureLoad(steps, photon.texel, 0);
    let on_plane = step.xyz - ray * (dot(step.xyz, photon.normal) / dot(ray, photon.normal));
    return select(alone, texel_at(map, photon.position + on_plane) - photon.at, step.w > 0.0);
}

// What one texel of the photons' view along x and along y moves in the map.
fn steps_of(photon: Photon, index: u32) -> vec4<f32> {
    let ray = textureLoad(photon_directions, photon.texel, 0).xyz;
    let x = step_in(steps_x, photon, ray, vec2<f32>(photon.beam, 0.0));
    let y = step_in(steps_y, photon, ray, vec2<f32>(0.0, photon.beam));
    return vec4<f32>(x, y);
}
