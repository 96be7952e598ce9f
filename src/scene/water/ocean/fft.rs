//! A small Fourier transform whose bits are the same everywhere.
//!
//! `rustfft` was the road not taken: its twiddle factors come from the sine and cosine of `std`, which differ between platforms, and a last bit of
//! height would be enough to break the equality of images. The tests compare with it. This one takes twiddles from `libm`, is Stockham's radix-2 form
//! (no bit reversal, unit stride), and does a 256×256 transform in a few milliseconds.

use std::f64::consts::TAU;

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Complex {
    pub re: f64,
    pub im: f64,
}

/// Plan of inverse transforms of one power-of-two length, unnormalised: `x_j = Σ_k X_k·e^{2πi·jk/N}`.
#[derive(Clone, Debug)]
pub(super) struct Fft {
    size: usize,
    /// `e^{2πi·j/N}` for `j < N/2`.
    twiddles: Vec<Complex>,
}

/// Columns of a two-dimensional transform that are done side by side.
const BLOCK: usize = 8;

impl Fft {
    /// `size` must be a power of two, at least 2.
    pub fn new(size: usize) -> Self {
        let twiddles = (0..size / 2).map(|j| {
            let (im, re) = libm::sincos(TAU * j as f64 / size as f64);
            Complex { re, im }
        });
        Self { size, twiddles: twiddles.collect() }
    }

    /// Transforms `size × size` numbers along rows, then along columns, in place.
    pub fn inverse_2d(&self, data: &mut [Complex]) {
        let n = self.size;
        let mut scratch = vec![Complex::default(); n * BLOCK];
        let mut block = vec![Complex::default(); n * BLOCK];
        for row in data.chunks_exact_mut(n) {
            self.inverse::<1>(row, &mut scratch[..n]);
        }
        // A few columns at a time are gathered into a block, so that memory is read by the line.
        let width = BLOCK.min(n);
        for first in (0..n).step_by(width) {
            if width == BLOCK {
                for (row, line) in block.chunks_exact_mut(BLOCK).enumerate() {
                    line.copy_from_slice(&data[row * n + first..][..BLOCK]);
                }
                self.inverse::<BLOCK>(&mut block, &mut scratch);
                for (row, line) in block.chunks_exact(BLOCK).enumerate() {
                    data[row * n + first..][..BLOCK].copy_from_slice(line);
                }
            } else {
                for column in first..first + width {
                    for row in 0..n {
                        block[row] = data[row * n + column];
                    }
                    self.inverse::<1>(&mut block[..n], &mut scratch[..n]);
                    for row in 0..n {
                        data[row * n + column] = block[row];
                    }
                }
            }
        }
    }

    /// Transforms `B` interleaved sequences of length `size` at once (Stockham's decimation in frequency).
    fn inverse<const B: usize>(&self, data: &mut [Complex], scratch: &mut [Complex]) {
        let (mut from, mut to) = (data, scratch);
        let mut half = self.size / 2;
        // `stride` transforms of length `2·half`, interleaved.
        let mut stride = 1;
        let mut swapped = false;
        while half > 0 {
            for p in 0..half {
                let w = self.twiddles[p * stride];
                for q in 0..stride * B {
                    let a = from[p * stride * B + q];
                    let b = from[(p + half) * stride * B + q];
                    let difference = Complex { re: a.re - b.re, im: a.im - b.im };
                    to[2 * p * stride * B + q] = Complex { re: a.re + b.re, im: a.im + b.im };
                    to[(2 * p + 1) * stride * B + q] =
                        Complex { re: difference.re * w.re - difference.im * w.im, im: difference.re * w.im + difference.im * w.re };
                }
            }
            std::mem::swap(&mut from, &mut to);
            swapped = !swapped;
            half /= 2;
            stride *= 2;
        }
        if swapped {
            to.copy_from_slice(from);
        }
    }
}
