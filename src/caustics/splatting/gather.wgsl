// From the caustic map to pixels: the twin of `gather.rs`.

const OFF_TX: f32 = 3.0;

// 0 all receivers, 1 those under water, 2 those that are dry.
override lit: u32 = 0u;

@group(0) @binding(0) var<uniform> map: TexelView;
@group(0) @binding(1) var positions: texture_2d<f32>;
@group(0) @binding(2) var normals: texture_2d<f32>;
@group(0) @binding(3) var receiver_positions: texture_2d<f32>;
@group(0) @binding(4) var receiver_normals: texture_2d<f32>;
@group(0) @binding(5) var caustic_map: texture_2d<f32>;
@group(0) @binding(6) var albedos: texture_2d<f32>;

@fragment
fn fs(@builtin(position) pixel: vec4<f32>) -> @location(0) vec4<f32> {
    let here = textureLoad(positions, vec2<i32>(pixel.xy), 0);
    let n = textureLoad(normals, vec2<i32>(pixel.xy), 0).xyz;
    let p = here.xyz;
    let cosine = -dot(n, direction_at(map.view, p));
    let at = texel_at(map, p);
    let area = area_at(map, p);
    let off = sqrt(area) * OFF_TX;
    let corner = floor(at - 0.5);
    let share = at - 0.5 - corner;
    let size = vec2<f32>(textureDimensions(caustic_map));
    var sum = vec3<f32>();
    var weights = 0.0;
    for (var k = 0u; k < 4u; k++) {
        let step = vec2<f32>(f32(k & 1u), f32(k >> 1u));
        let texel = corner + step;
        if all(texel >= vec2<f32>(0.0)) && all(texel < size) {
            let there = textureLoad(receiver_positions, vec2<i32>(texel), 0);
            let normal = textureLoad(receiver_normals, vec2<i32>(texel), 0).xyz;
            if there.w > 0.0 && abs(dot(p - there.xyz, normal)) <= off {
                let part = select(1.0 - share, share, step > vec2<f32>(0.0));
                let weight = part.x * part.y;
                sum += textureLoad(caustic_map, vec2<i32>(texel), 0).rgb * weight;
                weights += weight;
            }
        }
    }
    let wet = textureLoad(albedos, vec2<i32>(pixel.xy), 0).w > 0.0;
    let may_be_lit = lit == 0u || wet == (lit == 1u);
    if !(may_be_lit && here.w == 1.0 && cosine > 0.0 && weights > 0.0) {
        return vec4<f32>();
    }
    return vec4<f32>(sum * (cosine / (area * weights)), 0.0);
}
