// Vertices without shape operators; `light_buffer_both_sides.wgsl` and `light_buffer_one_side.wgsl` have the fragment stages.

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) position_ws: vec3<f32>,
    @location(1) normal_ws: vec4<f32>,
}

struct Targets {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) material: vec4<f32>,
    @location(3) curvature: f32,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let vertex = vertices[vertex_index];
    let clip = view.clip_from_world * vec4<f32>(vertex.position_ws.xyz, 1.0);
    return Varyings(clip, vertex.position_ws.xyz, vertex.normal_ws);
}

fn targets_at(in: Varyings) -> Targets {
    let lit = lit_at(in.position_ws, in.normal_ws.xyz);
    let curvature = in.normal_ws.w * lit.turned;
    return Targets(vec4<f32>(in.position_ws, 1.0), vec4<f32>(lit.normal, surface.optics.x), lit.material, curvature);
}
