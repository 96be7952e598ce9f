//! Figures and plots for reports, as PNG bytes.
//!
//! - [`Figure`] shows reference, result and signed difference side by side, with a colour bar and a table of numbers.
//! - [`judge()`] computes every measure of the table [`MEASURES`] for a pair of pictures.
//! - [`Plot`] draws series of points on linear or logarithmic axes, with fitted power laws.
//!
//! In: data and words. Out: the bytes of an 8-bit sRGB PNG, which the caller writes to a file. The same input gives the same bytes on any number of
//! threads: text is a bitmap font (`noto-sans-mono-bitmap`, from Noto Sans Mono under the SIL Open Font License), `tiny-skia` draws lines and
//! markers, and files contain neither times nor names.
//!
//! Text may use Latin-1, such as `m²`, `µ`, `×` and `±`; other characters become a question mark.

mod canvas;
mod colormap;
mod figure;
mod judge;
mod number;
mod plot;
mod text;

pub use colormap::diverging;
pub use figure::Figure;
pub use judge::{Better, Judged, MEASURES, Measure, REL_MSE_FLOOR, Verdict, Z_TEST_LEVEL, judge, measure};
pub use number::number;
pub use plot::{Plot, Scale, Series};

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The picture would be too large for memory, or too small for its contents.
    #[error("a picture of {width}x{height} pixels cannot be drawn; {allowed}")]
    Size {
        /// Width needed or requested, in pixels.
        width: u64,
        /// Height needed or requested, in pixels.
        height: u64,
        /// The allowed sizes.
        allowed: &'static str,
    },
    /// No series has a point.
    #[error("no series has a point; a plot needs at least 1")]
    NoPoints,
    /// A point that its axes cannot show.
    #[error("series `{series}` has the point ({x}, {y}); coordinates must be finite, and above 0 on a logarithmic axis")]
    BadPoint {
        /// Name of the series.
        series: String,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
    },
    /// The encoder refused the picture.
    #[error("the picture cannot be encoded as PNG")]
    Encode(#[from] png::EncodingError),
}
