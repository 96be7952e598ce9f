//! Layouts of the structs that programs share with their WGSL twins; a test compares both.

use nephroid_scene::PatternUniform;

use super::beams::Beam;
use super::passes::camera::CameraUniform;
use super::passes::compose::LayerUniform;
use super::passes::downsample::DownsampleUniform;
use super::passes::environment::EnvironmentUniform;
use super::passes::filter::KernelUniform;
use super::passes::geometry_buffer::{MaterialUniform, ReceiverVertex};
use super::passes::light_buffer::SurfaceUniform;
use super::passes::light_view::{LightView, TexelView};
use super::passes::receiver_search::ReceiverBounds;
use super::passes::rotating_filter::RotatingUniform;
use super::passes::shadow_map::LightUniform;
use super::passes::shape_operator::ShapeOperator;
use super::passes::water_surface::WaterVertex;

/// The memory layout of a struct in a buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Its name, the same in Rust and in WGSL.
    pub name: &'static str,
    /// Its size, bytes.
    pub size: usize,
    /// Names and offsets (bytes) of its fields, in order.
    pub fields: Vec<(&'static str, usize)>,
}

/// The [`Layout`] of a struct, from its name and the names of all its fields.
#[macro_export]
macro_rules! layout {
    ($type:ident: $($field:ident),+) => {
        $crate::layout::Layout {
            name: stringify!($type),
            size: size_of::<$type>(),
            fields: vec![$((stringify!($field), std::mem::offset_of!($type, $field))),+],
        }
    };
}

/// Structs of the passes that techniques share.
#[must_use]
pub fn shared() -> Vec<Layout> {
    vec![
        layout!(CameraUniform: clip_from_world, world_from_clip, eye_ws, size_px, water, extent, grid, level),
        layout!(EnvironmentUniform: zenith, horizon, ground, disc, suns, ambient, sigma_t, inscatter),
        layout!(PatternUniform: kind, numbers, first, colours),
        layout!(MaterialUniform: pattern, kind),
        layout!(ReceiverVertex: position_ws, normal_ws),
        layout!(WaterVertex: position_ws, normal_ws),
        layout!(LightUniform: clip_from_world, position_ws, intensity, spot, water, entry, refracted, own, cube),
        layout!(Beam: g, d, flux),
        layout!(LightView: clip_from_world, position_ws),
        layout!(TexelView: view, axis_ws, size_tx),
        layout!(SurfaceUniform: pattern, optics),
        layout!(ShapeOperator: diagonal, beside),
        layout!(ReceiverBounds: min_ws, max_ws),
        layout!(KernelUniform: weights, step),
        layout!(RotatingUniform: taps, rotations, count),
        layout!(DownsampleUniform: sizes),
        layout!(LayerUniform: scale, distance, ratio),
    ]
}
