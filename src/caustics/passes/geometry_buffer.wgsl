// World position, normal and albedo of the nearest receiver: the twin of `geometry_buffer.rs`.

struct MaterialUniform {
    pattern: PatternUniform,
    kind: vec4<f32>,
}

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<storage, read> vertices: array<ReceiverVertex>;
@group(0) @binding(2) var<uniform> material: MaterialUniform;
@group(0) @binding(3) var heights: texture_2d<f32>;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) position_ws: vec3<f32>,
    @location(1) normal_ws: vec3<f32>,
}

struct Targets {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) albedo: vec4<f32>,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let vertex = vertices[vertex_index];
    return Varyings(project(camera, vertex.position_ws.xyz), vertex.position_ws.xyz, vertex.normal_ws.xyz);
}

@fragment
fn fs(in: Varyings) -> Targets {
    var normal = normalize(in.normal_ws);
    // Open surfaces receive light on both sides, so the normal is turned towards the eye.
    if dot(normal, view_direction(camera, in.position_ws)) > 0.0 {
        normal = -normal;
    }
    let albedo = pattern_at(material.pattern, in.position_ws, normal);
    let wet = select(0.0, 1.0, under_water(camera, heights, in.position_ws));
    return Targets(vec4<f32>(in.position_ws, material.kind.x), vec4<f32>(normal, material.kind.y), vec4<f32>(albedo, wet));
}
