//! The way of a view ray through a body of glass, by its faces in the picture [C. Wyman, *An Approximate Image-Space Approach for Interactive
//! Refraction*, 2005].
//!
//! The front face at P₁ refracts the ray to T₁. The exit is first taken at `P₂ = P₁ + d·T₁`, d the distance from front face to back face along the view
//! ray, and then corrected: the ray is met with the tangent planes of the faces that the picture has at P₂. Where it has none, P₂ is outside of the body,
//! and the way is shortened. The face at the exit refracts the ray once more, and reflects a share of it, or all, into the body. This part is followed to
//! its own exit in the same way (Wyman stops before).
//!
//! Faces are the nearest front faces and the nearest back faces. Not followed: further reflections; under total reflection at the second exit the ray
//! leaves in the mirrored direction.

use nephroid_math::lanes::Lanes;
use nephroid_math::optics::{fresnel_reflectance_by, reflect, refract_by};
use nephroid_math::vector::{V2, V3, V4, v2, v3};
use nephroid_pipeline::TextureView;
use nephroid_pipeline::sampler::load;

use super::camera::CameraUniform;
use super::geometry_buffer::MaterialKind;

/// Corrections of an exit. Each squares the error that curvature leaves: on a ball, four leave less than a pixel. Two more bring a guess back that was up to
/// twice as long as the way.
const CORRECTIONS: usize = 6;

/// Factor of a guess outside of the body: small steps, because at an outline the exit is near.
const BACK: f32 = 0.75;

/// Cosine between normals of one smooth face; at creases, a normal is not filtered.
const SMOOTH: f32 = 0.9;

/// Faces of glass as the camera sees them. Normals have unit length and are turned towards the eye.
#[derive(Clone, Copy)]
pub struct Faces<'a> {
    /// The camera.
    pub camera: &'a CameraUniform,
    /// Position of the nearest surface, m; w = 3 on glass.
    pub front: &'a TextureView<'a>,
    /// Normal of the nearest surface.
    pub front_normal: &'a TextureView<'a>,
    /// Position of the nearest back face of glass, m; w = 3 on glass.
    pub back: &'a TextureView<'a>,
    /// Normal of the nearest back face of glass.
    pub back_normal: &'a TextureView<'a>,
}

/// A view ray at the front face of a body.
pub struct Entry<L> {
    /// Position, m.
    pub position: V3<L>,
    /// Unit normal, against the ray.
    pub normal: V3<L>,
    /// Unit direction of the ray, away from the eye.
    pub view: V3<L>,
    /// Distance to the back face along the view ray, m.
    pub thickness: L,
    /// Refractive index outside over the one inside.
    pub eta: L,
}

/// A part of a view ray that has left a body.
pub struct Exit<L> {
    /// Position, m.
    pub position: V3<L>,
    /// Unit direction, away from the eye.
    pub direction: V3<L>,
    /// Length of the way inside, m.
    pub length: L,
    /// Share of the radiance inside at the entry that leaves here.
    pub share: L,
}

/// A straight way inside of a body.
struct Way<L> {
    end: V3<L>,
    length: L,
    /// Unit normal at the end, against the way.
    normal: V3<L>,
}

