//! Adapters: the drivers of this machine and the rasterizers behind them.

use serde::Serialize;

use super::GpuError;
use nephroid_pipeline::state::RasterRules;

/// Features of wgpu that frames may need, with wgpu's names.
pub(super) const FEATURES: [(wgpu::Features, &str); 6] = [
    (wgpu::Features::FLOAT32_BLENDABLE, "FLOAT32_BLENDABLE"),
    (wgpu::Features::FLOAT32_FILTERABLE, "FLOAT32_FILTERABLE"),
    (wgpu::Features::DEPTH_CLIP_CONTROL, "DEPTH_CLIP_CONTROL"),
    (wgpu::Features::DEPTH32FLOAT_STENCIL8, "DEPTH32FLOAT_STENCIL8"),
    (wgpu::Features::DUAL_SOURCE_BLENDING, "DUAL_SOURCE_BLENDING"),
    (wgpu::Features::RG11B10UFLOAT_RENDERABLE, "RG11B10UFLOAT_RENDERABLE"),
];

/// An adapter: a driver and its device.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub(super) inner: wgpu::Adapter,
    info: wgpu::AdapterInfo,
}

/// The rasterizer of an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Mesa's lavapipe: llvmpipe behind Vulkan.
    Lavapipe,
    /// Google's SwiftShader.
    SwiftShader,
    /// Any other rasterizer, expected to follow [`RasterRules::REFERENCE`] until it is measured.
    Other,
}

impl Family {
    /// The rules that this rasterizer may follow, the most likely ones first. Lavapipe's depend on the processor.
    #[must_use]
    pub fn candidates(self) -> &'static [(&'static str, RasterRules)] {
        const REFERENCE: (&str, RasterRules) = ("REFERENCE", RasterRules::REFERENCE);
        const LAVAPIPE: (&str, RasterRules) = ("LAVAPIPE", RasterRules::LAVAPIPE);
        const NO_FMA: (&str, RasterRules) = ("LAVAPIPE_NO_FMA", RasterRules::LAVAPIPE_NO_FMA);
        const SWIFTSHADER: (&str, RasterRules) = ("SWIFTSHADER", RasterRules::SWIFTSHADER);
        match self {
            Self::Lavapipe => &[LAVAPIPE, NO_FMA],
            Self::SwiftShader => &[SWIFTSHADER],
            Self::Other => &[REFERENCE],
        }
    }
}

/// One line of a list of adapters.
#[derive(Clone, Debug, Serialize)]
pub struct AdapterLine {
    /// Name of the device.
    pub name: String,
    /// Name of the driver.
    pub driver: String,
    /// Version of the driver.
    pub version: String,
    /// Kind of device: `Cpu`, `DiscreteGpu`, ...
    pub kind: String,
    /// Features of wgpu that frames may need and the adapter lacks.
    pub missing: Vec<&'static str>,
}

impl Adapter {
    /// Name of the device.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.info.name
    }

    /// Device, driver and version in one line.
    #[must_use]
    pub fn title(&self) -> String {
        let line = self.line();
        format!("{} ({} {})", line.name, line.driver, line.version)
    }

    /// The rasterizer that the driver's name stands for.
    #[must_use]
    pub fn family(&self) -> Family {
        match self.info.driver.as_str() {
            "llvmpipe" => Family::Lavapipe,
            driver if driver.contains("SwiftShader") => Family::SwiftShader,
            _ => Family::Other,
        }
    }

    /// The adapter as a line of a list.
    #[must_use]
    pub fn line(&self) -> AdapterLine {
        let features = self.inner.features();
        let missing = FEATURES.iter().filter(|(feature, _)| !features.contains(*feature)).map(|(_, name)| *name).collect();
        AdapterLine {
            name: self.info.name.clone(),
            driver: self.info.driver.clone(),
            version: self.info.driver_info.clone(),
            kind: format!("{:?}", self.info.device_type),
            missing,
        }
    }

    pub(super) fn has(&self, feature: wgpu::Features) -> bool {
        self.inner.features().contains(feature)
    }
}

/// All Vulkan adapters, in the loader's order. Empty without a driver.
#[must_use]
pub fn adapters() -> Vec<Adapter> {
    let descriptor =
        wgpu::InstanceDescriptor { backends: wgpu::Backends::VULKAN, ..wgpu::InstanceDescriptor::new_without_display_handle() };
    let found = pollster::block_on(wgpu::Instance::new(descriptor).enumerate_adapters(wgpu::Backends::VULKAN));
    found.into_iter().map(|inner| Adapter { info: inner.get_info(), inner }).collect()
}

/// The first adapter whose device or driver name contains `name`, case-insensitive; for `None` the first adapter.
///
/// # Errors
/// If no adapter exists, or none has the name.
pub fn find_adapter(name: Option<&str>) -> Result<Adapter, GpuError> {
    let mut all = adapters();
    if all.is_empty() {
        return Err(GpuError::NoAdapter);
    }
    let Some(name) = name else { return Ok(all.swap_remove(0)) };
    let wanted = name.to_lowercase();
    let fits = |a: &Adapter| [&a.info.name, &a.info.driver].iter().any(|n| n.to_lowercase().contains(&wanted));
    match all.iter().position(fits) {
        Some(at) => Ok(all.swap_remove(at)),
        None => {
            let known = all.iter().map(|a| a.info.name.clone()).collect::<Vec<_>>().join(", ");
            Err(GpuError::UnknownAdapter { seen: name.to_owned(), known })
        }
    }
}
