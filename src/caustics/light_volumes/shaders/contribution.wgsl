// Contribution of a beam to the targets: the twin of `BeamContribution`.

override paper: bool = false;
// 0 intensities, 1 vectors, 2 irradiances.
override gather: u32 = 2u;

@group(0) @binding(7) var positions: texture_2d<f32>;
@group(0) @binding(8) var normals: texture_2d<f32>;
@group(0) @binding(9) var visibilities: texture_2d<f32>;

struct Targets {
    @location(0) first: vec4<f32>,
    @location(1) green: vec4<f32>,
    @location(2) blue: vec4<f32>,
    @location(3) direction: vec4<f32>,
    @location(4) count: vec4<f32>,
}

fn contribution(intensity_at: vec3<f32>, along: vec3<f32>, at: vec2<i32>) -> Targets {
    let ray = turned(along);
    let exists = textureLoad(positions, at, 0).w == 1.0;
    let seen = select(1.0, textureLoad(visibilities, at, 0).r, beams.sigma_t.w > 0.0);
    let visible = select(0.0, seen, exists);
    let intensity = intensity_at * visible;
    let unit = -normalize(ray);
    let to_light = select(-ray, unit, paper);
    let irradiance = intensity * max(dot(textureLoad(normals, at, 0).xyz, to_light), 0.0);
    var first = vec4<f32>(irradiance, 0.0);
    if gather == 0u {
        first = vec4<f32>(intensity, 0.0);
    }
    if gather == 1u {
        first = vec4<f32>(to_light * intensity.r, 0.0);
    }
    let total = irradiance.r + irradiance.g + irradiance.b;
    return Targets(
        first,
        vec4<f32>(to_light * intensity.g, 0.0),
        vec4<f32>(to_light * intensity.b, 0.0),
        vec4<f32>(unit * total, total),
        vec4<f32>(select(0.0, 1.0, exists), 0.0, 0.0, 0.0),
    );
}
