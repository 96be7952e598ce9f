//! Devices that differ: each runs machine code that no other here runs, or meets another order of work.

use nephroid::math::level::wide_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{Device, DeviceOptions};

/// One thread at the best level with ample bins: what the others are held to.
pub fn reference() -> Device {
    open(DeviceOptions { threads: Some(1), ..DeviceOptions::default() })
}

/// Every level with code of its own, on threads that differ, with ample bins and with bins that force a wave after every look at them.
pub fn others() -> Vec<(String, Device)> {
    let mut devices = Vec::new();
    for (rank, (name, level)) in wide_levels().into_iter().rev().enumerate() {
        let (threads, bin_budget_bytes) = [(2, 1), (7, 256 << 20), (7, 1)][rank % 3];
        let options = DeviceOptions { threads: Some(threads), level: Some(level), bin_budget_bytes, ..DeviceOptions::default() };
        devices.push((format!("{name}, {threads} threads, {bin_budget_bytes} bytes of bins"), open(options)));
    }
    devices
}

/// Scalar shaders on the best level's tiles.
pub fn scalar_shaders() -> Device {
    open(DeviceOptions { threads: Some(2), width: ShaderWidth::One, ..DeviceOptions::default() })
}

fn open(options: DeviceOptions) -> Device {
    Device::new(options).expect("threads start")
}
