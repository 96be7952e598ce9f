//! Data that one phase hands to the next: vertices in framebuffer coordinates, linear functions over a triangle, set-up primitives.

pub(crate) mod clip_vertex;
pub(crate) mod corner;
pub(crate) mod planes;
pub(crate) mod tile_primitive;
pub(crate) mod window;
