//! What a light sees of planes, against rays in 64 bits; of several surfaces, which one, and with which index.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec2, Vec3};
use nephroid::frame::{CpuExecutor, Executor as _, Frame};
use nephroid::geom::Mesh;
use nephroid::geom::shapes::{Grid, UvSphere};
use nephroid::pipeline::{Buffer, Texture};
use nephroid::scene::{Albedo, Material};

use nephroid::passes::light_buffer::{Keep, SurfaceDraw, SurfaceUniform, add};
use nephroid::passes::light_view::{LightView, Pyramid};
use nephroid::passes::shadow_map::LightUniform;
use nephroid::passes::shape_operator::{ShapeOperator, view_axes};

use super::executor;
use crate::support::shared_passes::{CURVATURE, surface};

/// A size of no round number.
const SIZE: (u32, u32) = (53, 37);

/// Position, normal, material, depth and curvature.
struct Seen([Texture; 5]);

impl Seen {
    fn of(view: &LightView, size: (u32, u32), draws: impl FnOnce(&mut Frame) -> Vec<SurfaceDraw>) -> Self {
        Self::keeping(Keep::Nearest, view, size, draws)
    }

    fn keeping(keep: Keep, view: &LightView, size: (u32, u32), draws: impl FnOnce(&mut Frame) -> Vec<SurfaceDraw>) -> Self {
        let mut frame = Frame::default();
        let draws = draws(&mut frame);
        let buffer = add(&mut frame, "light_buffer", view, size, keep, &draws);
        let mut executor: CpuExecutor = executor();
        let output = executor.run(&frame, None).expect("the frame runs");
        Self([buffer.position, buffer.normal, buffer.material, buffer.depth, buffer.curvature].map(|id| output.texture(id).clone()))
    }

    fn texel(&self, target: usize, x: u32, y: u32) -> [f64; 4] {
        let surface = self.0[target].surface(0, 0);
        std::array::from_fn(|channel| if channel < surface.channels { f64::from(surface.get(x, y, channel)) } else { 0.0 })
    }
}

/// Right, up and back of an eye that looks along a direction.
fn basis(direction: Vec3, up: Vec3) -> [DVec3; 3] {
    let back = -direction.as_dvec3().normalize();
    let right = up.as_dvec3().cross(back).normalize();
    [right, back.cross(right), back]
}

/// A plane: a point and its unit normal.
#[derive(Clone, Copy)]
struct Plane(DVec3, DVec3);

impl Plane {
    fn hit(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        origin + direction * ((self.0 - origin).dot(self.1) / direction.dot(self.1))
    }
}

/// A plane as the light sees it at a place in pixels: position and depth.
type Truth<'a> = &'a dyn Fn(f64, f64) -> (DVec3, f64);

/// How far the buffer is from the truth in position and depth, in units of what 1/128 pixel makes, where 1/256 is what snapping vertices allows.
fn error(seen: &Seen, (width, height): (u32, u32), truth: Truth<'_>) -> f64 {
    let mut worst = 0.0;
    for y in 0..height {
        for x in 0..width {
            let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (position, depth) = truth(px, py);
            let aside = [truth(px + 1.0 / 128.0, py), truth(px, py + 1.0 / 128.0)];
            let allowed = aside.iter().fold((1.0e-5, 1.0e-6), |sum, (p, d)| (sum.0 + p.distance(position), sum.1 + (d - depth).abs()));
            let [px, py, pz, hit] = seen.texel(0, x, y);
            let off = (DVec3::new(px, py, pz).distance(position) / allowed.0).max((seen.texel(3, x, y)[0] - depth).abs() / allowed.1);
            worst = if hit == 1.0 && off <= worst {
                worst
            } else if hit == 1.0 && off.is_finite() {
                off
            } else {
                f64::INFINITY
            };
        }
    }
    worst
}

