//! A white page to draw on: pixels, lines and text.

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Stroke, StrokeDash, Transform,
};

use super::ReportError;
use super::text::Font;

/// An 8-bit sRGB colour.
pub(super) type Rgb = [u8; 3];

/// Text and frames.
pub(super) const BLACK: Rgb = [26, 26, 26];
/// Notes and ticks.
pub(super) const GREY: Rgb = [96, 96, 96];
/// Grid lines.
pub(super) const LIGHT: Rgb = [222, 222, 222];

/// Most pixels of a page: 1 GiB of memory.
const MAX_PIXELS: u64 = 1 << 28;

/// A rectangle in pixels, with exclusive ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rect {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Rect {
    pub(super) fn right(self) -> u32 {
        self.x + self.width
    }

    pub(super) fn bottom(self) -> u32 {
        self.y + self.height
    }

    /// Whether two rectangles share a pixel.
    #[cfg(test)]
    pub(super) fn overlaps(self, other: Self) -> bool {
        self.x < other.right() && other.x < self.right() && self.y < other.bottom() && other.y < self.bottom()
    }
}

/// Alignment of a text relative to its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Align {
    /// The text begins at the position.
    Left,
    /// The text is centred at the position.
    Centre,
    /// The text ends at the position.
    Right,
}

/// A page.
pub(super) struct Canvas {
    pixmap: Pixmap,
    /// Boxes of all texts drawn, so that a test can check whether they fit.
    pub boxes: Vec<Rect>,
}

impl Canvas {
    /// A white page.
    pub(super) fn new(width: u64, height: u64) -> Result<Self, ReportError> {
        let too_large = || ReportError::Size { width, height, allowed: "it must have 1 to 2^28 pixels" };
        if width.checked_mul(height).is_none_or(|count| count == 0 || count > MAX_PIXELS) {
            return Err(too_large());
        }
        let mut pixmap = Pixmap::new(width as u32, height as u32).ok_or_else(too_large)?;
        pixmap.fill(Color::WHITE);
        Ok(Self { pixmap, boxes: Vec::new() })
    }

    pub(super) fn width(&self) -> u32 {
        self.pixmap.width()
    }

    pub(super) fn height(&self) -> u32 {
        self.pixmap.height()
    }

    /// The colour at a position inside the page.
    #[cfg(test)]
    pub(super) fn get(&self, x: u32, y: u32) -> Rgb {
        let pixel = self.pixmap.pixel(x, y).expect("a place inside the page");
        [pixel.red(), pixel.green(), pixel.blue()]
    }

    /// Sets a pixel; does nothing outside of the page.
    pub(super) fn set(&mut self, x: u32, y: u32, [r, g, b]: Rgb) {
        self.blend(x, y, [r, g, b], 255);
    }

    /// Blends a colour with weight `coverage/255`.
    fn blend(&mut self, x: u32, y: u32, color: Rgb, coverage: u8) {
        if x >= self.width() || y >= self.height() {
            return;
        }
        let at = y as usize * self.width() as usize + x as usize;
        let pixel = &mut self.pixmap.pixels_mut()[at];
        let share = u32::from(coverage);
        let mix = |under: u8, over: u8| ((u32::from(under) * (255 - share) + u32::from(over) * share + 127) / 255) as u8;
        let [r, g, b] = [mix(pixel.red(), color[0]), mix(pixel.green(), color[1]), mix(pixel.blue(), color[2])];
        // The colour is opaque, so premultiplied and straight are the same.
        *pixel = PremultipliedColorU8::from_rgba(r, g, b, 255).unwrap_or(*pixel);
    }

