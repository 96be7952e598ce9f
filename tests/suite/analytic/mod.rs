//! The ground truth against analytic truths: `scenes/analytic`, whose headers hold the derivations. `docs/analytic.md` lists who tests what.
//!
//! `truths` has the closed forms and `truths_checks` holds them against brute force, without the tracer; `verdict` says when a noisy value
//! agrees with a truth; `traced` measures with the crate's tracer. The other modules compare, one for each kind of scene.
//!
//! Every comparison is made at a relative standard error of at most one per cent, half a per cent at full size, against a truth that is integrated over the texel. Families of texels share one chance of 1e-4 to be refused when all is well.

mod folds;
mod glass;
mod in_turn;
mod mirrors;
mod scattering;
mod still;
mod traced;
pub mod truths;
mod truths_checks;
mod verdict;
mod waves;
