//! Synthetic passes with everything in them, on devices that differ, with bins of any size; and the committed hashes of their bytes.

use nephroid_math::lanes::Lanes;
use nephroid_math::vector::{V4, v2, v4};
use nephroid_pipeline::sampler::{AddressMode, Sampler, sample_grad, sample_level};
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Geometry, GeometryInput, GeometryOutput, GeometryShader, Interpolation, Program,
    Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::state::{
    ADD, BlendComponent, BlendFactor, BlendOperation, BlendState, ColorTargetState, ColorWrites, CompareFunction, DepthBiasState,
    DepthStencilState, Face, GeometryTopology, IndexFormat, PrimitiveState, PrimitiveTopology, RasterRules, StencilFaceState,
    StencilOperation, StencilState, TextureFormat, Viewport,
};
use nephroid_pipeline::{
    Binding, BindingKind, Bindings, Buffer, Device, DeviceOptions, Draw, IndexBuffer, PassOutput, StreamOutTarget, Texture,
    TextureDescriptor,
};

use crate::support::passes::*;

const SIZE: (u32, u32) = (150, 100);

/// Arithmetic of every kind that lanes offer, in both stages.
struct Busy;

impl VertexShader for Busy {
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        Pull { scalars: 4 }.vertex(bindings, input, output);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i: usize| output.varyings[i]);
        let wave = (a * 7.0 + b).floor() * 0.125 + (c * d).abs().sqrt();
        output.varyings[0] = L::select(wave.gt(a), wave - a, a * b);
        output.varyings[3] = Lanes::clamp(wave / (d * d + 1.0), 0.0, 2.0);
        output.point_size = c * 6.0 + 1.0;
    }
}

impl FragmentShader for Busy {
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let texture = bindings.texture(1);
        let sampler = bindings.sampler(2);
        let uv = v2(input.varying(0), input.varying(1));
        let near: V4<L> = sample_level(texture, &sampler, uv, 0, input.varying(3));
        let graded = sample_grad(texture, &sampler, uv, 0, v2(input.ddx(0), input.ddx(1)), v2(input.ddy(0), input.ddy(1)));
        let length = (near.x * near.x + graded.y * graded.y + 0.01).sqrt();
        let here = input.position;
        output.color[0] = v4(near.x / length, graded.y, here.z, input.varying(2));
        output.color[1] = v4(here.w, here.x * 0.01, near.z - graded.z, length);
        output.color[2] = v4(input.varying(0), -near.y, here.y * 0.01, input.varying(3));
        output.depth = Lanes::clamp(here.z + near.x * 0.05, 0.0, 1.0);
        let dropped = (here.x + here.y - ((here.x + here.y) * 0.2).floor() * 5.0).lt(L::splat(input.token, 1.0));
        output.keep = output.keep & !dropped;
    }
}

/// Turns a primitive into a fan of its corners around their middle, thrice.
struct Shatter;

impl GeometryShader for Shatter {
    fn geometry(&self, _: &Bindings<'_>, input: &GeometryInput<'_>, output: &mut GeometryOutput<'_>) {
        for turn in 0..3 {
            for corner in 0..input.vertices.len() {
                let v = &input.vertices[(corner + turn) % input.vertices.len()];
                let mut position = v.position;
                position[0] += 0.1 * turn as f32 * position[3];
                output.emit(position, v.point_size + turn as f32, v.varyings);
            }
            output.end_primitive();
        }
    }
}

fn random_vertices(rng: &mut Rng, count: usize) -> Vec<Vertex> {
    let mut vertices = Vec::new();
    while vertices.len() < count {
        let reach = if rng.chance(20) { 300.0 } else { [2.0, 6.0, 20.0][rng.int(0..3) as usize] };
        let centre = [rng.real(-10.0, 160.0), rng.real(-10.0, 110.0)];
        let z = rng.f32(-0.1, 1.1);
        for _ in 0..3 {
            let p = centre.map(|c| c + rng.real(-reach, reach));
            // Not `libm`'s doing: a power of two keeps every machine's bytes the same by construction.
            let w = [0.25, 0.5, 1.0, 2.0, 8.0][rng.int(0..5) as usize];
            let clip = clip_from_px(SIZE, p, z + rng.f32(-0.1, 0.1)).map(|c| c * w);
            vertices.push(vertex(clip, [0; 4].map(|_| rng.f32(-0.5, 1.5))));
        }
    }
    vertices
}

struct World {
    vertices: Vertices,
    indices: Buffer,
    texture: Texture,
}

