//! Rays in 64 bits through bodies that are given by their equations.

use glam::{DQuat, DVec3, Vec3};
use nephroid::scene::{Albedo, Camera, Environment, Scene};

/// A straight way to what is seen, and the share of its radiance that reaches the eye.
pub struct Part {
    pub origin: DVec3,
    pub direction: DVec3,
    pub share: DVec3,
}

/// A mirror or a body of glass.
pub trait Optic {
    /// The parts of a view ray after the body; `None` if it misses the body, or takes a way that passes do not follow.
    fn follow(&self, origin: DVec3, direction: DVec3) -> Option<Vec<Part>>;
}

/// A square floor at height 0, and the sky.
pub struct World {
    pub albedo: Albedo,
    pub half_m: f64,
    pub environment: Environment,
}

impl World {
    /// Where a ray meets the floor.
    pub fn hit(&self, part: &Part) -> Option<DVec3> {
        let distance = -part.origin.y / part.direction.y;
        let at = part.origin + part.direction * distance;
        (distance > 0.0 && at.x.abs().max(at.z.abs()) < self.half_m).then_some(at)
    }

    pub fn radiance(&self, part: &Part) -> DVec3 {
        let radiance = match self.hit(part) {
            Some(at) => self.albedo.at(at.as_vec3(), Vec3::Y) * self.environment.ambient_irradiance / std::f32::consts::PI,
            None => self.environment.sky_radiance(part.direction.as_vec3()),
        };
        radiance.as_dvec3() * part.share
    }
}

/// The scene's pinhole camera.
pub struct Eye {
    position: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    size: [f64; 2],
}

impl Eye {
    pub fn new(scene: &Scene) -> Self {
        let Camera::Perspective { fov_deg, .. } = scene.camera else { panic!("the scene has a pinhole camera") };
        let forward = (scene.camera.target_ws() - scene.camera.position_ws()).as_dvec3().normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let half = libm::tan(f64::from(fov_deg).to_radians() * 0.5);
        let size = [f64::from(scene.image.width), f64::from(scene.image.height)];
        let position = scene.camera.position_ws().as_dvec3();
        Self { position, forward, right: right * (half * size[0] / size[1]), up: right.cross(forward) * half, size }
    }

    /// Origin and unit direction of the ray through a place in pixels.
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let across = self.right * (2.0 * x / self.size[0] - 1.0) + self.up * (1.0 - 2.0 * y / self.size[1]);
        (self.position, (self.forward + across).normalize())
    }

    /// Whether a point is in a picture so many times as wide.
    pub fn sees(&self, point: DVec3, wider: f64) -> bool {
        let to = point - self.position;
        let along = to.dot(self.forward);
        let aside = |axis: DVec3| to.dot(axis).abs() / axis.length_squared();
        along > 0.0 && aside(self.right).max(aside(self.up)) < wider * along
    }
}

fn reflect(d: DVec3, n: DVec3) -> DVec3 {
    d - n * (2.0 * d.dot(n))
}

/// Snell's law, the normal against the ray, and the share that passes.
fn refract(d: DVec3, n: DVec3, n1: f64, n2: f64) -> (DVec3, f64) {
    let (eta, c) = (n1 / n2, -d.dot(n));
    let c_t = (1.0 - eta * eta * (1.0 - c * c)).sqrt();
    let p = (n2 * c - n1 * c_t) / (n2 * c + n1 * c_t);
    let s = (n1 * c - n2 * c_t) / (n1 * c + n2 * c_t);
    (d * eta + n * (eta * c - c_t), 1.0 - 0.5 * (p * p + s * s))
}

/// Faces towards the eye of a mirror that is a cuboid, turned about the vertical; only the large face is compared.
pub struct Wall {
    pub size: Vec3,
    pub centre: Vec3,
    pub turn_deg: f32,
    pub reflectance: Vec3,
}

