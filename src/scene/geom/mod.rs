//! Geometry without appearance: boxes, planes, frusta, rays, triangle meshes and procedural shapes.
//!
//! Everything is in metres, y up, right-handed; triangles are counter-clockwise seen from outside. Nothing here reads a file,
//! uses threads or knows a scene: a function of its arguments, with the same bits on every machine.

mod aabb;
mod frustum;
pub mod mesh;
mod plane;
mod ray;
pub mod shapes;
mod tessellate;
mod triangulate;

pub use aabb::Aabb;
pub use frustum::{Containment, Frustum};
pub(crate) use mesh::direction;
pub use mesh::{Curvature, Mesh, MeshError};
pub use plane::Plane;
pub use ray::{Ray, TriangleHit};
pub use tessellate::TessellateError;
pub use triangulate::{MAX_EAR_CLIPPED_CORNERS, triangulate_polygon};
