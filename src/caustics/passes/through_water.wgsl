// Radiance after `distance` metres of water: attenuated, with in-scattered light added. Part of the twin of `water_surface.rs`.

fn through_medium(sigma_t: vec3<f32>, inscatter: vec3<f32>, radiance: vec3<f32>, distance: f32) -> vec3<f32> {
    let left = beer_lambert_rgb(sigma_t, distance);
    return radiance * left + inscatter * (1.0 - left);
}
