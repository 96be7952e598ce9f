// Optics of clear media: the twin of `optics.rs`.

fn refract_ray(d: vec3<f32>, n: vec3<f32>, eta: f32) -> vec3<f32> {
    let c = -dot(d, n);
    let k = 1.0 - (1.0 - c * c) * (eta * eta);
    return d * eta + n * (c * eta - sqrt(max(k, 0.0)));
}

fn refracts(d: vec3<f32>, n: vec3<f32>, eta: f32) -> bool {
    let c = -dot(d, n);
    return 1.0 - (1.0 - c * c) * (eta * eta) >= 0.0;
}

fn reflect_ray(d: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    return d - n * (dot(d, n) * 2.0);
}

fn fresnel_reflectance(cos_i: f32, n1: f32, n2: f32) -> f32 {
    if n1 == n2 {
        return 0.0;
    }
    let eta = n1 / n2;
    let c = clamp(cos_i, 0.0, 1.0);
    let k = 1.0 - (1.0 - c * c) * (eta * eta);
    let c_t = sqrt(max(k, 0.0));
    let p = (c * n2 - c_t * n1) / (c * n2 + c_t * n1);
    let s = (c * n1 - c_t * n2) / (c * n1 + c_t * n2);
    return select((p * p + s * s) * 0.5, 1.0, k <= 0.0);
}

fn fresnel_reflectance_by(cos_i: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0;
    }
    let c = clamp(cos_i, 0.0, 1.0);
    let k = 1.0 - (1.0 - c * c) * (eta * eta);
    let c_t = sqrt(max(k, 0.0));
    let p = (c - c_t * eta) / (c + c_t * eta);
    let s = (c * eta - c_t) / (c * eta + c_t);
    return select((p * p + s * s) * 0.5, 1.0, k <= 0.0);
}

fn beer_lambert_rgb(sigma_t_per_m: vec3<f32>, distance_m: f32) -> vec3<f32> {
    return exp(-sigma_t_per_m * distance_m);
}
