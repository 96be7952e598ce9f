//! A test that holds a pass to a committed picture, and on failure writes what was drawn, what was expected, and the difference.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use nephroid_pipeline::prelude::*;

/// Written by `main`, looked at, and committed.
const EXPECTED: &[u8] = include_bytes!("picture_test.ppm");

/// The pass under test: two panes of coloured glass, the second over the first and moved to the right (the picture is 2 wide).
fn draw(moved: f32) -> Result<Vec<u8>, Box<dyn Error>> {
    let device = Device::new(DeviceOptions::default())?;
    let mut canvas = Canvas::new(&device, (64, 64), &[TextureFormat::Rgba8Unorm], None)?;
    canvas.clear_color(0, Color::WHITE)?;
    let pipeline = canvas.pipeline(Program::vertex_color(), |desc| {
        desc.vertex_buffers = vec![VertexBufferLayout::packed(&[VertexFormat::Float32x2, VertexFormat::Float32x4])];
        desc.targets = vec![Some(ColorTargetState { blend: Some(BlendState::ALPHA_BLENDING), ..TextureFormat::Rgba8Unorm.into() })];
    })?;
    let pane = |x: f32, [r, g, b, a]: [f32; 4]| [[-0.5, -0.75], [0.5, -0.5], [-0.25, 0.75]].map(|[u, v]| [u + x, v, r, g, b, a]);
    let vertices = Buffer::from_slice(&[pane(-0.25, [0.9, 0.2, 0.1, 0.6]), pane(0.25 + moved, [0.1, 0.3, 0.9, 0.6])]);
    let vertex_buffers = &[VertexBuffer { buffer: &vertices, offset: 0 }];
    canvas.draw(vec![Draw { vertex_buffers, ..Draw::new(&pipeline, Bindings::default(), 0..6, canvas.size()) }])?;
    Ok(canvas.ppm(0))
}

/// Compares PPM files of one size; the error says how many pixels differ, where most and by how much, and where to look.
fn compare(actual: &[u8], expected: &[u8], folder: &Path) -> Result<(), Box<dyn Error>> {
    let header = b"P6\n64 64\n255\n".len();
    assert_eq!(actual.len(), expected.len(), "the pictures' sizes differ");
    let difference: Vec<[u8; 3]> =
        (header..actual.len()).step_by(3).map(|at| [0, 1, 2].map(|c| actual[at + c].abs_diff(expected[at + c]))).collect();
    let Some((at, most)) = difference.iter().enumerate().rev().filter(|(_, d)| **d != [0; 3]).max_by_key(|(_, d)| d.iter().max()) else {
        return Ok(());
    };
    for (name, pixels) in [("actual", &actual[header..]), ("expected", &expected[header..]), ("difference", difference.as_flattened())] {
        fs::write(folder.join(format!("picture_test.{name}.ppm")), [&actual[..header], pixels].concat())?;
    }
    let count = difference.iter().filter(|d| **d != [0; 3]).count();
    let (x, y) = (at % 64, at / 64);
    Err(format!("{count} pixels differ, most at ({x}, {y}): by {most:?} of 255; see {}/picture_test.*.ppm", folder.display()).into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder: PathBuf = std::env::args().nth(1).map_or_else(std::env::temp_dir, Into::into);
    fs::write(folder.join("picture_test.ppm"), draw(0.0)?)?;
    compare(&draw(0.0)?, EXPECTED, &folder)
}

#[test]
fn the_pass_draws_the_committed_picture() {
    compare(&draw(0.0).expect("drawn"), EXPECTED, &std::env::temp_dir()).unwrap();
}

#[test]
fn a_pane_that_moved_by_a_pixel_is_found() {
    let error = compare(&draw(1.0 / 32.0).expect("drawn"), EXPECTED, &std::env::temp_dir()).unwrap_err();
    assert!(error.to_string().contains("pixels differ"), "{error}");
}
