// Photons alone.

struct Targets {
    @location(0) position: vec4<f32>,
    @location(1) direction: vec4<f32>,
    @location(2) flux: vec4<f32>,
    @location(3) losses: vec4<f32>,
}

@fragment
fn fs(@builtin(position) pixel: vec4<f32>) -> Targets {
    let photon = photon_in(floor(pixel.xy));
    return Targets(photon.position, photon.direction, photon.flux, photon.losses);
}