/// A square of 200 m around a place, turned.
fn square(frame: &mut Frame, turn: Quat, offset: Vec3, with: SurfaceUniform) -> SurfaceDraw {
    let grid = Grid { size_m: Vec2::splat(200.0), cells: glam::UVec2::splat(20) }.mesh().expect("a grid");
    surface(frame, &grid, (turn, offset), with)
}

/// A turn about a skew axis, from exact numbers.
fn leaning() -> Quat {
    Quat::from_xyzw(0.125, 0.25, -0.1875, 0.9375).normalize()
}

fn grey() -> SurfaceUniform {
    (&Material::Diffuse { albedo: Albedo::Solid(Vec3::new(0.25, 0.5, 0.75)) }).into()
}

#[test]
fn parallel_light_sees_a_plane_where_its_rays_meet_it() {
    let (min, max) = (Vec3::new(-2.0, -1.0, -9.0), Vec3::new(1.5, 1.25, 7.0));
    let (direction, up) = (Vec3::new(0.3, -1.0, 0.2), Vec3::Z);
    let view = LightView::parallel(direction, up, min, max).expect("a box");
    let offset = Vec3::new(0.5, -1.0, 0.25);
    let plane = Plane(offset.as_dvec3(), (leaning() * Vec3::Y).as_dvec3());
    let [right, up, back] = basis(direction, up);
    let truth_of = |plane: Plane| {
        move |px: f64, py: f64| {
            let (min, max) = (min.as_dvec3(), max.as_dvec3());
            let x = min.x + px / f64::from(SIZE.0) * (max.x - min.x);
            let y = max.y - py / f64::from(SIZE.1) * (max.y - min.y);
            let position = plane.hit(right * x + up * y, -back);
            (position, (max.z - position.dot(back)) / (max.z - min.z))
        }
    };
    let seen = Seen::of(&view, SIZE, |frame| vec![square(frame, leaning(), offset, grey())]);
    let off = error(&seen, SIZE, &truth_of(plane));
    assert!(off < 1.0, "{off}");
    let lower = Plane(plane.0 - DVec3::Y * 0.01, plane.1);
    assert!(error(&seen, SIZE, &truth_of(lower)) > 10.0, "a centimetre is noticed");
    for (x, y) in [(0, 0), (26, 18), (52, 36)] {
        let [nx, ny, nz, kind] = seen.texel(1, x, y);
        assert!(DVec3::new(nx, ny, nz).distance(plane.1) < 1.0e-6 && kind == 1.0);
        assert_eq!(seen.texel(2, x, y), [0.25, 0.5, 0.75, 0.0]);
    }
}

#[test]
fn light_from_a_point_sees_a_plane_through_any_opening() {
    for (fov_deg, size) in [(30.0_f32, SIZE), (90.0, (64, 64)), (150.0, (40, 80))] {
        let aspect = size.0 as f32 / size.1 as f32;
        let fov = fov_deg.to_radians();
        let pyramid = Pyramid {
            position_ws: Vec3::new(0.25, 3.0, -0.5),
            axis_ws: Vec3::new(0.1, -2.0, 0.05),
            up_ws: Vec3::X,
            fov_y_rad: fov,
            aspect,
            near_m: 0.25,
            far_m: 40.0,
        };
        let view = LightView::point(&pyramid).expect("a pyramid");
        let turn = Quat::from_xyzw(0.02, 0.1, -0.015, 1.0).normalize();
        let plane = Plane(DVec3::ZERO, (turn * Vec3::Y).as_dvec3());
        let [right, up, back] = basis(pyramid.axis_ws, pyramid.up_ws);
        let truth_of = |plane: Plane| {
            let tan = libm::tan(0.5 * f64::from(fov));
            move |px: f64, py: f64| {
                let x = (px / f64::from(size.0) * 2.0 - 1.0) * tan * f64::from(aspect);
                let y = (1.0 - py / f64::from(size.1) * 2.0) * tan;
                let eye = pyramid.position_ws.as_dvec3();
                let position = plane.hit(eye, right * x + up * y - back);
                let distance = (eye - position).dot(back);
                let (near, far) = (f64::from(pyramid.near_m), f64::from(pyramid.far_m));
                (position, far * (distance - near) / (distance * (far - near)))
            }
        };
        let seen = Seen::of(&view, size, |frame| vec![square(frame, turn, Vec3::ZERO, grey())]);
        let off = error(&seen, size, &truth_of(plane));
        assert!(off < 1.0, "{fov_deg}: {off}");
        assert!(error(&seen, size, &truth_of(Plane(plane.0 + DVec3::Y * 0.05, plane.1))) > 3.0, "{fov_deg}");
    }
}

