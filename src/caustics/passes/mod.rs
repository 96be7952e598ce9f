//! Passes that techniques share, each a program, its uniforms and a function that adds it to a frame.
//!
//! - [`geometry_buffer`]: what each pixel sees: position, normal, albedo.
//! - [`shadow_map`]: what a light sees, through air, and through flat water.
//! - [`light`]: direct light and visibility of each pixel for one light.
//! - [`shade`]: irradiance to radiance.
//! - [`water_surface`]: the picture: sky, receivers, and the water in front of them.
//! - [`light_buffer`]: position, normal, material, refractive index and depth of what a light sees.
//! - [`filter`] and [`rotating_filter`]: low passes.
//! - [`downsample`] and [`compose`]: depth for smaller targets, and layers of any size added up.
//! - [`in_scattering`]: light scattered by the medium on the way to the eye, added to the picture.

pub mod camera;
pub mod compose;
pub mod downsample;
pub mod environment;
pub mod filter;
pub mod fullscreen;
pub mod geometry_buffer;
pub mod in_scattering;
pub mod light;
pub mod light_buffer;
pub mod rotating_filter;
pub mod shade;
pub mod shadow_map;
pub mod water_surface;
