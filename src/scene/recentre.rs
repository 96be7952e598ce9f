//! Scenes far from the origin, moved to it.
//!
//! A 32-bit coordinate has 24 bits. Ten kilometres from the origin that is a millimetre: normals of waves, shadows and refracted rays are then noise. A scene
//! that is far away for its size is therefore moved, so that its water or what the camera looks at is in the middle. Places are moved in 64 bits; what was
//! rounded when they were read stays rounded.
//!
//! What is laid out from the origin goes along: waves keep their phases. Patterns without end (tiles, checkers, noise of albedos, ripples and smoke) are laid
//! out from the new origin.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::water::{Axis, InitialState, ObjectPath, WaterModel};
use super::{Camera, Light, Scene};

/// Distance from the origin, in sizes of the scene, up to which it stays where it is.
const FAR: f64 = 16.0;

/// A movement of the origin.
#[derive(Clone, Copy)]
struct To(DVec3);

impl To {
    fn place(self, p: &mut Vec3) {
        *p = (p.as_dvec3() - self.0).as_vec3();
    }

    fn flat(self, p: &mut Vec2) {
        *p = (p.as_dvec2() - DVec2::new(self.0.x, self.0.z)).as_vec2();
    }

    /// Moves a phase at the origin, rad, of a wave with these wave numbers, rad/m.
    fn phase(self, phase_rad: &mut f32, k: DVec2) {
        let moved = f64::from(*phase_rad) + k.dot(DVec2::new(self.0.x, self.0.z));
        *phase_rad = (moved % std::f64::consts::TAU) as f32;
    }
}

impl Scene {
    /// The scene with its middle at the origin if it is far away for its size, otherwise `None`. [`Self::origin`] of the result says where it was.
    #[must_use]
    pub fn recentred(&self) -> Option<Self> {
        let (middle, size) = self.middle_and_size();
        if middle.abs().max_element() <= FAR * size {
            return None;
        }
        let mut scene = self.clone();
        scene.origin += middle;
        scene.shift(To(middle));
        Some(scene)
    }

    /// The middle of the water, or what the camera looks at; and about how large the scene is, m.
    fn middle_and_size(&self) -> (DVec3, f64) {
        let away = self.camera.position_ws().as_dvec3().distance(self.camera.target_ws().as_dvec3());
        match &self.water {
            Some(water) => {
                let middle = DVec3::new(f64::from(water.center_m.x), f64::from(water.level_m), f64::from(water.center_m.y));
                (middle, f64::from(water.size_m.max_element()))
            }
            None => (self.camera.target_ws().as_dvec3(), away),
        }
    }

    fn shift(&mut self, to: To) {
        match &mut self.camera {
            Camera::Perspective { position, target, .. } | Camera::Orthographic { position, target, .. } => {
                to.place(position);
                to.place(target);
            }
        }
        for light in &mut self.lights {
            match light {
                Light::Point { position, .. } | Light::Spot { position, .. } => to.place(position),
                Light::Directional { .. } => {}
            }
        }
        if let Some(water) = &mut self.water {
            to.flat(&mut water.center_m);
            water.level_m = (f64::from(water.level_m) - to.0.y) as f32;
            shift_model(&mut water.model, to);
        }
        if let Some(smoke) = &mut self.smoke {
            to.place(&mut smoke.min);
            to.place(&mut smoke.max);
        }
        self.objects.iter_mut().for_each(|object| to.place(&mut object.transform.translate));
        self.motion.iter_mut().filter(|motion| motion.is_place()).for_each(|motion| motion.course.shift(to.0));
        if let Some(plane) = &mut self.trace.plane {
            to.place(&mut plane.corner);
        }
    }
}