    /// Fills whole pixels.
    pub(super) fn fill(&mut self, rect: Rect, color: Rgb) {
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                self.set(x, y, color);
            }
        }
    }

    /// Draws a frame of one pixel around a rectangle, outside of the rectangle.
    pub(super) fn frame(&mut self, rect: Rect, color: Rgb) {
        let Rect { x, y, width, height } = rect;
        self.fill(Rect { x: x - 1, y: y - 1, width: width + 2, height: 1 }, color);
        self.fill(Rect { x: x - 1, y: y + height, width: width + 2, height: 1 }, color);
        self.fill(Rect { x: x - 1, y, width: 1, height }, color);
        self.fill(Rect { x: x + width, y, width: 1, height }, color);
    }

    /// Draws an anti-aliased line through points, dashed if wanted.
    pub(super) fn line(&mut self, points: &[(f32, f32)], width_px: f32, color: Rgb, is_dashed: bool) {
        let Some(path) = polyline(points, false) else {
            return;
        };
        let dash = if is_dashed { StrokeDash::new(vec![3.0 * width_px, 3.0 * width_px], 0.0) } else { None };
        let stroke = Stroke { width: width_px, line_cap: LineCap::Butt, line_join: LineJoin::Round, dash, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint(color), &stroke, Transform::identity(), None);
    }

    /// Fills an anti-aliased polygon.
    pub(super) fn polygon(&mut self, points: &[(f32, f32)], color: Rgb) {
        if let Some(path) = polyline(points, true) {
            self.pixmap.fill_path(&path, &paint(color), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Fills an anti-aliased disc.
    pub(super) fn disc(&mut self, (x, y): (f32, f32), radius: f32, color: Rgb) {
        if let Some(path) = PathBuilder::from_circle(x, y, radius) {
            self.pixmap.fill_path(&path, &paint(color), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Writes a line of text with its top at `y`.
    pub(super) fn text(&mut self, x: u32, y: u32, align: Align, text: &str, font: Font, color: Rgb) {
        let width = font.width_px(text);
        let x = match align {
            Align::Left => x,
            Align::Centre => x.saturating_sub(width / 2),
            Align::Right => x.saturating_sub(width),
        };
        if width > 0 {
            self.boxes.push(Rect { x, y, width, height: font.line_px() });
        }
        self.glyphs(text, font, color, |along, down| (x + along, y + down));
    }

    /// Writes a line of text that is read from bottom to top, with its middle at `y` and its top at `x`.
    pub(super) fn text_upwards(&mut self, x: u32, y: u32, text: &str, font: Font, color: Rgb) {
        let width = font.width_px(text);
        let end = y + width / 2;
        if width > 0 {
            self.boxes.push(Rect { x, y: end.saturating_sub(width), width: font.line_px(), height: width });
        }
        self.glyphs(text, font, color, |along, down| (x + down, end.saturating_sub(along + 1)));
    }

    /// Draws a text pixel by pixel. `place` maps the distance along the line and down from its top to a pixel.
    fn glyphs(&mut self, text: &str, font: Font, color: Rgb, place: impl Fn(u32, u32) -> (u32, u32)) {
        for (index, character) in text.chars().enumerate() {
            let Some(glyph) = font.glyph(character) else {
                continue;
            };
            for (down, row) in glyph.rows().enumerate() {
                for (along, &coverage) in row.iter().enumerate() {
                    if coverage > 0 {
                        let (x, y) = place(index as u32 * font.char_px() + along as u32, down as u32);
                        self.blend(x, y, color, coverage);
                    }
                }
            }
        }
    }

    /// The bytes of an 8-bit sRGB PNG.
    pub(super) fn png(&self) -> Result<Vec<u8>, ReportError> {
        let codes: Vec<u8> = self.pixmap.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width(), self.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&codes)?;
        writer.finish()?;
        Ok(bytes)
    }
}

fn paint([r, g, b]: Rgb) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, 255);
    paint.anti_alias = true;
    paint
}

fn polyline(points: &[(f32, f32)], is_closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        if index == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    if is_closed {
        builder.close();
    }
    builder.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use noto_sans_mono_bitmap::RasterHeight;

    #[test]
    fn pages_of_no_or_too_many_pixels_are_refused() {
        for (width, height) in [(0, 10), (10, 0), (1 << 15, 1 << 14), (u64::MAX, 2)] {
            assert!(matches!(Canvas::new(width, height), Err(ReportError::Size { .. })), "{width}x{height}");
        }
    }

    #[test]
    fn drawing_outside_changes_nothing() {
        let mut canvas = Canvas::new(8, 8).unwrap();
        canvas.set(8, 0, BLACK);
        canvas.text(20, 30, Align::Left, "text", Font::regular(RasterHeight::Size16), BLACK);
        canvas.line(&[(-5.0, -5.0), (-1.0, -9.0)], 1.0, BLACK, false);
        assert!((0..64).all(|i| canvas.get(i % 8, i / 8) == [255; 3]));
    }

    #[test]
    fn text_read_upwards_is_text_turned() {
        let font = Font::bold(RasterHeight::Size20);
        let (mut flat, mut turned) = (Canvas::new(60, 60).unwrap(), Canvas::new(60, 60).unwrap());
        flat.text(30, 10, Align::Centre, "F(x)", font, BLACK);
        turned.text_upwards(10, 30, "F(x)", font, BLACK);
        assert!((0..60).any(|x| flat.get(x, 20) != [255; 3]));
        for (x, y) in (0..3600).map(|i| (i % 60, i / 60)) {
            assert_eq!(flat.get(x, y), turned.get(y, 59 - x), "({x}, {y})");
        }
    }
}
