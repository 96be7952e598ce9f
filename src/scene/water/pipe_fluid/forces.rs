//! What presses on the fluid: drops, rain and bodies. All of it is a function of time, with no state.

use glam::{DVec2, Vec2};
use serde::{Deserialize, Serialize};

use super::super::error::{WaterError, require, within};
use super::super::{GRAVITY_M_PER_S2, Water};
use nephroid_math::rng::uniform3;

/// A drop of water that falls into the fluid.
///
/// It arrives at `v = √(2·g·fall_height)`, sinks in during `2·radius/v`, and over that time adds its volume and presses with its momentum `m·v`, spread over a round spot of twice
/// its radius, no smaller than three columns across.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Drop {
    /// When it touches the surface, in seconds. 0..=1e6. Default: 0
    pub time_s: f32,
    /// World (x, z) where, in metres; inside the water. Default: (0, 0)
    pub position_m: Vec2,
    /// Radius in metres. 1e-4..=100. Default: 0.06
    pub radius_m: f32,
    /// Height in metres it fell from. 1e-5..=1e4. Default: 0.5
    pub fall_height_m: f32,
}

impl Default for Drop {
    fn default() -> Self {
        Self { time_s: 0.0, position_m: Vec2::ZERO, radius_m: 0.06, fall_height_m: 0.5 }
    }
}

impl Drop {
    pub(super) fn validate(&self, field: &str, water: &Water) -> Result<(), WaterError> {
        require(within(self.time_s, 0.0, 1e6), format_args!("{field}.time_s"), self.time_s, "0 ..= 1000000 s")?;
        let p = self.position_m;
        let inside = p.cmpge(water.min_ws()).all() && p.cmple(water.max_ws()).all();
        require(inside, format_args!("{field}.position_m"), p, "a point inside the water's extent")?;
        require(within(self.radius_m, 1e-4, 100.0), format_args!("{field}.radius_m"), self.radius_m, "0.0001 ..= 100 m")?;
        require(within(self.fall_height_m, 1e-5, 1e4), format_args!("{field}.fall_height_m"), self.fall_height_m, "0.00001 ..= 10000 m")
    }
}

/// Drops that keep falling, evenly over the whole surface.
///
/// Drop `k` arrives at a random moment of the `k`-th interval of `1/rate`, at a random place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rain {
    /// Drops per second on the whole surface. 0..=1000. Default: 2
    pub rate_per_s: f32,
    /// Radius of the largest drops in metres; the smallest are half of it. 1e-4..=1. Default: 0.05
    pub radius_m: f32,
    /// Height in metres they fall from. 1e-5..=1e4. Default: 0.5
    pub fall_height_m: f32,
    /// Which drops: every seed is another rain. Default: 1
    pub seed: u32,
}

impl Default for Rain {
    fn default() -> Self {
        Self { rate_per_s: 2.0, radius_m: 0.05, fall_height_m: 0.5, seed: 1 }
    }
}

impl Rain {
    /// Stream of the random numbers of rain.
    const STREAM: u32 = 0x7261_696e;

    pub(super) fn validate(&self) -> Result<(), WaterError> {
        require(within(self.rate_per_s, 0.0, 1e3), "model.rain.rate_per_s", self.rate_per_s, "0 ..= 1000 1/s")?;
        require(within(self.radius_m, 1e-4, 1.0), "model.rain.radius_m", self.radius_m, "0.0001 ..= 1 m")?;
        require(within(self.fall_height_m, 1e-5, 1e4), "model.rain.fall_height_m", self.fall_height_m, "0.00001 ..= 10000 m")
    }

    /// Calls `visit` with every drop that is being taken in at some moment of `start_s..end_s`, in order of index.
    pub(super) fn for_each_active(&self, start_s: f64, end_s: f64, min_ws: DVec2, size_m: DVec2, mut visit: impl FnMut(&ActiveDrop)) {
        let rate = f64::from(self.rate_per_s);
        if rate <= 0.0 {
            return;
        }
        let longest = ActiveDrop::new(0.0, DVec2::ZERO, self.radius_m, self.fall_height_m).duration_s;
        let first = ((start_s - longest) * rate).floor().max(0.0);
        let last = (end_s * rate).floor();
        // The drop index is a 32-bit counter; at the highest rate it lasts seven weeks.
        for index in first as u32..=last as u32 {
            let [u, v, w] = uniform3(self.seed, Self::STREAM, index).map(f64::from);
            let size = 0.5 + 0.5 * f64::from(uniform3(self.seed, Self::STREAM + 1, index)[0]);
            let radius = (f64::from(self.radius_m) * size) as f32;
            let position = min_ws + size_m * DVec2::new(u, v);
            visit(&ActiveDrop::new((f64::from(index) + w) / rate, position, radius, self.fall_height_m));
        }
    }
}

