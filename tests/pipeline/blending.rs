//! Blending: the vectors of `rendering/color_target_state.spec.ts` as tables, against the blend equation written out in f64.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v4};
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program};
use nephroid_pipeline::state::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, ColorTargetState, ColorWrites, RasterRules, TextureFormat,
};
use nephroid_pipeline::{
    Bindings, ColorTargetProblem, Draw, PipelineProblem, RenderPipeline, RenderPipelineDescriptor, linear_to_srgb8, srgb8_to_linear,
};

use super::passes::*;

const SOURCE: [f32; 4] = [0.11, 0.61, 0.81, 0.44];
const SOURCE1: [f32; 4] = [0.22, 0.41, 0.51, 0.33];
const CONSTANT: [f32; 4] = [0.91, 0.82, 0.73, 0.64];
const DESTINATIONS: [[f32; 4]; 2] = [[0.51, 0.22, 0.71, 0.33], [0.09, 0.73, 0.93, 0.81]];

/// The flat colour as output 0, [`SOURCE1`] as output 1.
struct TwoSources;

impl FragmentShader for TwoSources {
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let four = |c: [f32; 4]| -> V4<L> {
            let [x, y, z, w] = c.map(|v| L::splat(input.token, v));
            v4(x, y, z, w)
        };
        output.color[0] = four([0, 1, 2, 3].map(|scalar| input.flat(scalar)));
        output.color[1] = four(SOURCE1);
    }
}

fn fullscreen(color: [f32; 4]) -> [Vertex; 3] {
    [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| vertex([x, y, 0.5, 1.0], color))
}

fn blend_pipeline(format: TextureFormat, blend: Option<BlendState>, write_mask: ColorWrites) -> RenderPipeline {
    pipeline(pull_program(TwoSources, Interpolation::Flat), |desc| {
        desc.targets = vec![Some(ColorTargetState { format, blend, write_mask })]
    })
}

/// Clears to `destination`, draws `source`; what a pixel holds then.
fn blend_once(
    format: TextureFormat,
    blend: Option<BlendState>,
    write_mask: ColorWrites,
    source: [f32; 4],
    destination: [f32; 4],
    constant: [f32; 4],
) -> [f32; 4] {
    let pipeline = blend_pipeline(format, blend, write_mask);
    let vertices = Vertices::new(&fullscreen(source));
    let entries = vertices.entries();
    let mut canvas = Canvas::single((5, 3), format);
    canvas.clear = destination.map(f64::from);
    let draw = Draw { blend_constant: constant, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, (5, 3)) };
    canvas.run(vec![draw]);
    let pixel = canvas.pixel(0, 0, 0);
    assert_eq!(pixel, canvas.pixel(0, 4, 2), "every pixel is blended alike");
    pixel
}

use BlendFactor::*;

const FACTORS: [BlendFactor; 17] = [
    Zero,
    One,
    Src,
    OneMinusSrc,
    SrcAlpha,
    OneMinusSrcAlpha,
    Dst,
    OneMinusDst,
    DstAlpha,
    OneMinusDstAlpha,
    SrcAlphaSaturated,
    Constant,
    OneMinusConstant,
    Src1,
    OneMinusSrc1,
    Src1Alpha,
    OneMinusSrc1Alpha,
];

const OPERATIONS: [BlendOperation; 5] =
    [BlendOperation::Add, BlendOperation::Subtract, BlendOperation::ReverseSubtract, BlendOperation::Min, BlendOperation::Max];

