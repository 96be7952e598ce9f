//! Devices that differ: each runs machine code that no other here runs, or meets another order of work.

use nephroid::math::level::wide_levels;
use nephroid::pipeline::shader::ShaderWidth;
use nephroid::pipeline::{Device, DeviceOptions};

/// Every level with code of its own, the best one first, on threads that differ, with bins that force a wave after every look at them and with
/// ample ones.
pub fn others() -> Vec<(String, Device)> {
    let levels = wide_levels().into_iter().rev();
    let work = [(1, 1), (7, 256 << 20), (2, 1)].into_iter().cycle();
    levels
        .zip(work)
        .map(|((name, level), (threads, bin_budget_bytes))| {
            let options = DeviceOptions { threads: Some(threads), level: Some(level), bin_budget_bytes, ..DeviceOptions::default() };
            (format!("{name}, {threads} threads, {bin_budget_bytes} bytes of bins"), open(options))
        })
        .collect()
}

/// Scalar shaders on the best level's tiles.
pub fn scalar_shaders() -> Device {
    open(DeviceOptions { threads: Some(2), width: ShaderWidth::One, ..DeviceOptions::default() })
}

fn open(options: DeviceOptions) -> Device {
    Device::new(options).expect("threads start")
}
