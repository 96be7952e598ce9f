// Light computed at the faces of beams: the twins of `VertexAtFace` and `FragmentAtFace`.

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) intensity: vec3<f32>,
    @location(1) ray: vec3<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    let vertex = section_vertex(index);
    let d = beam.d[vertex.number];
    let scale = lit_at(vertex.number) * d.w / lit_area(abs(double_area_at(vertex.position.y)) * 0.5, beam.flux.w);
    let left = beer_lambert_rgb(beams.sigma_t.rgb, vertex.depth * d.y);
    return Varyings(project(camera, turned(vertex.position)), beam.flux.rgb * left * scale, vec3<f32>(d.x, -1.0, d.z));
}

@fragment
fn fs(in: Varyings) -> Targets {
    return contribution(in.intensity, in.ray, vec2<i32>(in.position.xy));
}
