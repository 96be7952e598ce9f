// A light and its two shadow maps: the twin of `shadow_map.rs`.

const SELF_SHADOW_TEXELS: f32 = 2.0;
const LEAST_HEIGHT: f32 = 1.0e-5;
const LEAST_COS_SQUARED: f32 = 0.01;

struct LightUniform {
    clip_from_world: mat4x4<f32>,
    position_ws: vec4<f32>,
    intensity: vec4<f32>,
    spot: vec4<f32>,
    water: vec4<f32>,
    entry: vec4<f32>,
    refracted: vec4<f32>,
    own: vec4<f32>,
    cube: vec4<f32>,
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
        let t = clamp((dot(direction, light.spot.xyz) - light.spot.w) / max(light.intensity.w - light.spot.w, 1.0e-6), 0.0, 1.0);
        scale *= t * t * (t * -2.0 + 3.0);
    }
    return LightAt(direction, light.intensity.rgb * scale);
}

// Distance that light has come on its own side of the water at a point.
fn own_distance(light: LightUniform, p_ws: vec3<f32>) -> f32 {
    if light.position_ws.w == 0.0 {
        return max(dot(p_ws, light.position_ws.xyz) - light.own.w, 0.0);
    }
    return length(p_ws - light.position_ws.xyz);
}

// Whether the map through the surface is indexed by the direction of the refracted ray.
fn maps_directions(light: LightUniform) -> bool {
    return light.position_ws.w != 0.0 && light.water.x < 0.0;
}

// Distance of a point beyond the mean water plane.
fn beyond(light: LightUniform, p_ws: vec3<f32>) -> f32 {
    return (light.water.y - p_ws.y) * light.water.x;
}

// The point at which light crosses the mean water plane on its way to a point beyond: x and z.
fn entry_point(light: LightUniform, p_ws: vec3<f32>) -> vec2<f32> {
    var depth = beyond(light, p_ws);
    if light.position_ws.w == 0.0 {
        return p_ws.xz - depth * (light.refracted.xz / abs(light.refracted.y));
    }
    let height = max((light.position_ws.y - light.water.y) * light.water.x, light.refracted.w * LEAST_HEIGHT);
    let across = p_ws.xz - light.position_ws.xz;
    let distance = sqrt(dot(across, across));
    depth = max(depth, 0.0);
    var low = 0.0;
    var high = distance;
    for (var i = 0; i < 20; i++) {
        let middle = (low + high) * 0.5;
        let rest = distance - middle;
        let sin_i = middle / sqrt(middle * middle + height * height);
        let sin_t = rest / max(sqrt(rest * rest + depth * depth), 1.17549435e-38);
        if sin_i - sin_t * light.water.z > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let share = select(0.0, (low + high) * 0.5 / distance, distance > 0.0);
    return across * share + light.position_ws.xz;
}

// Texture coordinates and depth of a point in the map through the surface.
fn on_refracted_map(light: LightUniform, p_ws: vec3<f32>) -> vec3<f32> {
    let entry = entry_point(light, p_ws);
    if maps_directions(light) {
        let depth = beyond(light, p_ws);
        let across = p_ws.xz - entry;
        let distance = sqrt(dot(across, across) + depth * depth);
        let up = max(depth, 0.0) / max(distance, 1.17549435e-38);
        let scale = 0.5 / (sqrt(up + 1.0) * max(distance, 1.17549435e-38));
        return vec3<f32>(across * scale + 0.5, distance / light.refracted.w);
    }
    let uv = (entry - light.entry.xy) / light.entry.zw;
    return vec3<f32>(uv, (beyond(light, p_ws) + light.water.w) / light.refracted.w);
}

fn refracted_texel(light: LightUniform, p_ws: vec3<f32>, size: u32) -> f32 {
    let texel = SELF_SHADOW_TEXELS * max(light.entry.z, light.entry.w) / f32(size);
    if maps_directions(light) {
        return length(p_ws - light.position_ws.xyz) * (SELF_SHADOW_TEXELS * 2.0 * 1.4142135 / f32(size));
    }
    if light.position_ws.w == 0.0 {
        return texel;
    }
    let height = max((light.position_ws.y - light.water.y) * light.water.x, light.refracted.w * LEAST_HEIGHT);
    let depth = max(beyond(light, p_ws), 0.0);
    let across = p_ws.xz - light.position_ws.xz;
    let whole = depth + height;
    let cos_squared = whole * whole / (whole * whole + dot(across, across));
    let sin_squared = (1.0 - cos_squared) * (1.0 / (light.water.z * light.water.z));
    let cos_t = sqrt(max(1.0 - sin_squared, LEAST_COS_SQUARED));
    return (1.0 + depth * sqrt(cos_squared) / (cos_t * (height * light.water.z))) * texel;
}

// A point on a face of the cube: the face's column and row, coordinates on it, distance along its axis.
struct OnFace {
    face: vec2<f32>,
    at: vec2<f32>,
    distance: f32,
}

fn face_of(light: LightUniform, p_ws: vec3<f32>) -> OnFace {
    let to = p_ws - light.position_ws.xyz;
    let far = abs(to);
    let is_x = far.x >= far.y && far.x >= far.z;
    let is_y = !is_x && far.y >= far.z;
    let distance = max(far.x, max(far.y, far.z));
    let along = select(select(to.z, to.y, is_y), to.x, is_x);
    let column = select(select(2.0, 1.0, is_y), 0.0, is_x);
    let at = vec2<f32>(select(to.x, to.z, is_x), select(to.y, to.z, is_y));
    return OnFace(vec2<f32>(column, select(1.0, 0.0, along >= 0.0)), at * (1.0 / distance), distance);
}

fn straight_texel(light: LightUniform, p_ws: vec3<f32>, size: u32) -> f32 {
    if light.cube.w > 0.0 {
        return face_of(light, p_ws).distance * (SELF_SHADOW_TEXELS * 2.0 / light.cube.w);
    }
    let c = light.clip_from_world;
    let per_metre = sqrt(c[0].x * c[0].x + c[1].x * c[1].x + c[2].x * c[2].x);
    let w = p_ws.x * c[0].w + p_ws.y * c[1].w + p_ws.z * c[2].w + c[3].w;
    return w * (SELF_SHADOW_TEXELS * 2.0 / (per_metre * f32(size)));
}

// Texture coordinates and depth of a point in the map of straight rays; w is 1 inside of the map.
fn on_straight_map(light: LightUniform, p_ws: vec3<f32>) -> vec4<f32> {
    if light.cube.w > 0.0 {
        let on = face_of(light, p_ws);
        let margin = 0.5 / light.cube.w;
        let uv = (on.face + clamp(on.at * 0.5 + 0.5, vec2<f32>(margin), vec2<f32>(1.0 - margin))) * vec2<f32>(1.0 / 3.0, 0.5);
        return vec4<f32>(uv, light.cube.y - 1.0 / on.distance * light.cube.z, select(0.0, 1.0, on.distance > 0.0));
    }
    let clip = light.clip_from_world * vec4<f32>(p_ws, 1.0);
    let ndc = clip.xyz * (1.0 / clip.w);
    let uv = vec2<f32>(ndc.x * 0.5 + 0.5, -ndc.y * 0.5 + 0.5);
    let inside = clip.w > 0.0 && uv.x >= 0.0 && uv.x <= 1.0 && uv.y >= 0.0 && uv.y <= 1.0;
    return vec4<f32>(uv, ndc.z, select(0.0, 1.0, inside));
}
