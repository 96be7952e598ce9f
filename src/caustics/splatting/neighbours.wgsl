// Steps of the light from the neighbours of a photon.

const EDGE: f32 = 4.0;
const CREASE: f32 = 0.3;

// Where the neighbour in a texel lies in the map; z is 1 where it lies on the same receiver.
fn neighbour(photon: Photon, texel: vec2<i32>) -> vec3<f32> {
    let size = vec2<i32>(textureDimensions(photon_positions));
    if any(texel < vec2<i32>(0)) || any(texel >= size) {
        return vec3<f32>();
    }
    let position = textureLoad(photon_positions, texel, 0);
    let to = position.xyz - photon.position;
    let same = position.w == 1.0 && abs(dot(to, photon.normal)) <= CREASE * length(to);
    return select(vec3<f32>(), vec3<f32>(texel_at(map, position.xyz), 1.0), same);
}

fn step_between(at: vec2<f32>, before: vec3<f32>, after: vec3<f32>, alone: vec2<f32>) -> vec2<f32> {
    let back = at - before.xy;
    let ahead = after.xy - at;
    let short = dot(back, back);
    let long = dot(ahead, ahead);
    let has_before = before.z == 1.0 && !(after.z == 1.0 && short > long * (EDGE * EDGE));
    let has_after = after.z == 1.0 && !(has_before && long > short * (EDGE * EDGE));
    if has_before && has_after {
        return (back + ahead) * 0.5;
    }
    return select(select(alone, ahead, has_after), back, has_before);
}

// What one texel of the photons' view along x and along y moves in the map.
fn steps_of(photon: Photon, index: u32) -> vec4<f32> {
    let t = photon.texel;
    let right = vec2<i32>(1, 0);
    let down = vec2<i32>(0, 1);
    let x = step_between(photon.at, neighbour(photon, t - right), neighbour(photon, t + right), vec2<f32>(photon.beam, 0.0));
    let y = step_between(photon.at, neighbour(photon, t - down), neighbour(photon, t + down), vec2<f32>(0.0, photon.beam));
    return vec4<f32>(x, y);
}