/// A drop with what follows from its description.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveDrop {
    /// Moment of contact.
    pub start_s: f64,
    /// Time it takes to sink in, `2r/v`.
    pub duration_s: f64,
    pub position_ws: DVec2,
    pub radius_m: f64,
    pub volume_m3: f64,
    /// Head times area it presses with while sinking in, `V·v/(g·duration)`: its momentum over `ρ·g·duration`.
    pub thrust_m3: f64,
}

impl ActiveDrop {
    pub fn new(start_s: f64, position_ws: DVec2, radius_m: f32, fall_height_m: f32) -> Self {
        let radius_m = f64::from(radius_m);
        let speed = (2.0 * GRAVITY_M_PER_S2 * f64::from(fall_height_m)).sqrt();
        let duration_s = 2.0 * radius_m / speed;
        let volume_m3 = std::f64::consts::PI * 4.0 / 3.0 * radius_m * radius_m * radius_m;
        Self { start_s, duration_s, position_ws, radius_m, volume_m3, thrust_m3: volume_m3 * speed / (GRAVITY_M_PER_S2 * duration_s) }
    }

    /// Share of its time of sinking in that falls into `start_s..end_s`: shares of consecutive intervals sum to one.
    pub fn share(&self, start_s: f64, end_s: f64) -> f64 {
        let overlap = end_s.min(self.start_s + self.duration_s) - start_s.max(self.start_s);
        (overlap / self.duration_s).clamp(0.0, 1.0)
    }
}

impl From<&Drop> for ActiveDrop {
    fn from(drop: &Drop) -> Self {
        Self::new(f64::from(drop.time_s), drop.position_m.as_dvec2(), drop.radius_m, drop.fall_height_m)
    }
}

/// The shape of a body's underside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ObjectShape {
    /// The lower half of a ball.
    #[default]
    Sphere,
    /// An upright cylinder: flat from below, round from above.
    Cylinder,
}

/// Where a body is over time, in world (x, z).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ObjectPath {
    /// It stays here, in metres.
    Still(Vec2),
    /// It passes through `(time in s, place in m)` one after another in straight lines, and rests before the first and after the last. 1..=4096 places, times rising.
    Keys(Vec<(f32, Vec2)>),
    /// It runs in circles, from +x towards +z.
    Circle {
        /// Middle of the circle, in metres.
        center_m: Vec2,
        /// Radius of the circle in metres. 0..=1e6.
        radius_m: f32,
        /// Time for one turn in seconds; negative runs the other way. Not 0, −1e6..=1e6.
        period_s: f32,
        /// Where it starts, in degrees from +x towards +z. Any finite number.
        start_deg: f32,
    },
}

impl ObjectPath {
    /// World (x, z) at a time.
    pub(super) fn at(&self, time_s: f64) -> DVec2 {
        match self {
            Self::Still(position) => position.as_dvec2(),
            Self::Keys(keys) => {
                let next = keys.partition_point(|(time, _)| f64::from(*time) <= time_s);
                match (next.checked_sub(1).and_then(|i| keys.get(i)), keys.get(next)) {
                    (Some((t0, p0)), Some((t1, p1))) => {
                        let f = (time_s - f64::from(*t0)) / (f64::from(*t1) - f64::from(*t0));
                        p0.as_dvec2().lerp(p1.as_dvec2(), f)
                    }
                    (Some((_, p)), None) | (None, Some((_, p))) => p.as_dvec2(),
                    (None, None) => DVec2::ZERO,
                }
            }
            Self::Circle { center_m, radius_m, period_s, start_deg } => {
                let angle = f64::from(*start_deg).to_radians() + std::f64::consts::TAU * time_s / f64::from(*period_s);
                let (s, c) = libm::sincos(angle);
                center_m.as_dvec2() + DVec2::new(c, s) * f64::from(*radius_m)
            }
        }
    }

