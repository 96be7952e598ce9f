// A low-pass filter with few taps on a disc that is rotated from texel to texel: the twin of `rotating_filter.rs`.

struct RotatingUniform {
    taps: array<vec4<f32>, 8>,
    rotations: array<vec4<f32>, 8>,
    count: vec4<f32>,
}

@group(0) @binding(0) var<uniform> kernel: RotatingUniform;
@group(0) @binding(1) var source: texture_2d<f32>;

// Bilinear interpolation between the four texels around a position in texels, with centres at integers.
fn bilinear(place: vec2<f32>) -> vec4<f32> {
    let base = floor(place);
    let part = place - base;
    let at = vec2<i32>(base);
    let upper_left = load_clamped(source, at);
    let upper = upper_left + (load_clamped(source, at + vec2<i32>(1, 0)) - upper_left) * part.x;
    let lower_left = load_clamped(source, at + vec2<i32>(0, 1));
    let below = lower_left + (load_clamped(source, at + vec2<i32>(1, 1)) - lower_left) * part.x;
    return upper + (below - upper) * part.y;
}

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let here = position.xy - 0.5;
    let at = vec2<i32>(here);
    let both_turns = kernel.rotations[(at.y & 3) * 2 + ((at.x & 3) >> 1u)];
    let turn = select(both_turns.xy, both_turns.zw, (at.x & 1) == 1);
    var mean = vec4<f32>(0.0);
    for (var k = 0; k < i32(kernel.count.x); k++) {
        let both = kernel.taps[k / 2];
        let tap = select(both.xy, both.zw, (k & 1) == 1);
        let offset = vec2<f32>(turn.x * tap.x - turn.y * tap.y, turn.y * tap.x + turn.x * tap.y);
        let pair = (bilinear(here + offset) + bilinear(here - offset)) * 0.5;
        mean += (pair - mean) * (1.0 / (f32(k) + 1.0));
    }
    return mean;
}
