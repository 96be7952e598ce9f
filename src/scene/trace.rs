//! What the ground truth is told, beyond the scene itself.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};
use super::settings::MAX_GRID;

/// Most texels along a side of a [`MeasuringPlane`].
pub const MAX_PLANE_TEXELS: u32 = 8192;

/// Settings of the ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TraceSettings {
    /// Columns and rows of vertices of a water mesh that light meets in place of the model's exact surface, each from 2 to 4096: triangles
    /// with smooth normals, as a technique has them. Default: None, the exact surface
    pub grid: Option<(u32, u32)>,
    /// A rectangle over which irradiance is measured, beside that of the visible points. Default: None
    pub plane: Option<MeasuringPlane>,
    /// Most surfaces that one photon may meet, from 1 to 65536; what is left of it then is counted as lost. Default: 1024
    pub max_events: u32,
}

impl Default for TraceSettings {
    fn default() -> Self {
        Self { grid: None, plane: None, max_events: 1024 }
    }
}

/// A parallelogram of texels that measures the light which crosses it, and lets it pass.
///
/// Its front is where `u × v` points to. Light that arrives on the front counts, light from behind does not. Light that ends on a surface in
/// which the plane lies counts, too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuringPlane {
    /// The corner of texel (0, 0), in world space, m.
    pub corner: Vec3,
    /// From that corner along the columns of texels to the next corner, m.
    pub u: Vec3,
    /// From that corner along the rows of texels to the next corner, m; not parallel to `u`.
    pub v: Vec3,
    /// Number of texels along `u` and along `v`, each from 1 to 8192.
    pub texels: (u32, u32),
}

impl MeasuringPlane {
    /// Unit normal of the front.
    #[must_use]
    pub fn normal_ws(&self) -> Vec3 {
        self.u.cross(self.v).normalize()
    }

    /// Area of one texel, m².
    #[must_use]
    pub fn texel_area_m2(&self) -> f64 {
        let area = self.u.as_dvec3().cross(self.v.as_dvec3()).length();
        area / (f64::from(self.texels.0) * f64::from(self.texels.1))
    }

    /// Middle of a texel, in world space.
    #[must_use]
    pub fn texel_center_ws(&self, column: u32, row: u32) -> Vec3 {
        let (columns, rows) = self.texels;
        self.corner + self.u * ((column as f32 + 0.5) / columns as f32) + self.v * ((row as f32 + 0.5) / rows as f32)
    }

    fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("corner").point(self.corner)?;
        at.field("u").direction(self.u)?;
        at.field("v").direction(self.v)?;
        let sine = self.u.normalize().cross(self.v.normalize()).length();
        at.field("v").require(sine > 1.0e-3, format!("({}, {}, {})", self.v.x, self.v.y, self.v.z), "a direction that is not along u")?;
        let texels = at.field("texels");
        texels.index(0).count(self.texels.0, 1..=MAX_PLANE_TEXELS)?;
        texels.index(1).count(self.texels.1, 1..=MAX_PLANE_TEXELS)
    }
}

impl TraceSettings {
    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        if let Some((columns, rows)) = self.grid {
            let grid = at.field("grid");
            grid.index(0).count(columns, 2..=MAX_GRID)?;
            grid.index(1).count(rows, 2..=MAX_GRID)?;
        }
        if let Some(plane) = &self.plane {
            plane.validate(&at.field("plane"))?;
        }
        at.field("max_events").count(self.max_events, 1..=65536)
    }
}
