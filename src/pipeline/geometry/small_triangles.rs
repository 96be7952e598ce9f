//! Setup of small triangles, sixteen at a time.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, i32x16, mask32x16};

use crate::api::rules::{DepthPlane, SetupFrom};
use crate::api::shader::clip_vertices::GROUP;
use crate::api::shader::fragment::PrimitiveAttributes;
use crate::api::state::{Face, FrontFace};
use crate::geometry::emitter::Emitter;
use crate::geometry::small::{Ids, SMALL, bits};
use crate::primitive::planes::{PlaneFrame, ZPlane, max_slope};
use crate::primitive::tile_primitive::{TilePrimitive, flag};
use crate::primitive::window::{HALF, outside};

/// Corners of sixteen triangles, `[corner][lane]`.
struct Corners {
    fx: [[i32; GROUP]; 3],
    fy: [[i32; GROUP]; 3],
    z: [[f32; GROUP]; 3],
    /// Outcode bits that at least one corner has, and bits that all corners have.
    any: [i32; GROUP],
    all: [i32; GROUP],
}

/// Results for sixteen triangles; masks have one bit per lane.
struct Setup {
    /// Small triangles with pixels to cover, set up here.
    drawn: u32,
    /// Triangles with pixels to cover that are not small.
    large: u32,
    /// Triangles that must be clipped.
    clipped: u32,
    front: u32,
    /// Triangles whose bounds the scissor has cut.
    cut: u32,
    /// Twice the signed area in 1/65536 pixel².
    area: [i64; GROUP],
    /// First and last column and row, inclusive: x0, y0, x1, y1.
    bounds: [[i32; GROUP]; 4],
    /// Edge functions: change per pixel right (a), per pixel down (b), and value at the first pixel of the tile where the bounds start (c).
    a: [[i32; GROUP]; 3],
    b: [[i32; GROUP]; 3],
    c: [[i32; GROUP]; 3],
}

/// Sixteen [`PlaneFrame`]s, field by field, so that loops over them become lanes.
struct Frames {
    x: [[f64; GROUP]; 2],
    y: [[f64; GROUP]; 2],
    scale: [f64; GROUP],
    to_centre: [[f64; GROUP]; 2],
    anchor: [[i32; GROUP]; 2],
}

impl Frames {
    #[inline(always)]
    fn new(corners: &Corners, area: &[i64; GROUP]) -> Self {
        let none = [[0.0; GROUP]; 2];
        let mut frames = Self { x: none, y: none, scale: [0.0; GROUP], to_centre: none, anchor: [[0; GROUP]; 2] };
        for lane in 0..GROUP {
            let (fx, fy) = (&corners.fx, &corners.fy);
            let frame = PlaneFrame::new([[fx[0][lane], fy[0][lane]], [fx[1][lane], fy[1][lane]], [fx[2][lane], fy[2][lane]]], area[lane]);
            for i in 0..2 {
                frames.x[i][lane] = frame.x[i];
                frames.y[i][lane] = frame.y[i];
                frames.to_centre[i][lane] = frame.to_centre[i];
                frames.anchor[i][lane] = frame.anchor[i];
            }
            frames.scale[lane] = frame.scale;
        }
        frames
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> PlaneFrame {
        PlaneFrame {
            x: [self.x[0][lane], self.x[1][lane]],
            y: [self.y[0][lane], self.y[1][lane]],
            scale: self.scale[lane],
            to_centre: [self.to_centre[0][lane], self.to_centre[1][lane]],
            anchor: [self.anchor[0][lane], self.anchor[1][lane]],
        }
    }

    /// The planes through three values at the corners, `[corner][lane]`.
    #[inline(always)]
    fn planes(&self, values: &[[f32; GROUP]; 3]) -> Planes {
        let mut planes = [[0.0; GROUP]; 3];
        for lane in 0..GROUP {
            let plane = self.get(lane).plane([values[0][lane], values[1][lane], values[2][lane]]);
            planes[0][lane] = plane[0];
            planes[1][lane] = plane[1];
            planes[2][lane] = plane[2];
        }
        Planes(planes)
    }
}

/// Depth or weight planes of sixteen triangles: at the anchor, per pixel right, per pixel down.
struct Planes([[f32; GROUP]; 3]);

impl Planes {
    const NONE: Self = Self([[0.0; GROUP]; 3]);

    #[inline(always)]
    fn get(&self, lane: usize) -> [f32; 3] {
        [self.0[0][lane], self.0[1][lane], self.0[2][lane]]
    }
}

impl Emitter<'_> {
    /// Sets up all triangles of a part.
    #[inline(always)]
    pub fn triangles<S: Simd>(&mut self, simd: S, primitives: &[[u32; 3]], ids: Ids<'_>) {
        let rules = self.pipeline.rules;
        if self.observer.is_some() || rules.depth_plane != DepthPlane::Reference || rules.setup_from != SetupFrom::Snapped {
            for (i, primitive) in primitives.iter().enumerate() {
                self.triangle(*primitive, ids.get(i));
            }
            return;
        }
        for (group, primitives) in primitives.chunks(GROUP).enumerate() {
            let corners = self.corners(primitives);
            let setup = self.set_up(simd, &corners, primitives.len());
            self.emit(&setup, &corners, primitives, ids, group * GROUP);
        }
    }

