//! Plots whose parts are known.

use super::*;
use crate::report::ReportError;

const FALLING: [(f64, f64); 5] = [(16.0, 0.31), (32.0, 0.082), (64.0, 0.0205), (128.0, 0.0049), (256.0, 0.0013)];

fn plot<'a>(series: &'a [Series<'a>]) -> Plot<'a> {
    Plot {
        title: "Error against grid size",
        x_label: "grid vertices per side",
        y_label: "relMSE",
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        series,
        width: 640,
        height: 440,
    }
}

fn series<'a>(name: &'a str, points: &'a [(f64, f64)]) -> Series<'a> {
    Series { name, points, is_fitted: true }
}

#[test]
fn text_fits_the_page_and_overlaps_nothing() {
    let long = "one of the longer names ".repeat(5);
    let steep: Vec<(f64, f64)> = (0..20).map(|i| (f64::from(i + 1), libm::pow(10.0, f64::from(-i)))).collect();
    let all = [series("conserving", &FALLING), series("paper", &steep), series(&long, &FALLING), series("last", &FALLING)];
    for count in 1..=all.len() {
        for scales in [(Scale::Log, Scale::Log), (Scale::Linear, Scale::Log), (Scale::Linear, Scale::Linear)] {
            for title in ["", "Error against grid size", &long] {
                let labels = if count > 2 { &long } else { "relMSE" };
                let plot = Plot { title, x_scale: scales.0, y_scale: scales.1, x_label: labels, y_label: labels, ..plot(&all[..count]) };
                let canvas = plot.paint().unwrap();
                assert_eq!((canvas.width(), canvas.height()), (640, 440));
                for (index, text) in canvas.boxes.iter().enumerate() {
                    assert!(text.x >= 20 && text.right() <= 620 && text.y >= 20 && text.bottom() <= 420, "{text:?}");
                    assert!(canvas.boxes[..index].iter().all(|other| !text.overlaps(*other)), "{scales:?} {title:?} {text:?}");
                }
            }
        }
    }
}

#[test]
fn the_same_plot_has_the_same_bytes() {
    let one = [series("conserving", &FALLING)];
    assert_eq!(plot(&one).png().unwrap(), plot(&one).png().unwrap());
    let joined = [Series { is_fitted: false, ..one[0] }];
    assert_ne!(plot(&one).png().unwrap(), plot(&joined).png().unwrap());
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    assert!(matches!(plot(&[]).png(), Err(ReportError::NoPoints)));
    assert!(matches!(plot(&[series("empty", &[])]).png(), Err(ReportError::NoPoints)));
    for point in [(0.0, 1.0), (1.0, -1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
        let error = plot(&[series("bad", &[(1.0, 1.0), point])]).png().unwrap_err();
        assert!(matches!(&error, ReportError::BadPoint { series, .. } if series == "bad"), "{error}");
    }
    let points = [(-1.0, 0.0)];
    let linear = Plot { x_scale: Scale::Linear, y_scale: Scale::Linear, ..plot(&[]) };
    assert!(Plot { series: &[series("one", &points)], ..linear }.png().is_ok());
    let good = [series("good", &FALLING)];
    for (width, height) in [(0, 440), (319, 440), (640, 239), (8193, 440)] {
        assert!(matches!(Plot { width, height, ..plot(&good) }.png(), Err(ReportError::Size { .. })), "{width}x{height}");
    }
    let title = "many words ".repeat(90);
    assert!(matches!(Plot { title: &title, ..plot(&good) }.png(), Err(ReportError::Size { .. })));
}
