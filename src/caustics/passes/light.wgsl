// Direct light of one light, for every pixel: the twin of `light.rs`.

override air_shadows: bool = true;
override water_shadows: bool = true;

@group(0) @binding(0) var<uniform> camera: CameraUniform;
@group(0) @binding(1) var<uniform> light: LightUniform;
@group(0) @binding(2) var positions: texture_2d<f32>;
@group(0) @binding(3) var normals: texture_2d<f32>;
@group(0) @binding(4) var air_map: texture_depth_2d;
@group(0) @binding(5) var water_map: texture_depth_2d;
@group(0) @binding(6) var compare: sampler_comparison;

struct Targets {
    @location(0) direct: vec4<f32>,
    @location(1) visibility: vec4<f32>,
}

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> Targets {
    let here = textureLoad(positions, vec2<i32>(position.xy), 0);
    let n = textureLoad(normals, vec2<i32>(position.xy), 0).xyz;
    let p = here.xyz;
    let exists = here.w > 0.0;
    let wet = exists && under_water(camera, p);
    var direct = vec3<f32>(0.0);
    if exists && !wet {
        let incident = light_at(light, p);
        let at = through_air(light, p + n * air_texel(light, p, textureDimensions(air_map).x));
        var lit = 1.0;
        if air_shadows && at.w > 0.0 {
            lit = textureSampleCompareLevel(air_map, compare, at.xy, at.z);
        }
        direct = incident.irradiance * (max(-dot(n, incident.direction), 0.0) * lit);
    }
    var visibility = select(0.0, 1.0, wet);
    if water_shadows && wet {
        let at = through_water(light, p + n * water_texel(light, textureDimensions(water_map).x));
        visibility = textureSampleCompareLevel(water_map, compare, at.xy, at.z);
    }
    return Targets(vec4<f32>(direct, 1.0), vec4<f32>(visibility, 0.0, 0.0, 1.0));
}