impl World {
    fn new() -> Self {
        let mut rng = Rng(1201);
        let vertices = Vertices::new(&random_vertices(&mut rng, 1_200));
        let strip: Vec<u32> = (0..900).map(|_| if rng.chance(4) { u32::MAX } else { rng.int(0..1200) as u32 }).collect();
        let desc = TextureDescriptor { mip_level_count: 5, ..TextureDescriptor::d2("noise", 24, 17, Rgba16Float) };
        let mut texture = Texture::new(desc).expect("valid");
        let bytes: Vec<u8> = (0..24 * 17 * 4).flat_map(|_| half::f16::from_f32_const(rng.f32(-1.0, 1.0)).to_le_bytes()).collect();
        texture.write_bytes(0, 0, &bytes).expect("the right size");
        texture.generate_mips();
        Self { vertices, indices: Buffer::from_slice(&strip), texture }
    }
}

/// What a pass is made of.
struct Recipe {
    name: &'static str,
    colors: &'static [TextureFormat],
    depth: Option<TextureFormat>,
    rules: RasterRules,
    topology: PrimitiveTopology,
    geometry: Option<GeometryTopology>,
    indexed: bool,
    discard: bool,
    frag_depth: bool,
    stencil: bool,
    bias: bool,
}

const PLAIN: Recipe = Recipe {
    name: "",
    colors: &[Rgba32Float],
    depth: None,
    rules: RasterRules::REFERENCE,
    topology: PrimitiveTopology::TriangleList,
    geometry: None,
    indexed: false,
    discard: false,
    frag_depth: false,
    stencil: false,
    bias: false,
};

use TextureFormat::{
    Depth16Unorm, Depth24PlusStencil8, Depth32Float, Depth32FloatStencil8, R8Unorm, R16Float, R32Float, Rg16Float, Rgba8Unorm,
    Rgba8UnormSrgb, Rgba16Float, Rgba32Float,
};

const RECIPES: [Recipe; 12] = [
    Recipe { name: "float additive", ..PLAIN },
    Recipe { name: "three targets", colors: &[Rgba16Float, Rgba8Unorm, R32Float], depth: Some(Depth32Float), ..PLAIN },
    Recipe {
        name: "srgb, stencil, discard",
        colors: &[Rgba8UnormSrgb, Rg16Float],
        depth: Some(Depth24PlusStencil8),
        stencil: true,
        discard: true,
        ..PLAIN
    },
    Recipe { name: "written depth", colors: &[R16Float], depth: Some(Depth32FloatStencil8), stencil: true, frag_depth: true, ..PLAIN },
    Recipe {
        name: "indexed strip",
        colors: &[Rgba32Float, R8Unorm],
        depth: Some(Depth16Unorm),
        topology: PrimitiveTopology::TriangleStrip,
        indexed: true,
        bias: true,
        ..PLAIN
    },
    Recipe { name: "points", colors: &[Rgba16Float], topology: PrimitiveTopology::PointList, depth: Some(Depth32Float), ..PLAIN },
    Recipe { name: "line strip", colors: &[Rgba32Float], topology: PrimitiveTopology::LineStrip, indexed: true, ..PLAIN },
    Recipe {
        name: "geometry to triangles",
        colors: &[Rgba16Float, Rgba32Float],
        depth: Some(Depth32Float),
        geometry: Some(GeometryTopology::TriangleStrip),
        ..PLAIN
    },
    Recipe {
        name: "geometry to points",
        colors: &[Rgba8Unorm],
        geometry: Some(GeometryTopology::Points),
        topology: PrimitiveTopology::LineStrip,
        ..PLAIN
    },
    Recipe {
        name: "llvmpipe rules",
        colors: &[Rgba16Float],
        depth: Some(Depth32FloatStencil8),
        stencil: true,
        bias: true,
        rules: RasterRules::LAVAPIPE,
        ..PLAIN
    },
    Recipe { name: "swiftshader rules", colors: &[Rgba32Float], depth: Some(Depth32Float), rules: RasterRules::SWIFTSHADER, ..PLAIN },
    Recipe { name: "stencil only", colors: &[], depth: Some(Depth32FloatStencil8), stencil: true, ..PLAIN },
];

