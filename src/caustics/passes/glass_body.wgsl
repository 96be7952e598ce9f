// The way of a view ray through a body of glass: the twin of `glass_body.rs`.

const CORRECTIONS: i32 = 6;
const BACK: f32 = 0.75;
const SMOOTH: f32 = 0.9;
const NO_PLANE: f32 = 3.0e38;

struct Entry {
    position: vec3<f32>,
    normal: vec3<f32>,
    view: vec3<f32>,
    thickness: f32,
    eta: f32,
}

struct Exit {
    position: vec3<f32>,
    direction: vec3<f32>,
    length: f32,
    share: f32,
}

struct Way {
    end: vec3<f32>,
    length: f32,
    normal: vec3<f32>,
}

// Distance to the plane of a face; `normal` points inwards.
fn to_plane(start: vec3<f32>, direction: vec3<f32>, at: vec4<f32>, normal: vec3<f32>) -> f32 {
    let slope = dot(direction, normal);
    let distance = dot(at.xyz - start, normal) / slope;
    return select(NO_PLANE, distance, at.w == 3.0 && slope < 0.0 && distance > 0.0);
}

// The normal at a pixel, filtered linearly over the faces whose normal is near `normal`.
fn smooth_normal(pixel: vec2<f32>, normal: vec3<f32>) -> vec3<f32> {
    let base = floor(pixel - 0.5);
    let weight = pixel - 0.5 - base;
    var sum = vec3<f32>(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let right = corner % 2 == 1;
        let down = corner / 2 == 1;
        let share = select(1.0 - weight.x, weight.x, right) * select(1.0 - weight.y, weight.y, down);
        let at = base + vec2<f32>(select(0.0, 1.0, right), select(0.0, 1.0, down));
        let back = texel_or_zero(back_normals, at).xyz;
        sum += back * select(0.0, share, dot(back, normal) >= SMOOTH);
        let front = -texel_or_zero(normals, at).xyz;
        sum += front * select(0.0, share, dot(front, normal) >= SMOOTH);
    }
    return normalize(select(normal, sum, dot(sum, sum) > 0.0));
}

// The way from a point inside, or on a face, to the first face in front.
fn way(start: vec3<f32>, direction: vec3<f32>, guess: f32) -> Way {
    var length = guess;
    var nearest = NO_PLANE;
    // Without a face the ray leaves as through a face across it.
    var normal = -direction;
    for (var i = 0; i < CORRECTIONS; i++) {
        let texel = floor(pixel_of(camera, project(camera, start + direction * length)));
        let back_at = texel_or_zero(back_positions, texel);
        let back_normal = texel_or_zero(back_normals, texel).xyz;
        let back = to_plane(start, direction, back_at, back_normal);
        // The eye sees a front face from outside.
        let front_normal = -texel_or_zero(normals, texel).xyz;
        let front = to_plane(start, direction, texel_or_zero(positions, texel), front_normal);
        let distance = min(front, back);
        // No tangent plane of a convex body cuts it, so the nearest of them is nearest to the exit.
        if distance < nearest {
            nearest = distance;
            normal = select(back_normal, front_normal, front < back);
        }
        if distance < NO_PLANE {
            length = distance;
        } else if back_at.w != 3.0 {
            length = length * BACK;
        }
    }
    if nearest < NO_PLANE {
        length = nearest;
    }
    let end = start + direction * length;
    let smoothed = smooth_normal(pixel_of(camera, project(camera, end)), normal);
    return Way(end, length, select(normal, smoothed, dot(direction, smoothed) < 0.0));
}

// The refracted part of a ray that leaves a body, and the one that the first exit reflects.
fn pass_body(entry: Entry) -> array<Exit, 2> {
    let eta = 1.0 / entry.eta;
    var inside = refract_ray(entry.view, entry.normal, entry.eta);
    let first = way(entry.position, inside, entry.thickness);
    let reflected = fresnel_reflectance_by(-dot(inside, first.normal), eta);
    let refracted = refract_ray(inside, first.normal, eta);
    inside = normalize(reflect_ray(inside, first.normal));
    let second = way(first.end, inside, first.length);
    var onward = reflect_ray(inside, second.normal);
    var leaves = 1.0;
    if refracts(inside, second.normal, eta) {
        onward = refract_ray(inside, second.normal, eta);
        leaves = 1.0 - fresnel_reflectance_by(-dot(inside, second.normal), eta);
    }
    return array<Exit, 2>(
        Exit(first.end, normalize(refracted), first.length, 1.0 - reflected),
        Exit(second.end, normalize(onward), first.length + second.length, reflected * leaves),
    );
}
