//! Bitmap text: measures, wraps and cuts it.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, RasterizedChar, get_raster, get_raster_width};

/// A face of the font.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Font {
    height: RasterHeight,
    weight: FontWeight,
}

impl Font {
    pub(super) const fn regular(height: RasterHeight) -> Self {
        Self { height, weight: FontWeight::Regular }
    }

    pub(super) const fn bold(height: RasterHeight) -> Self {
        Self { height, weight: FontWeight::Bold }
    }

    /// Height of a line of text, in pixels.
    pub(super) fn line_px(self) -> u32 {
        self.height.val() as u32
    }

    /// Width of a text in one line, in pixels.
    pub(super) fn width_px(self, text: &str) -> u32 {
        text.chars().count() as u32 * self.char_px()
    }

    /// Width of one character, in pixels.
    pub(super) fn char_px(self) -> u32 {
        get_raster_width(self.weight, self.height) as u32
    }

    /// The bitmap of a character; a question mark if the font lacks the character.
    pub(super) fn glyph(self, character: char) -> Option<RasterizedChar> {
        // The font has only one kind of space.
        let character = if character == '\u{a0}' { ' ' } else { character };
        get_raster(character, self.weight, self.height).or_else(|| get_raster('?', self.weight, self.height))
    }

    /// The text if it fits into `width_px`; otherwise its beginning, followed by three dots.
    pub(super) fn cut(self, text: &str, width_px: u32) -> String {
        let room = (width_px / self.char_px()) as usize;
        if text.chars().count() <= room {
            return text.to_owned();
        }
        let kept: String = text.chars().take(room.saturating_sub(3)).collect();
        kept.trim_end().chars().chain("...".chars().take(room)).collect()
    }

    /// The text in lines of at most `width_px`. Lines break at spaces but not at no-break spaces; a longer word is cut.
    pub(super) fn wrap(self, text: &str, width_px: u32) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split([' ', '\n']).filter(|word| !word.is_empty()) {
            match lines.last_mut() {
                Some(line) if self.width_px(line) + self.width_px(word) + self.char_px() <= width_px => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(self.cut(word, width_px)),
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FONT: Font = Font::regular(RasterHeight::Size16);

    #[test]
    fn text_is_as_wide_as_its_characters() {
        assert_eq!(FONT.width_px("W/m²"), 4 * FONT.char_px());
        assert_eq!(FONT.line_px(), 16);
        for character in "aZ09²±×·µ%()<>^".chars() {
            assert!(get_raster(character, FontWeight::Regular, RasterHeight::Size16).is_some(), "{character}");
        }
        assert_eq!(FONT.glyph('\u{a0}').map(|glyph| glyph.pixels()), FONT.glyph(' ').map(|glyph| glyph.pixels()));
        assert_eq!(FONT.glyph('月').map(|glyph| glyph.pixels()), FONT.glyph('?').map(|glyph| glyph.pixels()));
    }

    #[test]
    fn lines_fit() {
        let width = 10 * FONT.char_px() + 3;
        assert_eq!(FONT.wrap("one two three fourteen-letters", width), ["one two", "three", "fourtee..."]);
        assert_eq!(FONT.cut("0123456789", width), "0123456789");
        assert_eq!(FONT.cut("0123456789a", width), "0123456...");
        assert_eq!(FONT.cut("012345 789a", width), "012345...");
        assert_eq!(FONT.cut("abc", 2 * FONT.char_px()), "..");
        assert_eq!(FONT.wrap("nearly 12\u{a0}% of it", width), ["nearly", "12\u{a0}% of it"]);
        assert!(FONT.wrap("  ", width).is_empty());
    }
}
