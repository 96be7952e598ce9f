// Sections of beams that are narrower than a pixel: the twin of `needle.rs`.

const LEAST: f32 = 0.0625;
const FOCUSED: f32 = 0.03125;

struct Needle {
    a: vec2<f32>,
    b: vec2<f32>,
    c: vec2<f32>,
    twice_area: f32,
    first: u32,
    square: f32,
}

fn is_narrow(corners: array<vec2<f32>, 3>, twice_area: f32, generator: f32, pixel: f32) -> bool {
    let a = corners[1] - corners[0];
    let b = corners[2] - corners[1];
    let c = corners[0] - corners[2];
    let longest = max(max(dot(a, a), dot(b, b)), dot(c, c));
    let wide = pixel * (1.0 - LEAST);
    return (twice_area * twice_area < wide * wide * longest || longest == 0.0) && abs(twice_area) < generator * FOCUSED;
}

fn needle_of(corners: array<vec2<f32>, 3>, twice_area: f32, pixel: f32) -> Needle {
    var all = corners;
    var start = all[0];
    var span = all[1] - all[0];
    var apex = all[2];
    var first = 0u;
    for (var i = 1u; i < 3u; i++) {
        let other = all[(i + 1u) % 3u] - all[i];
        let longer = dot(other, other) > dot(span, span);
        start = select(start, all[i], longer);
        span = select(span, other, longer);
        apex = select(apex, all[(i + 2u) % 3u], longer);
        first = select(first, i, longer);
    }
    let length = sqrt(dot(span, span));
    let point = !(length > 0.0);
    let inverse = 1.0 / select(length, 1.0, point);
    let direction = vec2<f32>(select(span.x * inverse, 1.0, point), span.y * inverse);
    let height = abs(twice_area) * inverse;
    let least = pixel * LEAST;
    let long = max(length, least);
    let wide = max(height, least);
    let grown = select(wide - height, height - wide, twice_area < 0.0);
    let grown_area = select(long * wide, -(long * wide), twice_area < 0.0);
    let end = start + direction * long;
    return Needle(start, end, apex + vec2<f32>(-direction.y, direction.x) * grown, grown_area, first, pixel + least - wide);
}

// Area of the unit square below an edge, negative if the edge runs towards -x.
fn under_edge(a: vec2<f32>, b: vec2<f32>) -> f32 {
    let run = b.x - a.x;
    let inverse = select(1.0 / run, 0.0, run == 0.0);
    let x0 = clamp(a.x, 0.0, 1.0);
    let x1 = clamp(b.x, 0.0, 1.0);
    let rise = b.y - a.y;
    let y0 = a.y + (x0 - a.x) * inverse * rise;
    let y1 = a.y + (x1 - a.x) * inverse * rise;
    let low = clamp(y0, 0.0, 1.0);
    let high = clamp(y1, 0.0, 1.0);
    let climb = y1 - y0;
    let middle = (low + high) * 0.5;
    let level = abs(climb) < 1e-6;
    let sum = (low - y0) * low + (high - low) * middle + (y1 - high) * high;
    return (x1 - x0) * select(sum / select(climb, 1.0, level), middle, level);
}

// Share of the square around a point that the section covers, 0 to 1.
fn needle_coverage(needle: Needle, at: vec2<f32>) -> f32 {
    let inverse = 1.0 / needle.square;
    let a = (needle.a - at) * inverse + 0.5;
    let b = (needle.b - at) * inverse + 0.5;
    let c = (needle.c - at) * inverse + 0.5;
    let under = under_edge(a, b) + under_edge(b, c) + under_edge(c, a);
    return clamp(select(-under, under, needle.twice_area < 0.0), 0.0, 1.0);
}

// Barycentric weights of the section's point that is near a point, in the order of the section's corners.
fn needle_weights(needle: Needle, at: vec2<f32>) -> vec3<f32> {
    let inverse = 1.0 / needle.twice_area;
    let own = max(
        vec3<f32>(
            perp_dot(needle.c - needle.b, at - needle.b),
            perp_dot(needle.a - needle.c, at - needle.c),
            perp_dot(needle.b - needle.a, at - needle.a),
        ) * inverse,
        vec3<f32>(),
    );
    let scaled = own / (own.x + own.y + own.z);
    return select(select(scaled, scaled.zxy, needle.first == 1u), scaled.yzx, needle.first == 2u);
}
