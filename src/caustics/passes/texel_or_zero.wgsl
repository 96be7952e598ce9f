// The texel that holds a point, coordinates in texels; zeros outside of the texture.
//
// Not one branch: inside of loops, SwiftShader takes minutes to compile them.

fn texel_or_zero(source: texture_2d<f32>, at: vec2<f32>) -> vec4<f32> {
    let size = vec2<f32>(textureDimensions(source));
    let inside = all(at >= vec2<f32>(0.0)) & all(at < size);
    let texel = textureLoad(source, vec2<i32>(select(vec2<f32>(0.0), at, inside)), 0);
    return select(vec4<f32>(0.0), texel, inside);
}
