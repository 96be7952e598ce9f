//! The way of a view ray through a body of glass: in at the front face, out at the back face [C. Wyman, *An Approximate Image-Space Approach for
//! Interactive Refraction*, 2005].
//!
//! The front face at P₁ refracts the ray to T₁. The exit is first taken at `P₂ = P₁ + d·T₁`, d the distance from front face to back face along the view
//! ray, and then corrected: the ray is met with the tangent plane of the back face that the picture has at P₂. Where the picture has none there, P₂ is
//! outside of the body and the way is halved. The back face refracts the ray once more.
//!
//! Not followed: light that the back face reflects into the body. Under total reflection all light would be; the ray then leaves the body in the mirrored
//! direction without another interface.

use nephroid_math::lanes::Lanes;
use nephroid_math::optics::{fresnel_reflectance_by, reflect, refract_by};
use nephroid_math::vector::{V2, V3, V4, v2, v3};
use nephroid_pipeline::TextureView;
use nephroid_pipeline::sampler::load;

use super::camera::CameraUniform;

/// Corrections of the exit. The first one leaves errors of the size of the body's curvature, each further one squares them: on a ball, four leave less than
/// a pixel.
const CORRECTIONS: usize = 4;

/// Cosine between normals of one smooth face; at creases, a normal is not filtered.
const SMOOTH: f32 = 0.9;

/// Back faces of glass as the camera sees them.
#[derive(Clone, Copy)]
pub struct BackFaces<'a> {
    /// The camera.
    pub camera: &'a CameraUniform,
    /// World position, m; w = 0 where there is none.
    pub position: &'a TextureView<'a>,
    /// Unit normal, towards the eye.
    pub normal: &'a TextureView<'a>,
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

/// A view ray that has left a body.
pub struct Exit<L> {
    /// Position, m.
    pub position: V3<L>,
    /// Unit direction, away from the eye.
    pub direction: V3<L>,
    /// Length of the way inside, m.
    pub length: L,
    /// Share of the radiance that passes the back face.
    pub share: L,
}

impl BackFaces<'_> {
    /// Follows rays through a body.
    #[inline(always)]
    pub fn pass<L: Lanes>(&self, entry: &Entry<L>) -> Exit<L> {
        let (zero, one) = (entry.eta.like(0.0), entry.eta.like(1.0));
        let (inside, _) = refract_by(entry.view, entry.normal, entry.eta);
        let mut length = entry.thickness;
        // Without a back face the ray leaves as through a face across it.
        let mut normal = -inside;
        for _ in 0..CORRECTIONS {
            let pixel = self.pixel(entry.position + inside * length);
            let texel = v2(pixel.x.floor(), pixel.y.floor());
            let at: V4<L> = load(self.position, texel.x, texel.y, 0, 0);
            let face = load(self.normal, texel.x, texel.y, 0, 0).xyz();
            let exists = at.w.gt(zero);
            let slope = inside.dot(face);
            let to_plane = (at.xyz() - entry.position).dot(face) / slope;
            let meets = exists & slope.lt(zero) & to_plane.gt(zero);
            length = L::select(meets, to_plane, L::select(exists, length, length * 0.5));
            normal = V3::select(meets, face, normal);
        }
        let position = entry.position + inside * length;
        let normal = self.smooth(self.pixel(position), normal);
        let back = one / entry.eta;
        let (refracted, leaves) = refract_by(inside, normal, back);
        let direction = V3::select(leaves, refracted, reflect(inside, normal)).normalize();
        let share = L::select(leaves, one - fresnel_reflectance_by(-inside.dot(normal), back), one);
        Exit { position, direction, length, share }
    }

    #[inline(always)]
    fn pixel<L: Lanes>(&self, p_ws: V3<L>) -> V2<L> {
        self.camera.pixel(self.camera.project(p_ws))
    }

    /// The normal at a pixel, filtered linearly over the texels whose normal is near `normal`.
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
            let face: V3<L> = load(self.normal, x, y, 0, 0).xyz();
            let near = face.dot(normal).ge(zero.like(SMOOTH));
            sum = sum + face * L::select(near, share, zero);
        }
        let some = sum.dot(sum).gt(zero);
        V3::select(some, sum, normal).normalize()
    }
}