impl Faces<'_> {
    /// The two parts of rays that leave a body: the refracted one, and the one that the first exit reflects.
    #[inline(always)]
    pub fn pass<L: Lanes>(&self, entry: &Entry<L>) -> [Exit<L>; 2] {
        let one = entry.eta.like(1.0);
        let eta = one / entry.eta;
        let (inside, _) = refract_by(entry.view, entry.normal, entry.eta);
        let first = self.way(entry.position, inside, entry.thickness);
        let reflected = fresnel_reflectance_by(-inside.dot(first.normal), eta);
        let (refracted, _) = refract_by(inside, first.normal, eta);
        let inside = reflect(inside, first.normal).normalize();
        let second = self.way(first.end, inside, first.length);
        let leaves = one - fresnel_reflectance_by(-inside.dot(second.normal), eta);
        let (onward, is_refracted) = refract_by(inside, second.normal, eta);
        let onward = V3::select(is_refracted, onward, reflect(inside, second.normal)).normalize();
        let leaves = L::select(is_refracted, leaves, one);
        [
            Exit { position: first.end, direction: refracted.normalize(), length: first.length, share: one - reflected },
            Exit { position: second.end, direction: onward, length: first.length + second.length, share: reflected * leaves },
        ]
    }

    /// The way from a point inside, or on a face, to the first face in front. `length` is a first guess.
    #[inline(always)]
    fn way<L: Lanes>(&self, start: V3<L>, direction: V3<L>, mut length: L) -> Way<L> {
        let zero = length.like(0.0);
        let mut nearest = zero.like(f32::INFINITY);
        // Without a face the ray leaves as through a face across it.
        let mut normal = -direction;
        for _ in 0..CORRECTIONS {
            let pixel = self.pixel(start + direction * length);
            let texel = v2(pixel.x.floor(), pixel.y.floor());
            let at: V4<L> = load(self.back, texel.x, texel.y, 0, 0);
            let back_normal = load(self.back_normal, texel.x, texel.y, 0, 0).xyz();
            let back = to_plane(start, direction, at, back_normal);
            let exists = is_glass(at);
            // The eye sees a front face from outside.
            let at: V4<L> = load(self.front, texel.x, texel.y, 0, 0);
            let front_normal = -load(self.front_normal, texel.x, texel.y, 0, 0).xyz();
            let front = to_plane(start, direction, at, front_normal);
            let distance = Lanes::min(front, back);
            // No tangent plane of a convex body cuts it, so the nearest of them is nearest to the exit.
            let is_nearest = distance.lt(nearest);
            nearest = Lanes::min(distance, nearest);
            normal = V3::select(is_nearest, V3::select(front.lt(back), front_normal, back_normal), normal);
            length = L::select(distance.lt(zero.like(f32::INFINITY)), distance, L::select(exists, length, length * BACK));
        }
        let length = L::select(nearest.lt(zero.like(f32::INFINITY)), nearest, length);
        let end = start + direction * length;
        let smooth = self.smooth(self.pixel(end), normal);
        Way { end, length, normal: V3::select(direction.dot(smooth).lt(zero), smooth, normal) }
    }

    #[inline(always)]
    fn pixel<L: Lanes>(&self, p_ws: V3<L>) -> V2<L> {
        self.camera.pixel(self.camera.project(p_ws))
    }

    /// The normal at a pixel, filtered linearly over the faces whose normal is near `normal`.
    #[inline(always)]
    fn smooth<L: Lanes>(&self, pixel: V2<L>, normal: V3<L>) -> V3<L> {
        let (zero, one) = (pixel.x.like(0.0), pixel.x.like(1.0));
        let base = v2((pixel.x - 0.5).floor(), (pixel.y - 0.5).floor());
        let weight = v2(pixel.x - 0.5 - base.x, pixel.y - 0.5 - base.y);
        let mut sum = v3(zero, zero, zero);
        for corner in 0..4 {
            let (right, down) = (corner % 2 == 1, corner / 2 == 1);
            let share = (if right { weight.x } else { one - weight.x }) * (if down { weight.y } else { one - weight.y });
            let x = base.x + if right { 1.0 } else { 0.0 };
            let y = base.y + if down { 1.0 } else { 0.0 };
            let back = load(self.back_normal, x, y, 0, 0).xyz();
            sum = sum + back * L::select(back.dot(normal).ge(zero.like(SMOOTH)), share, zero);
            let front = -load(self.front_normal, x, y, 0, 0).xyz();
            sum = sum + front * L::select(front.dot(normal).ge(zero.like(SMOOTH)), share, zero);
        }
        V3::select(sum.dot(sum).gt(zero), sum, normal).normalize()
    }
}

/// Distance from a point inside of a body to the plane of a face, m; infinite unless the direction leaves the body there. `normal` points inwards.
#[inline(always)]
fn to_plane<L: Lanes>(start: V3<L>, direction: V3<L>, at: V4<L>, normal: V3<L>) -> L {
    let zero = at.w.like(0.0);
    let slope = direction.dot(normal);
    let distance = (at.xyz() - start).dot(normal) / slope;
    L::select(is_glass(at) & slope.lt(zero) & distance.gt(zero), distance, zero.like(f32::INFINITY))
}

/// Lanes of a position buffer that are on glass.
#[inline(always)]
fn is_glass<L: Lanes>(at: V4<L>) -> L::Mask {
    at.w.equals(at.w.like(1.0 + MaterialKind::Dielectric as u8 as f32))
}
