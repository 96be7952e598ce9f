// Counts beams in the stencil: the twin of `CountVertex`. The position is that of the programs that draw, to the last bit.

struct Varyings {
    @builtin(position) @invariant position: vec4<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varyings {
    return Varyings(project(camera, corner_at(index).position));
}

@fragment
fn fs() {
}
