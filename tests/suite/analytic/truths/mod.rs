//! Closed forms of the irradiance and radiance of the scenes in `scenes/analytic`, in `f64`.
//!
//! Nothing here traces light: a truth is an equation, or an integral of one over a texel. Lengths are in metres, angles in radians, and
//! light has an irradiance of 1 W/m² across its rays (or an intensity of 1 W/sr) unless an argument says otherwise. `ior` is the
//! refractive index of the denser side over that of the air.
//!
//! | Module | Truths |
//! |---|---|
//! | [`optics`] | Snell, Fresnel, still and leaning water, sheets of glass and water: T1, T2, T15, T16 |
//! | [`water`] | one and two crossed sine waves: T3, T4, T9 |
//! | [`sphere`] | one spherical interface and the glass ball: T5, T6 |
//! | [`ring`] | the upright mirror cylinder: T7, T8 |
//! | [`scatter`] | phase functions and the lit slab: T10, T11 |
//!
//! A texel measures a mean. At folds a point has no value but a texel has, so [`sheets`], [`sphere`] and [`ring`] integrate the flux that
//! lands on a texel over where it *comes from*, in which everything is bounded: ∫ E dX = ∫ T dx₀.

pub mod optics;
pub mod ring;
pub mod scatter;
pub mod sheets;
pub mod sphere;
pub mod water;

/// Nodes in (0, 1) and weights of eight-point Gauss-Legendre quadrature over [−1, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// `∫ f` from `low` to `high` by eight-point Gauss-Legendre quadrature on `pieces` equal pieces.
pub fn integrate(low: f64, high: f64, pieces: u32, f: impl Fn(f64) -> f64) -> f64 {
    let half = 0.5 * (high - low) / f64::from(pieces);
    let mut sum = 0.0;
    for piece in 0..pieces {
        let middle = low + half * (2.0 * f64::from(piece) + 1.0);
        for (node, weight) in GAUSS {
            sum += weight * (f(middle - half * node) + f(middle + half * node));
        }
    }
    sum * half
}

/// Where `f`, which has one sign at `low` and the other at `high`, is zero; to the last bits.
pub fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rising = f(high) > f(low);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low.min(high) || middle >= low.max(high) {
            break;
        }
        if (f(middle) < 0.0) == rising { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
