//! From radiance to what a screen shows: exposure and tone curve. The picture writer applies them; EXR layers are left as they are.

use serde::{Deserialize, Serialize};

use super::check::{At, Invalid};

/// How radiance becomes a picture: the parameters of the tone map of the picture writer.
///
/// Linear below the shoulder, extended Reinhard above it, highlights drawn towards white.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ToneSettings {
    /// Exposure in stops: radiance is multiplied by 2^exposure_ev. From −40 to 40. A white wall in full sun has about 300 W/(m² sr), so
    /// that daylight wants about −8. Default: -8
    pub exposure_ev: f32,
    /// Brightest exposed value that is shown unchanged, from 0 to 0.99. Default: 0.3
    pub shoulder: f32,
    /// Exposed value that becomes white, from 1 to 1e6. Default: 16
    pub white: f32,
    /// How fast compressed highlights lose saturation, from 0 (never) to 10. Default: 0.15
    pub desaturation: f32,
}

impl Default for ToneSettings {
    fn default() -> Self {
        Self { exposure_ev: -8.0, shoulder: 0.3, white: 16.0, desaturation: 0.15 }
    }
}

impl ToneSettings {
    /// The factor 2^exposure_ev.
    #[must_use]
    pub fn exposure(&self) -> f32 {
        libm::exp2f(self.exposure_ev)
    }

    pub(super) fn validate(&self, at: &At<'_>) -> Result<(), Invalid> {
        at.field("exposure_ev").within(self.exposure_ev, -40.0..=40.0, "stops")?;
        at.field("shoulder").within(self.shoulder, 0.0..=0.99, "")?;
        at.field("white").within(self.white, 1.0..=1.0e6, "")?;
        at.field("desaturation").within(self.desaturation, 0.0..=10.0, "")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_counts_in_stops() {
        assert_eq!(ToneSettings { exposure_ev: 3.0, ..ToneSettings::default() }.exposure(), 8.0);
        assert_eq!(ToneSettings { exposure_ev: -1.0, ..ToneSettings::default() }.exposure(), 0.5);
    }
}
