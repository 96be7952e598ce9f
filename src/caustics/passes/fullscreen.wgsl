// A pass over every pixel: the twin of `fullscreen.rs`.

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, vertex_index == 1u), select(-1.0, 3.0, vertex_index == 2u), 0.0, 1.0);
}
