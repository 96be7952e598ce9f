// Where a ray ends among the receivers that a light sees: the twin of `receiver_search.rs`.

const HALVINGS: i32 = 12;
const OFF_TX: f32 = 2.0;

const WYMAN: i32 = 0;
const SHAH: i32 = 1;
const BRACKETED: i32 = 2;

struct Landing {
    position: vec3<f32>,
    distance: f32,
    landed: bool,
    missed: bool,
}

struct Candidate {
    distance: f32,
    holds: bool,
}

fn receiver_at(p_ws: vec3<f32>) -> vec4<f32> {
    return texel_or_zero(receiver_positions, texel_at(map, p_ws));
}

fn is_behind(p_ws: vec3<f32>) -> bool {
    let at = receiver_at(p_ws);
    return at.w > 0.0 && dot(p_ws - at.xyz, map.axis_ws.xyz) >= 0.0;
}

fn on_plane(origin: vec3<f32>, ray: vec3<f32>, start: f32) -> Candidate {
    let at_start = texel_at(map, origin + ray * start);
    let plane = texel_or_zero(receiver_positions, at_start);
    let plane_normal = texel_or_zero(receiver_normals, at_start).xyz;
    let distance = dot(plane.xyz - origin, plane_normal) / dot(ray, plane_normal);
    let p = origin + ray * distance;
    let at_end = texel_at(map, p);
    let there = texel_or_zero(receiver_positions, at_end);
    let normal = texel_or_zero(receiver_normals, at_end).xyz;
    let off = abs(dot(p - there.xyz, normal));
    let near = off <= sqrt(area_at(map, p)) * OFF_TX;
    return Candidate(distance, near && distance >= 0.0 && there.w > 0.0 && dot(ray, normal) < 0.0);
}

fn find_receiver(search: i32, steps: i32, box_min: vec3<f32>, box_max: vec3<f32>, origin: vec3<f32>, ray: vec3<f32>) -> Landing {
    var near = 0.0;
    var far = 3.4028234e38;
    for (var axis = 0; axis < 3; axis++) {
        let inverse = 1.0 / ray[axis];
        let a = (box_min[axis] - origin[axis]) * inverse;
        let b = (box_max[axis] - origin[axis]) * inverse;
        let first = select(b, a, a < b);
        let last = select(b, a, b < a);
        near = select(near, first, near < first);
        far = select(far, last, last < far);
    }
    let crosses = near <= far;
    if search != BRACKETED {
        var distance = near;
        for (var k = 0; k < steps; k++) {
            let at = receiver_at(origin + ray * distance);
            if at.w > 0.0 {
                let to = at.xyz - origin;
                distance = select(length(to), dot(to, map.axis_ws.xyz) / dot(ray, map.axis_ws.xyz), search == WYMAN);
            }
        }
        let seen = receiver_at(origin + ray * distance).w > 0.0;
        let end = on_plane(origin, ray, distance);
        return Landing(origin + ray * end.distance, end.distance, end.holds && crosses, !crosses || !seen);
    }
    let step = (far - near) / f32(steps);
    var low = near;
    var high = near;
    var found = false;
    var in_front = false;
    for (var k = 0; k <= steps; k++) {
        if !crosses || found {
            break;
        }
        let distance = near + step * f32(k);
        let behind = is_behind(origin + ray * distance);
        if in_front && behind {
            high = distance;
            low = distance - step;
            found = true;
        }
        in_front = !behind;
    }
    var end = high;
    var done = false;
    for (var k = 0; k < HALVINGS; k++) {
        if !found || done {
            break;
        }
        let candidate = on_plane(origin, ray, high);
        if candidate.holds && candidate.distance >= low - step && candidate.distance <= high + step {
            end = candidate.distance;
            done = true;
        }
        let middle = (low + high) * 0.5;
        if is_behind(origin + ray * middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return Landing(origin + ray * end, end, done, !found);
}
