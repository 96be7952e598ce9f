//! Vertices after the viewport transform, in groups of sixteen, planar inside a group: divided, snapped and with their outcodes.

use fearless_simd::{Select, Simd, SimdBase, SimdCvtTruncate, f32x16, i32x16};

use nephroid_math::lanes::Lanes;

use crate::api::shader::clip_vertices::{ClipVertices, GROUP};
use crate::geometry::viewport::ViewTransform;
use crate::primitive::window::WindowVertex;

/// Sixteen vertices in framebuffer coordinates.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct WindowGroup {
    /// Snapped position in 1/256 pixel.
    pub fx: [i32; GROUP],
    pub fy: [i32; GROUP],
    /// Position in pixels before snapping.
    x: [f32; GROUP],
    y: [f32; GROUP],
    pub z: [f32; GROUP],
    pub inv_w: [f32; GROUP],
    /// Bits of `viewport::outside`.
    pub outcode: [i32; GROUP],
}

/// The vertices of a [`ClipVertices`] in framebuffer coordinates, with their outcodes.
#[derive(Default)]
pub(crate) struct WindowVertices {
    pub groups: Vec<WindowGroup>,
}

impl WindowVertices {
    #[inline(always)]
    pub fn get(&self, vertex: usize) -> WindowVertex {
        let (group, lane) = (&self.groups[vertex / GROUP], vertex % GROUP);
        WindowVertex {
            fx: group.fx[lane],
            fy: group.fy[lane],
            x: group.x[lane],
            y: group.y[lane],
            z: group.z[lane],
            inv_w: group.inv_w[lane],
        }
    }

    #[inline(always)]
    pub fn inv_w(&self, vertex: u32) -> f32 {
        self.groups[vertex as usize / GROUP].inv_w[vertex as usize % GROUP]
    }

    #[inline(always)]
    pub fn outcode(&self, vertex: usize) -> u8 {
        self.groups[vertex / GROUP].outcode[vertex % GROUP] as u8
    }

    /// Divides, applies the viewport, snaps and computes the outcodes of all vertices.
    #[inline(always)]
    pub fn transform<S: Simd>(&mut self, simd: S, view: &ViewTransform, clip: &ClipVertices) {
        self.groups.resize(clip.groups.len(), WindowGroup::default());
        let (unit, origin) = (view.grid_unit(), view.grid_origin());
        for (group, clip) in self.groups.iter_mut().zip(&clip.groups) {
            let [x, y, z, w] = &clip.position;
            let position = [
                <f32x16<S> as Lanes>::load(simd, x),
                <f32x16<S> as Lanes>::load(simd, y),
                <f32x16<S> as Lanes>::load(simd, z),
                <f32x16<S> as Lanes>::load(simd, w),
            ];
            let mut outcode = i32x16::splat(simd, 0);
            for (mask, bit) in view.outside(position) {
                outcode |= Select::select(mask, i32x16::splat(simd, i32::from(bit)), i32x16::splat(simd, 0));
            }
            group.outcode = outcode.into();
            let window = view.window(position, false);
            group.fx = (i32x16::<S>::truncate_from_precise(window.units[0]) * unit + origin).into();
            group.fy = (i32x16::<S>::truncate_from_precise(window.units[1]) * unit + origin).into();
            Lanes::store(window.pixels[0], &mut group.x);
            Lanes::store(window.pixels[1], &mut group.y);
            Lanes::store(window.z, &mut group.z);
            Lanes::store(window.inv_w, &mut group.inv_w);
        }
    }
}
