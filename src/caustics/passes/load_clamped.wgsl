// The texel at integer coordinates; outside of the texture, the nearest texel inside. The twin of `load_clamped` in `fullscreen.rs`.

fn load_clamped(source: texture_2d<f32>, at: vec2<i32>) -> vec4<f32> {
    return textureLoad(source, clamp(at, vec2<i32>(0), vec2<i32>(textureDimensions(source)) - 1), 0);
}
