// Light as the faces of beams carry it: the twins of `FaceVertex` and `FaceFragment`.

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) intensity: vec3<f32>,
    @location(1) ray: vec3<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    let corner = corner_at(index);
    let d = beam.d[corner.number];
    let scale = lit_at(corner.number) * d.w / spread(abs(double_area(corner.position.y)) * 0.5);
    let left = beer_lambert_rgb(beams.sigma_t.rgb, corner.depth * d.y);
    return Varyings(project(camera, corner.position), beam.flux.rgb * left * scale, vec3<f32>(d.x, -1.0, d.z));
}

@fragment
fn fs(in: Varyings) -> Targets {
    return shine(in.intensity, in.ray, vec2<i32>(in.position.xy));
}
