//! The driver presets against their measured formulas, written down a second time: coverage and depth bit for bit.
//!
//! Sources: measurements of Mesa's llvmpipe 25.0.7 and SwiftShader 5.0. Each triangle writes its depth unconditionally, so that a batch in order
//! compares as one image.

use nephroid_pipeline::state::{CompareFunction, DepthBiasState, DepthStencilState, RasterRules, StencilState, TextureFormat};

use super::passes::*;
use super::reference::{Fill, Fx, for_each_pixel};

/// A clip position through one driver's viewport arithmetic.
#[derive(Clone, Copy, Debug)]
struct Window {
    fx: Fx,
    /// Pixels before snapping.
    x: f32,
    y: f32,
    z: f32,
    clip: [f32; 4],
}

type Depth = Box<dyn Fn(i64, i64) -> f32>;

fn llvmpipe_window(size: (u32, u32), clip: [f32; 4], fused: bool) -> Window {
    let r = 1.0 / clip[3];
    let (hw, hh) = (size.0 as f32 / 2.0, size.1 as f32 / 2.0);
    let map = |n: f32, s: f32, t: f32| if fused { n.mul_add(s, t) } else { n * s + t };
    let (x, y) = (map(clip[0] * r, hw, hw), map(clip[1] * r, -hh, hh));
    let fx = [x, y].map(|v| (256.0 * v).round_ties_even() as i64);
    Window { fx, x, y, z: clip[2] * r, clip }
}

fn llvmpipe_depth(v: [Window; 3], fused: bool) -> Depth {
    let x = v.map(|v| v.x - 0.5);
    let y = v.map(|v| v.y - 0.5);
    let z = v.map(|v| v.z);
    let ooa = 1.0 / ((x[0] - x[1]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[0] - y[1]));
    let dadx = (z[0] - z[1]) * ((y[2] - y[0]) * ooa) - (z[2] - z[0]) * ((y[0] - y[1]) * ooa);
    let dady = (z[2] - z[0]) * ((x[0] - x[1]) * ooa) - (z[0] - z[1]) * ((x[2] - x[0]) * ooa);
    let a0 = z[0] - (dadx * x[0] + dady * y[0]);
    Box::new(move |px, py| {
        let (px, py) = (px as f32, py as f32);
        let z = if fused { dady.mul_add(py, dadx.mul_add(px, a0)) } else { (a0 + dadx * px) + dady * py };
        z.clamp(0.0, 1.0)
    })
}

/// Sutherland and Hodgman in the driver's order and arithmetic; the polygon as a fan from its first vertex.
fn llvmpipe_clip(size: (u32, u32), triangle: [[f32; 4]; 3], fused: bool) -> Vec<[Window; 3]> {
    let mut polygon: Vec<([f32; 4], bool)> = triangle.iter().map(|&v| (v, false)).collect();
    type Distance = fn(&[f32; 4]) -> f32;
    let planes: [Distance; 6] = [|v| v[3] - v[0], |v| v[0] + v[3], |v| v[3] - v[1], |v| v[1] + v[3], |v| v[2], |v| v[3] - v[2]];
    for distance in planes {
        let mut kept = Vec::new();
        for i in 0..polygon.len() {
            let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (da, db) = (distance(&a.0), distance(&b.0));
            if da >= 0.0 {
                kept.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                // From the nearer end; of two equally near ones, from the inside.
                let a_first = da.abs() < db.abs() || (da.abs() == db.abs() && da >= 0.0);
                let (near, far, dn, df) = if a_first { (a.0, b.0, da, db) } else { (b.0, a.0, db, da) };
                let t = dn / (dn - df);
                kept.push((std::array::from_fn(|k| near[k] + t * (far[k] - near[k])), true));
            }
        }
        polygon = kept;
    }
    let windows: Vec<Window> = polygon.iter().map(|&(v, new)| llvmpipe_window(size, v, fused && !new)).collect();
    (2..windows.len()).map(|k| [windows[0], windows[k - 1], windows[k]]).collect()
}

fn swiftshader_window(size: (u32, u32), clip: [f32; 4]) -> Window {
    let r = 1.0 / clip[3];
    let (hw, hh) = (16.0 * (size.0 as f32 / 2.0), 16.0 * (size.1 as f32 / 2.0));
    // Sixteenths of a pixel from the centre of pixel 0.
    let x = (clip[0] * r * hw + (hw - 8.0)).round_ties_even();
    let y = (clip[1] * r * -hh + (hh - 8.0)).round_ties_even();
    Window { fx: [x as i64 * 16 + 128, y as i64 * 16 + 128], x: x / 16.0, y: y / 16.0, z: clip[2] * r, clip }
}

