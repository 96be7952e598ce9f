// A light's view of the surfaces: the twin of `light_buffer.rs`.

struct SurfaceUniform {
    pattern: PatternUniform,
    optics: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: LightView;
@group(0) @binding(1) var<storage, read> vertices: array<ReceiverVertex>;
@group(0) @binding(2) var<uniform> surface: SurfaceUniform;

// What a fragment knows of its surface; `turned`: -1 where the light meets it from behind, else 1.
struct Lit {
    normal: vec3<f32>,
    material: vec4<f32>,
    turned: f32,
}

fn lit_at(position_ws: vec3<f32>, normal_ws: vec3<f32>) -> Lit {
    var normal = normalize(normal_ws);
    let from_behind = dot(normal, direction_at(view, position_ws)) > 0.0;
    if from_behind {
        normal = -normal;
    }
    let albedo = pattern_at(surface.pattern, position_ws, normal);
    let index = select(surface.optics.y, surface.optics.z, from_behind);
    return Lit(normal, vec4<f32>(albedo, index), select(1.0, -1.0, from_behind));
}
