//! What a ray meets of the receivers that a camera sees: the ray is followed through the camera's own picture.
//!
//! The part of the ray in the bounds of all receivers is sampled at equal distances in the picture. Each texel stands for the tangent plane of its
//! receiver. Where the ray passes from the front of the plane to the back, the step is halved [`HALVINGS`] times, and the hit is the point where the
//! ray meets the plane of the last texel; it does not depend on the size of steps or texels. If the ray is deep below the plane there, it passes
//! behind an edge of the receiver, and the search goes on.
//!
//! Not found: receivers outside of the picture, or hidden behind others; and those that are narrower in the picture than a step.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::lanes::{Lanes, Mask as _};
use nephroid_math::vector::{V2, V3, V4, transform_point, transform_vector, v2, v3};
use nephroid_pipeline::TextureView;
use nephroid_pipeline::sampler::load;
use nephroid_scene::geom::Aabb;

use super::camera::CameraUniform;
use super::shadow_map::none;

/// Steps along a ray in the bounds of the receivers. A step is at most a 32nd of the picture's diagonal, and much less where receivers are low, such as
/// things on a table: objects that are as wide are not missed.
const STEPS: usize = 32;

/// Halvings of the step in which a ray meets a plane: to less than a pixel, so that the last texel is the right one or its neighbour.
const HALVINGS: usize = 6;

/// Uniform of the receivers' bounds, m.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ReceiverBounds {
    /// Least coordinates; w is unused.
    pub min_ws: Vec4,
    /// Greatest coordinates; w is unused.
    pub max_ws: Vec4,
}

impl ReceiverBounds {
    /// The bounds, larger by a hundredth, so that rays leave them behind the outermost surfaces.
    #[must_use]
    pub fn around(bounds: Aabb) -> Self {
        let around = bounds.expanded(0.01 * bounds.size().length().max(f32::MIN_POSITIVE));
        Self { min_ws: around.min.extend(0.0), max_ws: around.max.extend(0.0) }
    }

    /// Distances at which rays enter and leave the bounds; the first is not below 0.
    #[inline(always)]
    fn span<L: Lanes>(&self, origin: V3<L>, direction: V3<L>) -> (L, L) {
        let mut span = (origin.x.like(0.0), origin.x.like(f32::INFINITY));
        span = between(origin.x, direction.x, (self.min_ws.x, self.max_ws.x), span);
        span = between(origin.y, direction.y, (self.min_ws.y, self.max_ws.y), span);
        between(origin.z, direction.z, (self.min_ws.z, self.max_ws.z), span)
    }
}

/// Receivers as a camera sees them.
#[derive(Clone, Copy)]
pub struct SeenReceivers<'a> {
    /// The camera.
    pub camera: &'a CameraUniform,
    /// Bounds of all receivers.
    pub bounds: &'a ReceiverBounds,
    /// World position, m; w = 0 where there is no receiver.
    pub position: &'a TextureView<'a>,
    /// Unit normal, towards the eye.
    pub normal: &'a TextureView<'a>,
    /// Radiance towards the eye, W/(m² sr).
    pub radiance: &'a TextureView<'a>,
}

/// A result of [`SeenReceivers::search`].
#[derive(Clone, Copy)]
pub struct Found<L: Lanes> {
    /// Radiance of the receiver, W/(m² sr).
    pub radiance: V3<L>,
    /// Lanes whose ray meets a receiver.
    pub exists: L::Mask,
    /// Lanes whose ray has passed behind a receiver, and meets none after it: what it meets may be hidden.
    pub doubtful: L::Mask,
}

/// A ray inside of the camera's view.
struct Ray<L> {
    origin: V3<L>,
    direction: V3<L>,
    /// Distance to the edge of the view, m.
    length: L,
    /// Clip-space w at the start and at the end.
    start_w: L,
    end_w: L,
}

/// The receiver at the texel of a point, and the point.
struct Meeting<L> {
    point: V3<L>,
    clip_w: L,
    /// Coordinates of the texel.
    texel: V2<L>,
    normal: V3<L>,
    /// Height of the point above the receiver's tangent plane, m; above 0 where there is no receiver.
    height: L,
}

