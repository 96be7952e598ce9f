// The camera as shaders see it: the twin of `camera.rs`.

struct CameraUniform {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    eye_ws: vec4<f32>,
    size_px: vec4<f32>,
    water: vec4<f32>,
    extent: vec4<f32>,
    grid: vec4<f32>,
    level: vec4<f32>,
}

// The apparent position of a point under water.
fn raise(camera: CameraUniform, p_ws: vec3<f32>) -> vec3<f32> {
    let depth = p_ws.y - camera.water.x;
    let raised = depth * camera.water.y + camera.water.x;
    return vec3<f32>(p_ws.x, select(p_ws.y, raised, depth < 0.0), p_ws.z);
}

fn project(camera: CameraUniform, p_ws: vec3<f32>) -> vec4<f32> {
    return camera.clip_from_world * vec4<f32>(raise(camera, p_ws), 1.0);
}

// Pixel coordinates, y down, of a clip-space position.
fn pixel_of(camera: CameraUniform, clip: vec4<f32>) -> vec2<f32> {
    let ndc = clip.xy * (1.0 / clip.w);
    return (vec2<f32>(ndc.x, -ndc.y) * 0.5 + 0.5) * camera.size_px.xy;
}

// Width of a pixel at a point.
fn pixel_m_at(camera: CameraUniform, p_ws: vec3<f32>) -> f32 {
    let m = camera.clip_from_world;
    let per_metre = sqrt(m[0].y * m[0].y + m[1].y * m[1].y + m[2].y * m[2].y);
    let p = raise(camera, p_ws);
    let w = p.x * m[0].w + p.y * m[1].w + p.z * m[2].w + m[3].w;
    return w * (2.0 * camera.size_px.w / per_metre);
}

// Unit vector from the eye towards a point.
fn view_direction(camera: CameraUniform, p_ws: vec3<f32>) -> vec3<f32> {
    let to = p_ws * camera.eye_ws.w - camera.eye_ws.xyz;
    return normalize(select(to, -to, camera.eye_ws.w == 0.0));
}

// Unit vector of the ray through a pixel, centre coordinates.
fn pixel_ray(camera: CameraUniform, pixel: vec2<f32>) -> vec3<f32> {
    let x = pixel.x * (2.0 * camera.size_px.z) - 1.0;
    let y = 1.0 - pixel.y * (2.0 * camera.size_px.w);
    let far = camera.world_from_clip * vec4<f32>(x, y, 1.0, 1.0);
    return view_direction(camera, far.xyz * (1.0 / far.w));
}
