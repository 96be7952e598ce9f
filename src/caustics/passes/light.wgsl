// Direct light of one light, for every pixel: the twin of `light.rs`.

override straight_shadows: bool = true;
override refracted_shadows: bool = true;

@group(0) @binding(0) var<uniform> light: LightUniform;
@group(0) @binding(1) var positions: texture_2d<f32>;
@group(0) @binding(2) var normals: texture_2d<f32>;
@group(0) @binding(3) var albedos: texture_2d<f32>;
@group(0) @binding(4) var straight_map: texture_depth_2d;
@group(0) @binding(5) var refracted_map: texture_depth_2d;
@group(0) @binding(6) var compare: sampler_comparison;

struct Targets {
    @location(0) direct: vec4<f32>,
    @location(1) visibility: vec4<f32>,
}

@fragment
fn fs(@builtin(position) position: vec4<f32>) -> Targets {
    let here = textureLoad(positions, vec2<i32>(position.xy), 0);
    let n = textureLoad(normals, vec2<i32>(position.xy), 0).xyz;
    let wet = textureLoad(albedos, vec2<i32>(position.xy), 0).w > 0.0;
    let p = here.xyz;
    let exists = here.w > 0.0;
    let beyond_water = wet == (light.water.x > 0.0);
    var direct = vec3<f32>(0.0);
    if exists && !beyond_water {
        let incident = light_at(light, p);
        let at = on_straight_map(light, p + n * straight_texel(light, p, textureDimensions(straight_map).x));
        var lit = 1.0;
        if straight_shadows && at.w > 0.0 {
            lit = textureSampleCompareLevel(straight_map, compare, at.xy, at.z);
        }
        var arriving = incident.irradiance;
        if light.water.x < 0.0 {
            arriving *= beer_lambert_rgb(light.own.rgb, own_distance(light, p));
        }
        direct = arriving * (max(-dot(n, incident.direction), 0.0) * lit);
    }
    var visibility = select(0.0, 1.0, exists && beyond_water);
    if refracted_shadows && exists && beyond_water {
        let at = on_refracted_map(light, p + n * refracted_texel(light, p, textureDimensions(refracted_map).x));
        visibility = textureSampleCompareLevel(refracted_map, compare, at.xy, at.z);
    }
    return Targets(vec4<f32>(direct, 1.0), vec4<f32>(visibility, 0.0, 0.0, 1.0));
}
