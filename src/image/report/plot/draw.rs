//! Layout and painting of a plot.

use noto_sans_mono_bitmap::RasterHeight;

use super::axis::{Axis, Scale, Tick};
use super::{Plot, Series};
use crate::metrics::PowerLaw;
use crate::report::ReportError;
use crate::report::canvas::{Align, BLACK, Canvas, GREY, LIGHT, Rect, Rgb};
use crate::report::text::Font;

/// Colours of the series, distinguishable with any colour vision: M. Okabe & K. Ito, "Color Universal Design", 2008, without their yellow.
const COLORS: [Rgb; 7] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [230, 159, 0], [86, 180, 233], [60, 60, 60]];
/// Distance from the border of the picture, in pixels.
const MARGIN: u32 = 24;
/// Distance between parts, in pixels.
const GAP: u32 = 12;
/// Length of a labelled tick, in pixels.
const TICK: u32 = 6;
/// Length of the line in the legend, in pixels.
const SAMPLE: u32 = 36;
/// Least width and height of the area inside the axes, in pixels.
const LEAST_AREA: u32 = 100;
const TITLE: Font = Font::bold(RasterHeight::Size20);
const LABEL: Font = Font::regular(RasterHeight::Size16);
/// Larger than other text, so that exponents can be smaller.
const TICKS: Font = Font::regular(RasterHeight::Size20);
const EXPONENT: Font = Font::regular(RasterHeight::Size16);

