//! Values of flags: converts words of the command line to numbers, sizes and settings.

use crate::scene::{MAX_IMAGE_PX, MAX_TIME_S};

/// The limit on memory, a flag of every verb that computes pictures.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct MemoryLimit {
    /// Refuse to start what takes more memory than this, in MiB
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    memory_limit: u32,
}

impl MemoryLimit {
    /// The limit in bytes.
    pub fn bytes(self) -> u64 {
        u64::from(self.memory_limit) << 20
    }
}

/// Largest number of threads that can be requested.
pub const MAX_THREADS: u16 = 1024;

/// Width and height of the image, in pixels, each in `1..=MAX_IMAGE_PX`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

/// One `--set KEY=VALUE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingArgument {
    /// Key of the setting: field names joined by dots.
    pub key: String,
    /// The new value, in the syntax of scene files.
    pub value: String,
}

/// Parses `WxH`, such as `1280x720`.
///
/// # Errors
/// With a message that states the allowed form and range.
pub fn image_size(text: &str) -> Result<ImageSize, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_IMAGE_PX).contains(side));
    match text.split_once('x').map(|(width, height)| (side(width), side(height))) {
        Some((Some(width), Some(height))) => Ok(ImageSize { width, height }),
        _ => Err(format!("expected WIDTHxHEIGHT in pixels, each 1 to {MAX_IMAGE_PX}, such as 1280x720")),
    }
}

/// Parses `KEY=VALUE`; only the first `=` separates.
///
/// # Errors
/// With a message if there is no `=`, or if key or value is empty.
pub fn setting(text: &str) -> Result<SettingArgument, String> {
    match text.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
        Some((key, value)) if !key.is_empty() && !value.is_empty() => Ok(SettingArgument { key: key.to_owned(), value: value.to_owned() }),
        _ => Err("expected KEY=VALUE; `nephroid list settings` shows the keys".to_owned()),
    }
}

/// Parses a number of seconds in the range that scenes allow.
///
/// # Errors
/// With a message that states the allowed range.
pub fn seconds(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(seconds) if (0.0..=MAX_TIME_S).contains(&seconds) => Ok(seconds),
        _ => Err(format!("expected a number of seconds, from 0 to {MAX_TIME_S}")),
    }
}

/// Parses a count that may be large: digits, optionally followed by `k`, `M` or `G`, such as `50M`; at least 1.
///
/// # Errors
/// With a message that states the allowed form and range.
pub fn large_count(text: &str) -> Result<u64, String> {
    let (digits, factor) = match text.char_indices().last() {
        Some((at, 'k')) => (&text[..at], 1_000),
        Some((at, 'M')) => (&text[..at], 1_000_000),
        Some((at, 'G')) => (&text[..at], 1_000_000_000),
        _ => (text, 1),
    };
    let count = digits.parse::<u64>().ok().and_then(|count| count.checked_mul(factor));
    count
        .filter(|count| (1..=MAX_COUNT).contains(count))
        .ok_or_else(|| format!("expected a whole number from 1 to {MAX_COUNT}, such as 50M"))
}

/// Largest count that can be requested.
const MAX_COUNT: u64 = 1_000_000_000_000_000;

/// Parses a time limit in seconds: above 0, at most a year.
///
/// # Errors
/// With a message that states the allowed range.
pub fn time_limit(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && seconds <= 31_536_000.0 => Ok(seconds),
        _ => Err("expected a number of seconds above 0, at most 31536000".to_owned()),
    }
}

/// Parses a share: above 0, at most 1.
///
/// # Errors
/// With a message that states the allowed range.
pub fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if share > 0.0 && share <= 1.0 => Ok(share),
        _ => Err("expected a number above 0, at most 1".to_owned()),
    }
}

/// Parses the name of a layer.
///
/// # Errors
/// With a message if no layer can have the name.
pub fn layer_name(text: &str) -> Result<String, String> {
    if text.is_empty() || !text.bytes().all(|byte| byte.is_ascii_graphic()) {
        return Err("expected names of visible ASCII characters, separated by commas".to_owned());
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_in_range() {
        assert_eq!(image_size("1280x720"), Ok(ImageSize { width: 1280, height: 720 }));
        assert_eq!(image_size("1x16384"), Ok(ImageSize { width: 1, height: 16384 }));
        for text in ["", "x", "1280", "1280x", "x720", "0x1", "1x0", "-1x1", "1x16385", "1X2", "1x2x3", "99999999999x1", "1.5x2"] {
            assert!(image_size(text).is_err(), "{text:?} was accepted");
        }
    }

    #[test]
    fn settings_split_at_the_first_equals_sign() {
        let setting_of = |key: &str, value: &str| Ok(SettingArgument { key: key.to_owned(), value: value.to_owned() });
        assert_eq!(setting("water.ior=1.4"), setting_of("water.ior", "1.4"));
        assert_eq!(setting(" a = (b: \"c=d\") "), setting_of("a", "(b: \"c=d\")"));
        for text in ["", "=", "a", "a=", "=b", " = "] {
            assert!(setting(text).is_err(), "{text:?} was accepted");
        }
    }

    #[test]
    fn large_counts_may_have_a_suffix() {
        assert_eq!((large_count("7"), large_count("50M"), large_count("2k")), (Ok(7), Ok(50_000_000), Ok(2_000)));
        for text in ["", "0", "0M", "-1", "1.5M", "M", "1e6", "99999999999999999999", "99999999G", "1m", "5\u{20ac}"] {
            assert!(large_count(text).is_err(), "{text:?} was accepted");
        }
    }

    #[test]
    fn times_are_numbers_in_range() {
        assert_eq!((seconds("2.5"), seconds("86400")), (Ok(2.5), Ok(86400.0)));
        for text in ["", "nan", "inf", "-1", "86401", "1s", "1e999"] {
            assert!(seconds(text).is_err(), "{text:?} was accepted");
        }
    }
}
