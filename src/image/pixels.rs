//! Rectangles of pixels with a checked size.

use std::fmt;

use bytemuck::Zeroable;
use bytemuck::allocation::try_zeroed_vec;
use rayon::prelude::*;

/// Why a rectangle of pixels is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeError {
    /// Width or height is zero.
    #[error("an image of {width}x{height} pixels has no pixels; both sides must be at least 1")]
    Empty {
        /// Width requested, in pixels.
        width: u32,
        /// Height requested, in pixels.
        height: u32,
    },
    /// The bytes exceed the address space, or the allocator has refused them.
    #[error("an image of {width}x{height} pixels of {bytes_per_pixel} bytes does not fit into memory")]
    TooLarge {
        /// Width requested, in pixels.
        width: u32,
        /// Height requested, in pixels.
        height: u32,
        /// Size of one pixel.
        bytes_per_pixel: usize,
    },
    /// The list of pixels does not have `width * height` entries.
    #[error("an image of {width}x{height} pixels needs {} pixels, {found} were given", u64::from(*.width) * u64::from(*.height))]
    WrongCount {
        /// Width requested, in pixels.
        width: u32,
        /// Height requested, in pixels.
        height: u32,
        /// Length of the list.
        found: usize,
    },
}

/// A rectangle of pixels, row-major, first row at the top. It is never empty, and its list has exactly `width * height` entries.
#[derive(Clone, PartialEq, Eq)]
pub struct Image<T> {
    width: u32,
    height: u32,
    pixels: Vec<T>,
}

/// The number of pixels of an image, if an image of this size can exist.
fn checked_count<T>(width: u32, height: u32) -> Result<usize, SizeError> {
    if width == 0 || height == 0 {
        return Err(SizeError::Empty { width, height });
    }
    let bytes_per_pixel = size_of::<T>();
    let too_large = SizeError::TooLarge { width, height, bytes_per_pixel };
    let count = usize::try_from(u64::from(width) * u64::from(height)).map_err(|_| too_large)?;
    // Rust allocations are limited to `isize::MAX` bytes.
    match count.checked_mul(bytes_per_pixel.max(1)) {
        Some(bytes) if isize::try_from(bytes).is_ok() => Ok(count),
        _ => Err(too_large),
    }
}

/// An empty list with capacity for every pixel. If the allocator refuses, an error is returned.
fn reserved<T>(width: u32, height: u32) -> Result<Vec<T>, SizeError> {
    let count = checked_count::<T>(width, height)?;
    let mut pixels = Vec::new();
    pixels.try_reserve_exact(count).map_err(|_| SizeError::TooLarge { width, height, bytes_per_pixel: size_of::<T>() })?;
    Ok(pixels)
}

impl<T: Zeroable + Send> Image<T> {
    /// Fills an image in parallel: `fill(y, row)` writes row `y`, which is zero before.
    ///
    /// # Errors
    /// If a side is zero or the image does not fit into memory.
    pub fn from_rows(width: u32, height: u32, fill: impl Fn(u32, &mut [T]) + Sync) -> Result<Self, SizeError> {
        let too_large = SizeError::TooLarge { width, height, bytes_per_pixel: size_of::<T>() };
        // Zeroed memory from the system: no page is touched before the thread that fills it does so.
        let mut pixels: Vec<T> = try_zeroed_vec(checked_count::<T>(width, height)?).map_err(|()| too_large)?;
        pixels.par_chunks_exact_mut(width as usize).enumerate().for_each(|(y, row)| fill(y as u32, row));
        Ok(Self { width, height, pixels })
    }
}

impl<T> Image<T> {
    /// Makes an image of a row-major list that must have exactly `width * height` pixels.
    ///
    /// # Errors
    /// If a side is zero or the list has another length.
    pub fn from_vec(width: u32, height: u32, pixels: Vec<T>) -> Result<Self, SizeError> {
        if checked_count::<T>(width, height)? != pixels.len() {
            return Err(SizeError::WrongCount { width, height, found: pixels.len() });
        }
        Ok(Self { width, height, pixels })
    }

    /// Makes an image with pixel `(x, y)` = `f(x, y)`. `f` is called in row-major order, once per pixel.
    ///
    /// # Errors
    /// If a side is zero or the image does not fit into memory.
    pub fn from_fn(width: u32, height: u32, mut f: impl FnMut(u32, u32) -> T) -> Result<Self, SizeError> {
        let mut pixels = reserved(width, height)?;
        for y in 0..height {
            pixels.extend((0..width).map(|x| f(x, y)));
        }
        Ok(Self { width, height, pixels })
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

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// All pixels, row-major.
    #[must_use]
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// All pixels, row-major, to write to.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.pixels
    }

    /// Returns the list of pixels, row-major.
    #[must_use]
    pub fn into_pixels(self) -> Vec<T> {
        self.pixels
    }

