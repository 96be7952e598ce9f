// The photons of a light: the twin of `photons.rs`.

override search: i32 = 2;
override lossless: bool = false;
override smooth_exits: bool = true;
override thick: bool = true;
override curvature_of_normals: bool = false;
override water: bool = false;

const MIRROR: f32 = 2.0;
const GLASS: f32 = 3.0;
const WATER: f32 = 4.0;

const LANDED: f32 = 1.0;
const TOTALLY_REFLECTED: f32 = 2.0;
const NO_EXIT: f32 = 3.0;
const MISSED: f32 = 4.0;
const NOT_FOUND: f32 = 5.0;

const CORRECTIONS: i32 = 2;
const CORRECTION_TX: f32 = 4.0;

struct PhotonsUniform {
    box_min: vec4<f32>,
    box_max: vec4<f32>,
    sigma_t: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: TexelView;
@group(0) @binding(1) var<uniform> map: TexelView;
@group(0) @binding(2) var<uniform> light: LightUniform;
@group(0) @binding(3) var<uniform> numbers: PhotonsUniform;
@group(0) @binding(4) var front_positions: texture_2d<f32>;
@group(0) @binding(5) var front_normals: texture_2d<f32>;
@group(0) @binding(6) var front_materials: texture_2d<f32>;
@group(0) @binding(7) var front_curvatures: texture_2d<f32>;
@group(0) @binding(8) var back_positions: texture_2d<f32>;
@group(0) @binding(9) var back_normals: texture_2d<f32>;
@group(0) @binding(10) var back_curvatures: texture_2d<f32>;
@group(0) @binding(11) var receiver_positions: texture_2d<f32>;
@group(0) @binding(12) var receiver_normals: texture_2d<f32>;

// Where a photon ends, and what a differential of its ray needs.
struct Photon {
    position: vec4<f32>,
    direction: vec4<f32>,
    flux: vec4<f32>,
    losses: vec4<f32>,
    p: vec3<f32>,
    d: vec3<f32>,
    normal: vec3<f32>,
    inside: vec3<f32>,
    index: f32,
    divergence: f32,
    width: f32,
    mirror: bool,
    glass: bool,
    leaving: Exit,
    distance: f32,
}

struct Back {
    position: vec3<f32>,
    normal: vec3<f32>,
    exists: bool,
}

struct Exit {
    position: vec3<f32>,
    normal: vec3<f32>,
    thickness: f32,
    curvature: f32,
    forms: vec3<f32>,
    exists: bool,
}

fn back_at(at: vec2<f32>) -> Back {
    if !smooth_exits {
        let p = texel_or_zero(back_positions, floor(at));
        return Back(p.xyz, texel_or_zero(back_normals, floor(at)).xyz, p.w > 0.0);
    }
    let corner = floor(at - 0.5);
    let share = at - 0.5 - corner;
    var p = vec4<f32>();
    var n = vec3<f32>();
    for (var k = 0u; k < 4u; k++) {
        let step = vec2<f32>(f32(k & 1u), f32(k >> 1u));
        let part = select(1.0 - share, share, step > vec2<f32>(0.0));
        let texel = texel_or_zero(back_positions, corner + step);
        let weight = part.x * part.y * texel.w;
        p += texel * weight;
        n += texel_or_zero(back_normals, corner + step).xyz * weight;
    }
    let exists = p.w > 0.0;
    return Back(p.xyz * (1.0 / select(1.0, p.w, exists)), normalize(n), exists);
}

fn curvature_from_normals(positions: texture_2d<f32>, normals: texture_2d<f32>, at: vec2<f32>) -> f32 {
    var sum = 0.0;
    var inside = true;
    for (var axis = 0; axis < 2; axis++) {
        let offset = select(vec2<f32>(0.0, 1.0), vec2<f32>(1.0, 0.0), axis == 0);
        let before = texel_or_zero(positions, at - offset);
        let after = texel_or_zero(positions, at + offset);
        let first = texel_or_zero(normals, at - offset);
        let second = texel_or_zero(normals, at + offset);
        let step = after.xyz - before.xyz;
        sum += dot(second.xyz - first.xyz, step) / dot(step, step);
        inside = inside && before.w > 0.0 && after.w > 0.0 && first.w == second.w;
    }
    return select(0.0, sum * 0.5, inside);
}

fn exit_of(texel: vec2<f32>, p: vec3<f32>, d: vec3<f32>, inside: vec3<f32>) -> Exit {
    let there = texel_or_zero(back_positions, texel);
    let straight = there.xyz - p;
    let exists = there.w > 0.0 && dot(straight, d) > 0.0;
    var thickness = length(straight);
    let steps = i32(numbers.box_max.w);
    if steps > 0 {
        var low = 0.0;
        var high = (numbers.sigma_t.w - dot(p, view.axis_ws.xyz)) / dot(inside, view.axis_ws.xyz);
        for (var k = 0; k < steps; k++) {
            let middle = (low + high) * 0.5;
            let at = p + inside * middle;
            let back = texel_or_zero(back_positions, texel_at(view, at));
            if back.w > 0.0 && dot(back.xyz - at, view.axis_ws.xyz) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        thickness = (low + high) * 0.5;
        for (var k = 0; k < CORRECTIONS; k++) {
            let back = back_at(texel_at(view, p + inside * thickness));
            let distance = dot(back.position - p, back.normal) / dot(inside, back.normal);
            if back.exists && abs(distance - thickness) < sqrt(area_at(view, p)) * CORRECTION_TX {
                thickness = distance;
            }
        }
    }
    let end = p + inside * thickness;
    let at = texel_at(view, end);
    let back = back_at(at);
    let side = -normalize(inside - d * dot(inside, d));
    var facing = select(side, back.normal, back.exists);
    let bends = texel_or_zero(back_curvatures, at);
    var forms = select(vec3<f32>(), bends.yzw, back.exists);
    if dot(facing, inside) > 0.0 {
        facing = -facing;
        forms = -forms;
    }
    var curvature = bends.x;
    if curvature_of_normals {
        curvature = curvature_from_normals(back_positions, back_normals, floor(at));
    }
    return Exit(end, facing, thickness, select(0.0, curvature, back.exists), forms, exists);
}

fn sum(v: vec3<f32>) -> f32 {
    return v.r + v.g + v.b;
}

fn photon_in(texel: vec2<f32>) -> Photon {
    var photon = Photon();
    let here = texel_or_zero(front_normals, texel);
    let mirror = here.w == MIRROR;
    let glass = here.w == GLASS;
    let surface = here.w == WATER;
    if !select(mirror || glass, surface, water) {
        return photon;
    }
    let p = texel_or_zero(front_positions, texel).xyz;
    let n = here.xyz;
    let material = texel_or_zero(front_materials, texel);
    let colour = material.rgb;
    let index = select(material.w, 1.0, mirror);
    let incident = light_at(light, p);
    let d = incident.direction;
    let width = area_at(view, p);
    let sent = incident.irradiance * width;
    var arriving = sent;
    var before_surface = 0.0;
    if light.water.x < 0.0 && !lossless {
        let left = beer_lambert_rgb(light.own.rgb, own_distance(light, p));
        arriving = sent * left;
        before_surface = sum(sent * (1.0 - left));
    }
    var curvature = 0.0;
    if curvature_of_normals {
        curvature = curvature_from_normals(front_positions, front_normals, texel);
    } else {
        curvature = texel_or_zero(front_curvatures, texel).x;
    }

    let inside = refract_ray(d, n, 1.0 / index);
    let enters = refracts(d, n, 1.0 / index) || mirror;
    let reflected_in = fresnel_reflectance_by(-dot(n, d), 1.0 / index);
    let passes = 1.0 - reflected_in;
    var origin = p;
    var ray = select(inside, reflect_ray(d, n), mirror);
    var share = select(vec3<f32>(passes), colour, mirror);
    var faces = Faces(index, curvature, 0.0, 0.0);
    var exits = true;
    var closed = true;
    var in_glass = vec3<f32>(1.0);
    var reflected_out = 0.0;
    if glass {
        let leaving = exit_of(texel, p, d, inside);
        photon.leaving = leaving;
        exits = refracts(inside, leaving.normal, index);
        closed = leaving.exists;
        reflected_out = fresnel_reflectance_by(-dot(inside, leaving.normal), index);
        let leaves = 1.0 - reflected_out;
        origin = leaving.position;
        if exits {
            ray = refract_ray(inside, leaving.normal, index);
        }
        in_glass = exp(-(colour * leaving.thickness));
        share = in_glass * (passes * leaves);
        faces = Faces(index, curvature, leaving.curvature, leaving.thickness);
    }

    let landing = find_receiver(search, i32(numbers.box_min.w), numbers.box_min.xyz, numbers.box_max.xyz, origin, ray);
    let behind_surface = share;
    var kept = vec3<f32>(1.0);
    if water {
        kept = beer_lambert_rgb(numbers.sigma_t.rgb, select(0.0, max(landing.distance, 0.0), landing.landed));
    }
    if lossless {
        share = select(vec3<f32>(1.0), colour, mirror);
    } else if water {
        share *= kept;
    }
    var divergence = 0.0;
    if light.position_ws.w != 0.0 {
        divergence = 1.0 / length(p - light.position_ws.xyz);
    }
    let beam = beam_diameter(faces, mirror, divergence, landing.distance) * sqrt(width);

    var ends = select(NOT_FOUND, MISSED, landing.missed);
    ends = select(ends, LANDED, landing.landed);
    ends = select(TOTALLY_REFLECTED, ends, enters && exits);
    ends = select(NO_EXIT, ends, closed);
    if sum(arriving) <= 0.0 {
        return photon;
    }
    let followed = enters && exits && closed;
    let entered = arriving * passes;
    var flux = select(arriving, arriving * share, followed);
    var losses = vec4<f32>();
    if lossless {
        losses.y = select(0.0, sum(arriving * (1.0 - colour)), mirror);
    } else {
        let within = glass && enters && closed;
        let at_back = entered * in_glass;
        if glass && enters && !closed {
            flux = entered;
        } else if within && !exits {
            flux = at_back;
        }
        losses.x = select(0.0, sum(arriving) * reflected_in, enters && !mirror) + select(0.0, sum(at_back) * reflected_out, within && exits);
        losses.y = before_surface + select(0.0, sum(arriving * (1.0 - colour)), mirror);
        losses.z = select(select(0.0, sum(arriving * behind_surface * (1.0 - kept)), followed), sum(entered * (1.0 - in_glass)), within);
    }
    photon.flux = vec4<f32>(flux, sum(sent));
    photon.losses = losses;
    photon.position = vec4<f32>(select(vec3<f32>(), landing.position, ends == LANDED), ends);
    photon.direction = select(vec4<f32>(), vec4<f32>(ray, beam), ends == LANDED);
    photon.p = p;
    photon.d = d;
    photon.normal = n;
    photon.inside = inside;
    photon.index = index;
    photon.divergence = divergence;
    photon.width = width;
    photon.mirror = mirror;
    photon.glass = glass;
    photon.distance = landing.distance;
    return photon;
}
