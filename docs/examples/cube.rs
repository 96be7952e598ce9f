//! A turned cube: indices, a mip-mapped texture, a matrix in a uniform buffer, a depth test, back faces culled.

use nephroid_pipeline::prelude::*;

struct Cube; // both shaders; bindings: 0 the matrix from the cube to clip space, 1 the texture, 2 its sampler

impl VertexShader for Cube {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        output.position = input.attribute(0).transformed(bindings.uniform(0));
        output.set3(0, input.attribute(1).xyz());
    }
}

impl FragmentShader for Cube {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = input.sample(bindings.texture(1), &bindings.sampler(2), 0, 0) * input.varying(2);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (device, format) = (Device::new(DeviceOptions::default())?, TextureFormat::Rgba8UnormSrgb);
    let mut canvas = Canvas::new(&device, (512, 512), &[format], Some(TextureFormat::Depth32Float))?;
    let mut program = Program::new("cube", Cube, Cube);
    program.varyings = vec![Varying::perspective("uv_and_brightness", 3)];
    program.bindings = vec![BindingKind::Uniform(64), BindingKind::Texture, BindingKind::Sampler];
    let pipeline = canvas.pipeline(program, |desc| {
        desc.primitive.cull_mode = Some(Face::Back);
        desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x3; 2])];
    })?;
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for face in 0..6u16 {
        let (axis, sign) = (usize::from(face) % 3, if face < 3 { 1.0f32 } else { -1.0 });
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            let mut corner = [sign; 3]; // counter-clockwise seen from outside
            [corner[(axis + 1) % 3], corner[(axis + 2) % 3]] = [sign * (2.0 * u - 1.0), 2.0 * v - 1.0];
            vertices.push([corner, [u, v, [0.4, 0.7, 1.0][axis]]]);
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| 4 * face + corner));
    }
    let squares = |x: u32, y: u32| if (x / 32 + y / 32) % 2 == 0 { [0.9, 0.85, 0.7, 1.0] } else { [0.05, 0.2, 0.4, 1.0] };
    let checker = Texture::mipmapped("checker", (256, 256), format, squares)?;
    // Columns of a turn about y, then about x (their sines are 8/17 and 0.6), 4.5 away from the eye, seen between depths 2 and 8.
    let (sin, cos) = (8.0f32 / 17.0, 15.0 / 17.0);
    let turn = [[cos, 0.6 * sin, -0.8 * sin, 0.0], [0.0, 0.8, 0.6, 0.0], [sin, -0.6 * cos, 0.8 * cos, 0.0], [0.0, 0.0, -4.5, 1.0]];
    let matrix = Buffer::from_value(&turn.map(|[x, y, z, w]| [2.0 * x, 2.0 * y, (-z - 2.0 * w) * 8.0 / 6.0, -z]));
    let bound = [Binding::uniform(&matrix), Binding::Texture(checker.view()), Binding::Sampler(Sampler::linear(AddressMode::ClampToEdge))];
    let output = canvas.draw(vec![Draw {
        vertex_buffers: &[VertexBuffer { buffer: &Buffer::from_slice(&vertices), offset: 0 }],
        index: Some(IndexBuffer { buffer: &Buffer::from_slice(&indices), format: IndexFormat::Uint16, offset: 0 }),
        ..Draw::new(&pipeline, Bindings::new(&bound, 0), 0..36, canvas.size())
    }])?;
    // Three faces look away. The view axis enters the cube in the light square around (−8/15, 0.85, 1), where the brightness is 1.
    assert_eq!((output.statistics.primitives_culled, canvas.pixel(0, 256, 256)), (6, checker.texel(0, 0, 60, 236)));
    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, Into::into);
    Ok(std::fs::write(folder.join("cube.ppm"), canvas.ppm(0))?)
}
