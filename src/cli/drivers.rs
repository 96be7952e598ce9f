//! The interface between the command line and drivers. In builds without drivers, every function returns an error.

use serde::Serialize;

use crate::frame::Executor;
use crate::pipeline::DeviceOptions;

/// One line of `list adapters`.
#[derive(Debug, Serialize)]
pub struct AdapterLine {
    /// Name of the device.
    pub name: String,
    /// Name of the driver.
    pub driver: String,
    /// Version of the driver.
    pub version: String,
    /// Kind of device: `Cpu`, `DiscreteGpu`, ...
    pub kind: String,
    /// Name of the rasterization rules that the adapter is compared under.
    pub rules: &'static str,
    /// Features that frames may need and the adapter lacks, separated by spaces.
    pub missing: String,
}

/// All adapters.
///
/// # Errors
/// If there is none.
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

/// An executor on the first adapter whose name contains `name`; on the first adapter for `None`.
///
/// # Errors
/// If there is no such adapter, the driver refuses to open the device, or the threads cannot be started.
#[cfg(feature = "wgpu")]
pub fn executor(name: Option<&str>, options: DeviceOptions, memory_limit_bytes: u64) -> anyhow::Result<Box<dyn Executor>> {
    use crate::gpu::{Gpu, GpuExecutor, find_adapter};
    let gpu = Gpu::open(find_adapter(name)?)?;
    Ok(Box::new(GpuExecutor::new(gpu, crate::pipeline::Device::new(options)?, memory_limit_bytes)))
}

/// The error of builds without drivers.
#[cfg(not(feature = "wgpu"))]
pub const WITHOUT: &str = "this build has no drivers; build it with `cargo build --release --features wgpu`";

/// Returns an error: this build has no drivers.
#[cfg(not(feature = "wgpu"))]
pub fn adapters() -> anyhow::Result<Vec<AdapterLine>> {
    anyhow::bail!(WITHOUT)
}

/// Returns an error: this build has no drivers.
#[cfg(not(feature = "wgpu"))]
pub fn executor(_name: Option<&str>, _options: DeviceOptions, _memory_limit_bytes: u64) -> anyhow::Result<Box<dyn Executor>> {
    anyhow::bail!(WITHOUT)
}
