// Uniform of a layer: the twin of `LayerUniform` in `compose.rs`.

struct LayerUniform {
    scale: vec4<f32>,
    distance: vec4<f32>,
    ratio: vec4<f32>,
}
