// The map through the surface: the twin of `RefractedVertex` in `shadow_map.rs`.

@group(0) @binding(0) var<uniform> light: LightUniform;
@group(0) @binding(1) var<storage, read> vertices: array<ReceiverVertex>;

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> @builtin(position) vec4<f32> {
    let at = on_refracted_map(light, vertices[vertex_index].position_ws.xyz);
    return vec4<f32>(at.x * 2.0 - 1.0, -(at.y * 2.0) + 1.0, at.z, 1.0);
}
