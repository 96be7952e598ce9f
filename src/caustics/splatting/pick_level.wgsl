// Takes a level of the pyramid for each texel: the twin of `Pick` in `pyramid.rs`.

@group(0) @binding(0) var pyramid: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let size = vec2<f32>(textureDimensions(pyramid, 0));
    var picked = vec4<f32>();
    let levels = i32(textureNumLevels(pyramid));
    for (var level = 0; level < levels; level++) {
        let share = vec2<f32>(textureDimensions(pyramid, level)) / size;
        let here = textureLoad(pyramid, vec2<i32>(position.xy * share), level);
        picked = vec4<f32>(here.rgb * (share.x * share.y), f32(level));
        if here.w >= 16.0 {
            break;
        }
    }
    return picked;
}
