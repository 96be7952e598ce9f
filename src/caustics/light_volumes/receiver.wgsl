// Light of a beam at the height of the receiver: the twins of `ReceiverVertex` and `ReceiverFragment`.

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) @interpolate(flat) lit: vec3<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(project(camera, corner_at(index).position), vec3<f32>(lit_at(0u), lit_at(1u), lit_at(2u)));
}

@fragment
fn fs(in: Varyings) -> Targets {
    let at_pixel = vec2<i32>(in.position.xy);
    let p = textureLoad(positions, at_pixel, 0).xyz;
    let inverse = 1.0 / double_area(p.y);
    var weights = vec3<f32>();
    for (var i = 0u; i < 3u; i++) {
        let a = section_corner((i + 1u) % 3u, p.y);
        let b = section_corner((i + 2u) % 3u, p.y);
        weights[i] = clamp(perp_dot(b - a, p.xz - a) * inverse, 0.0, 1.0);
    }
    let b = weights * (1.0 / max(weights.x + weights.y + weights.z, 1.0e-6));
    let across = b.x * beam.d[0].xz + b.y * beam.d[1].xz + b.z * beam.d[2].xz;
    let travelled = b.x * (beam.g[0].y - p.y) * beam.d[0].y
        + b.y * (beam.g[1].y - p.y) * beam.d[1].y
        + b.z * (beam.g[2].y - p.y) * beam.d[2].y;
    let share = b.x * (in.lit.x * beam.d[0].w) + b.y * (in.lit.y * beam.d[1].w) + b.z * (in.lit.z * beam.d[2].w);
    let left = beer_lambert_rgb(beams.sigma_t.rgb, max(travelled, 0.0));
    return shine(beam.flux.rgb * left * (share / spread(drawn_area(p.y))), vec3<f32>(across.x, -1.0, across.y), at_pixel);
}