#[test]
fn kinds_and_indices_are_those_of_the_side_that_is_lit() {
    let from_above = LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::splat(-1.0), Vec3::splat(1.0)).expect("a box");
    let from_below = LightView::parallel(Vec3::Y, Vec3::Z, Vec3::splat(-1.0), Vec3::splat(1.0)).expect("a box");
    let mirror: SurfaceUniform = (&Material::Mirror { reflectance: Vec3::new(0.5, 0.25, 1.0) }).into();
    let glass: SurfaceUniform = (&Material::Dielectric { ior: 1.5, abbe: None, absorption: Vec3::ZERO }).into();
    // Surface, 1 + kind, albedo, index from above and from below.
    let cases = [
        (grey(), 1.0, [0.25, 0.5, 0.75], 0.0, 0.0),
        (mirror, 2.0, [0.5, 0.25, 1.0], 0.0, 0.0),
        (glass, 3.0, [0.0; 3], 1.5, f64::from(1.0_f32 / 1.5)),
        (SurfaceUniform::water(1.333), 4.0, [0.0; 3], f64::from(1.333_f32), f64::from(1.0_f32 / 1.333)),
    ];
    for (with, kind, [r, g, b], above, below) in cases {
        for (view, index, up) in [(&from_above, above, 1.0), (&from_below, below, -1.0)] {
            let seen = Seen::of(view, (8, 8), |frame| vec![square(frame, Quat::IDENTITY, Vec3::ZERO, with)]);
            assert_eq!(seen.texel(1, 3, 5), [0.0, up, 0.0, kind]);
            assert_eq!(seen.texel(2, 3, 5), [r, g, b, index]);
        }
    }
}

#[test]
fn the_nearest_surface_is_kept_and_nothing_is_zeros() {
    let view = LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::new(-2.0, -2.0, -4.0), Vec3::new(2.0, 2.0, 4.0)).expect("a box");
    let ball = UvSphere { radius_m: 1.0, slices: 64, stacks: 32 }.mesh().expect("a ball");
    let small = Grid { size_m: Vec2::splat(3.0), ..Grid::default() }.mesh().expect("a grid");
    let orders: [[usize; 3]; 2] = [[0, 1, 2], [2, 1, 0]];
    for order in orders {
        let seen = Seen::of(&view, (64, 64), |frame| {
            let water = surface(frame, &small, (Quat::IDENTITY, Vec3::Y * 0.75), SurfaceUniform::water(1.333));
            let floor = surface(frame, &small, (Quat::IDENTITY, Vec3::Y * -1.0), grey());
            let glass = surface(frame, &ball, (Quat::IDENTITY, Vec3::ZERO), SurfaceUniform::glass(1.5, Vec3::ZERO));
            let all = [water, floor, glass];
            order.map(|k| all[k].clone()).to_vec()
        });
        for y in 0..64 {
            for x in 0..64 {
                let (wx, wz) = ((f64::from(x) + 0.5) / 16.0 - 2.0, (f64::from(y) + 0.5) / 16.0 - 2.0);
                let square = wx * wx + wz * wz;
                // The sphere stands out of the water within √(1 − 0.75²).
                let rim = 1.0 - 0.75 * 0.75;
                let [_, height, _, hit] = seen.texel(0, x, y);
                let index = seen.texel(2, x, y)[3];
                if square < rim - 0.05 {
                    assert!((height - (1.0 - square).sqrt()).abs() < 0.01 && index == 1.5, "({x}, {y}): {height} {index}");
                } else if square > rim + 0.05 && wx.abs().max(wz.abs()) < 1.5 {
                    assert!((height - 0.75).abs() < 1.0e-6 && index == f64::from(1.333_f32), "({x}, {y}): {height} {index}");
                } else if wx.abs().max(wz.abs()) > 1.5 {
                    assert_eq!(hit, 0.0);
                    for target in 0..3 {
                        assert_eq!(seen.texel(target, x, y), [0.0; 4]);
                    }
                    assert_eq!(seen.texel(3, x, y)[0], 1.0);
                }
            }
        }
    }
}

