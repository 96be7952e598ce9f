//! View rays: from the camera, through the water surface, to the first solid point.
//!
//! At the water a ray continues refracted, or reflected in case of total reflection. (A picture of the water surface also has the mirrored sky, which
//! contains no caustic.) Mirrors and glass end a ray, because what is seen in them does not lie on their surfaces.

use glam::{DVec3, DVec4, Vec3};

use nephroid_math::optics::{fresnel_transmittance, reflect, refract};
use nephroid_math::vector::v3;
use nephroid_scene::{Camera, Scene};

use super::media::Place;
use super::tree::NONE;
use super::water::{Rays, WaterSurface};
use super::world::{Surface, World};

/// Most crossings of a ray with the water.
pub(super) const MAX_CROSSINGS: u32 = 8;

/// One straight part of a view ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    /// Start, world space, m.
    pub origin: Vec3,
    /// Unit vector, away from the eye.
    pub direction: Vec3,
    /// Length, m; may be infinite.
    pub length: f32,
    /// Medium that the stretch runs through.
    pub place: Place,
    /// Factor from radiance at the start of this stretch to radiance at the eye, without the attenuation by media.
    pub throughput: f32,
    /// Normal of the surface at its end, on the side of the eye; zero if there is none.
    pub end_normal: Vec3,
}

/// The map from places to the picture: a point is at `(u/w, v/w)` pixels from the top left corner, and `z` metres from the eye along the view axis.
pub(super) struct Projection {
    /// Coefficients of u, v, w and z in x, y, z and 1.
    pub rows: [DVec4; 4],
    /// Distance to the near plane, m.
    pub near: f64,
    /// Area of a pixel at distance 1, m²; everywhere, for a parallel camera.
    pub area: f64,
    /// Whether view rays are parallel.
    pub parallel: bool,
    /// World-space position of the eye, m, and unit vector of its view axis.
    pub eye: DVec3,
    pub axis: DVec3,
}

/// The end of a view ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// World space, m.
    pub position: Vec3,
    /// Unit normal of the triangle, on the side of the eye.
    pub normal: Vec3,
    /// Number of the object.
    pub object: u32,
    /// Number of the triangle.
    pub triangle: u32,
    /// Whether the surface is diffuse, so that light can land there.
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
        // Half the height of the picture: at distance 1 for a perspective camera, everywhere for a parallel one.
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

    /// Width of the picture, pixels.
    pub fn columns(&self) -> u32 {
        self.size[0] as u32
    }

    /// Height of the picture, pixels.
    pub fn rows(&self) -> u32 {
        self.size[1] as u32
    }

    /// The map from places to the picture.
    pub fn projection(&self) -> Projection {
        let row = |v: DVec3, constant: f64| v.extend(constant - v.dot(self.origin));
        let parallel = matches!(self.camera, Camera::Orthographic { .. });
        let z = row(self.forward, 0.0);
        let w = if parallel { DVec4::W } else { z };
        let x = row(self.right / self.right.length_squared(), 0.0);
        let y = row(self.up / self.up.length_squared(), 0.0);
        let rows = [(w + x) * (0.5 * self.size[0]), (w - y) * (0.5 * self.size[1]), w, z];
        let area = self.right.length() * self.up.length() * 4.0 / (self.size[0] * self.size[1]);
        Projection { rows, near: f64::from(self.camera.depth_range_m().0), area, parallel, eye: self.origin, axis: self.forward }
    }

    /// The medium around the eye.
    pub fn place(&self) -> Place {
        let start = self.ray(0.5 * self.size[0], 0.5 * self.size[1]).0;
        if self.water.is_some_and(|water| water.holds(start)) { Place::Water } else { Place::Air }
    }

    /// The ray through a position of the picture in pixels from the top left corner: its start on the near plane and its direction.
    pub fn ray(&self, x_px: f64, y_px: f64) -> (Vec3, Vec3) {
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

    /// Follows the ray through a position of the picture. `stretch` is called with each straight part in order.
    pub fn look(&self, x_px: f64, y_px: f64, mut stretch: impl FnMut(Stretch)) -> Option<Seen> {
        let (mut origin, mut direction) = self.ray(x_px, y_px);
        let mut wet = self.water.is_some_and(|water| water.holds(origin));
        let mut throughput = 1.0;
        for _ in 0..MAX_CROSSINGS {
            let (to_water, normal) = self.meet(origin, direction, wet);
            let hit = self.world.nearest(origin, direction, to_water, NONE);
            let length = hit.map_or(to_water, |hit| hit.t);
            let place = if wet { Place::Water } else { Place::Air };
            let facet = hit.map(|hit| self.world.facet(hit.triangle).normal());
            let end = facet.unwrap_or(if length == f32::INFINITY { Vec3::ZERO } else { normal });
            let end_normal = if end.dot(direction) > 0.0 { -end } else { end };
            stretch(Stretch { origin, direction, length, place, throughput, end_normal });
            if let Some(hit) = hit {
                let object = self.world.object(hit.triangle);
                let normal = end_normal;
                let diffuse = self.world.surfaces[object as usize] == Surface::Diffuse;
                return Some(Seen { position: origin + direction * length, normal, object, triangle: hit.triangle, diffuse });
            }
            if length == f32::INFINITY {
                return None;
            }
            let normal = if wet { -normal } else { normal };
            let (here, there) = if wet { (self.ior, 1.0) } else { (1.0, self.ior) };
            let (d, n) = (v3(direction.x, direction.y, direction.z), v3(normal.x, normal.y, normal.z));
            let (onward, passes) = refract(d, n, here / there);
            let p = origin + direction * length;
            let lift = 1.0e-6 * p.abs().max_element().max(0.1 * self.water.map_or(0.0, |water| water.size));
            let onward = if passes {
                wet = !wet;
                origin = p - normal * lift;
                // A boundary transmits radiance over the square of the refractive index.
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

    /// Distance to the water, and the water's normal there, pointing up.
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
