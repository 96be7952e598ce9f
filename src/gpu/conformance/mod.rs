//! Random and adversarial primitives, drawn by a driver and by the software GPU under the rules that the driver is said to follow.
pub mod drawing;
pub mod program;