/// The factor of channel `c`, from the specification's table.
fn factor(factor: BlendFactor, c: usize, destination: [f64; 4]) -> f64 {
    let [source, source1, constant] = [SOURCE, SOURCE1, CONSTANT].map(|v| v.map(f64::from));
    match factor {
        Zero => 0.0,
        One => 1.0,
        Src => source[c],
        OneMinusSrc => 1.0 - source[c],
        SrcAlpha => source[3],
        OneMinusSrcAlpha => 1.0 - source[3],
        Dst => destination[c],
        OneMinusDst => 1.0 - destination[c],
        DstAlpha => destination[3],
        OneMinusDstAlpha => 1.0 - destination[3],
        SrcAlphaSaturated if c == 3 => 1.0,
        SrcAlphaSaturated => source[3].min(1.0 - destination[3]),
        Constant => constant[c],
        OneMinusConstant => 1.0 - constant[c],
        Src1 => source1[c],
        OneMinusSrc1 => 1.0 - source1[c],
        Src1Alpha => source1[3],
        OneMinusSrc1Alpha => 1.0 - source1[3],
    }
}

fn blended(component: BlendComponent, c: usize, destination: [f64; 4]) -> f64 {
    let (s, d) = (f64::from(SOURCE[c]), destination[c]);
    let (fs, fd) = (factor(component.src_factor, c, destination), factor(component.dst_factor, c, destination));
    match component.operation {
        BlendOperation::Add => s * fs + d * fd,
        BlendOperation::Subtract => s * fs - d * fd,
        BlendOperation::ReverseSubtract => d * fd - s * fs,
        BlendOperation::Min => s.min(d),
        BlendOperation::Max => s.max(d),
    }
}

