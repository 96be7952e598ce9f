//! Parallel light through spheres of radius 1 around the origin, on receivers across the light.
//!
//! Light comes along the axis at distances b from it, `sin θi = b`. Everything turns about the axis, so that a ring of light from b lands on
//! a ring of radius |r(b)| and `E = Σ W(b) |b / (r dr/db)|` over all b and all sequences of surfaces whose light lands there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::optics::{reflectance, refraction_angle, transmittance};
use super::sheets::Sheets;

/// Rings of light: b and what it brings.
pub trait Rings {
    /// Greatest b, and the number of sequences of surfaces that are told apart.
    fn domain(&self) -> (f64, u32);

    /// Signed distance from the axis at which the ray of `b` lands by sequence `order`, positive on its own side of the axis; `None`
    /// where it does not land.
    fn landing(&self, b: f64, order: u32) -> Option<f64>;

    /// Share of its light that the ray of `b` brings.
    fn share(&self, b: f64, order: u32) -> f64;

    /// Mean irradiance over the rectangle `x0..x1` by `z0..z1` across the axis, `∫ W 2πb p db / area`, with p the share of the ring's
    /// circle that lies in the rectangle. Finite at folds and on the axis.
    fn mean(&self, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> f64 {
        let (greatest, orders) = self.domain();
        // b = sin u keeps steps small at grazing incidence, where things change as the root of 1 - b.
        let steps = 50_000;
        let width = libm::asin(greatest) / f64::from(steps);
        let mut sum = 0.0;
        for step in 0..steps {
            let (b, cosine) = libm::sincos((f64::from(step) + 0.5) * width);
            for order in 0..orders {
                if let Some(r) = self.landing(b, order) {
                    let part = share_of_circle(r.abs(), [x0, x1], [z0, z1]);
                    if part > 0.0 {
                        sum += self.share(b, order) * b * cosine * part;
                    }
                }
            }
        }
        sum * TAU * width / ((x1 - x0) * (z1 - z0))
    }
}

/// The share of the circle of radius r around the origin that lies in a rectangle.
pub fn share_of_circle(r: f64, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> f64 {
    // Nearest and farthest point of the rectangle.
    let near = |a: f64, b: f64| {
        if a > 0.0 {
            a
        } else if b < 0.0 {
            -b
        } else {
            0.0
        }
    };
    let far = |a: f64, b: f64| a.abs().max(b.abs());
    let squared = |x: f64, z: f64| x * x + z * z;
    if squared(near(x0, x1), near(z0, z1)) > r * r || squared(far(x0, x1), far(z0, z1)) < r * r {
        return 0.0;
    }
    let mut ends = [0.0; 10];
    let mut count = 1;
    for x in [x0, x1].into_iter().filter(|x| x.abs() < r) {
        let angle = libm::acos(x / r);
        (ends[count], ends[count + 1]) = (angle, TAU - angle);
        count += 2;
    }
    for z in [z0, z1].into_iter().filter(|z| z.abs() < r) {
        let angle = libm::asin(z / r);
        (ends[count], ends[count + 1]) = ((angle + TAU) % TAU, PI - angle);
        count += 2;
    }
    ends[count] = TAU;
    let ends = &mut ends[..=count];
    ends.sort_by(f64::total_cmp);
    let mut inside = 0.0;
    for arc in ends.windows(2) {
        let (sine, cosine) = libm::sincos(0.5 * (arc[0] + arc[1]));
        if (x0..=x1).contains(&(r * cosine)) && (z0..=z1).contains(&(r * sine)) {
            inside += arc[1] - arc[0];
        }
    }
    inside / TAU
}

/// T5: one spherical interface, and a plane inside the glass across the axis.
#[derive(Clone, Copy)]
pub struct Cap {
    /// Refractive index of the glass.
    pub ior: f64,
    /// Where the plane is: its distance behind the centre; negative between the vertex and the centre.
    pub behind_center: f64,
}

impl Cap {
    /// Depth of the paraxial focus below the vertex, `n R/(n − 1)`.
    pub fn focus_depth(&self) -> f64 {
        self.ior / (self.ior - 1.0)
    }

    fn angles(&self, b: f64) -> (f64, f64) {
        let angle = libm::asin(b);
        (angle, refraction_angle(angle, self.ior).expect("light comes from the thinner side"))
    }

    /// Where the ray of b crosses the axis, behind the centre: `(b/n) / sin(θi − θt)`, from the triangle of centre, entry and crossing.
    pub fn crossing(&self, b: f64) -> f64 {
        let (angle, inside) = self.angles(b);
        b / self.ior / libm::sin(angle - inside)
    }

    /// `r = b − (cos θi + z) tan(θi − θt)`, z the plane's distance behind the centre.
    fn r(&self, b: f64) -> f64 {
        let (angle, inside) = self.angles(b);
        b - (libm::cos(angle) + self.behind_center) * libm::tan(angle - inside)
    }

    /// `dr/db = 1 + tan θi tan δ − (cos θi + z) (1/cos θi − 1/(n cos θt)) / cos² δ`, with `δ = θi − θt`.
    fn r_per_b(&self, b: f64) -> f64 {
        let (angle, inside) = self.angles(b);
        let turn = angle - inside;
        let cosine = libm::cos(turn);
        let turn_per_b = 1.0 / libm::cos(angle) - 1.0 / (self.ior * libm::cos(inside));
        1.0 + libm::tan(angle) * libm::tan(turn) - (libm::cos(angle) + self.behind_center) * turn_per_b / (cosine * cosine)
    }

    /// Irradiance at the distance `r > 0` from the axis.
    pub fn irradiance(&self, r: f64) -> f64 {
        let sheets = Sheets::new(0.0, 1.0, 4000, |b| self.r(b));
        let value = |b: f64| transmittance(libm::asin(b), self.ior) * b / (r * self.r_per_b(b).abs());
        [r, -r].into_iter().flat_map(|r| sheets.preimages(r)).map(value).sum()
    }

    /// Irradiance on the axis before the focus, `T(0) / (1 − d/f)²` with d the plane's depth below the vertex: each axis shrinks by
    /// `1 − d/f`, as light of small b crosses at f.
    pub fn on_axis(&self) -> f64 {
        let shrink = 1.0 - (1.0 + self.behind_center) / self.focus_depth();
        transmittance(0.0, self.ior) / (shrink * shrink)
    }
}

impl Rings for Cap {
    fn domain(&self) -> (f64, u32) {
        (1.0, 1)
    }

    fn landing(&self, b: f64, _order: u32) -> Option<f64> {
        Some(self.r(b))
    }

    fn share(&self, b: f64, _order: u32) -> f64 {
        transmittance(libm::asin(b), self.ior)
    }
}

/// T6: a ball of glass, and a plane behind it across the axis.
///
/// The sequence `order` counts the chords inside: 0 is light reflected outside, 1 passes straight through, 2 and more are reflected inside.
/// Light turns by `θi − θt` at each passage and by `π − 2θt` at each reflection inside (outside by `2θi − π`), so in all
/// by `D = 2(θi − θt) + (order − 1)(π − 2θt)`. The angle of incidence is θt at every surface from inside, where the reflectance is the same
/// as from outside (both equations of Fresnel are even in `θi ↔ θt`), so `W = T² R^(order − 1)`, and R for order 0.
#[derive(Clone, Copy)]
pub struct Ball {
    /// Refractive index of the glass.
    pub ior: f64,
    /// Distance of the plane behind the centre, above 1.
    pub behind_center: f64,
}

impl Ball {
    /// Sequences taken into account; what is left over is below R⁶.
    const ORDERS: u32 = 7;

    /// Paraxial focus, behind the centre: `n R / (2(n − 1))`.
    pub fn focus(&self) -> f64 {
        0.5 * self.ior / (self.ior - 1.0)
    }

    /// By how much the ray of b is turned, and `dD/db`.
    fn deviation(&self, b: f64, order: u32) -> (f64, f64) {
        let angle = libm::asin(b);
        let inside = libm::asin(b / self.ior);
        let more = f64::from(order) - 1.0;
        let (angle_per_b, inside_per_b) = (1.0 / libm::cos(angle), 1.0 / (self.ior * libm::cos(inside)));
        (2.0 * (angle - inside) + more * (PI - 2.0 * inside), 2.0 * (angle_per_b - inside_per_b) - more * 2.0 * inside_per_b)
    }

    /// Where the ray of b, once through, crosses the axis, behind the centre: `b / sin D`.
    ///
    /// Before and behind the ball the ray passes the centre at the same distance b, as both angles of incidence are equal.
    pub fn crossing(&self, b: f64) -> f64 {
        b / libm::sin(self.deviation(b, 1).0)
    }

    /// `r = (b − z sin D)/cos D`: the ray passes the centre at the distance b, in a direction turned by D.
    fn r(&self, b: f64, order: u32) -> Option<f64> {
        let (turn, _) = self.deviation(b, order);
        let cosine = libm::cos(turn);
        (cosine > 1.0e-9).then(|| (b - self.behind_center * libm::sin(turn)) / cosine)
    }

    fn r_per_b(&self, b: f64, order: u32) -> f64 {
        let (turn, turn_per_b) = self.deviation(b, order);
        let (sine, cosine) = libm::sincos(turn);
        let z = self.behind_center;
        ((1.0 - z * cosine * turn_per_b) * cosine + (b - z * sine) * sine * turn_per_b) / (cosine * cosine)
    }

    /// Irradiance at the distance `r > 0` from the axis, by the sequences `orders`.
    pub fn irradiance(&self, r: f64, orders: std::ops::Range<u32>) -> f64 {
        let samples = 5_000;
        let mut sum = 0.0;
        for order in orders {
            for wanted in [r, -r] {
                for step in 0..samples {
                    let at = |i: u32| libm::sin(FRAC_PI_2 * f64::from(i) / f64::from(samples));
                    let (low, high) = (at(step), at(step + 1));
                    let (Some(first), Some(last)) = (self.r(low, order), self.r(high, order)) else { continue };
                    if (first <= wanted) != (last <= wanted) {
                        let b = super::root(low, high, |b| self.r(b, order).map_or(f64::NAN, |r| r - wanted));
                        sum += self.share(b, order) * (b / (r * self.r_per_b(b, order))).abs();
                    }
                }
            }
        }
        sum
    }

    /// Irradiance on the axis by light that passes straight through near the axis: `T(0)² / (1 − z/f)²`, as paraxial
    /// light meets at f. Holds where no other ring of light is focused on the axis: before the first marginal crossing, and behind f.
    pub fn on_axis(&self) -> f64 {
        let shrink = 1.0 - self.behind_center / self.focus();
        let t = transmittance(0.0, self.ior);
        t * t / (shrink * shrink)
    }
}

impl Rings for Ball {
    fn domain(&self) -> (f64, u32) {
        (1.0, Self::ORDERS)
    }

    fn landing(&self, b: f64, order: u32) -> Option<f64> {
        self.r(b, order)
    }

    fn share(&self, b: f64, order: u32) -> f64 {
        let reflected = reflectance(libm::asin(b), self.ior);
        if order == 0 { reflected } else { (1.0 - reflected) * (1.0 - reflected) * libm::pow(reflected, f64::from(order - 1)) }
    }
}
