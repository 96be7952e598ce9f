//! Arithmetic of known rasterizers, as measured. [`RasterRules`](crate::state::RasterRules) choose it; the reference path does not come here.

pub(crate) mod llvmpipe;
pub(crate) mod outline;
pub(crate) mod swiftshader;
