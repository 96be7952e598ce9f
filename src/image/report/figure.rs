//! Figures: reference, result and difference, side by side.

use noto_sans_mono_bitmap::RasterHeight;

use super::ReportError;
use super::canvas::{Align, BLACK, Canvas, GREY, LIGHT, Rect, Rgb};
use super::colormap::diverging;
use super::number::{ROUNDING, number, round_up, short};
use super::text::Font;
use crate::metrics::{Pair, Which, luminance, quantile};
use crate::tone::{quantize_8bit, srgb_encode};

/// Panels narrower than this are magnified.
const LEAST_PANEL_PX: u32 = 320;
/// From this panel width on, text and distances are larger.
const LARGE_PANEL_PX: u32 = 700;
/// Least height of the colour bar, so that its numbers do not touch.
const LEAST_BAR_PX: u32 = 120;
/// Share of the luminances that the exposure brings to at most [`SHOWN`] of white.
const EXPOSED_QUANTILE: f64 = 0.99;
/// See [`EXPOSED_QUANTILE`].
const SHOWN: f64 = 0.9;
/// Share of the differences that the colour bar covers.
const RANGE_QUANTILE: f64 = 0.995;

/// A figure for a comparison: reference, result and signed difference as three panels, and a table of numbers.
///
/// - Reference and result are shown with one exposure, which brings the 99 % quantile of the reference's luminance to 0.9 of white; brighter values
///   are clipped. The only tone curve is that of sRGB.
/// - The difference is that of luminances, result minus reference, in [`diverging`] colours: blue is too dark, red too bright. The colour bar is
///   symmetric and covers 99.5 % of the pixels, rounded up; the figure states how many pixels lie beyond.
/// - Pixels that do not count are hatched.
/// - Pixels are shown 1:1. Panels narrower than 320 pixels are magnified by a whole number.
#[derive(Clone, Copy, Debug)]
pub struct Figure<'a> {
    /// Heading, wrapped to the width of the figure.
    pub title: &'a str,
    /// The pictures: linear RGB.
    pub pair: Pair<'a>,
    /// Caption of the first panel, such as "Reference".
    pub reference_name: &'a str,
    /// Caption of the second panel, such as the name of a technique.
    pub test_name: &'a str,
    /// Unit of the pictures' values, such as `W/m²`.
    pub unit: &'a str,
    /// Rows of the table: name and value.
    pub metrics: &'a [(String, String)],
}