impl SeenReceivers<'_> {
    /// The receivers that rays meet first, for the lanes of `wanted`.
    #[inline(always)]
    pub fn search<L: Lanes>(&self, origin: V3<L>, direction: V3<L>, wanted: L::Mask) -> Found<L> {
        let zero = origin.x.like(0.0);
        let ray = self.ray(origin, direction);
        let mut searching = wanted & ray.start_w.gt(zero) & ray.length.gt(zero);
        let mut in_front = searching;
        let mut found = Found { radiance: v3(zero, zero, zero), exists: zero.lt(zero), doubtful: zero.lt(zero) };
        for step in 0..STEPS {
            if none(searching) {
                break;
            }
            let [start, end] = [step, step + 1].map(|s| s as f32 / STEPS as f32);
            let behind = self.meet(&ray, ray.distance(zero.like(end))).height.lt(zero);
            let crosses = searching & in_front & behind;
            if crosses.any() {
                let (meeting, is_near) = self.halve(&ray, zero.like(start), zero.like(end));
                let hits = crosses & is_near;
                found.radiance = V3::select(hits, self.radiance(&meeting), found.radiance);
                found.exists = found.exists | hits;
                found.doubtful = found.doubtful | (crosses & !hits);
                searching = searching & !hits;
            }
            in_front = !behind;
        }
        found.doubtful = found.doubtful & !found.exists;
        found
    }

    /// The part of a ray inside of the bounds and of the view.
    #[inline(always)]
    fn ray<L: Lanes>(&self, origin: V3<L>, direction: V3<L>) -> Ray<L> {
        let (enters, leaves) = self.bounds.span(origin, direction);
        let origin = origin + direction * enters;
        let columns = self.camera.clip_from_world.to_cols_array();
        let along = transform_vector(&self.camera.clip_from_world, direction);
        let along_w = direction.x * columns[3] + direction.y * columns[7] + direction.z * columns[11];
        let start = transform_point(&self.camera.clip_from_world, origin);
        let mut length = leaves - enters;
        length = until_negative(start.w + start.x, along_w + along.x, length);
        length = until_negative(start.w - start.x, along_w - along.x, length);
        length = until_negative(start.w + start.y, along_w + along.y, length);
        length = until_negative(start.w - start.y, along_w - along.y, length);
        length = until_negative(start.z, along.z, length);
        length = until_negative(start.w - start.z, along_w - along.z, length);
        Ray { origin, direction, length, start_w: start.w, end_w: start.w + along_w * length }
    }

    /// The point at a distance along a ray, and the receiver there.
    #[inline(always)]
    fn meet<L: Lanes>(&self, ray: &Ray<L>, distance: L) -> Meeting<L> {
        let point = ray.origin + ray.direction * distance;
        let clip = self.camera.project(point);
        let pixel = self.camera.pixel(clip);
        let texel = v2(pixel.x.floor(), pixel.y.floor());
        let at: V4<L> = load(self.position, texel.x, texel.y, 0, 0);
        let normal = load(self.normal, texel.x, texel.y, 0, 0).xyz();
        let height = L::select(at.w.gt(at.w.like(0.0)), (point - at.xyz()).dot(normal), at.w.like(1.0));
        Meeting { point, clip_w: clip.w, texel, normal, height }
    }

    /// Narrows a step from the front of a receiver to its back. The meeting is moved onto the receiver's plane; the mask is false where the ray passes
    /// behind the receiver instead.
    #[inline(always)]
    fn halve<L: Lanes>(&self, ray: &Ray<L>, mut low: L, mut high: L) -> (Meeting<L>, L::Mask) {
        let zero = low.like(0.0);
        for _ in 0..HALVINGS {
            let middle = (low + high) * 0.5;
            let behind = self.meet(ray, ray.distance(middle)).height.lt(zero);
            high = L::select(behind, middle, high);
            low = L::select(behind, low, middle);
        }
        let (front, back) = (ray.distance(low), ray.distance(high));
        let mut meeting = self.meet(ray, back);
        // On one plane, the ray sinks by less than the step; a pixel is left for the difference between neighbouring texels.
        let is_near = (-meeting.height).le((back - front) + self.pixel_m(meeting.clip_w));
        let slope = ray.direction.dot(meeting.normal);
        let on_plane = L::select(slope.lt(zero), back - meeting.height / slope, back);
        // The plane of a curved receiver's last texel may be met a little before the step.
        let on_plane = Lanes::min(Lanes::max(on_plane, front * 2.0 - back), back);
        meeting.point = ray.origin + ray.direction * on_plane;
        (meeting, is_near)
    }

    /// Radiance at a meeting: the four texels around it, filtered linearly, without those that lie off the receiver's plane.
    #[inline(always)]
    fn radiance<L: Lanes>(&self, meeting: &Meeting<L>) -> V3<L> {
        let (zero, one) = (meeting.height.like(0.0), meeting.height.like(1.0));
        let pixel = self.camera.pixel(self.camera.project(meeting.point));
        let base = v2((pixel.x - 0.5).floor(), (pixel.y - 0.5).floor());
        let weight = v2(pixel.x - 0.5 - base.x, pixel.y - 0.5 - base.y);
        let tolerance = self.pixel_m(meeting.clip_w);
        let mut sum = v3(zero, zero, zero);
        let mut weights = zero;
        for corner in 0..4 {
            let (right, down) = (corner % 2 == 1, corner / 2 == 1);
            let texel = v2(base.x + if right { 1.0 } else { 0.0 }, base.y + if down { 1.0 } else { 0.0 });
            let share = (if right { weight.x } else { one - weight.x }) * (if down { weight.y } else { one - weight.y });
            let at: V4<L> = load(self.position, texel.x, texel.y, 0, 0);
            let off = (at.xyz() - meeting.point).dot(meeting.normal).abs();
            let share = L::select(at.w.gt(zero) & off.le(tolerance), share, zero);
            sum = sum + load(self.radiance, texel.x, texel.y, 0, 0).xyz() * share;
            weights = weights + share;
        }
        let nearest = load(self.radiance, meeting.texel.x, meeting.texel.y, 0, 0).xyz();
        let some = weights.gt(zero.like(1.0e-3));
        V3::select(some, sum * (one / L::select(some, weights, one)), nearest)
    }

    /// Width of a pixel at this clip-space w, m.
    #[inline(always)]
    fn pixel_m<L: Lanes>(&self, clip_w: L) -> L {
        let m = self.camera.clip_from_world.to_cols_array();
        // Clip units per metre along the vertical of the picture.
        let per_metre = (m[1] * m[1] + m[5] * m[5] + m[9] * m[9]).sqrt();
        clip_w * (2.0 * self.camera.size_px.w / per_metre)
    }
}

