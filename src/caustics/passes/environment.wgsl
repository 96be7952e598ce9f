// Sky, sun discs and the medium: the twin of `environment.rs`.

struct EnvironmentUniform {
    zenith: vec4<f32>,
    horizon: vec4<f32>,
    ground: vec4<f32>,
    disc: vec4<f32>,
    suns: array<vec4<f32>, 16>,
    ambient: vec4<f32>,
    sigma_t: vec4<f32>,
    inscatter: vec4<f32>,
}

// Radiance from a unit direction, the sun's disc included.
fn sky(environment: EnvironmentUniform, direction: vec3<f32>) -> vec3<f32> {
    var suns = environment.suns;
    let y = clamp(direction.y, -1.0, 1.0);
    let low = (1.0 - y) * (1.0 - y);
    let up = 1.0 - low * low;
    let down = min(-y / 0.02, 1.0);
    let horizon = environment.horizon.rgb;
    let above = horizon + (environment.zenith.rgb - horizon) * up;
    let below = horizon + (environment.ground.rgb - horizon) * down;
    var radiance = select(above, below, y < 0.0);
    if environment.disc.w > 0.0 {
        for (var i = 0; i < 16; i++) {
            let sun = suns[i];
            let gap = direction + sun.xyz;
            if sun.w > 0.0 && dot(gap, gap) <= environment.disc.w {
                radiance += environment.disc.rgb;
            }
        }
    }
    return radiance;
}