    #[inline(always)]
    fn corners(&self, primitives: &[[u32; 3]]) -> Corners {
        let zero = [[0; GROUP]; 3];
        let mut corners = Corners { fx: zero, fy: zero, z: [[0.0; GROUP]; 3], any: [0; GROUP], all: [0; GROUP] };
        for (lane, primitive) in primitives.iter().enumerate() {
            let (mut any, mut all) = (0, !0);
            for (corner, &vertex) in primitive.iter().enumerate() {
                let (group, at) = (&self.window.groups[vertex as usize / GROUP], vertex as usize % GROUP);
                corners.fx[corner][lane] = group.fx[at];
                corners.fy[corner][lane] = group.fy[at];
                corners.z[corner][lane] = group.z[at];
                any |= group.outcode[at];
                all &= group.outcode[at];
            }
            corners.any[lane] = any;
            corners.all[lane] = all;
        }
        corners
    }

    /// Rejects, culls and sets up the first `count` lanes, and counts the triangles that are dropped.
    #[inline(always)]
    fn set_up<S: Simd>(&mut self, simd: S, corners: &Corners, count: usize) -> Setup {
        let zero = i32x16::splat(simd, 0);
        let (any, all) = (i32x16::load_array(simd, corners.any), i32x16::load_array(simd, corners.all));
        let [x0, x1, x2] = lanes(simd, &corners.fx);
        let [y0, y1, y2] = lanes(simd, &corners.fy);
        let min_x = x0.min(x1).min(x2);
        let max_x = x0.max(x1).max(x2);
        let min_y = y0.min(y1).min(y2);
        let max_y = y0.max(y1).max(y2);

        let used = if count == GROUP { 0xffff } else { (1u32 << count) - 1 };
        let rejected =
            used & (bits(!(any & i32::from(outside::NAN)).simd_eq(zero)) | bits(!(all & i32::from(outside::FRUSTUM)).simd_eq(zero)));
        let unclipped = used & !rejected & bits((any & i32::from(self.view.clip_mask())).simd_eq(zero));
        let small = bits((max_x - min_x).simd_lt(i32x16::splat(simd, SMALL)) & (max_y - min_y).simd_lt(i32x16::splat(simd, SMALL)));

        let mut area = [0; GROUP];
        let (mut positive, mut negative) = (0, 0);
        for lane in 0..GROUP {
            let from_first = |at: &[[i32; GROUP]; 3], corner: usize| i64::from(at[corner][lane]) - i64::from(at[0][lane]);
            let (bx, cx) = (from_first(&corners.fx, 1), from_first(&corners.fx, 2));
            let (by, cy) = (from_first(&corners.fy, 1), from_first(&corners.fy, 2));
            // The product wraps only if a corner is out of range, and then the triangle will be clipped.
            area[lane] = bx.wrapping_mul(cy).wrapping_sub(cx.wrapping_mul(by));
            positive |= u32::from(area[lane] > 0) << lane;
            negative |= u32::from(area[lane] < 0) << lane;
        }
        let flat = unclipped & !(positive | negative);
        let state = &self.pipeline.desc.primitive;
        let front = if state.front_face == FrontFace::Ccw { negative } else { positive };
        let culled = unclipped
            & !flat
            & match state.cull_mode {
                Some(Face::Front) => front,
                Some(Face::Back) => !front,
                None => 0,
            };

        // Pixels whose centres lie in the bounding box, as in `setup::pixel_bounds`.
        let own = [(min_x + (HALF - 1)) >> 8, (min_y + (HALF - 1)) >> 8, (max_x - HALF) >> 8, (max_y - HALF) >> 8];
        let bounds = self.scissored(own);
        let cut = !bits(bounds[0].simd_eq(own[0]) & bounds[1].simd_eq(own[1]) & bounds[2].simd_eq(own[2]) & bounds[3].simd_eq(own[3]));
        let covers = bits(bounds[0].simd_le(bounds[2]) & bounds[1].simd_le(bounds[3]));
        let empty = unclipped & !flat & !culled & !covers;
        let visible = unclipped & !flat & !culled & covers;

        let statistics = &mut self.out.statistics;
        let clipped = used & !rejected & !unclipped;
        statistics.clipper_invocations += u64::from((used & !clipped).count_ones());
        statistics.clipper_primitives_out += u64::from(unclipped.count_ones());
        statistics.primitives_rejected += u64::from(rejected.count_ones());
        statistics.primitives_zero_area += u64::from(flat.count_ones());
        statistics.primitives_culled += u64::from(culled.count_ones());
        statistics.primitives_without_samples += u64::from(empty.count_ones());

        let (ox, oy) = ((bounds[0] >> 6) << 14, (bounds[1] >> 6) << 14);
        let clockwise = mask32x16::from_bitmask(simd, u64::from(positive));
        let cx = [x0, Select::select(clockwise, x1, x2), Select::select(clockwise, x2, x1)];
        let cy = [y0, Select::select(clockwise, y1, y2), Select::select(clockwise, y2, y1)];
        let none = [[0; GROUP]; 3];
        let mut setup = Setup {
            drawn: visible & small,
            large: visible & !small,
            clipped,
            front,
            cut,
            area,
            bounds: [bounds[0].into(), bounds[1].into(), bounds[2].into(), bounds[3].into()],
            a: none,
            b: none,
            c: none,
        };
        for i in 0..3 {
            let to = (i + 1) % 3;
            let (a, b) = (cy[i] - cy[to], cx[to] - cx[i]);
            let top_left = a.simd_gt(zero) | (a.simd_eq(zero) & b.simd_gt(zero));
            let k = a * (ox - cx[i] + HALF) + b * (oy - cy[i] + HALF) - Select::select(top_left, zero, i32x16::splat(simd, 1));
            setup.a[i] = a.into();
            setup.b[i] = b.into();
            setup.c[i] = (k >> 8).into();
        }
        setup
    }

