// The light of a beam: the twins of `lit` and `drawn_area`.

struct BeamsUniform {
    sigma_t: vec4<f32>,
    planes: vec4<f32>,
    space: vec4<f32>,
}

@group(0) @binding(1) var<uniform> beams: BeamsUniform;
@group(0) @binding(2) var<uniform> light: LightUniform;
@group(0) @binding(5) var straight_map: texture_depth_2d;
@group(0) @binding(6) var compare: sampler_comparison;

// A point or vector of the beams' space in the world, or the other way round.
fn turned(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(v.x, v.y * beams.space.x, v.z);
}

fn lit_at(number: u32) -> f32 {
    if beams.planes.w > 0.0 {
        let at = on_straight_map(light, turned(beam.g[number].xyz));
        if at.w > 0.0 {
            return textureSampleCompareLevel(straight_map, compare, at.xy, at.z);
        }
    }
    return 1.0;
}

fn drawn_area(y: f32) -> f32 {
    let level = beams.planes.x;
    let step = beams.planes.y;
    let slab = clamp(floor((level - y) / step), 0.0, beams.planes.z - 1.0);
    let top = level - slab * step;
    let bottom = level - (slab + 1.0) * step;
    let signed = double_area_at(y);
    let sign = select(1.0, -1.0, signed < 0.0);
    let whole = abs(signed);
    var area = whole;
    var balance = whole;
    for (var i = 0u; i < 3u; i++) {
        let j = (i + 1u) % 3u;
        let starts = beam.g[i].w > 0.0;
        let start = select(j, i, starts);
        let end = select(i, j, starts);
        let high = select(min(top, beam.g[start].y), beam.g[start].y, slab == 0.0);
        let low = min(bottom, beam.g[end].y);
        let above = section_at(start, high);
        let below = section_at(end, low);
        let t = clamp((high - y) / max(high - low, 1.0e-12), 0.0, 1.0);
        let diagonal = (below - above) * t + above;
        let pi = section_at(i, y);
        let pj = section_at(j, y);
        let r = section_at(3u - i - j, y);
        let outside = perp_dot(diagonal - pi, pj - pi) * sign;
        let d = perp_dot(r - pi, diagonal - pi) * sign;
        let b = perp_dot(r - pj, diagonal - pj) * sign;
        let taken = abs(outside);
        var shared_area = whole * taken / max(select(whole + d, whole - b, b < 0.0), 1.17549435e-38);
        if d <= 0.0 && b >= 0.0 {
            shared_area = taken;
        }
        if d > 0.0 && b < 0.0 {
            shared_area = whole;
        }
        balance += outside;
        area += taken;
        if outside < 0.0 {
            area -= shared_area * 2.0;
        }
    }
    return max(max(area, abs(balance)), whole * 0.5) * 0.5;
}
