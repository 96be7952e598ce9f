// The way of a view ray through a body of glass: the twin of `two_interfaces.rs`.

const CORRECTIONS: i32 = 4;
const SMOOTH: f32 = 0.9;

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

// The normal at a pixel, filtered linearly over the texels whose normal is near `normal`.
fn smooth_normal(normals: texture_2d<f32>, pixel: vec2<f32>, normal: vec3<f32>) -> vec3<f32> {
    let base = floor(pixel - 0.5);
    let weight = pixel - 0.5 - base;
    var sum = vec3<f32>(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let right = corner % 2 == 1;
        let down = corner / 2 == 1;
        let share = select(1.0 - weight.x, weight.x, right) * select(1.0 - weight.y, weight.y, down);
        let face = texel_or_zero(normals, base + vec2<f32>(select(0.0, 1.0, right), select(0.0, 1.0, down))).xyz;
        if dot(face, normal) >= SMOOTH {
            sum += face * share;
        }
    }
    return normalize(select(normal, sum, dot(sum, sum) > 0.0));
}

// Follows a ray through a body.
fn pass_body(camera: CameraUniform, positions: texture_2d<f32>, normals: texture_2d<f32>, entry: Entry) -> Exit {
    let inside = refract_ray(entry.view, entry.normal, entry.eta);
    var length = entry.thickness;
    // Without a back face the ray leaves as through a face across it.
    var normal = -inside;
    for (var i = 0; i < CORRECTIONS; i++) {
        let texel = floor(pixel_of(camera, project(camera, entry.position + inside * length)));
        let at = texel_or_zero(positions, texel);
        let face = texel_or_zero(normals, texel).xyz;
        let slope = dot(inside, face);
        let to_plane = dot(at.xyz - entry.position, face) / slope;
        if at.w > 0.0 && slope < 0.0 && to_plane > 0.0 {
            length = to_plane;
            normal = face;
        } else if !(at.w > 0.0) {
            length = length * 0.5;
        }
    }
    let position = entry.position + inside * length;
    normal = smooth_normal(normals, pixel_of(camera, project(camera, position)), normal);
    let back = 1.0 / entry.eta;
    if refracts(inside, normal, back) {
        let share = 1.0 - fresnel_reflectance_by(-dot(inside, normal), back);
        return Exit(position, normalize(refract_ray(inside, normal, back)), length, share);
    }
    return Exit(position, normalize(reflect_ray(inside, normal)), length, 1.0);
}