    /// Makes the tile primitives, in submission order.
    #[inline(always)]
    fn emit(&mut self, setup: &Setup, corners: &Corners, primitives: &[[u32; 3]], ids: Ids<'_>, first: usize) {
        let (needs_depth, attributes) = (self.needs_depth(), self.pipeline.fragment.attributes);
        let frames = Frames::new(corners, &setup.area);
        let z = if needs_depth { frames.planes(&corners.z) } else { Planes::NONE };
        let (mut l1, mut l2) = (Planes::NONE, Planes::NONE);
        if attributes {
            let (zero, one) = ([0.0; GROUP], [1.0; GROUP]);
            l1 = frames.planes(&[zero, one, zero]);
            l2 = frames.planes(&[zero, zero, one]);
        }
        let mut left = setup.drawn | setup.large | setup.clipped;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            let id = ids.get(first + lane);
            if setup.drawn >> lane & 1 == 0 {
                if setup.clipped >> lane & 1 == 1 {
                    self.triangle(primitives[lane], id);
                } else {
                    self.unclipped_triangle(primitives[lane], id);
                }
                continue;
            }
            let front = setup.front >> lane & 1 == 1;
            let mut flags = if front { 0 } else { flag::BACK };
            if setup.cut >> lane & 1 == 1 {
                flags |= flag::RECT;
            }
            let anchor = [frames.anchor[0][lane], frames.anchor[1][lane]];
            let mut plane = ZPlane { anchor, ..ZPlane::default() };
            if needs_depth {
                [plane.base, plane.dx, plane.dy] = z.get(lane);
                let corner_z = [corners.z[0][lane], corners.z[1][lane], corners.z[2][lane]];
                let bias = self.depth_bias(max_slope(&plane), corner_z);
                plane.base += bias;
                // An upper bound on the distance from the anchor. A larger bound only requests a clamp that changes nothing.
                let pixels = (2 * (SMALL >> 8)) as f32 + plane.anchor_slack();
                if plane.may_leave(self.view.depth_range, corner_z, bias, pixels) {
                    flags |= flag::CLAMP_Z;
                }
            }
            let entry = self.out.attributes.len() as u32;
            if attributes {
                let [v0, v1, v2] = primitives[lane];
                self.out.attributes.push(PrimitiveAttributes {
                    anchor: [anchor[0] as f32, anchor[1] as f32],
                    l1: l1.get(lane),
                    l2: l2.get(lane),
                    inv_w: [self.window.inv_w(v0), self.window.inv_w(v1), self.window.inv_w(v2)],
                    varyings: [self.varyings_of(v0), self.varyings_of(v1), self.varyings_of(v2)],
                    primitive_id: id,
                    front_facing: front,
                    is_point: false,
                });
            }
            let edge = |from: &[[i32; GROUP]; 3]| [from[0][lane], from[1][lane], from[2][lane]];
            let bounds = [setup.bounds[0][lane], setup.bounds[1][lane], setup.bounds[2][lane], setup.bounds[3][lane]];
            self.bin_small(
                bounds,
                edge(&setup.a),
                edge(&setup.b),
                edge(&setup.c),
                TilePrimitive {
                    z: [plane.base, plane.dx, plane.dy],
                    anchor: [plane.anchor[0] as i16, plane.anchor[1] as i16],
                    draw: self.draw,
                    attributes: entry,
                    sequence: self.out.sequence,
                    flags,
                    ..TilePrimitive::default()
                },
            );
            self.out.sequence += 1;
        }
    }
}

#[inline(always)]
fn lanes<S: Simd>(simd: S, corners: &[[i32; GROUP]; 3]) -> [i32x16<S>; 3] {
    [i32x16::load_array(simd, corners[0]), i32x16::load_array(simd, corners[1]), i32x16::load_array(simd, corners[2])]
}