fn swiftshader_depth(v: [Window; 3]) -> Depth {
    let mut v = v;
    for key in [|w: &Window| -w.clip[1], |w: &Window| w.clip[3]] {
        let greatest = key(&v[0]).max(key(&v[1])).max(key(&v[2]));
        let (second, third) = (key(&v[1]) == greatest, key(&v[2]) == greatest);
        if second {
            v.rotate_left(1);
        }
        if third {
            v.rotate_left(2);
        }
    }
    let (x0, y0, z0) = (v[0].x, v[0].y, v[0].z);
    let (x1, y1, z1) = (v[1].x - x0, v[1].y - y0, v[1].z - z0);
    let (x2, y2, z2) = (v[2].x - x0, v[2].y - y0, v[2].z - z0);
    let d = 1.0 / (x1 * y2 - x2 * y1);
    let (a, b) = (d * (y2 * z1 - y1 * z2), d * (x1 * z2 - x2 * z1));
    Box::new(move |px, py| ((z0 + (py as f32 - y0) * b) + (px as f32 - x0) * a).clamp(0.0, 1.0))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Driver {
    Llvmpipe { fused: bool },
    SwiftShader,
}

impl Driver {
    fn rules(self) -> RasterRules {
        match self {
            Self::Llvmpipe { fused: true } => RasterRules::LAVAPIPE,
            Self::Llvmpipe { fused: false } => RasterRules::LAVAPIPE_NO_FMA,
            Self::SwiftShader => RasterRules::SWIFTSHADER,
        }
    }

    fn windows(self, size: (u32, u32), triangle: [[f32; 4]; 3]) -> Vec<[Window; 3]> {
        match self {
            Self::Llvmpipe { fused } => {
                let outside = |v: &[f32; 4]| v[0].abs() > v[3] || v[1].abs() > v[3] || v[2] < 0.0 || v[2] > v[3];
                if triangle.iter().any(outside) {
                    llvmpipe_clip(size, triangle, fused)
                } else {
                    vec![triangle.map(|v| llvmpipe_window(size, v, fused))]
                }
            }
            Self::SwiftShader => vec![triangle.map(|v| swiftshader_window(size, v))],
        }
    }

    fn expected(self, size: (u32, u32), triangles: &[[[f32; 4]; 3]]) -> (Vec<f32>, u64) {
        let mut image = vec![CLEAR; (size.0 * size.1) as usize];
        let mut covered = 0;
        for piece in triangles.iter().flat_map(|t| self.windows(size, *t)) {
            let depth = match self {
                Self::Llvmpipe { fused } => llvmpipe_depth(piece, fused),
                Self::SwiftShader => swiftshader_depth(piece),
            };
            for_each_pixel(piece.map(|v| v.fx), size, Fill::TopLeft, |x, y| {
                image[y * size.0 as usize + x] = depth(x as i64, y as i64);
                covered += 1;
            });
        }
        (image, covered)
    }
}

/// Not a depth that any triangle has.
const CLEAR: f32 = 0.987_654_3;

fn render(rules: RasterRules, size: (u32, u32), triangles: &[[[f32; 4]; 3]]) -> (Vec<f32>, u64) {
    let pipeline = pipeline_with(depth_only_program(), rules, |desc| {
        desc.depth_stencil = Some(DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: StencilState::default(),
            bias: DepthBiasState::default(),
        });
    });
    let vertices: Vec<Vertex> = triangles.iter().flatten().map(|&p| vertex(p, [0.0; 4])).collect();
    let mut canvas = Canvas::new(size, &[], Some(TextureFormat::Depth32Float));
    canvas.clear_depth = CLEAR;
    let output = draw(&mut canvas, &pipeline, &vertices);
    (canvas.depths(), output.statistics.fragments_passed)
}

/// Triangles inside the frustum, of several sizes and tie classes; half of them with a `w` per vertex.
fn inside_view(rng: &mut Rng, size: (u32, u32)) -> [[f32; 4]; 3] {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    let centre = [rng.real(0.0, width), rng.real(0.0, height)];
    let reach = [1.0, 8.0, 40.0, 1000.0][rng.int(0..4) as usize];
    let step = [1.0 / 65536.0, 1.0 / 16.0, 0.5, 1.0 / 512.0, 1.0 / 32.0][rng.int(0..5) as usize];
    let varying_w = rng.chance(2);
    [(); 3].map(|()| {
        let at = |rng: &mut Rng, c: f64, size: f64| (((c + rng.real(-reach, reach)) / step).floor() * step).clamp(0.0, size);
        let p = [at(rng, centre[0], width), at(rng, centre[1], height)];
        let w = if varying_w { libm::exp(rng.real(-3.0, 5.0)) as f32 } else { 1.0 };
        let z = rng.f32(0.01, 0.99);
        clip_from_px(size, p, z).map(|c| c * w)
    })
}

