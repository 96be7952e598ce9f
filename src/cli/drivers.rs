//! The one place where the command line meets real drivers; in builds without them, where it says so.

use serde::Serialize;

use crate::frame::Executor;
use crate::pipeline::DeviceOptions;

/// One line of `list adapters`.
#[derive(Debug, Serialize)]
pub struct AdapterLine {
    /// The device.
    pub name: String,
    /// The driver.
    pub driver: String,
    /// The driver's version.
    pub version: String,
    /// `Cpu`, `DiscreteGpu`, ...
    pub kind: String,
    /// The rasterizer rules that it is compared under.
    pub rules: &'static str,
    /// Features that frames can ask for and this adapter lacks, separated by spaces.
    pub missing: String,
}

/// All adapters. Having none is an error: whoever lists them needs one.
#[cfg(feature = "wgpu")]
pub fn adapters() -> anyhow::Result<Vec<AdapterLine>> {
    use crate::gpu;
    let lines = gpu::adapters().into_iter().map(|adapter| {
        let line = adapter.line();
        let missing = if line.missing.is_empty() { String::new() } else { format!("lacks {}", line.missing.join(" ")) };
        let rules = adapter.family().candidates()[0].0;
        AdapterLine { name: line.name, driver: line.driver, version: line.version, kind: line.kind, rules, missing }
    });
    let lines: Vec<_> = lines.collect();
    if lines.is_empty() { Err(gpu::GpuError::NoAdapter.into()) } else { Ok(lines) }
}

/// An executor on the first adapter whose name contains this, or the first of all.
#[cfg(feature = "wgpu")]
pub fn executor(name: Option<&str>, options: DeviceOptions, memory_limit_bytes: u64) -> anyhow::Result<Box<dyn Executor>> {
    use crate::gpu::{Gpu, GpuExecutor, find_adapter};
    let gpu = Gpu::open(find_adapter(name)?)?;
    Ok(Box::new(GpuExecutor::new(gpu, crate::pipeline::Device::new(options)?, memory_limit_bytes)))
}

/// What a build without drivers answers.
#[cfg(not(feature = "wgpu"))]
pub const WITHOUT: &str = "this build has no drivers; build it with `cargo build --release --features wgpu`";

/// An error: this build has no drivers.
#[cfg(not(feature = "wgpu"))]
pub fn adapters() -> anyhow::Result<Vec<AdapterLine>> {
    anyhow::bail!(WITHOUT)
}

/// An error: this build has no drivers.
#[cfg(not(feature = "wgpu"))]
pub fn executor(_name: Option<&str>, _options: DeviceOptions, _memory_limit_bytes: u64) -> anyhow::Result<Box<dyn Executor>> {
    anyhow::bail!(WITHOUT)
}
