//! What splats with a kernel cost: rates of the fast path, and of the general path, which the same draw takes under an occlusion query.

use std::sync::Arc;
use std::time::Instant;

use nephroid::math::float::exp;
use nephroid::math::lanes::Lanes;
use nephroid::math::vector::{V4, v4};
use nephroid::pipeline::shader::{
    Axis, Interpolation, Program, Separable, SeparableShader, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid::pipeline::state::{
    ADDITIVE, Color, ColorTargetState, ColorWrites, PrimitiveState, PrimitiveTopology, RasterRules, TextureFormat,
};
use nephroid::pipeline::{
    Binding, BindingKind, Bindings, Buffer, ColorAttachment, Device, DeviceOptions, Draw, LoadOp, Pass, RenderPipeline,
    RenderPipelineDescriptor, Texture, TextureDescriptor, run_pass,
};

use crate::shared::{FRAMES, SIZE, median, triangles, wanted};

/// A point of a given size; its varyings are the centre in pixels.
struct Centre {
    diameter: f32,
}

impl VertexShader for Centre {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let vertices: &[[f32; 4]] = bindings.storage(0);
        output.position = input.per_vertex4(|i| vertices[i as usize]);
        output.point_size = output.position.x.like(self.diameter);
        output.varyings[0] = (output.position.x * 0.5 + 0.5) * SIZE.0 as f32;
        output.varyings[1] = (output.position.y * -0.5 + 0.5) * SIZE.1 as f32;
    }
}

/// A Gaussian in one channel of one target.
struct Gaussian {
    falloff: f32,
}

impl SeparableShader for Gaussian {
    const TARGETS: usize = 1;
    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let t = at - flat[axis as usize];
        let bell = exp(t * t * -self.falloff);
        values[0] = v4(bell, bell, bell, bell);
    }
}

/// Four Gaussians and, in a second target, their four squares.
struct FourSizes;

impl SeparableShader for FourSizes {
    const TARGETS: usize = 2;
    #[inline(always)]
    fn factor<L: Lanes>(&self, _: &Bindings<'_>, flat: &[f32], axis: Axis, at: L, values: &mut [V4<L>; 8]) {
        let t = at - flat[axis as usize];
        let (zero, one) = (t.like(0.0), t.like(1.0));
        let (mut bells, mut inside) = ([zero; 4], [zero; 4]);
        for (k, diameter) in [3.0, 7.0, 11.0, 15.0_f32].into_iter().enumerate() {
            let within = t.abs().lt(t.like(0.5 * diameter));
            bells[k] = L::select(within, exp(t * t * (-8.0 / (diameter * diameter))), zero);
            inside[k] = L::select(within, one, zero);
        }
        values[0] = v4(bells[0], bells[1], bells[2], bells[3]);
        values[1] = v4(inside[0], inside[1], inside[2], inside[3]);
    }
}

fn pipeline(program: Program, formats: &[TextureFormat]) -> RenderPipeline {
    let target = |&format: &TextureFormat| Some(ColorTargetState { format, blend: Some(ADDITIVE), write_mask: ColorWrites::ALL });
    let program = Program {
        bindings: vec![BindingKind::Storage(16)],
        varyings: vec![Varying { name: "centre", components: 2, interpolation: Interpolation::Flat }],
        ..program
    };
    let desc = RenderPipelineDescriptor {
        primitive: PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() },
        targets: formats.iter().map(target).collect(),
        ..RenderPipelineDescriptor::new("splats", Arc::new(program))
    };
    RenderPipeline::new(desc, RasterRules::REFERENCE).expect("the pipeline is valid")
}

/// Median seconds of a pass.
fn time(device: &Device, pipeline: &RenderPipeline, formats: &[TextureFormat], points: &Buffer, count: u32, query: bool) -> f64 {
    let texture = |&format: &TextureFormat| Texture::new(TextureDescriptor::d2("splats", SIZE.0, SIZE.1, format)).expect("a texture");
    let mut textures: Vec<Texture> = formats.iter().map(texture).collect();
    let entries = [Binding::Storage(points)];
    let mut times = Vec::new();
    for _ in 0..FRAMES {
        let start = Instant::now();
        let load = LoadOp::Clear(Color { r: 0.0, g: 0.0, b: 0.0, a: 0.0 });
        let draw = Draw { query: query.then_some(0), ..Draw::new(pipeline, Bindings::new(&entries, 0), 0..count, SIZE) };
        let mut pass = Pass {
            label: "splats".into(),
            color: textures.iter_mut().map(|texture| Some(ColorAttachment { view: texture.view_mut(), load })).collect(),
            draws: vec![draw],
            query_count: usize::from(query),
            ..Pass::default()
        };
        run_pass(device, &mut pass, None).expect("the pass is valid");
        times.push(start.elapsed().as_secs_f64());
    }
    median(times)
}

/// Prints the table.
pub fn splats() {
    let device = Device::new(DeviceOptions::default()).expect("threads");
    println!("\n| Gaussian splats | fast path | general path |\n|---|---|---|");
    let (r, rgba) = (TextureFormat::R32Float, TextureFormat::Rgba32Float);
    let gaussian =
        |diameter: f32| Program::new("gaussian", Centre { diameter }, Separable(Gaussian { falloff: 8.0 / (diameter * diameter) }));
    let rows: [(&str, u32, Program, &[TextureFormat]); 6] = [
        ("3x3, one channel", 1_000_000, gaussian(3.0), &[r]),
        ("7x7, one channel", 500_000, gaussian(7.0), &[r]),
        ("7x7, four channels", 500_000, gaussian(7.0), &[rgba]),
        ("15x15, one channel", 250_000, gaussian(15.0), &[r]),
        ("31x31, one channel", 100_000, gaussian(31.0), &[r]),
        (
            "sizes 3, 7, 11 and 15 and their counts",
            250_000,
            Program::new("sizes", Centre { diameter: 15.0 }, Separable(FourSizes)),
            &[rgba, rgba],
        ),
    ];
    for (name, count, program, formats) in rows {
        if wanted(name) {
            let pipeline = pipeline(program, formats);
            let points = Buffer::from_slice(&triangles(SIZE, count, 9.0, 1));
            let rate = |query| f64::from(count) / 1.0e6 / time(&device, &pipeline, formats, &points, count, query);
            println!("| {name} | {:.2} M/s | {:.2} M/s |", rate(false), rate(true));
        }
    }
}