    /// The pixel at column `x` and row `y`; `None` outside.
    #[must_use]
    pub fn get(&self, x: u32, y: u32) -> Option<&T> {
        self.index(x, y).map(|index| &self.pixels[index])
    }

    /// The pixel at column `x` and row `y`, to write to; `None` outside.
    pub fn get_mut(&mut self, x: u32, y: u32) -> Option<&mut T> {
        self.index(x, y).map(|index| &mut self.pixels[index])
    }

    /// The rows from top to bottom, each `width` long.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, T> {
        self.pixels.chunks_exact(self.width as usize)
    }

    /// The rows from top to bottom, each `width` long, to write to.
    pub fn rows_mut(&mut self) -> std::slice::ChunksExactMut<'_, T> {
        self.pixels.chunks_exact_mut(self.width as usize)
    }

    /// Applies `f` to every pixel and returns an image of the same size.
    ///
    /// # Errors
    /// If the new image does not fit into memory.
    pub fn map<U>(&self, mut f: impl FnMut(&T) -> U) -> Result<Image<U>, SizeError> {
        let mut pixels = reserved(self.width, self.height)?;
        pixels.extend(self.pixels.iter().map(&mut f));
        Ok(Image { width: self.width, height: self.height, pixels })
    }

    fn index(&self, x: u32, y: u32) -> Option<usize> {
        (x < self.width && y < self.height).then(|| y as usize * self.width as usize + x as usize)
    }
}

impl<T: Clone> Image<T> {
    /// An image with every pixel equal to `value`.
    ///
    /// # Errors
    /// If a side is zero or the image does not fit into memory.
    pub fn filled(width: u32, height: u32, value: T) -> Result<Self, SizeError> {
        let mut pixels = reserved(width, height)?;
        pixels.resize(checked_count::<T>(width, height)?, value);
        Ok(Self { width, height, pixels })
    }
}

/// Shows the size only, because a list of a million pixels is of no use.
impl<T> fmt::Debug for Image<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Image({}x{} {})", self.width, self.height, std::any::type_name::<T>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_row_major_from_the_top() {
        let image = Image::from_fn(3, 2, |x, y| 10 * y + x).unwrap();
        assert_eq!(image.pixels(), [0, 1, 2, 10, 11, 12]);
        assert_eq!(image.get(2, 1), Some(&12));
        assert_eq!(image.rows().nth(1), Some(&[10, 11, 12][..]));
        assert_eq!(image.size(), (3, 2));
    }

    #[test]
    fn rows_are_filled_by_number() {
        let image = Image::from_rows(3, 2, |y, row| row.iter_mut().zip(0..).for_each(|(pixel, x)| *pixel = 10 * y + x)).unwrap();
        assert_eq!(image, Image::from_fn(3, 2, |x, y| 10 * y + x).unwrap());
        assert_eq!(Image::from_rows(0, 2, |_, _: &mut [u8]| ()).unwrap_err(), SizeError::Empty { width: 0, height: 2 });
    }

    #[test]
    fn pixels_outside_are_none() {
        let mut image = Image::filled(3, 2, 0_u8).unwrap();
        assert_eq!((image.get(3, 0), image.get(0, 2)), (None, None));
        assert_eq!(image.get_mut(3, 1), None);
        *image.get_mut(1, 1).unwrap() = 7;
        assert_eq!(image.into_pixels(), [0, 0, 0, 0, 7, 0]);
    }

    #[test]
    fn size_zero_is_refused() {
        assert_eq!(Image::filled(0, 4, 0_u8).unwrap_err(), SizeError::Empty { width: 0, height: 4 });
        assert_eq!(Image::from_vec(4, 0, vec![0_u8; 4]).unwrap_err(), SizeError::Empty { width: 4, height: 0 });
    }

    #[test]
    fn size_and_list_must_agree() {
        for found in [0, 5, 7] {
            assert_eq!(Image::from_vec(3, 2, vec![0_u8; found]).unwrap_err(), SizeError::WrongCount { width: 3, height: 2, found });
        }
        assert_eq!(
            SizeError::WrongCount { width: 3, height: 2, found: 5 }.to_string(),
            "an image of 3x2 pixels needs 6 pixels, 5 were given"
        );
    }

    #[test]
    fn size_beyond_the_address_space_is_an_error_not_an_allocation() {
        let (width, height) = (u32::MAX, u32::MAX);
        assert_eq!(Image::filled(width, height, 0_f32).unwrap_err(), SizeError::TooLarge { width, height, bytes_per_pixel: 4 });
        // 2^62 bytes pass the arithmetic; the allocator refuses them.
        let (width, height) = (1 << 31, 1 << 31);
        assert_eq!(Image::from_fn(width, height, |_, _| 0_u8).unwrap_err(), SizeError::TooLarge { width, height, bytes_per_pixel: 1 });
    }
}