impl<L: Lanes> Ray<L> {
    /// Distance of the point at a share of the way in the picture, where w is not linear: `l·s·w₀/((1 − s)·w₁ + s·w₀)`.
    #[inline(always)]
    fn distance(&self, share: L) -> L {
        let near = share * self.start_w;
        let far = (share.like(1.0) - share) * self.end_w;
        self.length * (near / (far + near))
    }
}

/// The part of a span of distances in which a coordinate is between two bounds.
#[inline(always)]
fn between<L: Lanes>(start: L, along: L, (min, max): (f32, f32), (enters, leaves): (L, L)) -> (L, L) {
    // A level ray is given some slope: it is then either always or never between.
    let along = L::select(along.abs().lt(along.like(1.0e-9)), along.like(1.0e-9), along);
    let (a, b) = ((start.like(min) - start) / along, (start.like(max) - start) / along);
    (Lanes::max(enters, Lanes::min(a, b)), Lanes::min(leaves, Lanes::max(a, b)))
}

/// The distance at which `start + along·distance` becomes negative, if that is before `length`; otherwise `length`.
#[inline(always)]
fn until_negative<L: Lanes>(start: L, along: L, length: L) -> L {
    let zero = start.like(0.0);
    let falls = along.lt(zero);
    let distance = Lanes::max(-(start / L::select(falls, along, start.like(-1.0))), zero);
    L::select(falls, Lanes::min(distance, length), length)
}
