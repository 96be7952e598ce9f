//! Line plots on linear or logarithmic axes.

mod axis;
mod draw;
#[cfg(test)]
mod tests;

pub use axis::Scale;

/// One line of a plot.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Points in the order in which a line joins them; finite, and above 0 on a logarithmic axis.
    pub points: &'a [(f64, f64)],
    /// Whether a power law is fitted, drawn dashed, and its exponent shown in the legend. Only for two logarithmic axes.
    pub is_fitted: bool,
}

/// A plot of some series, such as errors against the resolution of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Plot<'a> {
    /// Heading, wrapped to the width of the plot.
    pub title: &'a str,
    /// Label of the horizontal axis, with its unit.
    pub x_label: &'a str,
    /// Label of the vertical axis, with its unit.
    pub y_label: &'a str,
    /// Kind of the horizontal axis.
    pub x_scale: Scale,
    /// Kind of the vertical axis.
    pub y_scale: Scale,
    /// The lines. Seven colours and four markers are used in turn.
    pub series: &'a [Series<'a>],
    /// Width of the picture in pixels, 320 to 8192.
    pub width: u32,
    /// Height of the picture in pixels, 240 to 8192, more if there are many series.
    pub height: u32,
}
