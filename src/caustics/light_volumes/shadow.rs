//! Shadow culling: beams under what stands above the water are found by occlusion queries, node by node [BO §3.4].
//!
//! The top of a parent beam is drawn into a shadow map with the depth test turned round. What passes lies behind something that the light meets
//! first; over the area that the top covers, that is the node's shadow ratio. A leaf whose ratio is above S_min is culled.
//!
//! The answers decide what the frame draws, so the queries run while it is built, level by level. The frame has the same passes again, with
//! what is known of them: another executor counts for itself, and the cross-check compares.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::passes::geometry_buffer::ReceiverVertex;
use crate::passes::shadow_map::{LightUniform, air_program};
use crate::receivers::ReceiverGroup;
use crate::stage::state::depth_state;
use crate::{Receivers, RenderError};
use nephroid_pipeline::frame::{BindEntry, BindGroupId, BufferId, DepthTarget, Frame, FrameDraw, FramePass, PipelineId, TextureId};
use nephroid_pipeline::frame::{Contents, pipelines, run_frame_pass};
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{Buffer, Device, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::HeightField;

use super::hierarchy::{Cells, Hierarchy, triangles};

/// Largest map that queries are drawn into: what is measured are areas.
const MAX_MAP_SIZE: u32 = 512;

/// Queries of a pass: drivers that count in colour targets have room for so many.
pub const QUERIES_PER_PASS: usize = 32;

/// Vertices of a node's top.
const TOP_VERTICES: u32 = 6;

/// What the queries of one light have found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shadowed {
    /// Per triangle of the mesh; empty if nothing is culled.
    pub triangles: Vec<bool>,
    /// Nodes asked about, level by level.
    pub levels: Vec<Vec<u32>>,
    /// Leaves culled.
    pub leaves: u64,
}

impl Shadowed {
    /// Queries made.
    #[must_use]
    pub fn queries(&self) -> u64 {
        self.levels.iter().map(|level| level.len() as u64).sum()
    }
}

/// Whether something above the water could cast a shadow on it: whether their bounds meet as the light sees them [BO §5].
#[must_use]
pub fn can_shade(receivers: &Receivers, casters: &[&ReceiverGroup], light: &LightUniform, water: Aabb) -> bool {
    let vertices: &[ReceiverVertex] = bytemuck::cast_slice(receivers.vertices.bytes());
    let indices: &[u32] = bytemuck::cast_slice(receivers.indices.bytes());
    let flat = |p: Vec3| (light.clip_from_world.project_point3(p)).with_z(0.0);
    let surface = Aabb::from_points(water.corners().map(flat));
    casters.iter().any(|group| {
        let corners = indices[group.elements.start as usize..group.elements.end as usize].iter();
        let above = corners.map(|&i| vertices[i as usize].position_ws.truncate()).filter(|p| p.y > water.min.y);
        let bounds = Aabb::from_points(above);
        !bounds.is_empty() && Aabb::from_points(bounds.corners().map(flat)).intersects(surface)
    })
}

/// A frame's resources for the queries of one light.
struct Prepared {
    map: TextureId,
    bindings: BindGroupId,
    pipeline: PipelineId,
}

/// What the queries of one light are made from.
#[derive(Clone, Copy)]
pub struct Queries<'a> {
    /// All receivers.
    pub receivers: &'a Receivers,
    /// Those that can cast a shadow on the water.
    pub casters: &'a [&'a ReceiverGroup],
    /// The surface.
    pub field: &'a HeightField,
    /// Its nodes.
    pub hierarchy: &'a Hierarchy,
    /// The light.
    pub light: &'a LightUniform,
    /// Number of the light.
    pub number: usize,
    /// Size of its shadow map.
    pub map_size: u32,
}

