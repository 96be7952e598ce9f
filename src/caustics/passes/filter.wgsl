// One pass of a separable low-pass filter: the twin of `filter.rs`.

struct KernelUniform {
    weights: array<vec4<f32>, 8>,
    step: vec4<f32>,
}

@group(0) @binding(0) var<uniform> kernel: KernelUniform;
@group(0) @binding(1) var source: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<i32>(position.xy);
    let here = load_clamped(source, at);
    var sum = here;
    for (var tap = 1; tap <= i32(kernel.step.z); tap++) {
        let offset = vec2<i32>(kernel.step.xy) * tap;
        let before = load_clamped(source, at - offset);
        let after = load_clamped(source, at + offset);
        sum += ((before - here) + (after - here)) * kernel.weights[tap / 4][tap % 4];
    }
    return sum;
}
