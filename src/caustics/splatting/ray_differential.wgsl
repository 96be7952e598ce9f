// Ray differentials: the twin of `ray_differential.rs`.

struct Differential {
    position: vec3<f32>,
    direction: vec3<f32>,
}

fn onto(d: Differential, ray: vec3<f32>, normal: vec3<f32>) -> Differential {
    return Differential(d.position - ray * (dot(d.position, normal) / dot(ray, normal)), d.direction);
}

fn transferred(d: Differential, distance: f32) -> Differential {
    return Differential(d.position + d.direction * distance, d.direction);
}

fn reflected_step(d: Differential, ray: vec3<f32>, normal: vec3<f32>, turn: vec3<f32>) -> Differential {
    let change = dot(d.direction, normal) + dot(ray, turn);
    return Differential(d.position, d.direction - (turn * dot(ray, normal) + normal * change) * 2.0);
}

fn refracted_step(d: Differential, ray: vec3<f32>, normal: vec3<f32>, turn: vec3<f32>, eta: f32) -> Differential {
    let c = -dot(ray, normal);
    let root = sqrt(1.0 - eta * eta * (1.0 - c * c));
    let mu = eta * c - root;
    let change = -(dot(d.direction, normal) + dot(ray, turn));
    return Differential(d.position, d.direction * eta + turn * mu + normal * ((eta - eta * eta * c / root) * change));
}
