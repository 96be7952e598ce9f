//! Setup of small point sprites, up to sixteen at a time.

use fearless_simd::{Simd, SimdBase, SimdCvtTruncate, f32x16, i32x16};

use crate::api::shader::clip_vertices::GROUP;
use crate::geometry::emitter::Emitter;
use crate::geometry::point::half_size;
use crate::geometry::small::{Ids, SMALL, bits};
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::primitive::window::{HALF, outside};

impl Emitter<'_> {
    /// Sets up all points of a part.
    #[inline(always)]
    pub fn points<S: Simd>(&mut self, simd: S, primitives: &[[u32; 3]], ids: Ids<'_>) {
        if self.observer.is_some() {
            for (i, primitive) in primitives.iter().enumerate() {
                self.point(primitive[0], ids.get(i));
            }
            return;
        }
        for (group, primitives) in primitives.chunks(GROUP).enumerate() {
            self.sprites(simd, primitives, ids, group * GROUP);
        }
    }

    /// Sets up at most sixteen points.
    #[inline(always)]
    fn sprites<S: Simd>(&mut self, simd: S, primitives: &[[u32; 3]], ids: Ids<'_>, first: usize) {
        let (mut fx, mut fy, mut outcode) = ([0; GROUP], [0; GROUP], [0; GROUP]);
        let (mut z, mut size) = ([0.0; GROUP], [1.0; GROUP]);
        for (lane, [vertex, ..]) in primitives.iter().enumerate() {
            let (group, at) = (*vertex as usize / GROUP, *vertex as usize % GROUP);
            let window = &self.window.groups[group];
            fx[lane] = window.fx[at];
            fy[lane] = window.fy[at];
            z[lane] = window.z[at];
            outcode[lane] = window.outcode[at];
            size[lane] = self.clip.groups[group].point_size[at];
        }
        let zero = i32x16::splat(simd, 0);
        let half = i32x16::<S>::truncate_from(half_size(f32x16::load_array(simd, size)));
        let (x, y) = (i32x16::load_array(simd, fx), i32x16::load_array(simd, fy));
        let outcode = i32x16::load_array(simd, outcode);

        let used = if primitives.len() == GROUP { 0xffff } else { (1u32 << primitives.len()) - 1 };
        let unclipped = bits((outcode & i32::from(outside::NAN | self.view.point_clip_mask())).simd_eq(zero));
        let small = bits(half.simd_lt(i32x16::splat(simd, SMALL / 2)));
        // The square's right and lower edges do not belong to the sprite.
        let bounds = self.scissored([
            (x - half + (HALF - 1)) >> 8,
            (y - half + (HALF - 1)) >> 8,
            (x + half - (HALF + 1)) >> 8,
            (y + half - (HALF + 1)) >> 8,
        ]);
        let covers = bits(bounds[0].simd_le(bounds[2]) & bounds[1].simd_le(bounds[3]));
        let (plain, long) = (used & unclipped & small, used & unclipped & !small);

        let statistics = &mut self.out.statistics;
        statistics.clipper_invocations += u64::from((used & !long).count_ones());
        statistics.clipper_primitives_out += u64::from(plain.count_ones());
        statistics.primitives_rejected += u64::from((used & !unclipped).count_ones());
        statistics.primitives_without_samples += u64::from((plain & !covers).count_ones());

        let bounds: [[i32; GROUP]; 4] = [bounds[0].into(), bounds[1].into(), bounds[2].into(), bounds[3].into()];
        let half: [i32; GROUP] = half.into();
        let mut left = (plain & covers) | long;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let (vertex, id) = (primitives[lane][0], ids.get(first + lane));
            if long >> lane & 1 == 1 {
                self.point(vertex, id);
                continue;
            }
            let entry = self.out.attributes.len() as u32;
            if self.pipeline.fragment.attributes {
                self.push_sprite(vertex, half[lane], id);
            }
            let bounds = [bounds[0][lane], bounds[1][lane], bounds[2][lane], bounds[3][lane]];
            self.bin_small(
                bounds,
                [0; 3],
                [0; 3],
                [0; 3],
                TilePrimitive {
                    z: [z[lane], 0.0, 0.0],
                    draw: self.draw,
                    attributes: entry,
                    sequence: self.out.sequence,
                    flags: flag::ACCEPT | flag::RECT | flag::CLAMP_Z,
                    ..TilePrimitive::default()
                },
            );
            self.out.sequence += 1;
        }
    }
}
