// Surfaces on one side of the water's surface.

override wet: bool = true;

@group(0) @binding(3) var<uniform> camera: CameraUniform;
@group(0) @binding(4) var heights: texture_2d<f32>;

@fragment
fn fs(in: Varyings) -> Targets {
    if (under_water(camera, heights, in.position_ws) || is_beside_and_lower(camera, in.position_ws)) != wet {
        discard;
    }
    return targets_at(in);
}
