//! Light on the floor inside an upright mirror cylinder of radius 1 around the y axis, after one reflection.
//!
//! An upright mirror changes a ray only in plan and never its inclination, so everything is plane geometry, seen from above: a ray is
//! reflected at a point of the circle and goes on for a level distance t. Light that reaches a texel is integrated over where it comes from,
//! as for the other truths: over the points of the circle, and for each over the piece of its reflected ray that lies in the texel.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A ray in plan after its reflection: from where, and its unit direction; (x, z).
struct Reflected {
    from: [f64; 2],
    along: [f64; 2],
}

/// The piece of the ray inside a rectangle, as level distances.
fn inside(ray: &Reflected, x: [f64; 2], z: [f64; 2], longest: f64) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0_f64, longest);
    for ([low, high], from, along) in [(x, ray.from[0], ray.along[0]), (z, ray.from[1], ray.along[1])] {
        let (a, b) = ((low - from) / along, (high - from) / along);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (far > near).then_some((near, far))
}

/// Parameters in `low..high` at which the reflected ray passes through `p`: zeros of the cross product, with p before the ray.
fn rays_through(p: [f64; 2], low: f64, high: f64, ray: impl Fn(f64) -> Reflected) -> Vec<(f64, f64)> {
    let to = |u: f64| {
        let Reflected { from, along } = ray(u);
        let d = [p[0] - from[0], p[1] - from[1]];
        (d[0] * along[1] - d[1] * along[0], d[0] * along[0] + d[1] * along[1])
    };
    let samples = 20_000;
    let at = |i: u32| low + (high - low) * (f64::from(i) + 0.5) / f64::from(samples);
    let mut found = Vec::new();
    for i in 1..samples {
        if (to(at(i - 1)).0 < 0.0) != (to(at(i)).0 < 0.0) {
            let u = super::root(at(i - 1), at(i), |u| to(u).0);
            if to(u).1 > 0.0 {
                found.push((u, to(u).1));
            }
        }
    }
    found
}

/// T7: parallel light along −x that falls at an angle, into a ring of some height.
#[derive(Clone, Copy)]
pub struct Nephroid {
    /// Elevation of the light.
    pub elevation: f64,
    /// Height of the wall.
    pub height: f64,
    /// Share of light that the mirror reflects.
    pub reflectance: f64,
}

impl Nephroid {
    /// The point of the caustic that belongs to the parameter θ: `¼ (3 cos θ − cos 3θ, 3 sin θ − sin 3θ)`, cusps at `(±½, 0)`.
    pub fn caustic(parameter: f64) -> [f64; 2] {
        let (s, c) = libm::sincos(parameter);
        let (s3, c3) = libm::sincos(3.0 * parameter);
        [0.25 * (3.0 * c - c3), 0.25 * (3.0 * s - s3)]
    }

    /// The ray reflected at `(−cos φ, sin φ)`, where it arrives at the angle φ to the normal and is turned by π − 2φ.
    fn ray(angle: f64) -> Reflected {
        let (s, c) = libm::sincos(angle);
        let (s2, c2) = libm::sincos(2.0 * angle);
        Reflected { from: [-c, s], along: [c2, -s2] }
    }

    /// How far, along the level, light from the top of the wall gets: `H / tan(elevation)`.
    pub fn reach(&self) -> f64 {
        self.height / libm::tan(self.elevation)
    }

    /// Level distances from the mirror, nearest and farthest, at which the floor gets light reflected once at φ: not what passed below
    /// the top of the wall when it came in, a chord `2 cos φ` before the mirror, and not what meets the mirror again after another chord.
    fn lit(reach: f64, angle: f64) -> (f64, f64) {
        let chord = 2.0 * libm::cos(angle);
        ((reach - chord).max(0.0), reach.min(chord))
    }

    /// Distance from the axis within which no light arrives that was reflected more than once.
    ///
    /// A second reflection needs `2 cos φ < H/tan e`, and all chords of the ray keep the distance `sin φ` from the axis.
    pub fn clean_radius(&self) -> f64 {
        let half = 0.5 * self.reach();
        (1.0 - half * half).max(0.0).sqrt()
    }

    /// Irradiance of the floor at (x, z): `Σ E_h ρ / |1 − 2t/cos φ|`, `E_h = sin(elevation)`.
    ///
    /// Rays reflected at neighbouring points of the mirror, with a level distance `cos φ dφ` between them, turn against each other
    /// by `2 dφ`; after t they are `(cos φ − 2t) dφ` apart. Along the ray, nothing is stretched.
    pub fn irradiance(&self, x: f64, z: f64) -> f64 {
        let reach = self.reach();
        let mut sum = 0.0;
        for (angle, t) in rays_through([x, z], -FRAC_PI_2, FRAC_PI_2, Self::ray) {
            let (near, far) = Self::lit(reach, angle);
            if t > near && t < far {
                sum += 1.0 / (1.0 - 2.0 * t / libm::cos(angle)).abs();
            }
        }
        sum * libm::sin(self.elevation) * self.reflectance
    }

