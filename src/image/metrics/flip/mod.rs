//! FLIP: the difference that an observer sees when alternating between two pictures.
//!
//! - [`flip_ldr`]: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
//!   PACMCGIT 3(2), HPG 2020 (`AN20`).
//! - [`flip_hdr`]: Andersson, Nilsson, Shirley & Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range Images", Eurographics 2021
//!   (`AN21`).
//!
//! In: a [`Pair`](super::Pair) of linear RGB pictures with the primaries of BT.709. Out: a number in `0..=1` per pixel and their mean, which is the
//! number to report. Steps: [`color`] converts to an opponent space; [`filter`] blurs as the eye does and detects edges and points; [`ldr`] measures
//! differences of colours and features; [`hdr`] repeats these steps over exposures and keeps the largest value.
//!
//! Results agree with the authors' program (version 1.7 of `flip_evaluator`) within 1e-5 in every pixel: `tests/suite/flip.rs`. To achieve this, the
//! arithmetic is theirs: 32 bits, sums in the order of the taps. This matters because the feature difference is the *square root* of a difference of
//! filtered values and turns a rounding error of 1e-7 into 3e-4. Two steps follow the program instead of the first paper: lightness is divided by 116
//! before the feature filters (the paper's 100 is an erratum that its authors list), and the sum of two Gaussians that filters blue against yellow is
//! separated into its two terms.

mod color;
mod filter;
mod hdr;
mod ldr;

pub use hdr::{Exposures, flip_hdr};
pub use ldr::{DEFAULT_PIXELS_PER_DEGREE, Flip, flip_ldr, pixels_per_degree};