impl Figure<'_> {
    /// Draws the figure. Returns the bytes of an 8-bit sRGB PNG.
    ///
    /// # Errors
    /// If the figure would have more than 2^28 pixels.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        self.paint()?.png()
    }

    fn paint(&self) -> Result<Canvas, ReportError> {
        let layout = Layout::new(self)?;
        let mut canvas = Canvas::new(layout.width, layout.height)?;
        let style = layout.style;
        let content = layout.panels[0].x;
        for (row, line) in layout.title.iter().enumerate() {
            canvas.text(content, style.margin + row as u32 * style.title.line_px(), Align::Left, line, style.title, BLACK);
        }
        self.paint_pictures(&mut canvas, &layout);
        self.paint_difference(&mut canvas, &layout);
        self.paint_table(&mut canvas, &layout);
        Ok(canvas)
    }

    /// Draws the first two panels and the note below them.
    fn paint_pictures(&self, canvas: &mut Canvas, layout: &Layout) {
        for (which, panel) in [Which::Reference, Which::Test].into_iter().zip(layout.panels) {
            let pixels = self.pair.picture(which);
            self.paint_panel(canvas, layout, panel, |index| {
                pixels[index].map(|channel| quantize_8bit(srgb_encode((f64::from(channel) * layout.scale.exposure) as f32)))
            });
        }
        let style = layout.style;
        let captions = [("(a) ", self.reference_name), ("(b) ", self.test_name), ("(c) ", "Difference")];
        for ((letter, name), panel) in captions.into_iter().zip(layout.panels) {
            let caption = style.caption.cut(&format!("{letter}{name}"), panel.width);
            canvas.text(panel.x, layout.captions_y, Align::Left, &caption, style.caption, BLACK);
        }
        for (notes, panel) in [(&layout.picture_notes, layout.panels[0]), (&layout.difference_notes, layout.panels[2])] {
            for (row, line) in notes.iter().enumerate() {
                canvas.text(panel.x, layout.notes_y + row as u32 * style.note.line_px(), Align::Left, line, style.note, GREY);
            }
        }
    }

    /// Draws the third panel and its colour bar.
    fn paint_difference(&self, canvas: &mut Canvas, layout: &Layout) {
        let (pair, range) = (&self.pair, layout.scale.range);
        self.paint_panel(canvas, layout, layout.panels[2], |index| diverging(difference(pair, index) / range));
        let (bar, style) = (layout.bar, layout.style);
        for row in 0..bar.height {
            // From +1 at the middle of the first row to −1 at that of the last.
            let value = 1.0 - 2.0 * f64::from(row) / f64::from(bar.height - 1);
            canvas.fill(Rect { y: bar.y + row, height: 1, ..bar }, diverging(value));
        }
        canvas.frame(bar, GREY);
        for (quarter, label) in layout.ticks.iter().enumerate() {
            let y = bar.y + (quarter as u32 * (bar.height - 1) + 2) / 4;
            canvas.fill(Rect { x: bar.right() + 1, y, width: style.tick, height: 1 }, GREY);
            let half = style.note.line_px() / 2;
            canvas.text(bar.right() + 1 + 2 * style.tick, y - half, Align::Left, label, style.note, BLACK);
        }
        let end = layout.width as u32 - style.margin;
        canvas.text(end, layout.captions_y + style.caption.line_px() - style.note.line_px(), Align::Right, &layout.unit, style.note, BLACK);
    }

    /// Draws one panel, magnified and framed. Pixels that do not count are hatched.
    fn paint_panel(&self, canvas: &mut Canvas, layout: &Layout, panel: Rect, color: impl Fn(usize) -> Rgb) {
        let width = self.pair.width();
        for y in 0..panel.height {
            for x in 0..panel.width {
                let index = ((y / layout.zoom) as usize) * width as usize + (x / layout.zoom) as usize;
                let shown = if self.pair.counts(index) { color(index) } else { hatching(x, y) };
                canvas.set(panel.x + x, panel.y + y, shown);
            }
        }
        canvas.frame(panel, GREY);
    }

    /// Draws the table in as many columns as fit, to be read down the columns.
    fn paint_table(&self, canvas: &mut Canvas, layout: &Layout) {
        let Some(table) = &layout.table else {
            return;
        };
        let style = layout.style;
        let end = layout.width as u32 - style.margin;
        let rule = |y: u32, height: u32| Rect { x: style.margin, y, width: end - style.margin, height };
        canvas.fill(rule(table.y, 2), BLACK);
        canvas.fill(rule(table.y + table.height - 2, 2), BLACK);
        for &(start, width) in &table.columns {
            for row in 1..table.rows as u32 {
                let y = table.y + 2 + style.gap / 2 + row * style.row_px() - style.row_px() / 6 - 1;
                canvas.fill(Rect { x: start, y, width, height: 1 }, LIGHT);
            }
        }
        for (index, (name, value)) in self.metrics.iter().enumerate() {
            let (start, width) = table.columns[index / table.rows];
            let y = table.y + 2 + style.gap / 2 + (index % table.rows) as u32 * style.row_px();
            let value = style.note.cut(value, width / 2);
            let room = width - style.note.width_px(&value) - style.note.char_px();
            canvas.text(start, y, Align::Left, &style.note.cut(name, room), style.note, GREY);
            canvas.text(start + width, y, Align::Right, &value, style.note, BLACK);
        }
    }
}

/// Difference of luminances at a pixel that counts, in the pictures' unit.
fn difference(pair: &Pair, index: usize) -> f64 {
    luminance(pair.test()[index]) - luminance(pair.reference()[index])
}

/// Grey with slanted darker stripes.
fn hatching(x: u32, y: u32) -> Rgb {
    if (x + y) % 8 < 2 { [176; 3] } else { [226; 3] }
}

/// Exposure and range of the colour bar.
struct Scales {
    /// Factor that reference and result are multiplied by.
    exposure: f64,
    /// Quantile of the luminance that determines the exposure.
    bright: f64,
    /// End of the colour bar, above 0.
    range: f64,
    /// Share of the pixels beyond the range.
    clipped: f64,
}