impl Recipe {
    fn program(&self) -> Program {
        let varyings = vec![
            Varying { name: "a", components: 2, interpolation: Interpolation::Perspective },
            Varying { name: "b", components: 1, interpolation: Interpolation::Flat },
            Varying { name: "c", components: 1, interpolation: Interpolation::Linear },
        ];
        let program = Program {
            varyings: varyings.clone(),
            bindings: vec![BindingKind::Storage(32), BindingKind::Texture, BindingKind::Sampler],
            may_discard: self.discard,
            writes_depth: self.frag_depth,
            ..Program::new("busy", Busy, Busy)
        };
        Program {
            geometry: self.geometry.map(|output| Geometry {
                shader: std::sync::Arc::new(Shatter),
                output,
                max_vertices: 9,
                input_varyings: varyings,
            }),
            fragment: program.fragment.clone().filter(|_| !self.colors.is_empty()),
            ..program
        }
    }

    fn targets(&self) -> Vec<Option<ColorTargetState>> {
        let over =
            BlendComponent { src_factor: BlendFactor::SrcAlpha, dst_factor: BlendFactor::OneMinusSrcAlpha, operation: BlendOperation::Add };
        let most = BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Max };
        let states = [Some((ADD, over)), Some((over, most)), None];
        let target = |(i, format): (usize, &TextureFormat)| {
            let blend = states[i % 3].map(|(color, alpha)| BlendState { color, alpha });
            Some(ColorTargetState { format: *format, blend, write_mask: if i == 1 { ColorWrites::COLOR } else { ColorWrites::ALL } })
        };
        self.colors.iter().enumerate().map(target).collect()
    }

    fn depth_stencil(&self) -> Option<DepthStencilState> {
        let face = |compare, pass_op| StencilFaceState {
            compare,
            fail_op: StencilOperation::Invert,
            depth_fail_op: StencilOperation::DecrementClamp,
            pass_op,
        };
        self.depth.map(|format| DepthStencilState {
            format,
            depth_write_enabled: Some(!self.colors.is_empty()),
            depth_compare: Some(CompareFunction::LessEqual),
            stencil: if self.stencil {
                StencilState {
                    front: face(CompareFunction::NotEqual, StencilOperation::IncrementWrap),
                    back: face(CompareFunction::LessEqual, StencilOperation::Replace),
                    read_mask: 0x7f,
                    write_mask: 0xfd,
                }
            } else {
                StencilState::default()
            },
            bias: if self.bias { DepthBiasState { constant: 20, slope_scale: 0.5, clamp: 0.01 } } else { DepthBiasState::default() },
        })
    }

    fn run(&self, world: &World, device: &Device) -> (Vec<u8>, PassOutput) {
        let pipelines: Vec<_> = [None, Some(Face::Back)]
            .into_iter()
            .map(|cull_mode| {
                pipeline_with(self.program(), self.rules, |desc| {
                    let strip_index_format = (self.indexed && self.topology.is_strip()).then_some(IndexFormat::Uint32);
                    desc.primitive = PrimitiveState { topology: self.topology, strip_index_format, cull_mode, ..PrimitiveState::default() };
                    desc.targets = self.targets();
                    desc.depth_stencil = self.depth_stencil();
                    desc.line_width = 2.5;
                })
            })
            .collect();
        let entries = [
            world.vertices.entries()[0],
            Binding::Texture(world.texture.view()),
            Binding::Sampler(Sampler::linear(AddressMode::MirrorRepeat)),
        ];
        let formats: Vec<_> = self.colors.iter().map(|f| Some(*f)).collect();
        let mut canvas = Canvas::new(SIZE, &formats, self.depth);
        canvas.clear = [0.1, 0.2, 0.3, 0.4];
        canvas.clear_depth = 0.9;
        canvas.clear_stencil = 5;
        canvas.queries = 2;
        canvas.stream_out = vec![StreamOutTarget { capacity: 3_000, ..StreamOutTarget::default() }];
        let draws = (0..6u32).map(|i| {
            let index = self.indexed.then_some(IndexBuffer { buffer: &world.indices, format: IndexFormat::Uint32, offset: 0 });
            Draw {
                index,
                instances: 0..1 + i % 2,
                blend_constant: [0.3, 0.6, 0.9, 0.2],
                stencil_reference: i,
                query: (i % 3 == 1).then_some(i % 2),
                stream_out: (i == 4).then_some(0),
                viewport: if i == 3 {
                    Viewport { x: 20.0, y: 10.0, width: 90.0, height: 70.0, min_depth: 0.2, max_depth: 0.8 }
                } else {
                    Viewport::full(SIZE.0, SIZE.1)
                },
                ..Draw::new(&pipelines[i as usize % 2], Bindings::new(&entries, 0), i * 100..i * 100 + 150, SIZE)
            }
        });
        let output = canvas.run_on(device, draws.collect(), None);
        (canvas.bytes(), output)
    }
}

