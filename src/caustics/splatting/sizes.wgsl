// Splats of four sizes: the twin of `sizes.rs`.

override by_integral: bool = false;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) place: vec4<f32>,
    @location(1) @interpolate(flat) shares: vec4<f32>,
    @location(2) @interpolate(flat) flux: vec4<f32>,
}

fn radii(distance: f32) -> vec4<f32> {
    return clamp(distance * vec4<f32>(3.0, 7.0, 11.0, 15.0), vec4<f32>(LEAST_DIAMETER_TX), vec4<f32>(MOST_DIAMETER_TX)) * 0.5;
}

fn falloffs(radius: vec4<f32>) -> vec4<f32> {
    return 0.25 * FALLOFF / (radius * radius);
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let photon = photon_of(vertex_index);
    if !photon.landed {
        return Varyings(sprite(photon), vec4<f32>(), vec4<f32>(), vec4<f32>());
    }
    let distance = splats.shape.z;
    var radius = radii(distance);
    var falloff = falloffs(radius);
    var shares = falloff * 0.31830987;
    if !by_integral {
        for (var size = 0; size < 4; size++) {
            let x = sampled_sum(photon.at.x, radius[size], falloff[size]);
            let y = sampled_sum(photon.at.y, radius[size], falloff[size]);
            shares[size] = 1.0 / (x * y);
        }
    }
    let sum = photon.flux.r + photon.flux.g + photon.flux.b;
    return Varyings(sprite(photon), vec4<f32>(photon.at, distance, 0.0), shares, vec4<f32>(photon.flux, sum));
}

// Gaussians of all sizes at a pixel.
fn bells(in: Varyings) -> vec4<f32> {
    let t = in.position.xy - in.place.xy;
    let radius = radii(in.place.z);
    let falloff = falloffs(radius);
    let x = select(vec4<f32>(0.0), exp(-(t.x * t.x * falloff)), vec4<f32>(abs(t.x)) < radius);
    let y = select(vec4<f32>(0.0), exp(-(t.y * t.y * falloff)), vec4<f32>(abs(t.y)) < radius);
    return (x * in.shares) * y;
}

// 1 for each size whose splat covers the pixel.
fn inside(in: Varyings) -> vec4<f32> {
    let t = abs(in.position.xy - in.place.xy);
    return select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<f32>(max(t.x, t.y)) < radii(in.place.z));
}
