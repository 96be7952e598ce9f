//! The ground truth: forward photon tracing, independent of the techniques that it judges.
//!
//! Photons leave the lights in proportion to flux, towards specular surfaces, and are followed through every refraction and reflection until they
//! land. In: a scene. Out: irradiance over the texels of a plane, irradiance at the points that the camera's pixels show, and radiance scattered
//! towards the camera, each with its standard error; and an energy audit. Light that met at least one specular surface is in the layers
//! `caustic_irradiance` and `godrays`; light that met none has layers of its own.
//!
//! - `emit`: starts of photons; `photon`: their interactions; `water`: the water surface, exact or as a mesh; `world`: objects, intersected by
//!   `tree`.
//! - `plane` and `cells` measure light that lands, `volume` light that is scattered, `direct` light straight from the lights; `statistics` sums up;
//!   `eye` follows view rays.
//! - [`Tracer`] runs batches. A batch is cut into chunks that do not depend on the number of threads, results are summed in order and in 64 bits, and
//!   random numbers are functions of seed, batch and photon: the same bits on any number of threads, and after an interruption.
//!
//! It uses neither the pipeline nor frames nor a technique; it shares only the scene's models of water and media with them. Not followed: light that
//! a diffuse surface reflects, and light that is scattered more than once.

mod account;
mod audit;
mod batch;
mod cells;
mod direct;
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
mod volume;
mod water;
mod wave;
mod world;

pub use account::account;
pub use audit::Audit;
pub use cells::Points;
pub use error::TraceError;
pub use statistics::Measured;
pub use tracer::{TraceOptions, Tracer, camera_points};
