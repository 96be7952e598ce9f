// Picks a size for each texel: the twin of `Resolve` in `sizes.rs`.

override linear: bool = false;

@group(0) @binding(0) var<uniform> colour: vec4<f32>;

fn pick(flux: array<vec3<f32>, 4>, brightness: vec4<f32>, counts: vec4<f32>) -> vec4<f32> {
    var sizes = flux;
    var picked = sizes[3];
    var bright = brightness[3];
    for (var size = 2; size >= 0; size--) {
        let share = clamp((counts[size] - 8.0) / 8.0, 0.0, 1.0);
        var weight = share;
        if !linear {
            let smooth_share = share * share * (share * -2.0 + 3.0);
            weight = select(0.0, smooth_share, brightness[size] > bright || share >= 1.0);
        }
        picked = picked * (1.0 - weight) + sizes[size] * weight;
        bright = bright * (1.0 - weight) + brightness[size] * weight;
    }
    return vec4<f32>(picked, counts.x);
}
