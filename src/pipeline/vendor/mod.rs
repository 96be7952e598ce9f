//! Arithmetic of known rasterizers, as measured. [`RasterRules`](crate::state::RasterRules) select it; the reference path does not use it.

pub(crate) mod llvmpipe;
pub(crate) mod outline;
pub(crate) mod swiftshader;
