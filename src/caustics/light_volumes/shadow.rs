//! Shadow culling: occlusion queries find beams in the shadow of objects above the water, node by node [BO §3.4].
//!
//! The top of a parent beam is tested against a shadow map with the reversed depth test: samples that pass lie behind an object that the light
//! meets first. Their number over the number of samples that the top covers is the node's shadow ratio. A leaf whose ratio is above S_min is
//! culled. Queries go level by level, and each level depends on the counts of the one above.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::Receivers;
use crate::beams::{LightBeams, NONE};
use crate::builder::state::depth_state;
use crate::passes::geometry_buffer::ReceiverVertex;
use crate::passes::shadow_map::{LightUniform, straight_program};
use crate::readback::{self, Counter, OcclusionQueries};
use crate::receivers::ReceiverGroup;
use nephroid_pipeline::frame::{BindEntry, BufferId, DepthStencilAttachment, Draw, Frame, FrameError, Pass};
use nephroid_pipeline::state::{CompareFunction, DepthBiasState, TextureFormat};
use nephroid_pipeline::{Buffer, Device, LoadOp, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::water::HeightField;

use super::hierarchy::{Cells, Hierarchy, triangles};

/// Largest shadow map of the queries, in texels along a side. The queries measure areas and need no fine edges.
const MAX_MAP_SIZE: u32 = 512;

/// Number of vertices of a node's top.
const TOP_VERTICES: u32 = 6;

/// Result of the queries of one light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shadowed {
    /// By triangle of the mesh, whether its beam is culled; empty if no query was made.
    pub triangles: Vec<bool>,
    /// Numbers of the nodes queried, by level.
    pub levels: Vec<Vec<u32>>,
    /// Number of leaves culled.
    pub leaves: u64,
}

impl Shadowed {
    /// Number of queries made.
    #[must_use]
    pub fn queries(&self) -> u64 {
        self.levels.iter().map(|level| level.len() as u64).sum()
    }

    /// By beam, whether it is culled; empty if no query was made.
    #[must_use]
    pub fn beams(&self, light: &LightBeams) -> Vec<bool> {
        let made = self.triangles.iter().zip(&light.of_triangle).filter(|(_, beam)| **beam != NONE);
        made.map(|(culled, _)| *culled).collect()
    }
}

/// Whether an object above the water could cast a shadow on the water: whether their bounds overlap in the light's view [BO §5].
#[must_use]
pub fn can_shade(receivers: &Receivers, casters: &[&ReceiverGroup], light: &LightUniform, water: Aabb) -> bool {
    let flat = |p: Vec3| (light.clip_from_world.project_point3(p)).with_z(0.0);
    let surface = Aabb::from_points(water.corners().map(flat));
    casters.iter().any(|group| {
        let above = receivers.positions_of(group).filter(|p| p.y > water.min.y);
        let bounds = Aabb::from_points(above);
        !bounds.is_empty() && Aabb::from_points(bounds.corners().map(flat)).intersects(surface)
    })
}

/// Shadow queries of one light.
#[derive(Clone, Copy)]
pub struct ShadowQueries<'a> {
    /// All receivers.
    pub receivers: &'a Receivers,
    /// Receivers that can cast a shadow on the water.
    pub casters: &'a [&'a ReceiverGroup],
    /// The water surface.
    pub field: &'a HeightField,
    /// The quadtrees over the surface.
    pub hierarchy: &'a Hierarchy,
    /// The light.
    pub light: &'a LightUniform,
    /// Number of the light.
    pub number: usize,
    /// Size of the shadow map, in texels along a side.
    pub map_size: u32,
}

