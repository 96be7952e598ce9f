//! The ground truth: forward photon tracing, which shares nothing with what it judges.
//!
//! Photons leave the lights by flux towards whatever is specular, and are followed through every refraction and reflection until they land.
//! In: a scene. Out: irradiance over the texels of a plane, irradiance at what each pixel of the camera shows, and radiance scattered towards the
//! camera, each with its standard error; and an audit of where the light went. Only light that met at least one specular surface is measured: this is
//! what the layers `caustic_irradiance` and `godrays` mean.
//!
//! - `emit`: where photons start; `photon`: their life; `water`: the surface that they meet, exact or as a mesh; `world`: objects,
//!   found by `tree`.
//! - `plane` and `cells` measure what lands, `beams` what is scattered, `statistics` adds up; `eye` follows view rays.
//! - [`Tracer`] runs batches. A batch is cut into chunks that do not depend on the number of threads, results are added up in order and in 64
//!   bits, and random numbers are functions of seed, batch and photon: the same bits on any number of threads, and after an interruption.
//!
//! It uses neither the pipeline nor frames nor a technique. The scene's models of water and media are its input, as they are theirs.
//! It does not follow light that a diffuse surface sends on, nor light that is scattered more than once.

mod audit;
mod beams;
mod cells;
mod emit;
mod error;
mod eye;
mod media;
mod photon;
mod plane;
mod random;
mod spectrum;
mod state;
mod statistics;
mod tracer;
mod tree;
mod water;
mod wave;
mod world;

pub use audit::Audit;
pub use cells::Points;
pub use error::TraceError;
pub use statistics::Measured;
pub use tracer::{TraceOptions, Tracer, camera_points};