impl Plot<'_> {
    /// Draws the plot. Returns the bytes of an 8-bit sRGB PNG.
    ///
    /// # Errors
    /// If there is no point, a point cannot be shown on the axes, or the size is out of range or too small for title and legend.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        self.paint()?.png()
    }

    pub(super) fn paint(&self) -> Result<Canvas, ReportError> {
        self.check()?;
        let laws: Vec<Option<PowerLaw>> = self.series.iter().map(|series| self.law(series)).collect();
        let points = || self.series.iter().flat_map(|series| series.points.iter().copied());
        let ends = || self.series.iter().zip(&laws).flat_map(|(series, law)| fitted_ends(series, law.as_ref()));
        let x_axis = Axis::new(self.x_scale, points().map(|(x, _)| x));
        let y_axis = Axis::new(self.y_scale, points().chain(ends()).map(|(_, y)| y));

        let legend = self.legend(&laws);
        let title = TITLE.wrap(self.title, self.width - 2 * MARGIN);
        let legend_y = MARGIN + title.len() as u32 * TITLE.line_px() + if title.is_empty() { 0 } else { GAP };
        let legend_rows = legend.last().map_or(0, |entry| entry.row + 1);
        let top = legend_y + legend_rows * (LABEL.line_px() + 4) + GAP;
        let tick_width = y_axis.ticks.iter().map(label_width).max().unwrap_or(0);
        let left = MARGIN + LABEL.line_px() + GAP + tick_width + 2 * TICK;
        let below = MARGIN + LABEL.line_px() + GAP / 2 + TICKS.line_px() + TICK + 2;
        // The last label of the x axis may extend to the right by half of its width.
        let beside = MARGIN + x_axis.ticks.iter().map(label_width).max().unwrap_or(0) / 2;
        let too_small = left + beside + LEAST_AREA > self.width || top + below + LEAST_AREA > self.height;
        if too_small {
            let (width, height) = (u64::from(self.width), u64::from(self.height));
            return Err(ReportError::Size { width, height, allowed: "title, legend and labels must leave 100x100 pixels for the plot" });
        }
        let area = Rect { x: left, y: top, width: self.width - left - beside, height: self.height - top - below };

        let mut canvas = Canvas::new(u64::from(self.width), u64::from(self.height))?;
        for (row, line) in title.iter().enumerate() {
            canvas.text(
                area.x,
                MARGIN + row as u32 * TITLE.line_px(),
                Align::Left,
                &TITLE.cut(line, self.width - MARGIN - area.x),
                TITLE,
                BLACK,
            );
        }
        for entry in &legend {
            entry.paint(&mut canvas, area.x, legend_y);
        }
        paint_axes(&mut canvas, area, &x_axis, &y_axis);
        let x_label = LABEL.cut(self.x_label, area.width);
        canvas.text(area.x + area.width / 2, self.height - MARGIN - LABEL.line_px(), Align::Centre, &x_label, LABEL, BLACK);
        canvas.text_upwards(MARGIN, area.y + area.height / 2, &LABEL.cut(self.y_label, area.height), LABEL, BLACK);

        let place = |(x, y): (f64, f64)| {
            let (x, y) = (x_axis.place(x) * f64::from(area.width), (1.0 - y_axis.place(y)) * f64::from(area.height));
            ((f64::from(area.x) + x) as f32, (f64::from(area.y) + y) as f32)
        };
        for (index, (series, law)) in self.series.iter().zip(&laws).enumerate() {
            let places: Vec<(f32, f32)> = series.points.iter().map(|&point| place(point)).collect();
            let color = COLORS[index % COLORS.len()];
            let fitted: Vec<(f32, f32)> = fitted_ends(series, law.as_ref()).into_iter().map(place).collect();
            // A fitted series is drawn as points and the law; other series are joined by a line.
            match fitted.is_empty() {
                true => canvas.line(&places, 2.0, color, false),
                false => canvas.line(&fitted, 1.5, color, true),
            }
            for &at in &places {
                paint_marker(&mut canvas, index, at, color);
            }
        }
        Ok(canvas)
    }

    fn check(&self) -> Result<(), ReportError> {
        let (width, height) = (u64::from(self.width), u64::from(self.height));
        if !(320..=8192).contains(&width) || !(240..=8192).contains(&height) {
            return Err(ReportError::Size { width, height, allowed: "a plot must be 320x240 to 8192x8192 pixels" });
        }
        let has_place = |scale: Scale, value: f64| value.is_finite() && (scale == Scale::Linear || value > 0.0);
        for series in self.series {
            for &(x, y) in series.points {
                if !(has_place(self.x_scale, x) && has_place(self.y_scale, y)) {
                    return Err(ReportError::BadPoint { series: series.name.to_owned(), x, y });
                }
            }
        }
        if self.series.iter().all(|series| series.points.is_empty()) { Err(ReportError::NoPoints) } else { Ok(()) }
    }

    /// The power law of a series, if it is to be fitted and can be.
    fn law(&self, series: &Series) -> Option<PowerLaw> {
        let is_log = self.x_scale == Scale::Log && self.y_scale == Scale::Log;
        if series.is_fitted && is_log { PowerLaw::fit(series.points) } else { None }
    }

    /// Legend entries from left to right, in as many rows as necessary.
    fn legend(&self, laws: &[Option<PowerLaw>]) -> Vec<Entry> {
        // The legend starts where the axes do, which is farther in than the margin; this is the least width that remains.
        let room = (self.width / 2).max(self.width.saturating_sub(2 * MARGIN + 160));
        let (mut x, mut row) = (0, 0);
        let mut entries = Vec::new();
        for (index, (series, law)) in self.series.iter().zip(laws).enumerate() {
            let text = law.map_or(series.name.to_owned(), |law| format!("{} (slope {:.2})", series.name, law.exponent));
            let text = LABEL.cut(&text, room - SAMPLE - 8);
            let width = SAMPLE + 8 + LABEL.width_px(&text);
            if x > 0 && x + width > room {
                (x, row) = (0, row + 1);
            }
            entries.push(Entry { index, text, x, row, is_fitted: law.is_some() });
            x += width + 2 * GAP;
        }
        entries
    }
}

/// One name in the legend.
struct Entry {
    index: usize,
    text: String,
    x: u32,
    row: u32,
    is_fitted: bool,
}

impl Entry {
    fn paint(&self, canvas: &mut Canvas, left: u32, top: u32) {
        let (x, y) = (left + self.x, top + self.row * (LABEL.line_px() + 4));
        let middle = (y + LABEL.line_px() / 2) as f32;
        let color = COLORS[self.index % COLORS.len()];
        let width = if self.is_fitted { 1.5 } else { 2.0 };
        canvas.line(&[(x as f32, middle), ((x + SAMPLE) as f32, middle)], width, color, self.is_fitted);
        paint_marker(canvas, self.index, ((x + SAMPLE / 2) as f32, middle), color);
        canvas.text(x + SAMPLE + 8, y, Align::Left, &self.text, LABEL, BLACK);
    }
}

