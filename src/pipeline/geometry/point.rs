//! Setup of point sprites of any size, one at a time.

use nephroid_math::lanes::Lanes;

use crate::api::observer::PrimitiveOutcome;
use crate::api::pipeline_descriptor::MAX_POINT_SIZE;
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::state::PixelRect;
use crate::geometry::emitter::Emitter;
use crate::geometry::setup::pixel_bounds;
use crate::primitive::planes::ZPlane;
use crate::primitive::tile_primitive::{SetupPrimitive, flag};
use crate::primitive::window::{HALF, ONE, outside};

impl Emitter<'_> {
    /// Sets up a point sprite: the square of the point's size around the snapped centre, by the fill rule of triangles [D3D11.3 §3.4.6].
    pub fn point(&mut self, vertex: u32, id: u32) {
        let (code, size) = (self.outcode(vertex), self.clip.point_size(vertex as usize));
        self.out.statistics.clipper_invocations += 1;
        // Sprites are clipped by their centre, against near, far and guard band alone.
        if code & (outside::NAN | self.view.point_clip_mask()) != 0 {
            return self.report(id, None, PrimitiveOutcome::Rejected);
        }
        self.out.statistics.clipper_primitives_out += 1;
        let corner = self.corner(vertex);
        let w = corner.window;
        let half = half_size(size) as i32;
        let at = Some([[w.fx, w.fy]; 3]);
        let Some(bounds) = pixel_bounds_half_open((w.fx - half, w.fy - half), (w.fx + half, w.fy + half), self.scissor) else {
            return self.report(id, at, PrimitiveOutcome::NoSamples);
        };
        if self.observer.is_some() {
            self.report(id, at, PrimitiveOutcome::Rasterized { clipped: false, front_facing: true });
        }
        let attributes = self.out.attributes.len() as u32;
        if self.pipeline.fragment.attributes {
            self.push_sprite(vertex, half, id);
        }
        self.insert(SetupPrimitive {
            z: ZPlane::flat(w.z),
            bounds: bounds.into(),
            draw: self.draw,
            attributes,
            flags: flag::ACCEPT | flag::RECT | flag::CLAMP_Z,
            ..SetupPrimitive::default()
        });
    }

    /// Interpolation data of a sprite that extends `half` (1/256 pixel) around its centre.
    #[inline(always)]
    pub fn push_sprite(&mut self, vertex: u32, half: i32, id: u32) {
        let w = self.window.get(vertex as usize);
        let per_pixel = ONE as f32 / (2 * half) as f32;
        let (column, row) = (w.fx >> 8, w.fy >> 8);
        let start = |pixel: i32, centre: i32| ((pixel << 8) + HALF - (centre - half)) as f32 / (2 * half) as f32;
        self.out.attributes.push(PrimitiveAttributes {
            anchor: [column as f32, row as f32],
            l1: [start(column, w.fx), per_pixel, 0.0],
            l2: [start(row, w.fy), 0.0, per_pixel],
            inv_w: [w.inv_w; 3],
            varyings: [self.varyings_of(vertex); 3],
            primitive_id: id,
            front_facing: true,
            is_point: true,
        });
    }
}

/// Half the edge of a sprite in 1/256 pixel, a whole number. NaN becomes the least size.
#[inline(always)]
pub(crate) fn half_size<L: Lanes>(size: L) -> L {
    let size = L::select(size.equals(size), size, size.like(0.0));
    (Lanes::clamp(size, 1.0 / 128.0, MAX_POINT_SIZE) * HALF as f32).round_ties_even()
}

/// [`pixel_bounds`] of a rectangle without its right and lower edges.
fn pixel_bounds_half_open(min: (i32, i32), max: (i32, i32), scissor: PixelRect) -> Option<PixelRect> {
    pixel_bounds(min, (max.0 - 1, max.1 - 1), scissor)
}