impl ShadowQueries<'_> {
    fn size(&self) -> u32 {
        self.map_size.min(MAX_MAP_SIZE)
    }

    /// The light with its shadow map cropped to the nodes, so that each leaf covers many texels.
    fn cropped(&self) -> LightUniform {
        let corners = self.hierarchy.nodes.iter().filter(|node| !node.is_empty()).flat_map(|node| self.top(&node.cells));
        let seen = corners.map(|p| self.light.clip_from_world.project_point3(p).truncate());
        let (low, high) = seen.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let size = high - low;
        if !(size.is_finite() && size.min_element() > 0.0) {
            return *self.light;
        }
        // One texel of margin, so that rounding loses no texel at the edge.
        let scale = 2.0 / (size * (1.0 + 2.0 / self.size() as f32));
        let shift = -(low + high) * 0.5 * scale;
        let crop = Mat4::from_cols(Vec4::X * scale.x, Vec4::Y * scale.y, Vec4::Z, Vec4::new(shift.x, shift.y, 0.0, 1.0));
        LightUniform { clip_from_world: crop * self.light.clip_from_world, ..*self.light }
    }

    /// Corners of a node's piece of the surface, world space.
    fn top(&self, cells: &Cells) -> [Vec3; 4] {
        let (c, r) = (&cells.columns, &cells.rows);
        [(c.start, r.start), (c.start, r.end), (c.end, r.end), (c.end, r.start)].map(|(c, r)| self.field.position_ws(c, r))
    }

    /// Number of texels of the map that a node's top covers.
    fn coverage(&self, cells: &Cells) -> f64 {
        let half = f64::from(self.size()) * 0.5;
        let corners = self.top(cells).map(|p| self.light.clip_from_world.project_point3(p).as_dvec3() * half);
        let cross = |i: usize| corners[i].truncate().perp_dot(corners[(i + 1) % 4].truncate());
        0.5 * (cross(0) + cross(1) + cross(2) + cross(3)).abs()
    }

    /// Describes the queries: casters as occluders, tops of nodes as shapes.
    fn describe(&self) -> OcclusionQueries {
        let mut frame = Frame::default();
        let label = format!("shadow_query_map {}", self.number);
        let size = self.size();
        let depth = frame.texture(TextureDescriptor::d2(label.clone(), size, size, TextureFormat::Depth32Float));
        let light = frame.buffer(format!("query light {}", self.number), Arc::new(Buffer::from_value(self.light)));
        let state = |compare, write, bias| Some(depth_state(TextureFormat::Depth32Float, compare, write, bias));
        // The depths of casters are biased away from the light, so that objects standing in the water do not shade the surface around them.
        let bias = DepthBiasState { constant: 64, slope_scale: 1.0, clamp: 0.0 };
        let fill = frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: state(CompareFunction::Less, true, bias),
            ..RenderPipelineDescriptor::new(label.clone(), straight_program())
        });
        let vertices = frame.buffer(format!("query casters {}", self.number), self.receivers.vertices.clone());
        let indices = frame.buffer(format!("query caster indices {}", self.number), self.receivers.indices.clone());
        let casters = frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(vertices)]);
        let draws = self.casters.iter().map(|group| Draw::new(fill, casters, group.indices.clone()).indexed(indices)).collect();
        let target = Some(DepthStencilAttachment { view: depth.into(), depth_load: LoadOp::Clear(1.0), stencil_load: LoadOp::Load });
        frame.passes.push(Pass { label, depth_stencil: target, draws, ..Pass::default() });
        let pipeline = frame.pipeline(RenderPipelineDescriptor {
            depth_stencil: state(CompareFunction::Greater, false, DepthBiasState::default()),
            ..RenderPipelineDescriptor::new(format!("shadow_query {}", self.number), straight_program())
        });
        let tops = self.tops(&mut frame);
        let bindings = frame.bind_group(vec![BindEntry::Uniform(light, 0), BindEntry::Storage(tops)]);
        OcclusionQueries { occluders: frame, depth, pipeline, bindings, shape_vertices: TOP_VERTICES }
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

    /// Runs the queries from the roots down, and culls leaves with more than `least_ratio` of their area in shadow. The passes are added to `frame`.
    ///
    /// Below a node with shadow s, no leaf of area a can have a ratio above s/a. If that is at most S_min for the node's smallest leaf, the
    /// node's children are not queried. For equal parts over L levels, this is the paper's bound `ratio < S_min·4^−L`.
    ///
    /// # Errors
    /// If the queries cannot run.
    pub fn ask(&self, device: &Device, least_ratio: f32, frame: &mut Frame) -> Result<Shadowed, FrameError> {
        let light = self.cropped();
        let cropped = ShadowQueries { light: &light, ..*self };
        readback::ask(device, frame, cropped.describe(), |counter| cropped.descend(counter, least_ratio))
    }

    fn descend(&self, counter: &mut Counter<'_>, least_ratio: f32) -> Result<Shadowed, FrameError> {
        let mut found = Shadowed { triangles: vec![false; 2 * self.cell_count()], ..Shadowed::default() };
        let nodes = &self.hierarchy.nodes;
        let coverage: Vec<f64> = nodes.iter().map(|node| self.coverage(&node.cells)).collect();
        let smallest = smallest_leaves(self.hierarchy, &coverage);
        let mut level: Vec<u32> = (0..self.hierarchy.roots as u32).filter(|&k| !nodes[k as usize].is_empty()).collect();
        while !level.is_empty() {
            let label = format!("shadow_queries {} level {}", self.number, found.levels.len());
            let counts = counter.count(&label, &level)?;
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

/// By node, the coverage of the smallest leaf below it.
fn smallest_leaves(hierarchy: &Hierarchy, coverage: &[f64]) -> Vec<f64> {
    let mut smallest = coverage.to_vec();
    for (index, node) in hierarchy.nodes.iter().enumerate().rev() {
        if !node.children.is_empty() {
            smallest[index] = node.children.clone().map(|child| smallest[child as usize]).fold(f64::INFINITY, f64::min);
        }
    }
    smallest
}
