//! The part of a water surface through which a lamp in the water shines.
//!
//! Beyond the critical angle all light is reflected, so a lamp half a metre deep lights a disc of little more than that. A mesh of the whole surface would
//! have few triangles there.

use glam::Vec2;

use nephroid_math::optics::refract;
use nephroid_math::vector::v3;
use nephroid_scene::Light;
use nephroid_scene::water::HeightField;

/// The disc under flat water is enlarged by this factor: waves refract light that a flat surface would reflect.
const MARGIN: f32 = 1.25;

/// The surface of water of index `ior` around where the light of a lamp below it passes, as fine as the whole; `None` for parallel light, and where light
/// passes nearly everywhere.
#[must_use]
pub fn window(field: &HeightField, light: &Light, ior: f32) -> Option<HeightField> {
    let (Light::Point { position, .. } | Light::Spot { position, .. }) = *light else { return None };
    let place = Vec2::new(position.x, position.z);
    let depth = (field.height_at(place.x, place.y) - position.y).max(0.0);
    // tan θ at the critical angle, sin θ = 1/n; light of all directions enters a rarer body.
    let radius = depth * MARGIN / (ior * ior - 1.0).max(1.0e-6).sqrt();
    let (mut min, mut max) = (place - radius, place + radius);
    for (i, p) in field.positions_ws().into_iter().enumerate() {
        let (d, n) = (light.incident(p).direction_ws, field.normals_ws[i]);
        let (_, passes) = refract(v3(d.x, d.y, d.z), v3(-n.x, -n.y, -n.z), ior);
        if passes && d.dot(n) > 0.0 {
            let at = Vec2::new(p.x, p.z);
            (min, max) = (min.min(at - field.spacing_m), max.max(at + field.spacing_m));
        }
    }
    let [first, last] = field.corners_ws();
    let (min, max) = (min.max(first), max.min(last));
    let small = (max - min).cmpgt(Vec2::ZERO).all() && (max - min).element_product() < 0.7 * (last - first).element_product();
    small.then(|| field.resampled(min, max))
}