/// Where parallel light leaves a ball of glass: the far half, from inside.
#[test]
fn the_farthest_surface_is_where_light_leaves_a_body() {
    let view = LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::splat(-2.0), Vec3::splat(2.0)).expect("a box");
    let ball = UvSphere { radius_m: 1.0, slices: 64, stacks: 32 }.mesh().expect("a ball");
    let seen = |keep| {
        Seen::keeping(keep, &view, (64, 64), |frame| {
            vec![surface(frame, &ball, (Quat::IDENTITY, Vec3::ZERO), SurfaceUniform::glass(1.5, Vec3::ZERO))]
        })
    };
    let [nearest, farthest] = [seen(Keep::Nearest), seen(Keep::Farthest)];
    // One body has one back.
    let back = seen(Keep::NearestBack);
    assert!((0..64).all(|i| (0..5).all(|target| target == 3 || back.texel(target, 32, i) == farthest.texel(target, 32, i))));
    for y in 0..64 {
        for x in 0..64 {
            let [wx, wz] = [x, y].map(|i| (f64::from(i) + 0.5) / 16.0 - 2.0);
            let square = wx * wx + wz * wz;
            let half = (1.0 - square).sqrt();
            if square < 0.9 {
                for (seen, side, index) in [(&nearest, 1.0, 1.5), (&farthest, -1.0, f64::from(1.0_f32 / 1.5))] {
                    let [px, py, pz, _] = seen.texel(0, x, y);
                    assert!((py - side * half).abs() < 0.01, "({x}, {y}): {py}");
                    assert!((seen.texel(3, x, y)[0] - (2.0 - py) / 4.0).abs() < 1.0e-4);
                    assert_eq!(seen.texel(4, x, y)[0], side * f64::from(CURVATURE));
                    // The ball's outward normal is its position; it is turned where light comes from inside.
                    let [nx, ny, nz, _] = seen.texel(1, x, y);
                    assert!((DVec3::new(nx, ny, nz) - DVec3::new(px, py, pz) * side).length() < 0.02 && ny > 0.0);
                    assert_eq!(seen.texel(2, x, y)[3], index);
                }
            } else if square > 1.1 {
                assert_eq!([nearest.texel(3, x, y)[0], farthest.texel(3, x, y)[0]], [1.0, 0.0]);
                assert_eq!(farthest.texel(0, x, y), [0.0; 4]);
            }
        }
    }
}

#[test]
fn vertices_can_be_drawn_without_indices() {
    let view = LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::splat(-1.0), Vec3::splat(1.0)).expect("a box");
    let flat = Grid { size_m: Vec2::splat(4.0), ..Grid::default() }.mesh().expect("a grid");
    let of = |all: &[Vec3]| flat.indices.iter().map(|index| all[*index as usize]).collect();
    let loose = Mesh { positions: of(&flat.positions), normals: of(&flat.normals), ..Mesh::default() };
    let seen = |indexed: bool| {
        Seen::of(&view, (16, 16), |frame| {
            let mesh = if indexed { &flat } else { &loose };
            let draw = surface(frame, mesh, (Quat::IDENTITY, Vec3::ZERO), grey());
            let count = mesh.positions.len() as u32;
            vec![if indexed { draw } else { SurfaceDraw { indices: None, range: 0..count, ..draw } }]
        })
    };
    let [indexed, loose] = [seen(true), seen(false)];
    for (a, b) in indexed.0.iter().zip(&loose.0) {
        assert_eq!(a.read_bytes(0, 0), b.read_bytes(0, 0));
    }
    assert_eq!(indexed.texel(0, 7, 7)[3], 1.0);
}

