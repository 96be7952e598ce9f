// The map of straight rays: the twin of `StraightVertex` in `shadow_map.rs`.

@group(0) @binding(0) var<uniform> light: LightUniform;
@group(0) @binding(1) var<storage, read> vertices: array<ReceiverVertex>;

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> @builtin(position) vec4<f32> {
    return light.clip_from_world * vec4<f32>(vertices[vertex_index].position_ws.xyz, 1.0);
}
