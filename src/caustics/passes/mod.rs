//! Passes that techniques share. Each is a program, its uniforms and a function that adds the pass to a frame.
//!
//! - [`geometry_buffer`]: position, normal and albedo of the receiver that each pixel shows.
//! - [`shadow_map`]: depth as seen from a light, through air and through flat water.
//! - [`light`]: direct light and visibility of each pixel for one light.
//! - [`shade`]: irradiance to radiance.
//! - [`receiver_search`]: what a ray meets of the receivers in a picture; [`glass_body`]: the way of a view ray through glass.
//! - [`glass`]: what mirrors and glass show.
//! - [`water_surface`]: the picture: sky, receivers, and the water in front of them.
//! - [`shape_operator`]: both principal curvatures of a surface in a texel.
//! - [`light_view`]: views of a light, given or fitted to a box.
//! - [`light_buffer`]: position, normal, material, refractive index and depth as seen from a light.
//! - [`filter`] and [`rotating_filter`]: low-pass filters.
//! - [`downsample`] and [`compose`]: depth for smaller targets, and sums of layers of any size.
//! - [`in_scattering`]: light that the medium scatters towards the eye, added to the picture.

pub mod camera;
pub mod compose;
pub mod downsample;
pub mod environment;
pub mod filter;
pub mod fullscreen;
pub mod geometry_buffer;
pub mod glass;
pub mod glass_body;
pub mod in_scattering;
pub mod light;
pub mod light_buffer;
pub mod light_view;
pub mod receiver_search;
pub mod rotating_filter;
pub mod shade;
pub mod shadow_map;
pub mod shape_operator;
pub mod water_surface;
