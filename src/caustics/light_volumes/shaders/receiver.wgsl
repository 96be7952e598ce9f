// Light computed at the height of the receiver: the twins of `VertexAtReceiver` and `FragmentAtReceiver`.

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) @interpolate(flat) lit: vec3<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(project(camera, turned(section_vertex(index).position)), vec3<f32>(lit_at(0u), lit_at(1u), lit_at(2u)));
}

@fragment
fn fs(in: Varyings) -> Targets {
    let at_pixel = vec2<i32>(in.position.xy);
    let p = turned(textureLoad(positions, at_pixel, 0).xyz);
    let inverse = 1.0 / double_area_at(p.y);
    var weights = vec3<f32>();
    for (var i = 0u; i < 3u; i++) {
        let a = section_at((i + 1u) % 3u, p.y);
        let b = section_at((i + 2u) % 3u, p.y);
        weights[i] = clamp(perp_dot(b - a, p.xz - a) * inverse, 0.0, 1.0);
    }
    let b = weights * (1.0 / max(weights.x + weights.y + weights.z, 1.0e-6));
    let depth = vec3<f32>(beam.g[0].y - p.y, beam.g[1].y - p.y, beam.g[2].y - p.y);
    let travelled = path_length(beam.d, b, depth);
    let share = b.x * (in.lit.x * beam.d[0].w) + b.y * (in.lit.y * beam.d[1].w) + b.z * (in.lit.z * beam.d[2].w);
    let left = beer_lambert_rgb(beams.sigma_t.rgb, max(travelled, 0.0));
    let intensity = beam.flux.rgb * left * (share / lit_area(drawn_area(p.y), beam.flux.w));
    return contribution(intensity, beam_ray(beam.d, b), at_pixel);
}
