//! Figures whose parts are known.

use super::*;

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;

fn figure<'a>(reference: &'a [[f32; 3]], test: &'a [[f32; 3]], mask: Option<&'a [bool]>, metrics: &'a [(String, String)]) -> Figure<'a> {
    let pair = Pair::with_mask(WIDTH, HEIGHT, reference, test, mask).unwrap();
    Figure { title: "Caustic on a floor", pair, reference_name: "Reference", test_name: "Result", unit: "W/m²", metrics }
}

fn ramp() -> Vec<[f32; 3]> {
    (0..WIDTH * HEIGHT).map(|i| [(i % WIDTH) as f32; 3]).collect()
}

fn metrics(count: usize) -> Vec<(String, String)> {
    (0..count).map(|i| (format!("metric {i}"), format!("{i}.5 W/m²"))).collect()
}

/// Middle of the magnified pixel `(x, y)` of a panel.
fn middle(layout: &Layout, panel: usize, x: u32, y: u32) -> (u32, u32) {
    let place = |at: u32| at * layout.zoom + layout.zoom / 2;
    (layout.panels[panel].x + place(x), layout.panels[panel].y + place(y))
}

#[test]
fn narrow_panels_are_magnified_and_the_page_is_as_large_as_computed() {
    let ramp = ramp();
    let metrics = metrics(4);
    let figure = figure(&ramp, &ramp, None, &metrics);
    let layout = Layout::new(&figure).unwrap();
    assert_eq!(layout.zoom, 8);
    assert!(layout.panels.iter().all(|panel| (panel.width, panel.height) == (320, 240)));
    let canvas = figure.paint().unwrap();
    assert_eq!((u64::from(canvas.width()), u64::from(canvas.height())), (layout.width, layout.height));
    let decoded = crate::png::decode(&figure.png().unwrap()).unwrap();
    assert_eq!((u64::from(decoded.width()), u64::from(decoded.height())), (layout.width, layout.height));
}

#[test]
fn equal_pictures_have_a_neutral_difference() {
    let ramp = ramp();
    let figure = figure(&ramp, &ramp, None, &[]);
    let (canvas, layout) = (figure.paint().unwrap(), Layout::new(&figure).unwrap());
    for (x, y) in [(0, 0), (20, 15), (39, 29)] {
        let (x, y) = middle(&layout, 2, x, y);
        assert_eq!(canvas.get(x, y), diverging(0.0));
    }
}

#[test]
fn too_bright_is_red_and_too_dark_is_blue() {
    let reference = ramp();
    let mut test = reference.clone();
    for row in test.chunks_exact_mut(WIDTH as usize) {
        row[5] = [7.0; 3];
        row[30] = [28.0; 3];
    }
    let figure = figure(&reference, &test, None, &[]);
    let (canvas, layout) = (figure.paint().unwrap(), Layout::new(&figure).unwrap());
    assert_eq!(layout.scale.range, 2.0);
    for (x, color) in [(5, diverging(1.0)), (30, diverging(-1.0)), (10, diverging(0.0))] {
        let (x, y) = middle(&layout, 2, x, 3);
        assert_eq!(canvas.get(x, y), color);
    }
    assert_eq!(canvas.get(layout.bar.x, layout.bar.y), diverging(1.0));
    assert_eq!(canvas.get(layout.bar.x, layout.bar.bottom() - 1), diverging(-1.0));
}

#[test]
fn one_outlier_does_not_set_the_range_and_is_told() {
    let reference = ramp();
    let mut test = reference.clone();
    test.iter_mut().enumerate().for_each(|(i, pixel)| *pixel = pixel.map(|value| value + 0.25 * (i % 7) as f32));
    test[77] = [500.0; 3];
    let figure = figure(&reference, &test, None, &[]);
    let layout = Layout::new(&figure).unwrap();
    assert!(layout.scale.range == 1.5 && layout.scale.clipped == 1.0 / 1200.0);
    let note = layout.difference_notes.join(" ");
    assert!(note.ends_with("clipped beyond ±1.5\u{a0}W/m² (0.083\u{a0}% of pixels)."), "{note}");
}