fn shift_model(model: &mut WaterModel, to: To) {
    match model {
        WaterModel::Flat | WaterModel::Tilted { .. } | WaterModel::FftOcean(_) => {}
        WaterModel::Waves(waves) => {
            for wave in waves {
                let k = wave.wave_vector_per_m();
                to.phase(&mut wave.phase_rad, k);
            }
        }
        WaterModel::CircularCosine(rings) => to.flat(&mut rings.center_m),
        WaterModel::AxisCosine(waves) => {
            let k = std::f64::consts::TAU / f64::from(waves.wavelength_m);
            let k = if waves.axis == Axis::X { DVec2::new(k, 0.0) } else { DVec2::new(0.0, k) };
            to.phase(&mut waves.phase_rad, k);
        }
        WaterModel::PipeFluid(fluid) => {
            if let InitialState::Hump { center_m, .. } = &mut fluid.initial {
                to.flat(center_m);
            }
            fluid.drops.iter_mut().for_each(|drop| to.flat(&mut drop.position_m));
            for object in &mut fluid.objects {
                match &mut object.path {
                    ObjectPath::Still(place) | ObjectPath::Circle { center_m: place, .. } => to.flat(place),
                    ObjectPath::Keys(keys) => keys.iter_mut().for_each(|(_, place)| to.flat(place)),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(text: &str) -> Scene {
        crate::parse(text, "recentre", Path::new(""), &[]).expect("the scene is valid")
    }

    #[test]
    fn scenes_near_the_origin_stay() {
        assert!(
            parse("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), water: (center_m: (100, 40), size_m: (8, 8)))")
                .recentred()
                .is_none()
        );
        assert!(parse("(camera: Perspective(position: (30, 2, 5), target: (30, 0, 0)))").recentred().is_none());
    }

    #[test]
    fn everything_that_has_a_place_moves_and_the_surface_stays_the_same() {
        let scene = parse(
            "(
            camera: Perspective(position: (20001, 503, 10002), target: (20000, 500, 10000)),
            lights: [Point(position: (20000, 504, 9999), intensity: (1, 1, 1)), Directional(aim: Along((1, -2, 0)), irradiance: (1, 1, 1))],
            water: (center_m: (20000, 10000), level_m: 500, size_m: (6, 6),
                    model: Waves([(amplitude_m: 0.02, wavelength_m: 0.7, direction_deg: 33, phase_rad: 1, motion: Steady)])),
            smoke: (min: (19999, 500, 9999), max: (20001, 501, 10001), sigma_s: (1, 1, 1)),
            objects: [(shape: Grid(size_m: (8, 8)), transform: (translate: (20000, 499, 10000)))],
            trace: (plane: (corner: (19999, 499, 9999), u: (0, 0, 1), v: (1, 0, 0), texels: (4, 4))),
        )",
        );
        let moved = scene.recentred().expect("it is far away");
        assert_eq!(moved.origin, DVec3::new(20000.0, 500.0, 10000.0));
        assert!(moved.recentred().is_none() && moved.validate().is_ok());
        let Camera::Perspective { position, target, .. } = moved.camera else { panic!("a perspective camera") };
        assert_eq!((position, target), (Vec3::new(1.0, 3.0, 2.0), Vec3::ZERO));
        let Light::Point { position, .. } = moved.lights[0] else { panic!("a point light") };
        assert_eq!((position, moved.lights[1]), (Vec3::new(0.0, 4.0, -1.0), scene.lights[1]));
        assert_eq!(moved.objects[0].transform.translate, Vec3::new(0.0, -1.0, 0.0));
        assert_eq!(moved.smoke.expect("smoke").min, Vec3::new(-1.0, 0.0, -1.0));
        assert_eq!(moved.trace.plane.expect("a plane").corner, Vec3::new(-1.0, -1.0, -1.0));
        let heights = |scene: &Scene, at: Vec2| scene.water.as_ref().expect("water").height_normal(at.x, at.y, 0.3).expect("a formula");
        for at in [Vec2::ZERO, Vec2::new(0.5, -1.25), Vec2::new(-2.0, 2.5)] {
            let ((far, normal), (near, same)) = (heights(&scene, at + Vec2::new(20000.0, 10000.0)), heights(&moved, at));
            assert!((far - 500.0 - near).abs() < 1e-4 && normal.distance(same) < 1e-4, "{far} {near} at {at}");
        }
    }
}