impl Optic for Wall {
    fn follow(&self, origin: DVec3, direction: DVec3) -> Option<Vec<Part>> {
        let turn = DQuat::from_rotation_y(f64::from(self.turn_deg).to_radians());
        let (normal, half) = (turn * DVec3::Z, self.size.as_dvec3() * 0.5);
        let on_face = self.centre.as_dvec3() + normal * half.z;
        let at = origin + direction * ((on_face - origin).dot(normal) / direction.dot(normal));
        let aside = turn.inverse() * (at - on_face);
        let inside = aside.x.abs() < half.x && aside.y.abs() < half.y && direction.dot(normal) < 0.0;
        inside.then(|| vec![Part { origin: at, direction: reflect(direction, normal), share: self.reflectance.as_dvec3() }])
    }
}

/// A level cuboid, seen through its top and its bottom.
pub struct Slab {
    pub size: Vec3,
    pub centre: Vec3,
    pub ior: f64,
    pub absorption: Vec3,
}

impl Optic for Slab {
    fn follow(&self, origin: DVec3, direction: DVec3) -> Option<Vec<Part>> {
        let (centre, half) = (self.centre.as_dvec3(), self.size.as_dvec3() * 0.5);
        let holds = |at: DVec3| (at.x - centre.x).abs() < half.x && (at.z - centre.z).abs() < half.z;
        let entry = origin + direction * ((centre.y + half.y - origin.y) / direction.y);
        let (inside, enters) = refract(direction, DVec3::Y, 1.0, self.ior);
        let length = 2.0 * half.y / -inside.y;
        let exit = entry + inside * length;
        let (outside, leaves) = refract(inside, DVec3::Y, self.ior, 1.0);
        let left = |length: f64| DVec3::from_array((self.absorption.as_dvec3() * -length).to_array().map(libm::exp));
        let through = Part { origin: exit, direction: outside, share: left(length) * (enters * leaves) };
        let mirrored = Part { origin: entry, direction: reflect(direction, DVec3::Y), share: DVec3::splat(1.0 - enters) };
        // From the bottom back to the top, where it leaves as if the top had mirrored it.
        let returns = exit + reflect(inside, DVec3::Y) * length;
        let share = left(2.0 * length) * (enters * (1.0 - leaves) * leaves);
        let back = Part { origin: returns, direction: reflect(direction, DVec3::Y), share };
        (holds(entry) && holds(exit) && holds(returns)).then(|| vec![through, mirrored, back])
    }
}

/// A ball.
pub struct Ball {
    pub radius: f64,
    pub centre: Vec3,
    pub ior: f64,
}

impl Optic for Ball {
    fn follow(&self, origin: DVec3, direction: DVec3) -> Option<Vec<Part>> {
        let to = self.centre.as_dvec3() - origin;
        let along = to.dot(direction);
        let beside = to.length_squared() - along * along;
        // Nearer to the outline, the part that is reflected inside leaves where the picture shows the surface at a slant: half a texel turns its normal
        // by several degrees.
        if beside > (0.8 * self.radius) * (0.8 * self.radius) {
            return None;
        }
        let entry = origin + direction * (along - (self.radius * self.radius - beside).sqrt());
        let normal = |at: DVec3| (at - self.centre.as_dvec3()) / self.radius;
        let (inside, enters) = refract(direction, normal(entry), 1.0, self.ior);
        let chord = 2.0 * self.radius * -inside.dot(normal(entry));
        let exit = entry + inside * chord;
        let (outside, leaves) = refract(inside, -normal(exit), self.ior, 1.0);
        let through = Part { origin: exit, direction: outside, share: DVec3::splat(enters * leaves) };
        let mirrored = Part { origin: entry, direction: reflect(direction, normal(entry)), share: DVec3::splat(1.0 - enters) };
        let again = reflect(inside, normal(exit));
        let second = exit + again * chord;
        let (onward, _) = refract(again, -normal(second), self.ior, 1.0);
        let share = DVec3::splat(enters * (1.0 - leaves) * leaves);
        Some(vec![through, mirrored, Part { origin: second, direction: onward, share }])
    }
}
