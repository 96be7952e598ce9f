// A light and its two shadow maps: the twin of `shadow_map.rs`.

const SELF_SHADOW_TEXELS: f32 = 2.0;

struct LightUniform {
    clip_from_world: mat4x4<f32>,
    position_ws: vec4<f32>,
    intensity: vec4<f32>,
    spot: vec4<f32>,
    water: vec4<f32>,
    entry: vec4<f32>,
    refracted: vec4<f32>,
}

// The light at a point: its direction of travel, and its irradiance on a perpendicular surface.
struct LightAt {
    direction: vec3<f32>,
    irradiance: vec3<f32>,
}

fn light_at(light: LightUniform, p_ws: vec3<f32>) -> LightAt {
    if light.position_ws.w == 0.0 {
        return LightAt(light.position_ws.xyz, light.intensity.rgb);
    }
    let to = p_ws - light.position_ws.xyz;
    let squared = dot(to, to);
    let direction = to * (1.0 / sqrt(squared));
    var scale = 1.0 / squared;
    if light.spot.w > -2.0 {
        let t = clamp((dot(direction, light.spot.xyz) - light.spot.w) / max(light.water.x - light.spot.w, 1.0e-6), 0.0, 1.0);
        scale *= t * t * (t * -2.0 + 3.0);
    }
    return LightAt(direction, light.intensity.rgb * scale);
}

// The point at which light enters the mean water plane on its way to a point under water: x and z.
fn entry_point(light: LightUniform, p_ws: vec3<f32>) -> vec2<f32> {
    var depth = light.water.y - p_ws.y;
    if light.position_ws.w == 0.0 {
        return p_ws.xz - depth * (light.refracted.xz / -light.refracted.y);
    }
    let height = max(light.position_ws.y - light.water.y, 1.0e-4);
    let across = p_ws.xz - light.position_ws.xz;
    let distance = sqrt(dot(across, across));
    depth = max(depth, 0.0);
    var low = 0.0;
    var high = distance;
    for (var i = 0; i < 20; i++) {
        let middle = (low + high) * 0.5;
        let rest = distance - middle;
        let sin_i = middle / sqrt(middle * middle + height * height);
        let sin_t = rest / max(sqrt(rest * rest + depth * depth), 1.0e-12);
        if sin_i - sin_t * light.water.z > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let share = select(0.0, (low + high) * 0.5 / distance, distance > 1.0e-9);
    return across * share + light.position_ws.xz;
}

// Texture coordinates and depth of a point in the map through water.
fn through_water(light: LightUniform, p_ws: vec3<f32>) -> vec3<f32> {
    let uv = (entry_point(light, p_ws) - light.entry.xy) / light.entry.zw;
    return vec3<f32>(uv, (light.water.y - p_ws.y) / light.water.w);
}

fn water_texel(light: LightUniform, size: u32) -> f32 {
    return SELF_SHADOW_TEXELS * max(light.entry.z, light.entry.w) / f32(size);
}

fn air_texel(light: LightUniform, p_ws: vec3<f32>, size: u32) -> f32 {
    let c = light.clip_from_world;
    let per_metre = sqrt(c[0].x * c[0].x + c[1].x * c[1].x + c[2].x * c[2].x);
    let w = p_ws.x * c[0].w + p_ws.y * c[1].w + p_ws.z * c[2].w + c[3].w;
    return w * (SELF_SHADOW_TEXELS * 2.0 / (per_metre * f32(size)));
}

// Texture coordinates and depth of a point in the map through air; w is 1 inside of the map.
fn through_air(light: LightUniform, p_ws: vec3<f32>) -> vec4<f32> {
    let clip = light.clip_from_world * vec4<f32>(p_ws, 1.0);
    let ndc = clip.xyz * (1.0 / clip.w);
    let uv = vec2<f32>(ndc.x * 0.5 + 0.5, -ndc.y * 0.5 + 0.5);
    let inside = clip.w > 0.0 && uv.x >= 0.0 && uv.x <= 1.0 && uv.y >= 0.0 && uv.y <= 1.0;
    return vec4<f32>(uv, ndc.z, select(0.0, 1.0, inside));
}
