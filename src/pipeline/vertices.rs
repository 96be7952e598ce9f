//! Vertices on their way from the last vertex-like stage to setup: in groups of sixteen, planar inside a group.
//!
//! Whole planes would be a power of two apart, as chunks are, and then all planes of a vertex fall into one set of the cache.

use fearless_simd::{Select, Simd, SimdBase, SimdCvtTruncate, f32x16, i32x16};

use nephroid_math::lanes::Lanes;

use super::viewport::{ViewTransform, WindowVertex};

/// Vertices in a group.
pub(super) const GROUP: usize = 16;

/// Sixteen vertices in clip space.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct ClipGroup {
    /// x, y, z, w.
    pub position: [[f32; GROUP]; 4],
    pub point_size: [f32; GROUP],
}

/// Clip-space positions and point sizes. What the last group holds beyond the last vertex means nothing.
#[derive(Default)]
pub(super) struct ClipVertices {
    pub groups: Vec<ClipGroup>,
    count: usize,
}

impl ClipVertices {
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn resize(&mut self, count: usize) {
        self.count = count;
        self.groups.resize(count.div_ceil(GROUP), ClipGroup { position: [[0.0; GROUP]; 4], point_size: [1.0; GROUP] });
    }

    pub fn clear(&mut self) {
        self.resize(0);
    }

    #[inline]
    pub fn push(&mut self, position: [f32; 4], point_size: f32) {
        let (group, lane) = (self.count / GROUP, self.count % GROUP);
        self.resize(self.count + 1);
        let group = &mut self.groups[group];
        for (plane, value) in group.position.iter_mut().zip(position) {
            plane[lane] = value;
        }
        group.point_size[lane] = point_size;
    }

    #[inline(always)]
    pub fn get(&self, vertex: usize) -> [f32; 4] {
        let [x, y, z, w] = &self.groups[vertex / GROUP].position;
        let lane = vertex % GROUP;
        [x[lane], y[lane], z[lane], w[lane]]
    }

    #[inline(always)]
    pub fn point_size(&self, vertex: usize) -> f32 {
        self.groups[vertex / GROUP].point_size[vertex % GROUP]
    }

    /// The positions from `first` on, for an observer.
    pub fn positions_from(&self, first: usize) -> Vec<[f32; 4]> {
        (first..self.count).map(|v| self.get(v)).collect()
    }
}

/// Sixteen vertices in framebuffer coordinates.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(super) struct WindowGroup {
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
pub(super) struct WindowVertices {
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

    /// Divide, viewport, snap and outcode of all vertices.
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
