//! About 800,000 points, each added to four pixels of a float target: light that a round mirror reflects, whose bright edge is a nephroid.

use nephroid_pipeline::math::rng::uniform3;
use nephroid_pipeline::prelude::*;

/// What a point adds to each of its four pixels. A power of two: sums are exact, in any order.
const SHARE: f32 = 1.0 / 256.0;

struct Splat;

impl VertexShader for Splat {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        output.position = input.attribute(0);
        output.point_size = L::splat(input.token, 2.0); // pixels; a point of two pixels covers 2x2 centres, wherever it is
    }
}

impl FragmentShader for Splat {
    const PER_PRIMITIVE: bool = true; // the pipeline asks for one colour per point

    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = V4::from_array(input.token, [SHARE, 0.75 * SHARE, 0.5 * SHARE, 1.0]);
    }
}

/// A point of the light inside of a mirror of radius 1, after one reflection; `None` if it would be outside.
fn photon(index: u32) -> Option<[f32; 2]> {
    // Light along +x meets the mirror at height y, in (x, y). Its chord across the mirror is 2x long.
    let [y, along, _] = uniform3(1, 0, index).map(|number| 2.0 * number - 1.0);
    let (x, along) = ((1.0 - y * y).sqrt(), along + 1.0);
    let reflected = [1.0 - 2.0 * x * x, -2.0 * x * y];
    (along < 2.0 * x).then_some([x + along * reflected[0], y + along * reflected[1]])
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::new(DeviceOptions::default())?;
    let mut canvas = Canvas::new(&device, (512, 512), &[TextureFormat::Rgba32Float], None)?;
    let pipeline = canvas.pipeline(Program::new("splat", Splat, Splat), |desc| {
        desc.primitive.topology = PrimitiveTopology::PointList;
        desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x2])];
        desc.targets = vec![Some(ColorTargetState { blend: Some(ADDITIVE), ..TextureFormat::Rgba32Float.into() })];
    })?;
    let points: Vec<_> = (0..1 << 20).filter_map(photon).map(|at| at.map(|number| 0.95 * number)).collect();
    canvas.draw(vec![Draw {
        vertex_buffers: &[VertexBuffer { buffer: &Buffer::from_slice(&points), offset: 0 }],
        ..Draw::new(&pipeline, Bindings::default(), 0..points.len() as u32, canvas.size())
    }])?;

    // No light is lost or made: the target holds what the points brought, to the last bit.
    let sum: f64 = canvas.color(0).read_channel(0, 0, 0).into_iter().map(f64::from).sum();
    assert_eq!(sum, points.len() as f64 * f64::from(4.0 * SHARE));
    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, Into::into);
    Ok(std::fs::write(folder.join("splats.ppm"), canvas.ppm(0))?)
}
