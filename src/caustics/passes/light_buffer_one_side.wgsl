// Surfaces on one side of the water's surface, without shape operators.

override wet: bool = true;

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

@group(0) @binding(3) var<uniform> camera: CameraUniform;
@group(0) @binding(4) var heights: texture_2d<f32>;

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let vertex = vertices[vertex_index];
    let clip = view.clip_from_world * vec4<f32>(vertex.position_ws.xyz, 1.0);
    return Varyings(clip, vertex.position_ws.xyz, vertex.normal_ws);
}

@fragment
fn fs(in: Varyings) -> Targets {
    if (under_water(camera, heights, in.position_ws) || is_beside_and_lower(camera, in.position_ws)) != wet {
        discard;
    }
    let lit = lit_at(in.position_ws, in.normal_ws.xyz);
    let curvature = in.normal_ws.w * lit.turned;
    return Targets(vec4<f32>(in.position_ws, 1.0), vec4<f32>(lit.normal, surface.optics.x), lit.material, curvature);
}
