//! Pairs of pictures that can be compared, checked once.

use std::fmt;

/// One of the two pictures of a [`Pair`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The picture that is taken as the truth.
    Reference,
    /// The picture that is judged.
    Test,
}

impl fmt::Display for Which {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reference => "reference",
            Self::Test => "test",
        })
    }
}

/// Why two pictures cannot be compared, or cannot be compared by a measure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricError {
    /// Width or height is zero.
    #[error("pictures of {width}x{height} pixels have no pixels; both sides must be at least 1")]
    Empty {
        /// Width given, in pixels.
        width: u32,
        /// Height given, in pixels.
        height: u32,
    },
    /// A list does not have one entry per pixel.
    #[error("the {list} has {found} entries; {width}x{height} pixels need {}", u64::from(*.width) * u64::from(*.height))]
    WrongCount {
        /// Name of the list.
        list: &'static str,
        /// Width given, in pixels.
        width: u32,
        /// Height given, in pixels.
        height: u32,
        /// Length of the list.
        found: usize,
    },
    /// The mask leaves no pixel that counts.
    #[error("the mask leaves no pixel to compare; at least 1 must count")]
    NothingCounts,
    /// A pixel that counts has a value for which the measure is not defined.
    #[error("the {list} is {value} at pixel ({x}, {y}), channel {channel}; {allowed}")]
    BadValue {
        /// Name of the list.
        list: &'static str,
        /// Column of the pixel.
        x: u32,
        /// Row of the pixel.
        y: u32,
        /// Index of the channel.
        channel: usize,
        /// The value seen.
        value: f32,
        /// The allowed values.
        allowed: &'static str,
    },
    /// A parameter is out of its range.
    #[error("{name} is {value}; {allowed}")]
    BadParameter {
        /// Name of the parameter.
        name: &'static str,
        /// The value seen.
        value: f64,
        /// The allowed values.
        allowed: &'static str,
    },
    /// The reference has no energy to divide by.
    #[error("the reference sums to {sum}; an energy ratio needs a sum other than 0")]
    NoEnergy {
        /// The sum over all channels.
        sum: f64,
    },
    /// No window of the measure lies wholly within the pixels that count.
    #[error("no window of {side}x{side} pixels lies inside the picture and its mask; at least 1 is needed")]
    NoWindow {
        /// Side of the window, in pixels.
        side: usize,
    },
    /// The exposures cannot be derived from the reference.
    #[error(
        "the reference has a median luminance of {median} and a largest of {largest}; exposures follow from numbers above 0 only, so state them"
    )]
    NoExposures {
        /// Median luminance over the pixels that count.
        median: f32,
        /// Largest luminance over the pixels that count.
        largest: f32,
    },
    /// A picture has no ridge.
    #[error("the {picture} shows no ridge, so there is no distance to measure")]
    NoRidge {
        /// The picture.
        picture: Which,
    },
}

/// Relative luminance of linear RGB with the primaries of ITU-R BT.709, in the unit of the channels: `Y = 0.2126·R + 0.7152·G + 0.0722·B`.
#[must_use]
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Two linear RGB pictures of one size, row-major, top row first, and the set of pixels that count.
///
/// Invariant: at least one pixel counts, and at every pixel that counts all channels of both pictures are finite. Other pixels may have any value.
#[derive(Clone, Copy)]
pub struct Pair<'a> {
    width: u32,
    height: u32,
    reference: &'a [[f32; 3]],
    test: &'a [[f32; 3]],
    mask: Option<&'a [bool]>,
    count: usize,
}

impl<'a> Pair<'a> {
    /// A pair in which all pixels count.
    ///
    /// # Errors
    /// If a list has the wrong length, or a value is not finite.
    pub fn new(width: u32, height: u32, reference: &'a [[f32; 3]], test: &'a [[f32; 3]]) -> Result<Self, MetricError> {
        Self::with_mask(width, height, reference, test, None)
    }

    /// A pair in which the pixels count at which `mask` is true, or all pixels without a mask.
    ///
    /// # Errors
    /// If a list has the wrong length, no pixel counts, or a value at a pixel that counts is not finite.
    pub fn with_mask(
        width: u32,
        height: u32,
        reference: &'a [[f32; 3]],
        test: &'a [[f32; 3]],
        mask: Option<&'a [bool]>,
    ) -> Result<Self, MetricError> {
        if width == 0 || height == 0 {
            return Err(MetricError::Empty { width, height });
        }
        let mut pair = Self { width, height, reference, test, mask, count: 0 };
        pair.check_count("reference", reference.len())?;
        pair.check_count("test", test.len())?;
        if let Some(mask) = mask {
            pair.check_count("mask", mask.len())?;
        }
        pair.count = pair.indices().count();
        if pair.count == 0 {
            return Err(MetricError::NothingCounts);
        }
        pair.check_values("reference", reference, f32::is_finite, "it must be finite")?;
        pair.check_values("test", test, f32::is_finite, "it must be finite")?;
        Ok(pair)
    }

