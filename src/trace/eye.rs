//! What the eye sees: rays from the camera, through the water surface, to the first solid point.
//!
//! At the water a ray goes on refracted, or reflected where nothing is refracted: a picture of the water's surface itself has another part
//! that mirrors the sky, which holds no caustic. Mirrors and glass end a ray, as what is seen in them is no point of theirs.

use glam::{DVec3, Vec3};

use nephroid_math::optics::{fresnel_transmittance, reflect, refract};
use nephroid_math::vector::v3;
use nephroid_scene::{Camera, Scene};

use super::media::Place;
use super::tree::NONE;
use super::water::{Rays, WaterSurface};
use super::world::{Surface, World};

/// Most times that a ray meets the water.
const MAX_CROSSINGS: u32 = 8;

/// One straight part of a view ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Start, world space, m.
    pub origin: Vec3,
    /// Unit vector, away from the eye.
    pub direction: Vec3,
    /// Length, m; may be infinite.
    pub length: f32,
    /// What it runs through.
    pub place: Place,
    /// Radiance that arrives at the eye over radiance at the start of this stretch, all media left out.
    pub throughput: f32,
}

/// Where a view ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// World space, m.
    pub position: Vec3,
    /// Normal of the triangle, turned against the ray.
    pub normal: Vec3,
    /// Number of the object.
    pub object: u32,
    /// Whether light can land there.
    pub diffuse: bool,
}

/// Rays of a camera.
pub(super) struct Eye<'a> {
    world: &'a World,
    water: Option<&'a WaterSurface>,
    ior: f32,
    camera: Camera,
    origin: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    size: [f64; 2],
}

impl<'a> Eye<'a> {
    /// The scene's camera.
    pub fn new(scene: &Scene, world: &'a World, water: Option<&'a WaterSurface>) -> Self {
        let camera = scene.camera;
        let forward = (camera.target_ws().as_dvec3() - camera.position_ws().as_dvec3()).normalize();
        let right = forward.cross(camera.up_ws().as_dvec3()).normalize();
        // Half the height of the picture: at a distance of 1, or everywhere.
        let half = match camera {
            Camera::Perspective { fov_deg, .. } => libm::tan(f64::from(fov_deg).to_radians() * 0.5),
            Camera::Orthographic { height_m, .. } => f64::from(height_m) * 0.5,
        };
        Self {
            world,
            water,
            ior: scene.water.as_ref().map_or(1.0, |w| w.ior),
            camera,
            origin: camera.position_ws().as_dvec3(),
            forward,
            right: right * (half * f64::from(scene.image.aspect())),
            up: right.cross(forward) * half,
            size: [f64::from(scene.image.width), f64::from(scene.image.height)],
        }
    }

    /// The ray through a place of the picture in pixels, from the top left corner: start, at the near plane, and direction.
    fn ray(&self, x_px: f64, y_px: f64) -> (Vec3, Vec3) {
        let (x, y) = (2.0 * x_px / self.size[0] - 1.0, 1.0 - 2.0 * y_px / self.size[1]);
        let across = self.right * x + self.up * y;
        let near = f64::from(self.camera.depth_range_m().0);
        match self.camera {
            Camera::Perspective { .. } => {
                let to = self.forward + across;
                ((self.origin + to * near).as_vec3(), to.normalize().as_vec3())
            }
            Camera::Orthographic { .. } => ((self.origin + across + self.forward * near).as_vec3(), self.forward.as_vec3()),
        }
    }

    /// Follows the ray through a place of the picture; `stretch` is told of its straight parts in order.
    pub fn look(&self, x_px: f64, y_px: f64, mut stretch: impl FnMut(Stretch)) -> Option<Seen> {
        let (mut origin, mut direction) = self.ray(x_px, y_px);
        let mut wet = self.water.is_some_and(|water| water.holds(origin));
        let mut throughput = 1.0;
        for _ in 0..MAX_CROSSINGS {
            let (to_water, normal) = self.meet(origin, direction, wet);
            let hit = self.world.nearest(origin, direction, to_water, NONE);
            let length = hit.map_or(to_water, |hit| hit.t);
            let place = if wet { Place::Water } else { Place::Air };
            stretch(Stretch { origin, direction, length, place, throughput });
            if let Some(hit) = hit {
                let object = self.world.object(hit.triangle);
                let normal = self.world.facet(hit.triangle).normal();
                let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
                let diffuse = self.world.surfaces[object as usize] == Surface::Diffuse;
                return Some(Seen { position: origin + direction * length, normal, object, diffuse });
            }
            if length == f32::INFINITY {
                return None;
            }
            let normal = if wet { -normal } else { normal };
            let (here, there) = if wet { (self.ior, 1.0) } else { (1.0, self.ior) };
            let (d, n) = (v3(direction.x, direction.y, direction.z), v3(normal.x, normal.y, normal.z));
            let (onward, passes) = refract(d, n, here / there);
            let p = origin + direction * length;
            let lift = 1.0e-6 * (p.abs().max_element() + 0.1);
            let onward = if passes {
                wet = !wet;
                origin = p - normal * lift;
                // Radiance over the square of the refractive index is what a boundary lets through.
                throughput *= fresnel_transmittance(-direction.dot(normal), here, there) * (here / there) * (here / there);
                onward
            } else {
                origin = p + normal * lift;
                reflect(d, n)
            };
            direction = Vec3::new(onward.x, onward.y, onward.z).normalize();
        }
        None
    }

    /// Distance to the water and its normal there, pointing up.
    fn meet(&self, origin: Vec3, direction: Vec3, wet: bool) -> (f32, Vec3) {
        let Some(water) = self.water else { return (f32::INFINITY, Vec3::Y) };
        let rays = Rays {
            origin: v3(origin.x, origin.y, origin.z),
            direction: v3(direction.x, direction.y, direction.z),
            side: if wet { -1.0 } else { 1.0 },
        };
        let crossing = water.cross(rays);
        (crossing.t, Vec3::new(crossing.normal.x, crossing.normal.y, crossing.normal.z))
    }
}
