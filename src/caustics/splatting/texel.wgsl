// One texel for each photon: the twin of `pyramid.rs`.

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) flux: vec4<f32>,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let photon = photon_of(vertex_index);
    if !photon.landed {
        return Varyings(sprite(photon), vec4<f32>());
    }
    return Varyings(sprite(photon), vec4<f32>(photon.flux, 1.0));
}

@fragment
fn fs(in: Varyings) -> @location(0) vec4<f32> {
    return in.flux;
}
