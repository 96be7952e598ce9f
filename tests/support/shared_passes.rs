//! A frame with the passes that techniques share: two light buffers, both low passes, depth for a smaller target, and a composition.

#![allow(dead_code, reason = "no test binary uses all of it")]

use std::sync::Arc;

use glam::{Quat, Vec2, Vec3, Vec4};
use nephroid::frame::{Frame, TextureId};
use nephroid::geom::Mesh;
use nephroid::geom::shapes::{Cuboid, Grid, UvSphere};
use nephroid::passes::compose::{ByDepth, DistanceFromDepth, Layer};
use nephroid::passes::filter::Kernel;
use nephroid::passes::geometry_buffer::ReceiverVertex;
use nephroid::passes::light_buffer::{Keep, SurfaceDraw, SurfaceUniform};
use nephroid::passes::light_view::{LightView, Pyramid};
use nephroid::passes::rotating_filter::RotatingKernel;
use nephroid::passes::{compose, downsample, filter, light_buffer, rotating_filter};
use nephroid::pipeline::state::TextureFormat;
use nephroid::pipeline::{Buffer, TextureDescriptor};
use nephroid::scene::{Albedo, Material};

use super::numbers::Rng;

/// Size of the light buffers, texels.
pub const SIZE: (u32, u32) = (72, 56);

/// Adds a float texture whose texels, row by row, have these numbers.
pub fn texture(frame: &mut Frame, label: &str, (width, height): (u32, u32), format: TextureFormat, numbers: &[f32]) -> TextureId {
    let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    frame.texture_with(TextureDescriptor::d2(label, width, height, format), vec![bytes.into()])
}

/// So many numbers from 0 to 1, always the same.
pub fn noise(seed: u64, count: usize) -> Vec<f32> {
    let mut rng = Rng(seed);
    (0..count).map(|_| rng.f32(0.0, 1.0)).collect()
}

/// What the vertices of surfaces have as their curvature, 1/m.
pub const CURVATURE: f32 = 0.375;

/// Adds a mesh, turned and then moved.
pub fn surface(frame: &mut Frame, mesh: &Mesh, (turn, offset): (Quat, Vec3), surface: SurfaceUniform) -> SurfaceDraw {
    let vertices: Vec<ReceiverVertex> = (mesh.positions.iter().zip(&mesh.normals))
        .map(|(p, n)| ReceiverVertex { position_ws: (turn * *p + offset).extend(1.0), normal_ws: (turn * *n).extend(CURVATURE) })
        .collect();
    let indices: Vec<u32> = mesh.triangles().flatten().collect();
    SurfaceDraw {
        vertices: frame.buffer("vertices", Arc::new(Buffer::from_slice(&vertices))),
        indices: Some(frame.buffer("indices", Arc::new(Buffer::from_slice(&indices)))),
        range: 0..indices.len() as u32,
        surface,
        operators: None,
    }
}

/// The frame: passes `light_buffer 0` and `1`, `low pass`, `rotating`, `half depth` and `composed`.
pub fn frame() -> Frame {
    let mut frame = Frame::default();
    let checker = Material::Diffuse { albedo: Albedo::Checker { size_m: 0.5, even: Vec3::splat(0.75), odd: Vec3::new(0.25, 0.5, 0.125) } };
    let mirror = Material::Mirror { reflectance: Vec3::splat(0.875) };
    let floor = Grid { size_m: Vec2::splat(5.0), ..Grid::default() }.mesh().expect("a grid");
    let ball = UvSphere { radius_m: 0.6, slices: 16, stacks: 8 }.mesh().expect("a ball");
    let block = Cuboid { size_m: Vec3::new(0.7, 0.5, 0.9) }.mesh().expect("a block");
    let still = Quat::IDENTITY;
    let draws = [
        surface(&mut frame, &floor, (still, Vec3::ZERO), (&checker).into()),
        surface(&mut frame, &ball, (still, Vec3::new(0.6, 1.0, 0.1)), SurfaceUniform::glass(1.5, Vec3::ZERO)),
        surface(&mut frame, &block, (still, Vec3::new(-1.0, 0.3, -0.3)), (&mirror).into()),
    ];
    let pyramid = Pyramid {
        position_ws: Vec3::new(0.3, 3.0, 0.4),
        axis_ws: Vec3::new(-0.1, -1.0, 0.05),
        up_ws: Vec3::Z,
        fov_y_rad: 1.6,
        aspect: SIZE.0 as f32 / SIZE.1 as f32,
        near_m: 0.5,
        far_m: 8.0,
    };
    let point = LightView::point(&pyramid).expect("a pyramid");
    let seen = light_buffer::add(&mut frame, "light_buffer 0", &point, SIZE, Keep::Nearest, &draws);
    let box_ls = (Vec3::new(-2.5, -2.0, -3.0), Vec3::new(2.5, 2.0, 3.0));
    let sun = LightView::parallel(Vec3::new(0.5, -1.0, 0.25), Vec3::Y, box_ls.0, box_ls.1).expect("a box");
    light_buffer::add(&mut frame, "light_buffer 1", &sun, SIZE, Keep::Farthest, &draws);

    let specks = texture(&mut frame, "specks", (61, 47), TextureFormat::Rgba32Float, &noise(1, 61 * 47 * 4));
    filter::separable(&mut frame, "low pass", specks, &Kernel::gaussian(1.5, 5).expect("a kernel"));
    rotating_filter::rotating(&mut frame, "rotating", specks, &RotatingKernel::default());

    let half = (SIZE.0 / 2, SIZE.1 / 2);
    let layer_depth = downsample::depth(&mut frame, "half depth", seen.depth, half);
    let rays = texture(&mut frame, "rays", half, TextureFormat::Rgba32Float, &noise(2, (half.0 * half.1 * 4) as usize));
    let distance = DistanceFromDepth::perspective(pyramid.near_m, pyramid.far_m);
    let by_depth = Some(ByDepth { layer_depth, full_depth: seen.depth, distance, tolerance: 0.0625 });
    let layers =
        [Layer { texture: seen.material, scale: Vec4::ONE, by_depth: None }, Layer { texture: rays, scale: Vec4::splat(0.5), by_depth }];
    compose::add(&mut frame, TextureDescriptor::d2("composed", SIZE.0, SIZE.1, TextureFormat::Rgba32Float), &layers);
    frame
}
