// Photons as splats: the twin of `splats.rs`.

const MOST_DIAMETER_TX: f32 = 63.0;
const MOST_TEXELS: i32 = 64;
const LEAST_DIAMETER_TX: f32 = 3.0;
const SPRITE_MARGIN_TX: f32 = 0.04;
const FALLOFF: f32 = 12.5;
const SPLAT_OFF_TX: f32 = 2.0;

struct SplatsUniform {
    shape: vec4<f32>,
}

@group(0) @binding(0) var<uniform> map: TexelView;
@group(0) @binding(1) var<uniform> splats: SplatsUniform;
@group(0) @binding(2) var receiver_positions: texture_2d<f32>;
@group(0) @binding(3) var receiver_normals: texture_2d<f32>;

struct Photon {
    texel: vec2<i32>,
    position: vec3<f32>,
    normal: vec3<f32>,
    at: vec2<f32>,
    landed: bool,
    flux: vec3<f32>,
    beam: f32,
}

// A photon; `ray` has the diameter of its beam in w.
fn photon_at(texel: vec2<i32>, position: vec3<f32>, ray: vec4<f32>, flux: vec3<f32>, exists: bool) -> Photon {
    let at = texel_at(map, position);
    let there = texel_or_zero(receiver_positions, at);
    let normal = texel_or_zero(receiver_normals, at).xyz;
    let width_tx = sqrt(area_at(map, position));
    let near = abs(dot(position - there.xyz, normal)) <= width_tx * SPLAT_OFF_TX;
    let landed = exists && there.w == 1.0 && near && dot(ray.xyz, normal) < 0.0;
    return Photon(texel, position, normal, select(vec2<f32>(), at, landed), landed, flux * splats.shape.w, ray.w / width_tx);
}

fn sprite(photon: Photon) -> vec4<f32> {
    let at = photon.at * (2.0 * map.size_tx.zw);
    return vec4<f32>(at.x - 1.0, 1.0 - at.y, select(2.0, 0.5, photon.landed), 1.0);
}

fn bell(t: f32, radius: f32, falloff: f32) -> f32 {
    return select(0.0, exp(-(t * t * falloff)), abs(t) < radius);
}

fn sampled_sum(at: f32, radius: f32, falloff: f32) -> f32 {
    let first = floor(at - radius) + 0.5;
    var sum = 0.0;
    for (var k = 0; k <= MOST_TEXELS; k++) {
        let centre = first + f32(k);
        if !(centre < at + radius) {
            break;
        }
        sum += bell(centre - at, radius, falloff);
    }
    return sum;
}
