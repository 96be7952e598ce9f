// A light's view of the surfaces: the twin of `light_buffer.rs`.

struct SurfaceUniform {
    pattern: PatternUniform,
    optics: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: LightView;
@group(0) @binding(1) var<storage, read> vertices: array<ReceiverVertex>;
@group(0) @binding(2) var<uniform> surface: SurfaceUniform;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) position_ws: vec3<f32>,
    @location(1) normal_ws: vec4<f32>,
}

struct Targets {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) material: vec4<f32>,
    @location(3) curvature: f32,
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let vertex = vertices[vertex_index];
    let clip = view.clip_from_world * vec4<f32>(vertex.position_ws.xyz, 1.0);
    return Varyings(clip, vertex.position_ws.xyz, vertex.normal_ws);
}

@fragment
fn fs(in: Varyings) -> Targets {
    var normal = normalize(in.normal_ws.xyz);
    let from_behind = dot(normal, direction_at(view, in.position_ws)) > 0.0;
    if from_behind {
        normal = -normal;
    }
    let albedo = pattern_at(surface.pattern, in.position_ws, normal);
    let index = select(surface.optics.y, surface.optics.z, from_behind);
    let curvature = select(in.normal_ws.w, -in.normal_ws.w, from_behind);
    return Targets(vec4<f32>(in.position_ws, 1.0), vec4<f32>(normal, surface.optics.x), vec4<f32>(albedo, index), curvature);
}
