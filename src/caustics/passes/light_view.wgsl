// Views of a light: the twin of `light_view.rs`.

struct LightView {
    clip_from_world: mat4x4<f32>,
    position_ws: vec4<f32>,
}

// Unit vector along which light travels when it reaches a point.
fn direction_at(view: LightView, p_ws: vec3<f32>) -> vec3<f32> {
    if view.position_ws.w == 0.0 {
        return view.position_ws.xyz;
    }
    return normalize(p_ws - view.position_ws.xyz);
}

struct TexelView {
    view: LightView,
    axis_ws: vec4<f32>,
    size_tx: vec4<f32>,
}

// Area across the light's ray to a point that a texel covers there.
fn area_at(texels: TexelView, p_ws: vec3<f32>) -> f32 {
    let area = texels.axis_ws.w;
    if texels.view.position_ws.w == 0.0 {
        return area;
    }
    let to = p_ws - texels.view.position_ws.xyz;
    let along = dot(to, texels.axis_ws.xyz);
    return along * along * along * area / length(to);
}

// Texel coordinates of a point.
fn texel_at(texels: TexelView, p_ws: vec3<f32>) -> vec2<f32> {
    let clip = texels.view.clip_from_world * vec4<f32>(p_ws, 1.0);
    let ndc = clip.xy * (1.0 / clip.w);
    return vec2<f32>(ndc.x * 0.5 + 0.5, -ndc.y * 0.5 + 0.5) * texels.size_tx.xy;
}

struct TexelSteps {
    x: vec3<f32>,
    y: vec3<f32>,
}

// How far a point moves across the view's axis with one texel along x and along y.
fn steps_at(texels: TexelView, p_ws: vec3<f32>) -> TexelSteps {
    let m = texels.view.clip_from_world;
    let x = vec3<f32>(m[0].x, m[1].x, m[2].x);
    let y = vec3<f32>(m[0].y, m[1].y, m[2].y);
    let w = (m * vec4<f32>(p_ws, 1.0)).w;
    return TexelSteps(x * (w * (2.0 * texels.size_tx.z) / dot(x, x)), y * (w * (-2.0 * texels.size_tx.w) / dot(y, y)));
}
