// A receiver's vertex in world space: the twin of `ReceiverVertex` in `geometry_buffer.rs`.

struct ReceiverVertex {
    position_ws: vec4<f32>,
    normal_ws: vec4<f32>,
}
