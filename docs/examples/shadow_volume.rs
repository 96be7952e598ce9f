//! Shadow volumes: the stencil counts how many shadows each visible point is in, and light is added where the count is low.

use nephroid_pipeline::prelude::*;

const COLOR: TextureFormat = TextureFormat::Rgba8UnormSrgb;
const DEPTH: TextureFormat = TextureFormat::Depth24PlusStencil8;

/// Clip position of a point in the world (y up): seen from 53° above the ground, 6 away from the origin, between depths 2 and 16, lens shifted.
fn clip([x, y, z]: [f32; 3]) -> [f32; 4] {
    let depth = 6.0 - 0.8 * y - 0.6 * z;
    [3.0 * x + 0.3 * depth, 3.0 * (0.6 * y - 0.8 * z) - 0.4 * depth, (depth - 2.0) * 16.0 / 14.0, depth]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::new(DeviceOptions::default())?;
    let mut canvas = Canvas::new(&device, (512, 512), &[COLOR], Some(DEPTH))?;
    // Every draw adds its colour times the blend constant to what is there, or replaces it.
    let pipeline = |write, compare, [front, back]: [StencilFaceState; 2], dst_factor| {
        canvas.pipeline(Program::vertex_color(), |desc| {
            desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x4; 2])];
            let stencil = StencilState { front, back, read_mask: 0xff, write_mask: 0xff };
            desc.depth_stencil = Some(DepthStencilState { depth_write_enabled: Some(write), stencil, ..depth_test(DEPTH, compare) });
            let blend = BlendComponent { src_factor: BlendFactor::Constant, dst_factor, operation: BlendOperation::Add };
            desc.targets = vec![Some(ColorTargetState { blend: Some(BlendState { color: blend, alpha: blend }), ..COLOR.into() })];
        })
    };
    // Between the eye and a point, front faces enter volumes and back faces leave them: what remains is how many the point is in.
    let face = |compare, pass_op| StencilFaceState { compare, pass_op, ..StencilFaceState::IGNORE };
    let count = [StencilOperation::IncrementWrap, StencilOperation::DecrementWrap].map(|pass_op| face(CompareFunction::Always, pass_op));
    let ambient = pipeline(true, CompareFunction::Less, [StencilFaceState::IGNORE; 2], BlendFactor::Zero)?;
    let volumes = pipeline(false, CompareFunction::Less, count, BlendFactor::One)?;
    let sun = pipeline(false, CompareFunction::Equal, [face(CompareFunction::GreaterEqual, StencilOperation::Keep); 2], BlendFactor::One)?;
    // The ground and two squares above it, each with its volume: the square itself, carried along the light until it is below the ground.
    let (gray, red, blue) = ([0.7, 0.7, 0.6, 1.0], [0.8, 0.1, 0.05, 1.0], [0.05, 0.3, 0.7, 1.0]);
    let squares = [([0.0f32; 3], 7.0, gray), ([-0.85, 0.7, -0.5], 0.8, red), ([-0.5, 1.3, -1.0], 0.6, blue)];
    let (mut scene, mut sides) = (Vec::new(), Vec::new());
    for ([x, y, z], half, color) in squares {
        let corner = |number: usize| {
            let [u, v] = [[-half, half], [half, half], [half, -half], [-half, -half]][number % 4];
            let fall = (number / 4) as f32 * (y + 0.1);
            [clip([x + u + 0.5 * fall, y - fall, z + v + 0.25 * fall]), color]
        };
        let faces = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]; // counter-clockwise from outside
        let triangles = faces.map(|[a, b, c, d]| [a, b, c, a, c, d].map(corner));
        scene.extend(triangles[0]);
        sides.extend(triangles.concat());
    }
    let vertices = Buffer::from_slice(&[scene, sides].concat());
    let buffers = [VertexBuffer { buffer: &vertices, offset: 0 }];
    let draw = |pipeline, vertices, light, stencil_reference| {
        let draw = Draw::new(pipeline, Bindings::default(), vertices, (512, 512));
        Draw { vertex_buffers: &buffers, blend_constant: [light; 4], stencil_reference, ..draw }
    };
    let lights = [draw(&sun, 0..18, 0.55, 0), draw(&sun, 0..18, 0.25, 1)]; // where the reference is at least the count
    canvas.draw([vec![draw(&ambient, 0..18, 0.2, 0), draw(&volumes, 18..126, 0.0, 0)], lights.into()].concat())?;
    // On the ground at z = -0.2 (row 338), one shadow is over x = -1.3..0.3 and one over -0.45..0.75. The columns are those of -0.6, 0.1, 0.5, 1.2.
    assert_eq!([257, 345, 396, 483].map(|x| canvas.stencil(x, 338)), [1, 2, 1, 0]);
    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, Into::into);
    Ok(std::fs::write(folder.join("shadow_volume.ppm"), canvas.ppm(0))?)
}