/// Triangles that cross the borders of the view in every way.
fn crossing(rng: &mut Rng, kind: usize) -> [[f32; 4]; 3] {
    [(); 3].map(|()| {
        let spread = [1.9, 5.0, 200.0, 20_000.0][kind % 4];
        match kind {
            // Sides.
            0..=3 => [rng.f32(-spread, spread), rng.f32(-spread, spread), rng.f32(0.05, 0.95), 1.0],
            // Near and far.
            4 | 5 => [rng.f32(-0.9, 0.9), rng.f32(-0.9, 0.9), rng.f32(-0.6, 1.6), 1.0],
            // Behind the eye.
            _ => {
                let w = rng.f32(-2.0, 6.0);
                [rng.f32(-4.0, 4.0), rng.f32(-4.0, 4.0), w - rng.f32(0.0, 0.5), w]
            }
        }
    })
}

fn check(driver: Driver, size: (u32, u32), triangles: &[[[f32; 4]; 3]], what: &str) -> u64 {
    let (expected, covered) = driver.expected(size, triangles);
    let (seen, passed) = render(driver.rules(), size, triangles);
    let bits = |image: &[f32]| image.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    if first_difference(size.0, &bits(&expected), &bits(&seen)).is_some() || covered != passed {
        for triangle in triangles {
            let (e, s) = (driver.expected(size, &[*triangle]).0, render(driver.rules(), size, &[*triangle]).0);
            if let Some((x, y, e, s)) = first_difference(size.0, &bits(&e), &bits(&s)) {
                let (e, s) = (f32::from_bits(e), f32::from_bits(s));
                let (pieces, clear) = (driver.windows(size, *triangle), CLEAR);
                panic!(
                    "{what}, {driver:?} at {size:?}: {triangle:?} -> {pieces:?}, pixel ({x}, {y}): expected {e}, got {s} (nothing: {clear})"
                );
            }
        }
        panic!(
            "{what}, {driver:?} at {size:?}: the batch differs although every triangle alone is right, or counts differ: {covered}, {passed}"
        );
    }
    covered
}

const DRIVERS: [Driver; 3] = [Driver::Llvmpipe { fused: true }, Driver::Llvmpipe { fused: false }, Driver::SwiftShader];
const SIZES: [((u32, u32), usize); 3] = [((64, 64), 40), ((100, 60), 40), ((1024, 768), 1)];

#[test]
fn presets_inside_the_view() {
    let mut rng = Rng(201);
    for driver in DRIVERS {
        let (mut count, mut pixels) = (0, 0);
        for (size, share) in SIZES {
            for _ in 0..sized(50, 4) {
                let triangles: Vec<_> = (0..share * 50).map(|_| inside_view(&mut rng, size)).collect();
                pixels += check(driver, size, &triangles, "inside the view");
                count += triangles.len();
            }
        }
        println!("{driver:?}, inside the view: {count} triangles, {pixels} covered pixels, coverage and depth bit-equal");
    }
}

#[test]
fn preset_llvmpipe_clipped() {
    let mut rng = Rng(202);
    for driver in [Driver::Llvmpipe { fused: true }, Driver::Llvmpipe { fused: false }] {
        let (mut count, mut pixels) = (0, 0);
        for (size, share) in SIZES {
            for kind in 0..7 {
                for _ in 0..sized(8, 1) {
                    let triangles: Vec<_> = (0..share * 25).map(|_| crossing(&mut rng, kind)).collect();
                    pixels += check(driver, size, &triangles, &format!("crossing, kind {kind}"));
                    count += triangles.len();
                }
            }
        }
        println!("{driver:?}, clipped: {count} triangles, {pixels} covered pixels, coverage and depth bit-equal");
    }
}

#[test]
fn presets_are_told_apart() {
    let size = (100, 60);
    let mut rng = Rng(203);
    let triangles: Vec<_> = (0..2000).map(|_| inside_view(&mut rng, size)).collect();
    for driver in DRIVERS {
        let expected = driver.expected(size, &triangles).0;
        for other in DRIVERS {
            let seen = render(other.rules(), size, &triangles).0;
            assert_eq!(first_difference(size.0, &expected, &seen).is_none(), driver == other, "{driver:?} against {other:?}");
        }
        let seen = render(RasterRules::REFERENCE, size, &triangles).0;
        assert!(first_difference(size.0, &expected, &seen).is_some(), "{driver:?} against the reference rules");
    }
}
