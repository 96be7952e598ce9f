//! Measures of the difference between two pictures, as data.
//!
//! In: a [`Pair`], two linear RGB pictures of one size and, if wanted, a mask of the pixels that count. Out: plain numbers and maps. Nothing here
//! prints, opens files or knows the subject of the pictures; the unit of a number follows from that of the pictures, such as W/m2.
//!
//! | Question | Answer |
//! |---|---|
//! | How large is the error? | [`mse`], [`mae`], [`rel_mse`], [`psnr`] |
//! | Is it too bright or too dark? | [`bias`], [`energy_ratio`] |
//! | Is the error visible? | [`flip_ldr`], [`flip_hdr`], [`ssim()`] |
//! | Are the bright lines where they should be? | [`ridge_error`] |
//! | Is it noise? | [`z_test()`] |
//! | How fast does it decrease? | [`PowerLaw`] |
//! | How large may it be between two executors of one frame? | [`bounds`] |
//!
//! Every number is the same on any number of threads: sums are 64-bit and in index order, and rows that run in parallel are independent. NaN is never
//! averaged away: a pair with a NaN in a pixel that counts cannot be made.

pub mod bounds;
mod energy;
mod filter;
mod flip;
mod pair;
mod pointwise;
mod power_law;
mod quantile;
mod ridge;
mod ssim;
mod z_test;

pub use energy::{EnergyRatio, energy_ratio};
pub use flip::{DEFAULT_PIXELS_PER_DEGREE, Exposures, Flip, flip_hdr, flip_ldr, pixels_per_degree};
pub use pair::{MetricError, Pair, Which, luminance};
pub use pointwise::{REL_MSE_EPSILON, bias, mae, mse, psnr, rel_mse};
pub use power_law::PowerLaw;
pub use quantile::quantile;
pub use ridge::{RidgeError, RidgeSettings, ridge_error};
pub use ssim::ssim;
pub use z_test::{Variances, ZTest, two_sided_quantile, z_test};
