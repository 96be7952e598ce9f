//! Energy audit of the tracer: every watt that a light emits towards specular surfaces is counted in exactly one category.

use glam::Vec3;

/// Flux summed over photons, in W summed over RGB and per batch; and counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Audit {
    /// Emitted by the lights.
    pub emitted: f64,
    /// Missed all surfaces.
    pub missed: f64,
    /// Left the scene after at least one specular surface.
    pub left: f64,
    /// Absorbed by media and mirrors.
    pub absorbed: f64,
    /// Scattered out of its path by media.
    pub scattered: f64,
    /// Landed on a diffuse surface after at least one specular surface: caustics.
    pub landed: f64,
    /// Landed on a diffuse surface directly from a light.
    pub landed_direct: f64,
    /// Dropped after too many surfaces.
    pub lost: f64,
    /// Photons emitted.
    pub photons: u64,
    /// Intersections of photons with surfaces.
    pub events: u64,
    /// Photons dropped after too many surfaces.
    pub photons_lost: u64,
    /// How often a photon left a body that it was not in, or entered one that it was in, and went straight on. Causes: a start within rounding of an
    /// edge, and bodies that intersect themselves.
    pub unexpected_sides: u64,
    /// How often an interpolated normal would have sent light through the wrong side, so that the triangle's normal was used.
    pub normals_replaced: u64,
}

impl Audit {
    /// Adds the sums of another part of the same batch.
    pub(super) fn add(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.missed += other.missed;
        self.left += other.left;
        self.absorbed += other.absorbed;
        self.scattered += other.scattered;
        self.landed += other.landed;
        self.landed_direct += other.landed_direct;
        self.lost += other.lost;
        self.photons += other.photons;
        self.events += other.events;
        self.photons_lost += other.photons_lost;
        self.unexpected_sides += other.unexpected_sides;
        self.normals_replaced += other.normals_replaced;
    }

    /// Flux that is in no category, as a share of the emitted flux: 0 up to rounding.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        let ends = self.missed + self.left + self.absorbed + self.scattered + self.landed + self.landed_direct + self.lost;
        if self.emitted > 0.0 { (self.emitted - ends) / self.emitted } else { 0.0 }
    }

    /// Watts by name, as means over `batches`, in the order of a photon's path.
    #[must_use]
    pub fn watts(&self, batches: u64) -> Vec<(&'static str, f64)> {
        let share = 1.0 / batches.max(1) as f64;
        [
            ("emitted", self.emitted),
            ("missed", self.missed),
            ("landed_direct", self.landed_direct),
            ("absorbed", self.absorbed),
            ("scattered", self.scattered),
            ("left", self.left),
            ("landed", self.landed),
            ("lost", self.lost),
        ]
        .map(|(name, watts)| (name, watts * share))
        .to_vec()
    }

    /// Counts by name.
    #[must_use]
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("photons", self.photons),
            ("events", self.events),
            ("photons_lost", self.photons_lost),
            ("unexpected_sides", self.unexpected_sides),
            ("normals_replaced", self.normals_replaced),
        ]
    }
}

/// Sum over the channels, exact in 64 bits for each.
pub(super) fn sum(v: Vec3) -> f64 {
    f64::from(v.x) + f64::from(v.y) + f64::from(v.z)
}
