//! The calibration probes: tiny drawings that each ask a rasterizer one question.

use serde::Serialize;

use crate::gpu::{Gpu, GpuError};
use crate::pipeline::Device;
use crate::pipeline::state::RasterRules;

/// A question and two answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probe {
    /// Number, from 1.
    pub number: u32,
    /// What is asked.
    pub name: &'static str,
    /// What the driver does.
    pub driver: String,
    /// What the software GPU does under `REFERENCE`.
    pub reference: String,
}

/// Asks all questions.
///
/// # Errors
/// If the driver cannot draw them.
pub fn probes(_gpu: &Gpu, _device: &Device, _rules: &RasterRules) -> Result<Vec<Probe>, GpuError> {
    Ok(Vec::new())
}
