
@group(0) @binding(1) var reds: texture_2d<f32>;
@group(0) @binding(2) var counts: texture_2d<f32>;
@group(0) @binding(3) var greens: texture_2d<f32>;
@group(0) @binding(4) var blues: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let r = textureLoad(reds, at, 0);
    let g = textureLoad(greens, at, 0);
    let b = textureLoad(blues, at, 0);
    let sizes = array<vec3<f32>, 4>(
        vec3<f32>(r.x, g.x, b.x),
        vec3<f32>(r.y, g.y, b.y),
        vec3<f32>(r.z, g.z, b.z),
        vec3<f32>(r.w, g.w, b.w),
    );
    return pick(sizes, r + g + b, textureLoad(counts, at, 0));
}
