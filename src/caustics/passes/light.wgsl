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
@group(0) @binding(7) var<uniform> camera: CameraUniform;
@group(0) @binding(8) var heights: texture_2d<f32>;

struct Targets {
    @location(0) direct: vec4<f32>,
    @location(1) visibility: vec4<f32>,
}

fn wet_within(q: vec3<f32>) -> bool {
    let e = camera.extent;
    return under_water(camera, heights, vec3<f32>(clamp(q.x, e.x, e.z), q.y, clamp(q.z, e.y, e.w)));
}

// Whether the way from a light in the water to a dry point goes through the water's surface.
fn passes_surface(p: vec3<f32>) -> bool {
    let is_lamp = light.position_ws.w != 0.0;
    let back = select(-light.position_ws.xyz, light.position_ws.xyz - p, is_lamp);
    let slope = select(back.xz, vec2<f32>(1.0e-9), abs(back.xz) < vec2<f32>(1.0e-9));
    let a = (camera.extent.xy - p.xz) / slope;
    let b = (camera.extent.zw - p.xz) / slope;
    let first = min(a, b);
    let last = max(a, b);
    let leaves = max(max(0.0, first.x), first.y);
    let comes = min(min(select(3.402823466e38, 1.0, is_lamp), last.x), last.y);
    let passes = leaves <= comes && !wet_within(p + back * leaves);
    return passes && (is_lamp || wet_within(p + back * comes));
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
    let near = !beyond_water || (light.water.x < 0.0 && !passes_surface(p));
    if exists && near {
        let incident = light_at(light, p);
        // The depth is that of a point off the surface, at the place of the point itself.
        let at = on_straight_map(light, p);
        let depth = on_straight_map(light, p + n * straight_texel(light, p, textureDimensions(straight_map).x)).z;
        var lit = 1.0;
        if straight_shadows && at.w > 0.0 {
            lit = textureSampleCompareLevel(straight_map, compare, at.xy, depth);
        }
        var arriving = incident.irradiance;
        if light.water.x < 0.0 {
            arriving *= beer_lambert_rgb(light.own.rgb, own_distance(light, p));
        }
        direct = arriving * (max(-dot(n, incident.direction), 0.0) * lit);
    }
    var visibility = select(0.0, 1.0, exists && beyond_water);
    if refracted_shadows && exists && beyond_water {
        let at = on_refracted_map(light, p);
        let depth = on_refracted_map(light, p + n * refracted_texel(light, p, textureDimensions(refracted_map).x)).z;
        visibility = textureSampleCompareLevel(refracted_map, compare, at.xy, depth);
    }
    return Targets(vec4<f32>(direct, 1.0), vec4<f32>(visibility, 0.0, 0.0, 1.0));
}
