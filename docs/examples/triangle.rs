//! A triangle whose colours run from corner to corner, and how many pixels it has.

use nephroid_pipeline::prelude::*;

/// Runs once for each vertex; `L` is one lane or sixteen, and both give the same bits.
struct Corner;

impl VertexShader for Corner {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, _: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        output.position = input.attribute(0); // missing components are 0, 0, 0, 1
        output.set3(0, input.attribute(1).xyz());
    }
}

/// Runs once for each 4x4 pixels with a centre inside the triangle.
struct Blend;

impl FragmentShader for Blend {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        output.color[0] = v4(input.varying(0), input.varying(1), input.varying(2), L::splat(input.token, 1.0));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let device = Device::new(DeviceOptions::default())?;
    let mut canvas = Canvas::new(&device, (256, 256), &[TextureFormat::Rgba8Unorm], None)?;
    canvas.clear_color(0, Color { r: 0.08, g: 0.09, b: 0.12, a: 1.0 })?;

    // The program says what goes from vertices to fragments, the pipeline what is read before and written after them.
    let program = Program { varyings: vec![Varying::perspective("color", 3)], ..Program::new("triangle", Corner, Blend) };
    let pipeline = canvas.pipeline(program, |desc| {
        desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x2, VertexFormat::Float32x3])];
    })?;

    // x and y in clip space (y up), then red, green and blue; counter-clockwise.
    let vertices = Buffer::from_slice(&[[-0.75f32, -0.75, 0.0, 1.0, 0.0], [0.75, -0.75, 0.0, 0.0, 1.0], [0.0, 0.75, 1.0, 0.0, 0.0]]);
    let output = canvas.draw(vec![Draw {
        vertex_buffers: &[VertexBuffer { buffer: &vertices, offset: 0 }],
        ..Draw::new(&pipeline, Bindings::default(), 0..3, canvas.size())
    }])?;

    // The triangle is 192 pixels wide and high. Row k of it has k or k + 1 pixel centres, whichever is even: as many in all as the area says.
    assert_eq!(output.statistics.fragments_passed, 192 * 192 / 2);
    // The centre of row 127 is 96.5 pixels above the lower edge, where red is 0: 255 * 96.5 / 192 is 128.2.
    assert_eq!(canvas.pixel(0, 128, 127)[0], 128.0 / 255.0);

    let folder = std::env::args().nth(1).map_or_else(std::env::temp_dir, Into::into);
    Ok(std::fs::write(folder.join("triangle.ppm"), canvas.ppm(0))?)
}