/// The ends of the fitted line of a series; empty without a law.
fn fitted_ends(series: &Series, law: Option<&PowerLaw>) -> Vec<(f64, f64)> {
    let xs = series.points.iter().map(|(x, _)| *x);
    let (low, high) = (xs.clone().fold(f64::INFINITY, f64::min), xs.fold(0.0, f64::max));
    law.map_or(Vec::new(), |law| vec![(low, law.at(low)), (high, law.at(high))])
}

/// Width of a tick's label, in pixels.
fn label_width(tick: &Tick) -> u32 {
    tick.label.as_ref().map_or(0, |(base, exponent)| TICKS.width_px(base) + EXPONENT.width_px(exponent))
}

/// Draws grid, frame, ticks and labels. A label that would touch the one before it is left out.
fn paint_axes(canvas: &mut Canvas, area: Rect, x_axis: &Axis, y_axis: &Axis) {
    let column = |tick: &Tick| area.x + (x_axis.place(tick.value) * f64::from(area.width)).round() as u32;
    let row = |tick: &Tick| area.bottom() - (y_axis.place(tick.value) * f64::from(area.height)).round() as u32;
    for tick in x_axis.ticks.iter().filter(|tick| tick.label.is_some()) {
        canvas.fill(Rect { x: column(tick), y: area.y, width: 1, height: area.height }, LIGHT);
    }
    for tick in y_axis.ticks.iter().filter(|tick| tick.label.is_some()) {
        canvas.fill(Rect { x: area.x, y: row(tick), width: area.width, height: 1 }, LIGHT);
    }
    canvas.frame(area, GREY);
    let length = |tick: &Tick| if tick.label.is_some() { TICK } else { TICK / 2 };

    let mut free_from = 0;
    for tick in &x_axis.ticks {
        let x = column(tick);
        canvas.fill(Rect { x, y: area.bottom() + 1, width: 1, height: length(tick) }, GREY);
        let start = x.saturating_sub(label_width(tick) / 2);
        if start >= free_from && tick.label.is_some() {
            paint_label(canvas, start, area.bottom() + 1 + TICK + 2, tick);
            free_from = start + label_width(tick) + TICKS.char_px();
        }
    }
    let mut free_to = u32::MAX;
    for tick in &y_axis.ticks {
        let y = row(tick);
        canvas.fill(Rect { x: area.x - 1 - length(tick), y, width: length(tick), height: 1 }, GREY);
        let half = TICKS.line_px() / 2;
        if tick.label.is_some() && y + half <= free_to {
            paint_label(canvas, area.x - 1 - 2 * TICK + 3 - label_width(tick), y - half, tick);
            free_to = y - half;
        }
    }
}

/// Draws the label of a tick, with a raised exponent.
fn paint_label(canvas: &mut Canvas, x: u32, y: u32, tick: &Tick) {
    if let Some((base, exponent)) = &tick.label {
        canvas.text(x, y, Align::Left, base, TICKS, BLACK);
        canvas.text(x + TICKS.width_px(base), y - 4, Align::Left, exponent, EXPONENT, BLACK);
    }
}

/// Draws a disc, square, triangle or diamond with a white rim, which separates it from lines.
fn paint_marker(canvas: &mut Canvas, index: usize, (x, y): (f32, f32), color: Rgb) {
    for (radius, color) in [(6.5, [255; 3]), (5.0, color)] {
        let corners =
            |corners: &[(f32, f32)]| -> Vec<(f32, f32)> { corners.iter().map(|(dx, dy)| (x + dx * radius, y + dy * radius)).collect() };
        match index % 4 {
            0 => canvas.disc((x, y), radius, color),
            1 => canvas.polygon(&corners(&[(-0.88, -0.88), (0.88, -0.88), (0.88, 0.88), (-0.88, 0.88)]), color),
            2 => canvas.polygon(&corners(&[(0.0, -1.2), (1.1, 0.75), (-1.1, 0.75)]), color),
            _ => canvas.polygon(&corners(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)]), color),
        }
    }
}
