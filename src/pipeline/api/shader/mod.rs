//! The programmable stages: the inputs and outputs of shaders, and the loops that run them over batches.
//!
//! Write a stage once, generic over [`Lanes`](nephroid_math::lanes::Lanes), as [`VertexShader`] or [`FragmentShader`]. It becomes a [`VertexStage`]
//! or [`FragmentStage`], which the pipeline calls once per batch through a trait object; inside a batch all code is monomorphic. A geometry shader is
//! scalar and sees one primitive at a time.

pub(crate) mod clip_vertices;
pub(crate) mod fragment;
pub(crate) mod geometry;
pub(crate) mod program;
pub(crate) mod separable;
pub(crate) mod stages;
pub(crate) mod varying;
pub(crate) mod vertex;
pub(crate) mod vertex_color;

pub use fragment::{FragmentInput, FragmentOutput, FragmentShader, PrimitiveAttributes, Separable, ShadeSource};
pub use geometry::{Geometry, GeometryInput, GeometryOutput, GeometryShader, StageVertex};
pub use program::Program;
pub use separable::{Axis, SeparableShader};
pub use stages::{Execution, FactorBatch, FragmentStage, ShadeBatch, ShadeItem, ShaderWidth, VertexBatch, VertexStage};
pub use varying::{Interpolation, Varying, flatten_varyings};
pub use vertex::{VertexInput, VertexOutput, VertexShader};
