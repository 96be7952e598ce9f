// A smaller layer, upsampled by depth: the twin of `Upsampled` in `compose.rs`.

const FARTHEST_M: f32 = 1.0e30;

@group(0) @binding(0) var<uniform> layer: LayerUniform;
@group(0) @binding(1) var texels: texture_2d<f32>;
@group(0) @binding(2) var layer_depth: texture_2d<f32>;
@group(0) @binding(3) var full_depth: texture_2d<f32>;

// Distance along the view, m, from the value of a depth texture.
fn distance_m(depth: f32) -> f32 {
    let d = layer.distance;
    let distance = (depth * d.y + d.x) / (depth * d.w + d.z);
    return select(FARTHEST_M, distance, distance < FARTHEST_M);
}

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let here = distance_m(load_clamped(full_depth, vec2<i32>(position.xy)).x);
    // In these coordinates, texel centres of the layer are at integers.
    let place = position.xy * layer.ratio.xy - 0.5;
    let base = floor(place);
    let part = place - base;
    var around = array<vec4<f32>, 4>();
    var weights = array<f32, 4>();
    var nearest = vec4<f32>(0.0);
    // Larger than any difference of distances.
    var least_gap = 1.0e38;
    for (var corner = 0; corner < 4; corner++) {
        let offset = vec2<i32>(corner % 2, corner / 2);
        let f = select(1.0 - part.x, part.x, offset.x == 1) * select(1.0 - part.y, part.y, offset.y == 1);
        let at = vec2<i32>(base) + offset;
        around[corner] = load_clamped(texels, at);
        let gap = abs(distance_m(load_clamped(layer_depth, at).x) - here);
        if f > 0.0 && gap < least_gap {
            nearest = around[corner];
            least_gap = gap;
        }
        weights[corner] = select(0.0, f, gap <= here * layer.ratio.z);
    }
    var sum = vec4<f32>(0.0);
    var total = 0.0;
    for (var corner = 0; corner < 4; corner++) {
        if weights[corner] > 0.0 {
            sum += (around[corner] - nearest) * weights[corner];
        }
        total += weights[corner];
    }
    return (nearest + sum * (1.0 / select(1.0, total, total > 0.0))) * layer.scale;
}