impl Scales {
    fn new(pair: &Pair) -> Self {
        let bright = |which: Which| {
            let mut values: Vec<f64> = pair.indices().map(|index| luminance(pair.picture(which)[index])).collect();
            quantile(&mut values, EXPOSED_QUANTILE).filter(|bright| *bright > 0.0)
        };
        let mut differences: Vec<f64> = pair.indices().map(|index| difference(pair, index).abs()).collect();
        let beyond = |range: f64, differences: &[f64]| differences.iter().filter(|value| **value > range * (1.0 + ROUNDING)).count();
        // If nearly all pixels agree, the quantile is 0, and the largest difference is used instead.
        let robust = quantile(&mut differences, RANGE_QUANTILE).unwrap_or(0.0);
        let largest = differences.last().copied().unwrap_or(0.0);
        let range = [robust, largest].into_iter().find(|value| *value > 0.0).map_or(1.0, round_up);
        let clipped = beyond(range, &differences) as f64 / differences.len() as f64;
        let bright = bright(Which::Reference).or_else(|| bright(Which::Test));
        Self { exposure: bright.map_or(1.0, |bright| SHOWN / bright), bright: bright.unwrap_or(0.0), range, clipped }
    }
}

/// Fonts and distances, in pixels.
#[derive(Clone, Copy)]
struct Style {
    title: Font,
    caption: Font,
    note: Font,
    margin: u32,
    gap: u32,
    bar: u32,
    tick: u32,
}

impl Style {
    fn of(panel_width: u32) -> Self {
        if panel_width < LARGE_PANEL_PX {
            let (title, caption) = (Font::bold(RasterHeight::Size24), Font::bold(RasterHeight::Size16));
            Self { title, caption, note: Font::regular(RasterHeight::Size16), margin: 28, gap: 20, bar: 14, tick: 4 }
        } else {
            let (title, caption) = (Font::bold(RasterHeight::Size32), Font::bold(RasterHeight::Size24));
            Self { title, caption, note: Font::regular(RasterHeight::Size24), margin: 40, gap: 30, bar: 20, tick: 6 }
        }
    }

    /// Height of a row of the table.
    fn row_px(&self) -> u32 {
        self.note.line_px() * 3 / 2
    }
}

/// The table below the panels.
struct Table {
    y: u32,
    height: u32,
    rows: usize,
    /// Start and width of each column.
    columns: Vec<(u32, u32)>,
}

/// Positions of all parts.
struct Layout {
    style: Style,
    scale: Scales,
    /// Magnification of pixels.
    zoom: u32,
    title: Vec<String>,
    captions_y: u32,
    panels: [Rect; 3],
    bar: Rect,
    /// Numbers beside the colour bar, from its top.
    ticks: [String; 5],
    /// Unit above the colour bar.
    unit: String,
    notes_y: u32,
    picture_notes: Vec<String>,
    difference_notes: Vec<String>,
    table: Option<Table>,
    width: u64,
    height: u64,
}

