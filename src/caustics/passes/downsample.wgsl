// The depth of a smaller target: the twin of `downsample.rs`.

struct DownsampleUniform {
    sizes: vec4<u32>,
}

@group(0) @binding(0) var<uniform> targets: DownsampleUniform;
@group(0) @binding(1) var depths: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @builtin(frag_depth) f32 {
    let at = (2u * vec2<u32>(position.xy) + 1u) * targets.sizes.xy / (2u * targets.sizes.zw);
    return load_clamped(depths, vec2<i32>(at)).x;
}