    /// Width in pixels, at least 1.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels, at least 1.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels of the reference.
    #[must_use]
    pub fn reference(&self) -> &'a [[f32; 3]] {
        self.reference
    }

    /// All pixels of the test.
    #[must_use]
    pub fn test(&self) -> &'a [[f32; 3]] {
        self.test
    }

    /// All pixels of one of the two pictures.
    #[must_use]
    pub fn picture(&self, which: Which) -> &'a [[f32; 3]] {
        match which {
            Which::Reference => self.reference,
            Which::Test => self.test,
        }
    }

    /// Number of pixels that count, at least 1.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether the pixel with this index counts.
    #[must_use]
    pub fn counts(&self, index: usize) -> bool {
        self.mask.is_none_or(|mask| mask[index])
    }

    /// Indices of the pixels that count, ascending.
    pub fn indices(&self) -> impl Iterator<Item = usize> + use<'a> {
        let mask = self.mask;
        (0..self.reference.len()).filter(move |&index| mask.is_none_or(|mask| mask[index]))
    }

    /// Reference and test of the pixels that count, in index order.
    pub fn pixels(&self) -> impl Iterator<Item = ([f32; 3], [f32; 3])> + use<'a> {
        let (reference, test) = (self.reference, self.test);
        self.indices().map(move |index| (reference[index], test[index]))
    }

    /// Column and row of the pixel with this index.
    #[must_use]
    pub fn position(&self, index: usize) -> (u32, u32) {
        let width = self.width as usize;
        ((index % width) as u32, (index / width) as u32)
    }

    /// Returns an error unless a list has one entry per pixel.
    pub(super) fn check_count(&self, list: &'static str, found: usize) -> Result<(), MetricError> {
        match u64::from(self.width) * u64::from(self.height) == found as u64 {
            true => Ok(()),
            false => Err(MetricError::WrongCount { list, width: self.width, height: self.height, found }),
        }
    }

    /// Returns an error for the first value, among the pixels that count, for which `is_good` is false.
    pub(super) fn check_values(
        &self,
        list: &'static str,
        pixels: &[[f32; 3]],
        is_good: impl Fn(f32) -> bool,
        allowed: &'static str,
    ) -> Result<(), MetricError> {
        for index in self.indices() {
            for (channel, &value) in pixels[index].iter().enumerate() {
                if !is_good(value) {
                    let (x, y) = self.position(index);
                    return Err(MetricError::BadValue { list, x, y, channel, value, allowed });
                }
            }
        }
        Ok(())
    }
}

/// Shows the size only, because a list of a million pixels is of no use.
impl fmt::Debug for Pair<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pair({}x{}, {} count)", self.width, self.height, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: [f32; 3] = [0.5; 3];

    #[test]
    fn sizes_must_agree() {
        assert_eq!(Pair::new(0, 3, &[], &[]).unwrap_err(), MetricError::Empty { width: 0, height: 3 });
        let wrong = |list, found| MetricError::WrongCount { list, width: 2, height: 2, found };
        assert_eq!(Pair::new(2, 2, &[GREY; 3], &[GREY; 4]).unwrap_err(), wrong("reference", 3));
        assert_eq!(Pair::new(2, 2, &[GREY; 4], &[GREY; 5]).unwrap_err(), wrong("test", 5));
        let mask = [true];
        assert_eq!(Pair::with_mask(2, 2, &[GREY; 4], &[GREY; 4], Some(&mask)).unwrap_err(), wrong("mask", 1));
        assert_eq!(wrong("mask", 1).to_string(), "the mask has 1 entries; 2x2 pixels need 4");
    }

    #[test]
    fn a_mask_that_leaves_nothing_is_refused() {
        let mask = [false; 4];
        assert_eq!(Pair::with_mask(2, 2, &[GREY; 4], &[GREY; 4], Some(&mask)).unwrap_err(), MetricError::NothingCounts);
    }

    #[test]
    fn broken_numbers_are_refused_where_they_count() {
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut pixels = [GREY; 4];
            pixels[3][1] = broken;
            let error = Pair::new(2, 2, &[GREY; 4], &pixels).unwrap_err();
            assert!(matches!(error, MetricError::BadValue { list: "test", x: 1, y: 1, channel: 1, .. }), "{error}");
            assert!(Pair::new(2, 2, &pixels, &[GREY; 4]).is_err());
            let mask = [true, true, true, false];
            let pair = Pair::with_mask(2, 2, &pixels, &pixels, Some(&mask)).unwrap();
            assert_eq!((pair.count(), pair.pixels().count()), (3, 3));
        }
    }
}