impl Layout {
    fn new(figure: &Figure) -> Result<Self, ReportError> {
        let (width, height) = (figure.pair.width(), figure.pair.height());
        let zoom = LEAST_PANEL_PX.div_ceil(width).max(1);
        let allowed = "panels must be below 2^24 pixels wide and high";
        let too_large = ReportError::Size { width: 3 * u64::from(width), height: u64::from(height), allowed };
        let limit = 1 << 24;
        let (panel_width, panel_height) = match (width.checked_mul(zoom), height.checked_mul(zoom)) {
            (Some(panel_width), Some(panel_height)) if panel_width < limit && panel_height < limit => (panel_width, panel_height),
            _ => return Err(too_large),
        };
        let style = Style::of(panel_width);
        let scale = Scales::new(&figure.pair);
        let end = short(scale.range, 3);
        let half = short(0.5 * scale.range, 3);
        let ticks = [format!("+{end}"), format!("+{half}"), "0".to_owned(), format!("-{half}"), format!("-{end}")];
        let tick_width = ticks.iter().map(|label| style.note.width_px(label)).max().unwrap_or(0);
        let bar_width = style.bar + 1 + 2 * style.tick + tick_width;

        let x = [0, 1, 2].map(|panel| style.margin + panel * (panel_width + style.gap));
        let bar_x = x[2] + panel_width + style.gap / 2;
        let right = bar_x + bar_width;
        let title = style.title.wrap(figure.title, right - style.margin);
        let captions_y = style.margin + title.len() as u32 * style.title.line_px() + if title.is_empty() { 0 } else { style.gap / 2 };
        // The number at the top of the colour bar extends above it by half a line, up to the unit.
        let panels_y = captions_y + style.caption.line_px() + style.note.line_px() / 2 + 2;
        let panels = x.map(|x| Rect { x, y: panels_y, width: panel_width, height: panel_height });
        let bar = Rect { x: bar_x, y: panels_y, width: style.bar, height: panel_height.max(LEAST_BAR_PX) };
        let unit = style.note.cut(figure.unit, right - bar_x);

        let notes_y = bar.bottom() + 10;
        let picture_notes = style.note.wrap(&Self::picture_note(figure, &scale), 2 * panel_width + style.gap);
        let difference_notes = style.note.wrap(&Self::difference_note(figure, &scale), right - x[2]);
        let rows = picture_notes.len().max(difference_notes.len()) as u32;
        let table_y = notes_y + rows * style.note.line_px() + style.gap;
        let table = Self::table(figure, style, table_y, &x, right);
        let bottom = table.as_ref().map_or(table_y - style.gap, |table| table.y + table.height);
        Ok(Self {
            style,
            scale,
            zoom,
            title,
            captions_y,
            panels,
            bar,
            ticks,
            unit,
            notes_y,
            picture_notes,
            difference_notes,
            table,
            width: u64::from(right + style.margin),
            height: u64::from(bottom + style.margin),
        })
    }

    /// As many columns as there are panels if all rows fit into their width, otherwise fewer and wider ones.
    fn table(figure: &Figure, style: Style, y: u32, panels_x: &[u32; 3], right: u32) -> Option<Table> {
        if figure.metrics.is_empty() {
            return None;
        }
        let whole = right - style.margin;
        let needed = |(name, value): &(String, String)| style.note.width_px(name) + style.note.width_px(value) + 2 * style.note.char_px();
        let needed = figure.metrics.iter().map(needed).max().unwrap_or(0);
        let panel_width = panels_x[1] - panels_x[0] - style.gap;
        let columns: Vec<(u32, u32)> = if needed <= panel_width - style.gap {
            // Values end before the names of the next column.
            vec![(panels_x[0], panel_width - style.gap), (panels_x[1], panel_width - style.gap), (panels_x[2], right - panels_x[2])]
        } else if needed <= whole / 2 - style.gap {
            let width = whole / 2 - style.gap;
            vec![(style.margin, width), (right - width, width)]
        } else {
            vec![(style.margin, whole)]
        };
        let rows = figure.metrics.len().div_ceil(columns.len());
        // Each row includes the space to the next one; the last row does not need it.
        let text = rows as u32 * style.row_px() - (style.row_px() - style.note.line_px());
        Some(Table { y, height: 4 + style.gap + text, rows, columns })
    }

    fn picture_note(figure: &Figure, scale: &Scales) -> String {
        let zoom = LEAST_PANEL_PX.div_ceil(figure.pair.width()).max(1);
        let magnified = if zoom > 1 { format!(" Pixels magnified {zoom} times.") } else { String::new() };
        let hatched = if figure.pair.count() < figure.pair.reference().len() { " Hatched: not compared." } else { "" };
        if scale.bright > 0.0 {
            let (exposure, bright, unit) = (number(scale.exposure, 3), number(scale.bright, 3), figure.unit);
            format!(
                "(a), (b): values times {exposure}, sRGB; the 99\u{a0}% quantile of luminance in (a), {bright}\u{a0}{unit}, \
                 is shown as 0.9 of white.{hatched}{magnified}"
            )
        } else {
            format!("(a), (b): values as they are, sRGB.{hatched}{magnified}")
        }
    }

    fn difference_note(figure: &Figure, scale: &Scales) -> String {
        let beyond = match scale.clipped {
            0.0 => "nothing clipped.".to_owned(),
            share => {
                let (range, percent) = (short(scale.range, 3), number(100.0 * share, 2));
                format!("clipped beyond ±{range}\u{a0}{} ({percent}\u{a0}% of pixels).", figure.unit)
            }
        };
        format!("(c): luminance, (b) minus (a); {beyond}")
    }
}

#[cfg(test)]
#[path = "figure_tests.rs"]
mod tests;
