// Whether a point is above or below the water's rectangle.
fn in_extent(camera: CameraUniform, p_ws: vec3<f32>) -> bool {
    let e = camera.extent;
    return p_ws.x >= e.x && p_ws.x <= e.z && p_ws.z >= e.y && p_ws.z <= e.w;
}

// Whether a point is beside the water's rectangle and lower than all of its surface: the twin of `CameraUniform::is_beside_and_lower`.
fn is_beside_and_lower(camera: CameraUniform, p_ws: vec3<f32>) -> bool {
    return !in_extent(camera, p_ws) && p_ws.y < camera.water.x - 1.0e-3 * camera.level.y;
}

// Whether a point is in the body of water: the twin of `CameraUniform::under_water`.

fn under_water(camera: CameraUniform, heights: texture_2d<f32>, p_ws: vec3<f32>) -> bool {
    let inside = in_extent(camera, p_ws);
    let last = vec2<f32>(textureDimensions(heights)) - 1.0;
    let place = clamp((p_ws.xz - camera.grid.xy) * camera.grid.zw, vec2<f32>(0.0), last);
    let corner = min(floor(place), max(last - 1.0, vec2<f32>(0.0)));
    let part = place - corner;
    // The triangle's corners are (0, 0) or (1, 1), and both others.
    let far = part.x + part.y > 1.0;
    let along = select(part, 1.0 - part.yx, far);
    let at = vec2<i32>(corner);
    let base = textureLoad(heights, at + select(vec2<i32>(0), vec2<i32>(1), far), 0).r;
    let right = textureLoad(heights, at + vec2<i32>(1, 0), 0).r;
    let down = textureLoad(heights, at + vec2<i32>(0, 1), 0).r;
    let surface = base + along.x * (right - base) + along.y * (down - base);
    return camera.water.w > 0.0 && inside && p_ws.y < surface;
}