#[test]
fn the_view_of_a_shadow_map_is_taken_over() {
    let view = LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::splat(-1.0), Vec3::splat(1.0)).expect("a box");
    let LightView { clip_from_world, position_ws } = view;
    let light = LightUniform { clip_from_world, position_ws, ..bytemuck::Zeroable::zeroed() };
    assert_eq!(LightView::from(&light), view);
}

#[test]
fn views_that_are_none_are_refused() {
    assert!(LightView::parallel(Vec3::NEG_Y, Vec3::Y, Vec3::splat(-1.0), Vec3::splat(1.0)).is_none());
    assert!(LightView::parallel(Vec3::NEG_Y, Vec3::Z, Vec3::splat(1.0), Vec3::splat(1.0)).is_none());
    let good = Pyramid {
        position_ws: Vec3::ZERO,
        axis_ws: Vec3::NEG_Z,
        up_ws: Vec3::Y,
        fov_y_rad: 1.0,
        aspect: 1.0,
        near_m: 0.1,
        far_m: f32::INFINITY,
    };
    assert!(LightView::point(&good).is_some());
    for bad in [Pyramid { up_ws: Vec3::Z, ..good }, Pyramid { fov_y_rad: 3.2, ..good }, Pyramid { near_m: 0.0, ..good }] {
        assert!(LightView::point(&bad).is_none(), "{bad:?}");
    }
}

/// A ball bends alike everywhere: the forms of axes x and y are those of (1 − nnᵀ)/r. Turned inside out, they change their sign.
#[test]
fn forms_of_a_ball_are_those_of_its_normal() {
    let view =
        LightView::parallel(Vec3::new(0.3, -1.0, 0.2), Vec3::Z, Vec3::new(-1.0, -1.0, -3.0), Vec3::new(1.0, 1.0, 3.0)).expect("a box");
    let radius_m = 0.8;
    let [x, y] = view_axes(&view.clip_from_world).map(|axis| axis.as_dvec3());
    for (keep, sign) in [(Keep::Nearest, 1.0), (Keep::NearestBack, -1.0)] {
        let seen = Seen::keeping(keep, &view, SIZE, |frame| {
            let ball = UvSphere { radius_m, slices: 96, stacks: 48 }.mesh().expect("a ball");
            let operators: Vec<ShapeOperator> = ball
                .curvatures()
                .into_iter()
                .zip(&ball.normals)
                .map(|(curvature, normal)| ShapeOperator::new(curvature, *normal))
                .collect();
            let draw = surface(frame, &ball, (Quat::IDENTITY, Vec3::ZERO), SurfaceUniform::glass(1.5, Vec3::ZERO));
            vec![SurfaceDraw { operators: Some(frame.buffer("operators", Arc::new(Buffer::from_slice(&operators)))), ..draw }]
        });
        let mut count = 0;
        for (column, row) in (0..SIZE.0 * SIZE.1).map(|k| (k % SIZE.0, k / SIZE.0)) {
            let [nx, ny, nz, hit] = seen.texel(1, column, row);
            if hit == 0.0 {
                continue;
            }
            let n = DVec3::new(nx, ny, nz);
            // At the outline, interpolated normals can look away from a light that sees the face.
            if n.dot(view.position_ws.truncate().as_dvec3()) > -0.2 {
                continue;
            }
            let (a, b) = (n.dot(x), n.dot(y));
            let expected = [1.0 - a * a, -a * b, 1.0 - b * b].map(|form| sign * form / f64::from(radius_m));
            let [_, forms @ ..] = seen.texel(4, column, row);
            let off = (0..3).map(|k| (forms[k] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(off < 0.02, "{column} {row}: {forms:?} {expected:?}");
            count += 1;
        }
        assert!(count > 600, "{count}");
    }
}
