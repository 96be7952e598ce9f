// What a ray meets of the receivers that a camera sees: the twin of `receiver_search.rs`.

const STEPS: i32 = 32;
const HALVINGS: i32 = 6;

struct ReceiverBounds {
    min_ws: vec4<f32>,
    max_ws: vec4<f32>,
}

struct Found {
    radiance: vec3<f32>,
    exists: bool,
    doubtful: bool,
}

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
    length: f32,
    start_w: f32,
    end_w: f32,
}

struct Meeting {
    point: vec3<f32>,
    clip_w: f32,
    texel: vec2<f32>,
    normal: vec3<f32>,
    height: f32,
}

// Width of a pixel at this clip-space w, m.
fn pixel_m(camera: CameraUniform, clip_w: f32) -> f32 {
    let m = camera.clip_from_world;
    let per_metre = sqrt(m[0].y * m[0].y + m[1].y * m[1].y + m[2].y * m[2].y);
    return clip_w * (2.0 * camera.size_px.w / per_metre);
}

// Distance of the point at a share of the way in the picture.
fn distance_at(ray: Ray, share: f32) -> f32 {
    let near = share * ray.start_w;
    let far = (1.0 - share) * ray.end_w;
    return ray.length * (near / (far + near));
}

fn until_negative(start: f32, along: f32, length: f32) -> f32 {
    if along < 0.0 {
        return min(max(-(start / along), 0.0), length);
    }
    return length;
}

// The part of a span of distances in which a coordinate is between two bounds.
fn between(start: f32, slope: f32, low: f32, high: f32, span: vec2<f32>) -> vec2<f32> {
    // A level ray is given some slope: it is then either always or never between.
    let along = select(slope, 1.0e-9, abs(slope) < 1.0e-9);
    let a = (low - start) / along;
    let b = (high - start) / along;
    return vec2<f32>(max(span.x, min(a, b)), min(span.y, max(a, b)));
}

// The part of a ray inside of the bounds and of the view.
fn ray_in_view(camera: CameraUniform, bounds: ReceiverBounds, start_ws: vec3<f32>, direction: vec3<f32>) -> Ray {
    var span = vec2<f32>(0.0, 3.0e38);
    span = between(start_ws.x, direction.x, bounds.min_ws.x, bounds.max_ws.x, span);
    span = between(start_ws.y, direction.y, bounds.min_ws.y, bounds.max_ws.y, span);
    span = between(start_ws.z, direction.z, bounds.min_ws.z, bounds.max_ws.z, span);
    let origin = start_ws + direction * span.x;
    let along = camera.clip_from_world * vec4<f32>(direction, 0.0);
    let start = camera.clip_from_world * vec4<f32>(origin, 1.0);
    var length = span.y - span.x;
    length = until_negative(start.w + start.x, along.w + along.x, length);
    length = until_negative(start.w - start.x, along.w - along.x, length);
    length = until_negative(start.w + start.y, along.w + along.y, length);
    length = until_negative(start.w - start.y, along.w - along.y, length);
    length = until_negative(start.z, along.z, length);
    length = until_negative(start.w - start.z, along.w - along.z, length);
    return Ray(origin, direction, length, start.w, start.w + along.w * length);
}

// The point at a distance along a ray, and the receiver there.
fn meet(camera: CameraUniform, positions: texture_2d<f32>, normals: texture_2d<f32>, ray: Ray, distance: f32) -> Meeting {
    let point = ray.origin + ray.direction * distance;
    let clip = project(camera, point);
    let texel = floor(pixel_of(camera, clip));
    let at = texel_or_zero(positions, texel);
    let normal = texel_or_zero(normals, texel).xyz;
    let height = select(1.0, dot(point - at.xyz, normal), at.w > 0.0);
    return Meeting(point, clip.w, texel, normal, height);
}

// Radiance at a meeting: the four texels around it, filtered linearly, without those that lie off the receiver's plane.
fn radiance_of(camera: CameraUniform, positions: texture_2d<f32>, radiances: texture_2d<f32>, meeting: Meeting) -> vec3<f32> {
    let pixel = pixel_of(camera, project(camera, meeting.point));
    let base = floor(pixel - 0.5);
    let weight = pixel - 0.5 - base;
    let tolerance = pixel_m(camera, meeting.clip_w);
    var sum = vec3<f32>(0.0);
    var weights = 0.0;
    for (var corner = 0; corner < 4; corner++) {
        let right = corner % 2 == 1;
        let down = corner / 2 == 1;
        let texel = base + vec2<f32>(select(0.0, 1.0, right), select(0.0, 1.0, down));
        let share = select(1.0 - weight.x, weight.x, right) * select(1.0 - weight.y, weight.y, down);
        let at = texel_or_zero(positions, texel);
        if at.w > 0.0 && abs(dot(at.xyz - meeting.point, meeting.normal)) <= tolerance {
            sum += texel_or_zero(radiances, texel).rgb * share;
            weights += share;
        }
    }
    if weights > 1.0e-3 {
        return sum * (1.0 / weights);
    }
    return texel_or_zero(radiances, meeting.texel).rgb;
}

// The receiver that a ray meets first.
fn search(
    camera: CameraUniform,
    bounds: ReceiverBounds,
    positions: texture_2d<f32>,
    normals: texture_2d<f32>,
    radiances: texture_2d<f32>,
    origin: vec3<f32>,
    direction: vec3<f32>,
) -> Found {
    let ray = ray_in_view(camera, bounds, origin, direction);
    if !(ray.start_w > 0.0 && ray.length > 0.0) {
        return Found(vec3<f32>(0.0), false, false);
    }
    var in_front = true;
    var doubtful = false;
    for (var step = 0; step < STEPS; step++) {
        let start = f32(step) / f32(STEPS);
        let end = f32(step + 1) / f32(STEPS);
        let behind = meet(camera, positions, normals, ray, distance_at(ray, end)).height < 0.0;
        if in_front && behind {
            // Narrow the step from the front of the receiver to its back.
            var low = start;
            var high = end;
            for (var i = 0; i < HALVINGS; i++) {
                let middle = (low + high) * 0.5;
                if meet(camera, positions, normals, ray, distance_at(ray, middle)).height < 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let front = distance_at(ray, low);
            let back = distance_at(ray, high);
            var meeting = meet(camera, positions, normals, ray, back);
            // On one plane, the ray sinks by less than the step; a pixel is left for the difference between neighbouring texels.
            if -meeting.height <= (back - front) + pixel_m(camera, meeting.clip_w) {
                let slope = dot(ray.direction, meeting.normal);
                var on_plane = select(back, back - meeting.height / slope, slope < 0.0);
                // The plane of a curved receiver's last texel may be met a little before the step.
                on_plane = min(max(on_plane, front * 2.0 - back), back);
                meeting.point = ray.origin + ray.direction * on_plane;
                return Found(radiance_of(camera, positions, radiances, meeting), true, false);
            }
            doubtful = true;
        }
        in_front = !behind;
    }
    return Found(vec3<f32>(0.0), false, doubtful);
}
