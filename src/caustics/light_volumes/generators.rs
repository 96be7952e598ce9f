//! The generators of beams in a frame: the water surface, or mirrors and glass.

use nephroid_scene::water::HeightField;
use nephroid_scene::{Radiometry, Scene};

use std::sync::Arc;

use crate::beams::{FluxModel, Interface, LightBeams};
use crate::builder::FrameLight;
use crate::{Receivers, RenderError};

use super::hierarchy::Span;
use super::settings::LightVolumes;
use super::specular::{self, Specular};
use super::{LightVolumesError, MAX_BEAMS};

/// The generators of a frame, and the inputs of their beams.
pub struct Generators<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The technique's settings.
    pub settings: &'a LightVolumes,
    /// Receivers: beams end below the lowest one.
    pub receivers: &'a Receivers,
    /// The water surface.
    pub field: Option<&'a HeightField>,
    /// Mirrors and glass; used if there is no water.
    pub specular: Option<&'a Specular>,
}

/// A light's beams, with their slicing and grouping.
pub struct GeneratedBeams {
    /// The beams.
    pub beams: Arc<LightBeams>,
    /// Heights of the generators and of the lowest plane.
    pub span: Span,
    /// Height of the first slicing plane, m: the mean level of the generators.
    pub level: f32,
    /// Columns and rows of vertices of the mesh, which has two triangles per cell.
    pub grid: (u32, u32),
    /// Number of quadtrees along columns and rows.
    pub buckets: (u32, u32),
    /// How many times each tree is subdivided.
    pub levels: u32,
}

/// Least height below the lowest receiver, as a share of the size of the scene.
const LEAST_BELOW: f32 = 1.0e-3;

impl Generators<'_> {
    /// Whether the scene has no generators.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.field.is_none() && self.specular.is_none()
    }

    /// The beams of a light; `None` if the scene has no generators.
    ///
    /// # Errors
    /// If mirrors and glass make more beams than [`MAX_BEAMS`].
    pub fn beams_of(&self, light: &FrameLight) -> Result<Option<GeneratedBeams>, RenderError> {
        let settings = self.settings;
        let source = &self.scene.lights[light.number];
        if let (Some(field), Some(water)) = (self.field, &self.scene.water) {
            let flux_model = match settings.radiometry {
                Radiometry::Physical => FluxModel::Conserved,
                Radiometry::Paper => FluxModel::OwnTransmittance,
            };
            let interface = Interface::new(field, source, &light.uniform, &self.scene.medium);
            let (level, field) = (water.level_m * interface.side, &interface.field);
            let beams = Arc::new(interface.beams(flux_model));
            let heights = field.heights_ws.iter().fold((level, level), |(low, high), &y| (low.min(y), high.max(y)));
            let span = self.span(heights, beams.side);
            let (grid, buckets, levels) = ((field.columns, field.rows), settings.buckets, settings.levels);
            return Ok(Some(GeneratedBeams { beams, span, level, grid, buckets, levels }));
        }
        let Some(specular) = self.specular else { return Ok(None) };
        let beams = Arc::new(specular.beams(source, settings.radiometry)?);
        let heights = beams.beams.iter().flat_map(|beam| beam.g.map(|g| g.y));
        let heights = heights.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        let span = self.span(if beams.beams.is_empty() { (0.0, 0.0) } else { heights }, beams.side);
        // One row of cells: a tree over a space-filling curve, halved twice where a quadtree is divided into four.
        let grid = (specular::cells(&beams) + 1, 2);
        let buckets = (settings.buckets.0 * settings.buckets.1, 1);
        Ok(Some(GeneratedBeams { beams, span, level: span.top_y, grid, buckets, levels: 2 * settings.levels }))
    }

    /// Heights that beams of a side span, given the least and the greatest height of the generators there.
    fn span(&self, (low, high): (f32, f32), side: f32) -> Span {
        let bounds = self.receivers.bounds;
        let lowest = if side > 0.0 { bounds.min.y } else { -bounds.max.y };
        let floor = if bounds.is_empty() { low } else { lowest.min(low) };
        // A beam needs some height, even if nothing lies below it.
        let least = (bounds.size().max_element().max(high - low) * LEAST_BELOW).max(f32::MIN_POSITIVE);
        let bottom_y = floor - ((high - floor) * self.settings.depth_below_floor).max(least);
        Span { top_y: high, trough_y: low, bottom_y }
    }
}

/// Refuses a water mesh of more than [`MAX_BEAMS`] triangles before any beam is made.
///
/// # Errors
/// [`LightVolumesError::TooManyBeams`].
pub fn check_mesh(scene: &Scene, settings: &LightVolumes) -> Result<(), RenderError> {
    let Some(water) = &scene.water else { return Ok(()) };
    let (columns, rows) = settings.grid.unwrap_or(water.grid);
    let triangles = 2 * (u64::from(columns) - 1) * (u64::from(rows) - 1);
    if triangles > MAX_BEAMS {
        return Err(LightVolumesError::TooManyBeams { columns, rows, triangles, limit: MAX_BEAMS }.into());
    }
    Ok(())
}