/// Hashes of every recipe's bytes. A change here is a change of the image: say so in the changelog.
const HASHES: [u64; 12] = [
    0xb5889a1eb50f37f0, // float additive
    0xe266849b57c0cd3c, // three targets
    0xd690f3b049b74955, // srgb, stencil, discard
    0xb792bee87dfe92dc, // written depth
    0x400f9b772be9e27c, // indexed strip
    0x4c513a43e35472c7, // points
    0x7821981bf61ed576, // line strip
    0x51bb7cac32c44cc4, // geometry to triangles
    0xc9c53690a2d1866d, // geometry to points
    0x660129c1171f4b50, // llvmpipe rules
    0x2b760bf9ea8ddfaa, // swiftshader rules
    0xd31095a50260d952, // stencil only
];

#[test]
fn same_bytes_on_every_device() {
    let world = World::new();
    let mut reference = Vec::new();
    for recipe in &RECIPES {
        reference.push(recipe.run(&world, scalar_device()));
    }
    let mut others = crate::devices::others();
    others.push(("scalar shaders".to_owned(), crate::devices::scalar_shaders()));
    for (device, (recipe, (bytes, output))) in others.iter().flat_map(|device| RECIPES.iter().zip(&reference).map(move |r| (device, r))) {
        let (seen_bytes, seen) = recipe.run(&world, &device.1);
        let what = format!("{}: {}", recipe.name, device.0);
        assert!(seen_bytes == *bytes, "{what}: attachments or stream-out differ");
        assert_eq!(PassOutput { waves: output.waves, ..seen }, *output, "{what}: counters differ");
    }
}

#[test]
fn many_waves_give_the_same_bytes() {
    // More chunks than one look at the budget covers.
    let mut rng = Rng(1202);
    let vertices = Vertices::new(&random_vertices(&mut rng, 90_000));
    let entries = vertices.entries();
    let pipeline = pipeline(pull_program(VaryingColor, Interpolation::Flat), |desc| desc.targets = vec![additive(Rgba32Float)]);
    let mut results = Vec::new();
    for bin_budget_bytes in [1, 100_000, 256 << 20] {
        let options = DeviceOptions { threads: Some(2), bin_budget_bytes, ..DeviceOptions::default() };
        let device = Device::new(options).expect("threads start");
        let mut canvas = Canvas::single((64, 64), Rgba32Float);
        canvas.clear = [0.5; 4];
        let draw = Draw::new(&pipeline, Bindings::new(&entries, 0), 0..vertices.count, (64, 64));
        let output = canvas.run_on(&device, vec![draw], None);
        results.push((canvas.bytes(), output.statistics, output.waves));
    }
    assert!(results[0].2 >= 3, "the tiny budget must force waves, saw {}", results[0].2);
    assert_eq!(results[2].2, 1);
    for other in &results[1..] {
        assert!(results[0].0 == other.0 && results[0].1 == other.1, "waves changed the result");
    }
}

#[test]
fn passes_have_the_committed_hashes() {
    let world = World::new();
    let seen: Vec<u64> = RECIPES.iter().map(|recipe| fnv1a(&recipe.run(&world, device()).0)).collect();
    let list: Vec<String> = seen.iter().zip(&RECIPES).map(|(hash, recipe)| format!("{hash:#018x}, // {}", recipe.name)).collect();
    assert!(seen == HASHES, "the bytes changed; now they are\n{}", list.join("\n"));
}

#[test]
fn every_recipe_draws_something_of_its_own() {
    let world = World::new();
    let mut hashes = Vec::new();
    for recipe in &RECIPES {
        let (bytes, output) = recipe.run(&world, device());
        assert!(output.statistics.fragments_passed > 1_000, "{}: {:?}", recipe.name, output.statistics);
        assert!(output.queries[0] > 0 && output.stream_out[0].primitive_storage_needed > 0, "{}: {output:?}", recipe.name);
        hashes.push(fnv1a(&bytes));
    }
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), RECIPES.len(), "two recipes gave the same bytes");
    // One bit of one byte changes the hash.
    let mut bytes = RECIPES[0].run(&world, device()).0;
    let before = fnv1a(&bytes);
    bytes[12_345] ^= 1;
    assert_ne!(before, fnv1a(&bytes));
}