    fn validate(&self, field: &str) -> Result<(), WaterError> {
        match self {
            Self::Still(position) => require(position.is_finite(), field, position, "Still((x, z)) with finite numbers of metres"),
            Self::Keys(keys) => {
                require((1..=4096).contains(&keys.len()), format_args!("{field}: the number of keys"), keys.len(), "1 ..= 4096")?;
                for (i, (time, position)) in keys.iter().enumerate() {
                    let valid = time.is_finite() && position.is_finite() && (i == 0 || keys[i - 1].0 < *time);
                    require(valid, format_args!("{field}[{i}]"), (time, position), "(s, (m, m)), finite, times rising")?;
                }
                Ok(())
            }
            Self::Circle { center_m, radius_m, period_s, start_deg } => {
                require(center_m.is_finite(), format_args!("{field}.center_m"), center_m, "two finite numbers of metres")?;
                require(within(*radius_m, 0.0, 1e6), format_args!("{field}.radius_m"), radius_m, "0 ..= 1000000 m")?;
                let valid = within(*period_s, -1e6, 1e6) && *period_s != 0.0;
                require(valid, format_args!("{field}.period_s"), period_s, "-1000000 ..= 1000000 s, not 0")?;
                require(start_deg.is_finite(), format_args!("{field}.start_deg"), start_deg, "a finite number of degrees")
            }
        }
    }
}

/// A body that is held in the surface and presses it down to its own underside.
///
/// Below it the head is raised by the depth of its underside under the still surface, so that at rest the water takes its shape; moved, it draws a wake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MovingObject {
    /// Shape of its underside. Default: Sphere
    pub shape: ObjectShape,
    /// Radius in metres. 1e-5..=1e4. Default: 0.5
    pub radius_m: f32,
    /// Depth of its lowest point under the still surface, in metres. 0..=1e4; for a sphere at most its radius. Default: 0.1
    pub draft_m: f32,
    /// Time in seconds over which it is lowered into the water from time 0. 0..=1e6. Default: 1
    pub lowering_s: f32,
    /// Where it is. Default: Still((0, 0))
    pub path: ObjectPath,
}

impl Default for MovingObject {
    fn default() -> Self {
        Self { shape: ObjectShape::Sphere, radius_m: 0.5, draft_m: 0.1, lowering_s: 1.0, path: ObjectPath::Still(Vec2::ZERO) }
    }
}

impl MovingObject {
    pub(super) fn validate(&self, field: &str) -> Result<(), WaterError> {
        require(within(self.radius_m, 1e-5, 1e4), format_args!("{field}.radius_m"), self.radius_m, "0.00001 ..= 10000 m")?;
        let limit = if self.shape == ObjectShape::Sphere { self.radius_m } else { 1e4 };
        require(
            within(self.draft_m, 0.0, limit),
            format_args!("{field}.draft_m"),
            self.draft_m,
            "0 ..= 10000 m, a sphere's at most its radius",
        )?;
        require(within(self.lowering_s, 0.0, 1e6), format_args!("{field}.lowering_s"), self.lowering_s, "0 ..= 1000000 s")?;
        self.path.validate(&format!("{field}.path"))
    }

    /// Depth of the lowest point at a time: the draft, eased in by `3s² − 2s³` while it is lowered.
    pub(super) fn draft_at(&self, time_s: f64) -> f64 {
        let s = if self.lowering_s > 0.0 { (time_s / f64::from(self.lowering_s)).clamp(0.0, 1.0) } else { 1.0 };
        f64::from(self.draft_m) * (s * s * (3.0 - 2.0 * s))
    }

    /// Depth of the underside at the distance `r` from the axis, for a lowest point at `draft`; zero outside.
    ///
    /// A cylinder's rim is a ramp of width `blur`, one column, so that a moving body changes the pressure smoothly.
    pub(super) fn underside(&self, r: f64, draft: f64, blur: f64) -> f64 {
        let radius = f64::from(self.radius_m);
        match self.shape {
            ObjectShape::Sphere if r < radius => (draft - (radius - (radius * radius - r * r).sqrt())).max(0.0),
            ObjectShape::Sphere => 0.0,
            ObjectShape::Cylinder => draft * ((radius - r) / blur + 0.5).clamp(0.0, 1.0),
        }
    }
}