impl Queries<'_> {
    fn size(&self) -> u32 {
        self.map_size.min(MAX_MAP_SIZE)
    }

    /// The light with its map cut down to what the nodes cover: what counts are texels on them, and a leaf must have many.
    fn cropped(&self) -> LightUniform {
        let corners = self.hierarchy.nodes.iter().filter(|node| !node.is_empty()).flat_map(|node| self.top(&node.cells));
        let seen = corners.map(|p| self.light.clip_from_world.project_point3(p).truncate());
        let (low, high) = seen.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let size = high - low;
        if !(size.is_finite() && size.min_element() > 0.0) {
            return *self.light;
        }
        // A texel all around, so that none at the rim is left out by rounding.
        let scale = 2.0 / (size * (1.0 + 2.0 / self.size() as f32));
        let shift = -(low + high) * 0.5 * scale;
        let crop = Mat4::from_cols(Vec4::X * scale.x, Vec4::Y * scale.y, Vec4::Z, Vec4::new(shift.x, shift.y, 0.0, 1.0));
        LightUniform { clip_from_world: crop * self.light.clip_from_world, ..*self.light }
    }

    /// Corners of the piece of the surface that a node covers, world space.
    fn top(&self, cells: &Cells) -> [Vec3; 4] {
        let (c, r) = (&cells.columns, &cells.rows);
        [(c.start, r.start), (c.start, r.end), (c.end, r.end), (c.end, r.start)].map(|(c, r)| self.field.position_ws(c, r))
    }

    /// Texels of the map that a node's top covers.
    fn coverage(&self, cells: &Cells) -> f64 {
        let half = f64::from(self.size()) * 0.5;
        let corners = self.top(cells).map(|p| self.light.clip_from_world.project_point3(p).as_dvec3() * half);
        let cross = |i: usize| corners[i].truncate().perp_dot(corners[(i + 1) % 4].truncate());
        0.5 * (cross(0) + cross(1) + cross(2) + cross(3)).abs()
    }

    fn prepare(&self, frame: &mut Frame) -> Prepared {
        let label = format!("shadow_query_map {}", self.number);
        let size = self.size();
        let map = frame.texture(TextureDescriptor::d2(label.clone(), size, size, TextureFormat::Depth32Float));
        let light = frame.buffer(format!("query light {}", self.number), Arc::new(Buffer::from_value(self.light)));
        let drawn = |compare, write, bias| Some(depth_state(TextureFormat::Depth32Float, compare, write, bias));
        // Pushed back a little, so that what stands in the water does not shade the surface around it.
        let bias = DepthBiasState { constant: 64, slope_scale: 1.0, clamp: 0.0 };
        let pipeline = frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: drawn(CompareFunction::Less, true, bias),
            ..RenderPipelineDescriptor::new(label.clone(), air_program())
        });
        let vertices = frame.buffer(format!("query casters {}", self.number), self.receivers.vertices.clone());
        let indices = frame.buffer(format!("query caster indices {}", self.number), self.receivers.indices.clone());
        let bindings = frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(vertices)]);
        let draws = self.casters.iter().map(|group| FrameDraw::new(pipeline, bindings, group.elements.clone()).indexed(indices)).collect();
        let depth = Some(DepthTarget { view: map.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        frame.passes.push(FramePass { label, depth, draws, ..FramePass::default() });
        let pipeline = frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: drawn(CompareFunction::Greater, false, DepthBiasState::default()),
            ..RenderPipelineDescriptor::new(format!("shadow_query {}", self.number), air_program())
        });
        let tops = self.tops(frame);
        let bindings = frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(tops)]);
        Prepared { map, bindings, pipeline }
    }

    /// Two triangles for every node.
    fn tops(&self, frame: &mut Frame) -> BufferId {
        let vertex = |p: Vec3| ReceiverVertex { position_ws: p.extend(1.0), normal_ws: Vec4::Y };
        let top = |cells: &Cells| {
            let [a, b, c, d] = self.top(cells);
            [a, b, c, a, c, d].map(vertex)
        };
        let vertices: Vec<ReceiverVertex> = self.hierarchy.nodes.iter().flat_map(|node| top(&node.cells)).collect();
        frame.buffer(format!("query tops {}", self.number), Arc::new(Buffer::from_slice(&vertices)))
    }

    fn pass(&self, prepared: &Prepared, label: String, nodes: &[u32]) -> FramePass {
        let draw = |(query, &node): (usize, &u32)| FrameDraw {
            query: Some(query as u32),
            ..FrameDraw::new(prepared.pipeline, prepared.bindings, node * TOP_VERTICES..(node + 1) * TOP_VERTICES)
        };
        FramePass {
            label,
            depth: Some(DepthTarget { view: prepared.map.into(), depth_load: LoadOp::Load, stencil_load: LoadOp::Load }),
            draws: nodes.iter().enumerate().map(draw).collect(),
            query_count: nodes.len(),
            ..FramePass::default()
        }
    }

    /// Asks, from the roots down, and culls leaves with more than `least_ratio` of their area in shadow; the passes are added to `frame`.
    ///
    /// Below a node with area A and shadow s, no leaf of area a can have a ratio above s/a: where that is less than S_min for the
    /// smallest leaf, nothing more is asked. For equal parts over L levels it is the bound ratio < S_min·4^−L.
    pub fn ask(&self, device: &Device, least_ratio: f32, frame: &mut Frame) -> Result<Shadowed, RenderError> {
        let light = self.cropped();
        Queries { light: &light, ..*self }.ask_map(device, least_ratio, frame)
    }

    fn ask_map(&self, device: &Device, least_ratio: f32, frame: &mut Frame) -> Result<Shadowed, RenderError> {
        let mut found = Shadowed { triangles: vec![false; 2 * self.cell_count()], ..Shadowed::default() };
        // A frame of its own to count in.
        let mut counting = Frame { rules: frame.rules, ..Frame::default() };
        let prepared = self.prepare(&mut counting);
        let mut contents = Contents::initial(&counting).map_err(nephroid_pipeline::frame::FrameError::from)?;
        let made = pipelines(&counting).map_err(nephroid_pipeline::frame::FrameError::from)?;
        run_frame_pass(device, &counting, &made, &counting.passes[0], &mut contents, None)?;
        let again = self.prepare(frame);
        let nodes = &self.hierarchy.nodes;
        let coverage: Vec<f64> = nodes.iter().map(|node| self.coverage(&node.cells)).collect();
        let smallest = smallest_leaves(self.hierarchy, &coverage);
        let mut level: Vec<u32> = (0..self.hierarchy.roots as u32).filter(|&k| !nodes[k as usize].is_empty()).collect();
        while !level.is_empty() {
            let label = format!("shadow_queries {} level {}", self.number, found.levels.len());
            let mut counts = Vec::with_capacity(level.len());
            for (part, nodes) in level.chunks(QUERIES_PER_PASS).enumerate() {
                let label = format!("{label} part {part}");
                let output = run_frame_pass(device, &counting, &made, &self.pass(&prepared, label.clone(), nodes), &mut contents, None)?;
                counts.extend_from_slice(&output.queries);
                frame.passes.push(FramePass { known: Some(output), ..self.pass(&again, label, nodes) });
            }
            let mut next = Vec::new();
            for (&index, count) in level.iter().zip(counts) {
                let node = &nodes[index as usize];
                let most = count as f64 / smallest[index as usize].max(f64::MIN_POSITIVE);
                if most <= f64::from(least_ratio) {
                    continue;
                }
                if !node.children.is_empty() {
                    next.extend(node.children.clone().filter(|&child| !nodes[child as usize].is_empty()));
                } else if (count as f64 / coverage[index as usize]).min(1.0) > f64::from(least_ratio) {
                    found.leaves += 1;
                    for triangle in triangles(self.hierarchy.columns, &node.cells) {
                        found.triangles[triangle as usize] = true;
                    }
                }
            }
            found.levels.push(std::mem::replace(&mut level, next));
        }
        Ok(found)
    }

    fn cell_count(&self) -> usize {
        (self.field.columns as usize - 1) * (self.field.rows as usize - 1)
    }
}

/// Per node, the coverage of the smallest leaf below it.
fn smallest_leaves(hierarchy: &Hierarchy, coverage: &[f64]) -> Vec<f64> {
    let mut smallest = coverage.to_vec();
    for (index, node) in hierarchy.nodes.iter().enumerate().rev() {
        if !node.children.is_empty() {
            smallest[index] = node.children.clone().map(|child| smallest[child as usize]).fold(f64::INFINITY, f64::min);
        }
    }
    smallest
}
