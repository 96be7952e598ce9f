// Round splats: the twin of `splats.rs`. A sprite has no size here; the sizes come with the vertices.

override by_beam: bool = false;
override by_integral: bool = false;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) kernel: vec4<f32>,
    @location(1) @interpolate(flat) flux: vec4<f32>,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let photon = photon_of(vertex_index);
    if !photon.landed {
        return Varyings(sprite(photon), vec4<f32>(), vec4<f32>());
    }
    var diameter = splats.shape.x;
    if by_beam {
        diameter = photon.beam * diameter;
    }
    diameter = clamp(diameter, LEAST_DIAMETER_TX, MOST_DIAMETER_TX);
    let radius = diameter * 0.5;
    let falloff = FALLOFF / (diameter * diameter);
    var share = falloff * 0.31830987;
    if !by_integral {
        share = 1.0 / (sampled_sum(photon.at.x, radius, falloff) * sampled_sum(photon.at.y, radius, falloff));
    }
    return Varyings(sprite(photon), vec4<f32>(photon.at, radius, falloff), vec4<f32>(photon.flux * share, share));
}

@fragment
fn fs(in: Varyings) -> @location(0) vec4<f32> {
    let x = bell(in.position.x - in.kernel.x, in.kernel.z, in.kernel.w);
    let y = bell(in.position.y - in.kernel.y, in.kernel.z, in.kernel.w);
    return (x * in.flux) * y;
}
