// Geometry of a beam: the twin of `geometry.rs`.

const SMALLEST_SECTION: f32 = 1.0e-7;

struct Beam {
    g: array<vec4<f32>, 3>,
    d: array<vec4<f32>, 3>,
    flux: vec4<f32>,
}

// Twice the signed area of the triangle that two vectors span.
fn perp_dot(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Point of a beam's ray `depth` metres below its start, x and z.
fn on_ray(g: vec4<f32>, d: vec4<f32>, depth: f32) -> vec2<f32> {
    return depth * d.xz + g.xz;
}

fn double_area(a: vec2<f32>, b: vec2<f32>, c: vec2<f32>) -> f32 {
    return perp_dot(b - a, c - a);
}

// Area that flux is spread over; at least the smallest section's.
fn lit_area(area: f32, generator_area: f32) -> f32 {
    return max(area, SMALLEST_SECTION * generator_area);
}

// Step per metre of depth of the ray through the point with these barycentric weights.
fn beam_ray(d: array<vec4<f32>, 3>, weights: vec3<f32>) -> vec3<f32> {
    let across = weights.x * d[0].xz + weights.y * d[1].xz + weights.z * d[2].xz;
    return vec3<f32>(across.x, -1.0, across.y);
}

// Length of the ray with these weights, from the generator, whose vertices are `depth` metres higher.
fn path_length(d: array<vec4<f32>, 3>, weights: vec3<f32>, depth: vec3<f32>) -> f32 {
    return weights.x * depth.x * d[0].y + weights.y * depth.y * d[1].y + weights.z * depth.z * d[2].y;
}