/// Every factor pair, operation and destination, for colour and for alpha, on two formats with their tolerances.
#[test]
fn blending_all_factors_and_operations() {
    let mut worst = 0.0f64;
    for (format, tolerance) in [(TextureFormat::Rgba16Float, 0.003), (TextureFormat::Rgba32Float, 3.0e-7)] {
        for src_factor in FACTORS {
            for dst_factor in FACTORS {
                for operation in OPERATIONS {
                    // Minimum and maximum ignore factors, and are refused with any but one.
                    let ignores = matches!(operation, BlendOperation::Min | BlendOperation::Max);
                    if ignores && (src_factor, dst_factor) != (One, One) {
                        continue;
                    }
                    let tested = BlendComponent { src_factor, dst_factor, operation };
                    let other = BlendComponent { src_factor: One, dst_factor: Zero, operation: BlendOperation::Add };
                    for (alpha, blend) in
                        [(false, BlendState { color: tested, alpha: other }), (true, BlendState { color: other, alpha: tested })]
                    {
                        for destination in DESTINATIONS {
                            let seen = blend_once(format, Some(blend), ColorWrites::ALL, SOURCE, destination, CONSTANT);
                            let destination = destination.map(f64::from);
                            for (c, value) in seen.into_iter().enumerate() {
                                let component = if (c == 3) == alpha { tested } else { other };
                                let expected = blended(component, c, destination);
                                let error = (f64::from(value) - expected).abs();
                                assert!(
                                    error <= tolerance,
                                    "{format:?} {tested:?}, alpha: {alpha}, channel {c}: {value}, expected {expected}"
                                );
                                if format == TextureFormat::Rgba32Float {
                                    worst = worst.max(error);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    println!("blending: greatest error on rgba32float {worst:e}");
}

const BLENDABLE: [TextureFormat; 10] = [
    TextureFormat::R8Unorm,
    TextureFormat::Rg8Unorm,
    TextureFormat::Rgba8Unorm,
    TextureFormat::Rgba8UnormSrgb,
    TextureFormat::R16Float,
    TextureFormat::Rg16Float,
    TextureFormat::Rgba16Float,
    TextureFormat::R32Float,
    TextureFormat::Rg32Float,
    TextureFormat::Rgba32Float,
];

fn plain_add() -> BlendState {
    let add = BlendComponent { src_factor: One, dst_factor: One, operation: BlendOperation::Add };
    BlendState { color: add, alpha: add }
}

#[test]
fn blending_formats() {
    for format in BLENDABLE {
        let seen = blend_once(format, Some(plain_add()), ColorWrites::ALL, [0.4; 4], [0.2; 4], [0.0; 4]);
        let channels = nephroid_pipeline::format_info(format).expect("supported").channels;
        for value in &seen[..channels] {
            assert!((value - 0.6).abs() < 0.005, "{format:?}: {seen:?}");
        }
    }
}

#[test]
fn blending_clamps_unorm_and_not_float() {
    let subtract = BlendComponent { src_factor: One, dst_factor: One, operation: BlendOperation::Subtract };
    let reverse = BlendComponent { operation: BlendOperation::ReverseSubtract, ..subtract };
    let table = [
        // Source, destination, blend, unclamped result.
        (0.8, 0.4, plain_add(), 1.2),
        (0.2, 0.7, BlendState { color: subtract, alpha: subtract }, -0.5),
        (0.7, 0.2, BlendState { color: reverse, alpha: reverse }, -0.5),
    ];
    for (source, destination, blend, result) in table {
        for format in BLENDABLE {
            let seen = blend_once(format, Some(blend), ColorWrites::ALL, [source; 4], [destination; 4], [0.0; 4])[0];
            let unorm = matches!(
                format,
                TextureFormat::R8Unorm | TextureFormat::Rg8Unorm | TextureFormat::Rgba8Unorm | TextureFormat::Rgba8UnormSrgb
            );
            let expected: f32 = if unorm { f32::clamp(result, 0.0, 1.0) } else { result };
            assert!((seen - expected).abs() < 0.003, "{format:?}: {source} and {destination}: {seen}, expected {expected}");
        }
    }
    // The source is clamped before it is blended, not only the result: 1 − 0.25, not 3 − 0.25.
    let seen = blend_once(
        TextureFormat::Rgba8Unorm,
        Some(BlendState { color: subtract, alpha: subtract }),
        ColorWrites::ALL,
        [3.0; 4],
        [0.25; 4],
        [0.0; 4],
    );
    assert!((seen[0] - 0.75).abs() < 0.005, "{seen:?}");
    // And so is the constant.
    let constant = BlendComponent { src_factor: Constant, dst_factor: Zero, operation: BlendOperation::Add };
    let blend = Some(BlendState { color: constant, alpha: constant });
    let seen = blend_once(TextureFormat::Rgba8Unorm, blend, ColorWrites::ALL, [0.5; 4], [0.0; 4], [2.0; 4]);
    assert!((seen[0] - 0.5).abs() < 0.005, "{seen:?}");
    let seen = blend_once(TextureFormat::Rgba16Float, blend, ColorWrites::ALL, [0.5; 4], [0.0; 4], [2.0; 4]);
    assert_eq!(seen, [1.0; 4]);
}

#[test]
fn blend_constant_set_per_draw_and_zero_by_default() {
    let component = BlendComponent { src_factor: Constant, dst_factor: Zero, operation: BlendOperation::Add };
    let pipeline = blend_pipeline(TextureFormat::Rgba32Float, Some(BlendState { color: component, alpha: component }), ColorWrites::ALL);
    let vertices = Vertices::new(&fullscreen([1.0; 4]));
    let entries = vertices.entries();
    let draw = |constant| Draw { blend_constant: constant, ..Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, (4, 4)) };
    let unset = Draw::new(&pipeline, Bindings::new(&entries, 0), 0..3, (4, 4));
    let mut canvas = Canvas::single((4, 4), TextureFormat::Rgba32Float);
    canvas.clear = [0.5; 4];
    canvas.run(vec![unset]);
    assert_eq!(canvas.pixel(0, 1, 1), [0.0; 4]);
    for constant in [[1.0, 1.0, 1.0, 1.0], [0.5, 0.25, 0.125, 1.0]] {
        canvas.run(vec![draw([0.75; 4]), draw(constant)]);
        assert_eq!(canvas.pixel(0, 1, 1), constant);
    }
}

#[test]
fn color_write_masks() {
    for bits in 0..16 {
        let mask = ColorWrites::from_bits_truncate(bits);
        for blend in [None, Some(plain_add())] {
            let (source, destination) = ([0.5, 0.25, 0.75, 1.0], [0.125, 0.5, 0.0625, 0.25]);
            let seen = blend_once(TextureFormat::Rgba32Float, blend, mask, source, destination, [0.0; 4]);
            for c in 0..4 {
                let drawn = if blend.is_some() { source[c] + destination[c] } else { source[c] };
                let expected = if bits >> c & 1 == 1 { drawn } else { destination[c] };
                assert_eq!(seen[c], expected, "mask {bits:04b}, channel {c}, blend: {}", blend.is_some());
            }
        }
    }
}

/// IEC 61966-2-1 from outside: codes on both sides of the knee (10 and 11), and thresholds half a code beside them.
#[test]
fn srgb_codes_are_the_standards() {
    let truths =
        [(1, 3.035_269_8e-4), (10, 3.035_269_8e-3), (11, 3.346_535_8e-3), (64, 5.126_945_8e-2), (128, 0.215_860_50), (188, 0.502_886_48)];
    for (code, linear) in truths {
        let found = f64::from(srgb8_to_linear(code));
        assert!((found / linear - 1.0).abs() < 1.0e-6, "code {code}: {found}, not {linear}");
    }
    // The linear values half way between two codes of the curve.
    for (code, half_way) in [(9, 2.883_506_3e-3), (128, 0.217_688_85), (187, 0.499_904_56)] {
        assert_eq!([0.999_99, 1.000_01].map(|f: f64| linear_to_srgb8((half_way * f) as f32)), [code, code + 1]);
    }
}

#[test]
fn srgb_targets_blend_in_linear_light() {
    let seen = blend_once(TextureFormat::Rgba8UnormSrgb, Some(plain_add()), ColorWrites::ALL, [0.2; 4], [0.3; 4], [0.0; 4]);
    let stored = srgb8_to_linear(linear_to_srgb8(0.3));
    assert_eq!(seen[0], srgb8_to_linear(linear_to_srgb8(stored + 0.2)));
    assert!((seen[3] - 0.5).abs() < 0.005, "alpha is linear: {}", seen[3]);
}

#[test]
fn dual_source_needs_one_target() {
    let component = BlendComponent { src_factor: Src1, dst_factor: Zero, operation: BlendOperation::Add };
    let state = Some(ColorTargetState {
        format: TextureFormat::Rgba8Unorm,
        blend: Some(BlendState { color: component, alpha: component }),
        write_mask: ColorWrites::ALL,
    });
    let mut desc = RenderPipelineDescriptor::new("two", std::sync::Arc::new(Program { ..pull_program(TwoSources, Interpolation::Flat) }));
    desc.targets = vec![state.clone(), target(TextureFormat::Rgba8Unorm)];
    let error = RenderPipeline::new(desc, RasterRules::REFERENCE).expect_err("two targets and a second source do not go together");
    let problem = PipelineProblem::ColorAttachment { target: 0, problem: ColorTargetProblem::DualSource { targets: 2 } };
    assert_eq!(error.problem, problem, "{error}");
}

#[test]
fn blend_check_notices_swapped_factors() {
    let add = |src_factor, dst_factor| BlendComponent { src_factor, dst_factor, operation: BlendOperation::Add };
    let destination = DESTINATIONS[0];
    let swapped = add(Dst, SrcAlpha);
    let seen = blend_once(
        TextureFormat::Rgba32Float,
        Some(BlendState { color: swapped, alpha: swapped }),
        ColorWrites::ALL,
        SOURCE,
        destination,
        CONSTANT,
    );
    let expected = blended(add(SrcAlpha, Dst), 0, destination.map(f64::from));
    assert!((f64::from(seen[0]) - expected).abs() > 0.003, "swapped factors went unnoticed");
}
