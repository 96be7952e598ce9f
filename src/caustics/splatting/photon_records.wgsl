
// Photons in a buffer.

struct PhotonRecord {
    position_ws: vec4<f32>,
    direction_ws: vec4<f32>,
    flux: vec4<f32>,
    x_ws: vec4<f32>,
    y_ws: vec4<f32>,
}

@group(0) @binding(4) var<storage, read> records: array<PhotonRecord>;

fn photon_of(index: u32) -> Photon {
    let record = records[index];
    let ray = vec4<f32>(record.direction_ws.xyz, record.position_ws.w);
    return photon_at(vec2<i32>(0), record.position_ws.xyz, ray, record.flux.rgb, true);
}

fn step_to(photon: Photon, step_ws: vec4<f32>, alone: vec2<f32>) -> vec2<f32> {
    if step_ws.w == 0.0 {
        return alone;
    }
    return texel_at(map, photon.position + step_ws.xyz) - photon.at;
}

// What one texel of the photons' view along x and along y moves in the map.
fn steps_of(photon: Photon, index: u32) -> vec4<f32> {
    let record = records[index];
    let x = step_to(photon, record.x_ws, vec2<f32>(photon.beam, 0.0));
    let y = step_to(photon, record.y_ws, vec2<f32>(0.0, photon.beam));
    return vec4<f32>(x, y);
}
