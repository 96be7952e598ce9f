//! An opened adapter.

use super::GpuError;
use super::adapter::{Adapter, FEATURES, adapters};
use super::depth_copy::DepthCopy;

/// An opened adapter: device and queue.
#[derive(Debug)]
pub struct Gpu {
    pub(super) adapter: Adapter,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) depth_copy: DepthCopy,
}

impl Gpu {
    /// Opens an adapter with all its limits, and with those features that frames may need.
    ///
    /// # Errors
    /// If the driver refuses to open the device.
    pub fn open(adapter: Adapter) -> Result<Self, GpuError> {
        let wanted = FEATURES.iter().fold(wgpu::Features::empty(), |all, (feature, _)| all | *feature);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("nephroid"),
            required_features: wanted & adapter.inner.features(),
            required_limits: adapter.inner.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let opened = pollster::block_on(adapter.inner.request_device(&descriptor));
        let (device, queue) =
            opened.map_err(|error| GpuError::Driver { doing: format!("opening {}", adapter.name()), why: error.to_string() })?;
        Ok(Self { adapter, device, queue, depth_copy: DepthCopy::default() })
    }

    /// The adapter.
    #[must_use]
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Returns an error if the device lacks a feature.
    pub(super) fn require(&self, feature: wgpu::Features, what: &str) -> Result<(), GpuError> {
        if self.device.features().contains(feature) {
            return Ok(());
        }
        let name = FEATURES.iter().find(|(f, _)| *f == feature).map_or("an unknown feature", |(_, name)| *name);
        let have: Vec<String> = adapters().iter().filter(|a| a.has(feature)).map(|a| a.name().to_owned()).collect();
        let have = if have.is_empty() { "no adapter here has it".to_owned() } else { format!("these have: {}", have.join(", ")) };
        Err(GpuError::Feature { what: what.to_owned(), feature: name, adapter: self.adapter.name().to_owned(), have })
    }

    /// Returns an error if `seen` is above `limit`.
    pub(super) fn within(&self, what: &str, seen: u64, limit: u64) -> Result<(), GpuError> {
        if seen <= limit {
            return Ok(());
        }
        Err(GpuError::Limit { what: what.to_owned(), seen, adapter: self.adapter.name().to_owned(), limit })
    }

    /// Runs `work`; errors of the driver or of wgpu are returned.
    pub(super) fn checked<R>(&self, doing: &str, work: impl FnOnce() -> R) -> Result<R, GpuError> {
        let scopes = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation]
            .map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let mut first = None;
        for scope in scopes.into_iter().rev() {
            first = first.or(pollster::block_on(scope.pop()));
        }
        match first {
            None => Ok(result),
            Some(error) => Err(GpuError::Driver { doing: doing.to_owned(), why: error.to_string() }),
        }
    }

    /// Waits until all submitted work has run.
    pub(super) fn wait(&self) -> Result<(), GpuError> {
        match self.device.poll(wgpu::PollType::wait_indefinitely()) {
            Ok(_) => Ok(()),
            Err(error) => Err(GpuError::Driver { doing: "waiting for the driver".to_owned(), why: error.to_string() }),
        }
    }
}
