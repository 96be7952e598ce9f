//! Water as columns joined by pipes, after J. F. O'Brien and J. K. Hodgins, "Dynamic Simulation of Splashing Fluids", Computer Animation 1995.
//!
//! A cell `i` of the grid is a column of volume `V_i` on the base `Δx·Δz`; eight pipes join it to its neighbours. With the head (pressure over `ρg`)
//! `H_i = V_i/(Δx·Δz) + E_i`, `E` from what presses on the surface, a pipe of cross-section `c` and length `l` accelerates its flow `Q` (m³/s) by
//! `dQ/dt = g·(c/l)·(H_i − H_n)`, and `dV_i/dt` is the sum of flows. No pipe leads out: the rim is a wall.
//!
//! **Cross-sections.** The paper leaves `c` to the animator. Here it follows from the depth `d` of the still water so that small waves travel at
//! `√(g·d)` and no direction is preferred: `c/l = d·Δx·Δz·w`, with `w` the nine-point Laplacian whose error is isotropic,
//! `w_diagonal = (Δx² + Δz²)/(12·Δx²·Δz²)`, `w_x = 1/Δx² − 2·w_diagonal`, `w_z` likewise (2/3 and 1/6 of `1/Δ²` for square cells). All are positive
//! for cells up to √5 times as long as wide. Walls mirror the water, so pipes along a wall take over the diagonals that would cross it. Waves of all
//! lengths travel at about that one speed; on the grid and with the time step below, a wave along x has
//! `sin(ωΔt/2) = (√(g·d)·Δt/Δx)·sin(kΔx/2)`.
//!
//! **Time.** Fixed steps of half the stable length, `Δt = 1/√(g·d·λ)`, `λ` the largest eigenvalue of `w`, and at most 1/120 s.
//! Flows are advanced first, then volumes by the *new* flow (leapfrog, flows half a step ahead). The paper moves the mean of old and new flow; without damping that multiplies a wave by `√(1 + (ωΔt)²/2)` every step, which is
//! growth, so it was not taken. Between steps the surface is interpolated linearly: what an animation shows depends on time alone.
//!
//! **Conservation.** What leaves one column enters another; drops add exactly their volume, spray carries its own and returns it. Flows out of a column that would run dry are
//! scaled to what it holds, as in the paper. The state is 64-bit; the total drifts by rounding alone.
//!
//! **Surface.** The paper's control points are means of the four columns around them. The same weights at the corners, and a smooth surface between,
//! come from the biquadratic B-spline over the columns, mirrored at the rim; normals are those of the spline.

mod forces;
mod rows;
mod settings;
mod solver;
mod spray;
mod surface;
#[cfg(test)]
mod tests;

pub use forces::{Drop, MovingObject, ObjectPath, ObjectShape, Rain};
pub use settings::{FluidSettings, InitialState};
pub use solver::PipeFluid;
pub use spray::{SprayParticle, SpraySettings};
