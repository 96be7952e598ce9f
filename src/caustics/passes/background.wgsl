// Sky and receivers, without the water surface: the twin of `Background` in `water_surface.rs`.

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> environment: EnvironmentUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var radiances: texture_2d<f32>;

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let here = textureLoad(positions, vec2<i32>(position.xy), 0);
    let seen = textureLoad(radiances, vec2<i32>(position.xy), 0).rgb;
    let exists = here.w > 0.0;
    var color = seen;
    if camera.water.z > 0.0 {
        // The eye is under water, so it sees everything through water.
        let distance = select(1.0e4 * camera.level.y, length(here.xyz - camera.eye_ws.xyz), exists);
        color = through_medium(environment.sigma_t.rgb, environment.inscatter.rgb, select(vec3<f32>(0.0), seen, exists), distance);
    } else if !exists {
        color = sky(environment, pixel_ray(camera, position.xy));
    }
    return vec4<f32>(color, 1.0);
}