    /// Mean irradiance of a rectangle of floor: `E_h ρ ∫ cos φ (t₂ − t₁) dφ / area`, as `E |cos φ − 2t| dφ dt = E_h ρ cos φ dφ dt`.
    pub fn mean(&self, x: [f64; 2], z: [f64; 2]) -> f64 {
        let steps = 40_000;
        let width = PI / f64::from(steps);
        let reach = self.reach();
        let mut sum = 0.0;
        for step in 0..steps {
            let angle = -FRAC_PI_2 + width * (f64::from(step) + 0.5);
            let (near, far) = Self::lit(reach, angle);
            if let Some((from, to)) = inside(&Self::ray(angle), x, z, far) {
                sum += libm::cos(angle) * (to - from.max(near)).max(0.0);
            }
        }
        sum * width * libm::sin(self.elevation) * self.reflectance / ((x[1] - x[0]) * (z[1] - z[0]))
    }
}

/// T8: a point of light above the rim, at `(1, light_height, 0)`.
#[derive(Clone, Copy)]
pub struct Cardioid {
    /// Height of the light above the floor.
    pub light_height: f64,
    /// Height of the wall, at most half of that of the light, so that no light meets the mirror twice.
    pub height: f64,
    /// Share of light that the mirror reflects.
    pub reflectance: f64,
}

impl Cardioid {
    /// The point of the caustic that light reflected at `(cos φ, sin φ)` touches: `⅓ (2 cos φ + cos 2φ, 2 sin φ + sin 2φ)`, cusp at `(−⅓, 0)`.
    pub fn caustic(parameter: f64) -> [f64; 2] {
        let (s, c) = libm::sincos(parameter);
        let (s2, c2) = libm::sincos(2.0 * parameter);
        [(2.0 * c + c2) / 3.0, (2.0 * s + s2) / 3.0]
    }

    /// The ray reflected at `(cos α, sin α)`, and the chord `s = 2 sin(α/2)` from the light to there.
    ///
    /// The chord from (1, 0) points along the angle `ψ = α/2 + π/2`. Mirrored at the normal, whose angle is α, and turned back, it points
    /// along `2α − ψ + π = 3α/2 + π/2`.
    fn ray(alpha: f64) -> (Reflected, f64) {
        let (s, c) = libm::sincos(alpha);
        let (turned_s, turned_c) = libm::sincos(1.5 * alpha + FRAC_PI_2);
        (Reflected { from: [c, s], along: [turned_c, turned_s] }, 2.0 * libm::sin(0.5 * alpha))
    }

    /// Farthest level distance from the mirror at which light gets to the floor, for a chord s from the light: light that meets the floor
    /// after a level distance `L = s + t` meets the wall at the height `h t/L`, which is at most the wall's.
    fn farthest(&self, chord: f64) -> f64 {
        chord * self.height / (self.light_height - self.height)
    }

    /// Irradiance of the floor at (x, z): `Σ ρ h L / ((L² + h²)^(3/2) |s − 3t|)`, `L = s + t`.
    ///
    /// Into an azimuth `dψ` and the inclinations that reach the floor from L to `L + dL` go `h L/(L² + h²)^(3/2) dψ dL` of an intensity of 1
    /// (that is `h/D³` per area, D the distance, on the area `L dψ dL`). Mirrored, that light has the width `|s − 3t| dψ`:
    /// s at the mirror, where light from a distance s turns into light that meets at t with `1/s + 1/t = 2/cos i = 4/s`.
    pub fn irradiance(&self, x: f64, z: f64) -> f64 {
        let h = self.light_height;
        let mut sum = 0.0;
        for (alpha, t) in rays_through([x, z], 0.0, TAU, |alpha| Self::ray(alpha).0) {
            let s = Self::ray(alpha).1;
            if t < self.farthest(s) {
                let level = s + t;
                let distance = libm::hypot(level, h);
                sum += h * level / (distance * distance * distance * (s - 3.0 * t).abs());
            }
        }
        sum * self.reflectance
    }

    /// Mean irradiance of a rectangle of floor: `ρ h ∫ [(L₁² + h²)^(−1/2) − (L₂² + h²)^(−1/2)] dψ / area`. Seen from the rim, the
    /// azimuth is half of the angle at the centre: `dψ = dα/2`.
    pub fn mean(&self, x: [f64; 2], z: [f64; 2]) -> f64 {
        let steps = 40_000;
        let width = TAU / f64::from(steps);
        let h = self.light_height;
        let mut sum = 0.0;
        for step in 0..steps {
            let (ray, s) = Self::ray(width * (f64::from(step) + 0.5));
            if let Some((from, to)) = inside(&ray, x, z, self.farthest(s)) {
                sum += 1.0 / libm::hypot(s + from, h) - 1.0 / libm::hypot(s + to, h);
            }
        }
        sum * 0.5 * width * h * self.reflectance / ((x[1] - x[0]) * (z[1] - z[0]))
    }
}