#[test]
fn both_pictures_are_shown_with_one_exposure() {
    let reference = vec![[2.0; 3]; 1200];
    let test = vec![[1.0; 3]; 1200];
    let figure = figure(&reference, &test, None, &[]);
    let (canvas, layout) = (figure.paint().unwrap(), Layout::new(&figure).unwrap());
    assert!((layout.scale.exposure - 0.45).abs() < 1.0e-7);
    for (panel, value) in [(0, 0.9), (1, 0.45)] {
        let (x, y) = middle(&layout, panel, 4, 4);
        assert_eq!(canvas.get(x, y), [quantize_8bit(srgb_encode(value)); 3]);
    }
}

#[test]
fn pixels_that_do_not_count_are_hatched() {
    let mut ramp = ramp();
    let mask: Vec<bool> = (0..ramp.len()).map(|i| i != 5).collect();
    ramp[5] = [f32::NAN; 3];
    let figure = figure(&ramp, &ramp, Some(&mask), &[]);
    let (canvas, layout) = (figure.paint().unwrap(), Layout::new(&figure).unwrap());
    for panel in layout.panels {
        let colors: Vec<Rgb> = (0..64).map(|i| canvas.get(panel.x + 40 + i % 8, panel.y + i / 8)).collect();
        assert!(colors.contains(&[176; 3]) && colors.iter().all(|color| [[176; 3], [226; 3]].contains(color)));
    }
    assert!(layout.picture_notes.join(" ").contains("Hatched: not compared."));
}

#[test]
fn text_fits_the_page_and_overlaps_nothing() {
    let (reference, test) = (ramp(), vec![[3.0e-7; 3]; 1200]);
    let long = "Irradiance below a wave ".repeat(12);
    let mut many = metrics(13);
    many.push((long.clone(), "1.0".to_owned()));
    let wide = vec![("a name of some thirty characters".to_owned(), "and a value of as many or more".to_owned()); 5];
    for metrics in [&[][..], &metrics(1), &metrics(7), &wide, &many] {
        for name in ["Result", &long] {
            let figure = Figure { title: name, test_name: name, unit: name, ..figure(&reference, &test, None, metrics) };
            let (canvas, layout) = (figure.paint().unwrap(), Layout::new(&figure).unwrap());
            let obstacles: Vec<Rect> = layout.panels.into_iter().chain([layout.bar]).collect();
            for (index, text) in canvas.boxes.iter().enumerate() {
                assert!(text.x >= layout.style.margin && text.right() <= canvas.width() - layout.style.margin, "{text:?}");
                assert!(text.y >= layout.style.margin && text.bottom() <= canvas.height() - layout.style.margin, "{text:?}");
                assert!(canvas.boxes[..index].iter().chain(&obstacles).all(|other| !text.overlaps(*other)), "{text:?}");
            }
        }
    }
}

#[test]
fn the_same_figure_has_the_same_bytes() {
    let (reference, metrics) = (ramp(), metrics(5));
    let mut test = reference.clone();
    test[3] = [9.0; 3];
    let bytes = || figure(&reference, &test, None, &metrics).png().unwrap();
    let on = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(bytes);
    assert!(on(1) == on(2) && on(1) == on(7));
    let other = figure(&reference, &reference, None, &metrics).png().unwrap();
    assert_ne!(other, bytes());
}

#[test]
fn a_figure_beyond_memory_is_refused() {
    let column = vec![[0.5; 3]; 1 << 17];
    let pair = Pair::new(1, 1 << 17, &column, &column).unwrap();
    let figure = Figure { title: "", pair, reference_name: "", test_name: "", unit: "", metrics: &[] };
    assert!(matches!(figure.png(), Err(ReportError::Size { .. })));
}
