//! The passes of one light: its photons, their splats in the map, and the map's light on the receivers.

use std::sync::Arc;

use glam::{Vec3, Vec4};

use nephroid_math::vector::v3;
use nephroid_pipeline::frame::{AttachmentView, BindEntry, BindGroupId, ColorAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::state::{ADDITIVE, PrimitiveState, PrimitiveTopology, TextureFormat};
use nephroid_pipeline::{Buffer, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_scene::geom::Aabb;
use nephroid_scene::{Material, Radiometry};

use super::differential::{self, Steps};
use super::drawn::Surfaced;
use super::exact::{self, ExactPhotons, PhotonRecord};
use super::gather::{self, Lit};
use super::photons::{self, PhotonsUniform};
use super::settings::{CurvatureFrom, Gather, Lens, Splats, Splatting};
use super::splats::{self, Source, SplatsUniform};
use super::totals::{ENDS, ExactTotals, LOST_AT_OBJECTS, LOST_IN_WATER, Totals};
use super::views::{LightViews, PhotonView};
use super::{pyramid, sizes};
use crate::builder::state::{additive, clear, target};
use crate::builder::{CausticTargets, FrameBuilder, FrameLight};
use crate::passes::fullscreen;
use crate::passes::light_buffer::{self, Keep, Kept, LightBuffer, SurfaceDraw};
use crate::passes::light_view::{LightView, TexelView};
use crate::surfaces::Surfaces;
use crate::{PhotonTally, Tally};

/// Format of everything that holds light.
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// The photons of a light at a moment, and where splats read them.
pub(super) struct Photons {
    source: Source,
    view: TexelView,
    entries: Vec<BindEntry>,
    /// Columns of photons in textures.
    columns: f32,
    count: u32,
}

/// Where splats are drawn, and the receivers that are seen there.
pub(super) struct Map {
    /// The view.
    pub texels: TexelView,
    /// Position of the receiver in each texel.
    pub position: TextureId,
    /// Its normal.
    pub normal: TextureId,
}

/// The passes of one light.
pub(super) struct LightPass<'a> {
    /// The light.
    pub light: &'a FrameLight,
    /// Its views at the frame's own moment.
    pub own: &'a LightViews,
    /// The settings.
    pub settings: &'a Splatting,
    /// Number of moments whose photons are in the map.
    pub moments: usize,
}

impl LightPass<'_> {
    /// Adds a light buffer.
    pub fn light_buffer(
        &self,
        builder: &mut FrameBuilder<'_>,
        of: &str,
        view: &TexelView,
        kept: impl Into<Kept>,
        draws: &[SurfaceDraw],
    ) -> LightBuffer {
        let label = format!("light_buffer {of} {}", self.light.number);
        light_buffer::add(&mut builder.frame, &label, &view.view, size(view), kept, draws)
    }

    /// The light's number; the age of a moment in frames if that is not the frame's own; the number of the view if it is not the first.
    pub fn label(&self, age: usize, view: usize) -> String {
        let number = self.light.number;
        let age = if age == 0 { String::new() } else { format!(" before {age}") };
        if view == 0 { format!("{number}{age}") } else { format!("{number}{age} view {view}") }
    }

    fn paper(&self) -> bool {
        self.settings.radiometry == Radiometry::Paper
    }

    /// Emits the photons of a view and finds where they land.
    pub fn photons(
        &self,
        builder: &mut FrameBuilder<'_>,
        label: &str,
        &PhotonView { texels: ref view, deepest }: &PhotonView,
        surfaces: &Surfaced,
        receivers: &LightBuffer,
        tallies: &mut Vec<Tally>,
    ) -> Photons {
        let settings = self.settings;
        let buffer = |builder: &mut FrameBuilder<'_>, of: &str, keep, draws: &[SurfaceDraw]| {
            light_buffer::add(&mut builder.frame, &format!("light_buffer {of} {label}"), &view.view, size(view), keep, draws)
        };
        let front = buffer(builder, "front", Keep::Nearest, &surfaces.all);
        let back = buffer(builder, "back", Keep::NearestBack, &surfaces.glass);
        let (width, height) = size(view);
        let mut texture = |part| builder.frame.texture(TextureDescriptor::d2(format!("photon_{part} {label}"), width, height, FORMAT));
        let [position, direction, flux, losses] = ["position", "direction", "flux", "losses"].map(&mut texture);
        let both = self.settings.has_both_curvatures();
        let steps: Vec<TextureId> = if both { ["step_x", "step_y"].map(&mut texture).to_vec() } else { Vec::new() };
        let numbers = PhotonsUniform {
            box_min: self.own.reached.min.extend(settings.search_steps as f32),
            box_max: self.own.reached.max.extend(settings.exit_steps as f32),
            sigma_t: if self.light.in_water { Vec3::ZERO } else { builder.scene.medium.sigma_t() }.extend(deepest),
        };
        let numbers = builder.uniform(&format!("photons {label}"), &numbers);
        let own_view = builder.uniform(&format!("photon view {label}"), view);
        let map_view = builder.uniform(&format!("receivers view {label}"), &self.own.map);
        let textures = [
            front.position,
            front.normal,
            front.material,
            front.curvature,
            back.position,
            back.normal,
            back.curvature,
            receivers.position,
            receivers.normal,
        ];
        let uniforms = [own_view, map_view, self.light.buffer, numbers].map(|buffer| BindEntry::Uniform(buffer, 0));
        let bindings = builder.frame.bind_group(uniforms.into_iter().chain(textures.map(BindEntry::texture)).collect());
        let options = photons::Options {
            search: settings.search,
            lossless: self.paper(),
            smooth_exits: settings.smooth_exits,
            thick: settings.lens == Lens::Thick,
            curvature_of_normals: settings.splats == Splats::Lens && settings.curvature == CurvatureFrom::Normals,
            water: builder.scene.water.is_some(),
            differentials: both,
        };
        let read: Vec<TextureId> = [position, direction, flux].into_iter().chain(steps).collect();
        // What splats do not read comes last.
        let targets: Vec<TextureId> = read.iter().copied().chain([losses]).collect();
        let pipeline = builder.fullscreen("photons", photons::program(options), &vec![FORMAT; targets.len()], None);
        builder.frame.passes.push(Pass {
            label: format!("photons {label}"),
            color: targets.iter().map(|&target| clear(target)).collect(),
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        let lost_to = if builder.scene.water.is_some() { LOST_IN_WATER } else { LOST_AT_OBJECTS };
        tallies.push(Tally::Photons(PhotonTally { fates: position, values: flux, losses, ends: ENDS, lost_to }));
        let entries = read.into_iter().map(BindEntry::texture).collect();
        Photons { source: Source::Textures, view: *view, entries, columns: view.size_tx.x, count: width * height }
    }

    /// Follows the photons of a view through the triangles of the scene.
    pub fn exact_photons(
        &self,
        builder: &mut FrameBuilder<'_>,
        label: &str,
        view: &TexelView,
        surfaces: &Surfaces,
        totals: &mut Totals,
    ) -> Photons {
        let light = &builder.scene.lights[self.light.number];
        let everywhere = Aabb { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) };
        let reached = if self.settings.gather == Gather::Eye { everywhere } else { self.own.reached };
        let ExactPhotons { mut records, beyond, arrived, audit } =
            exact::follow(surfaces, &exact::Source { light, uniform: Some(&self.light.uniform) }, view, reached, self.paper());
        let sum = totals.exact.get_or_insert_with(ExactTotals::default);
        sum.rays += arrived;
        sum.photons += records.len() as u64;
        sum.beyond += beyond;
        sum.audit.merge(&audit);
        let count = records.len() as u32;
        if records.is_empty() {
            // A storage binding has at least one element.
            records.push(PhotonRecord::default());
        }
        let buffer = builder.frame.buffer(format!("photons {label}"), Arc::new(Buffer::from_slice(&records)));
        Photons { source: Source::Records, view: *view, entries: vec![BindEntry::Storage(buffer)], columns: 1.0, count }
    }

    /// Draws the photons of all moments into the caustic map.
    pub fn splats(&self, builder: &mut FrameBuilder<'_>, photons: &[Photons], map: &Map) -> TextureId {
        let (settings, source) = (self.settings, photons[0].source);
        let bound: Vec<(BindGroupId, u32)> =
            photons.iter().map(|photons| (self.splat_bindings(builder, photons, map), photons.count)).collect();
        let by_beam = settings.splats != Splats::Fixed;
        let colours = self.has_colours(builder);
        let (by_rays, by_neighbours) = match source {
            Source::Textures => (Steps::Rays, Steps::Neighbours),
            Source::Records => (Steps::Records, Steps::Records),
        };
        let (program, parts): (_, &[&str]) = match settings.splats {
            Splats::Lens if settings.has_both_curvatures() => (differential::program(by_rays), &["caustic_map"]),
            Splats::Fixed | Splats::Lens => (splats::round(source, by_beam, self.paper()), &["caustic_map"]),
            Splats::Pyramid => return self.pyramid(builder, source, map, &bound),
            Splats::Differential => (differential::program(by_neighbours), &["caustic_map"]),
            Splats::Sizes if colours => (sizes::program(source, true, self.paper()), &["map_red", "map_green", "map_blue", "map_count"]),
            Splats::Sizes => (sizes::program(source, false, self.paper()), &["map_flux", "map_count"]),
        };
        let textures: Vec<TextureId> = parts.iter().map(|part| self.map_texture(builder, map, part)).collect();
        let pipeline = builder.frame.pipeline(RenderPipelineDescriptor {
            primitive: PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() },
            targets: textures.iter().map(|_| target(FORMAT, Some(ADDITIVE))).collect(),
            ..RenderPipelineDescriptor::new("splats", program)
        });
        builder.frame.passes.push(Pass {
            label: format!("splats {}", self.light.number),
            color: textures.iter().map(|texture| clear(*texture)).collect(),
            draws: bound.iter().map(|&(bindings, count)| Draw::new(pipeline, bindings, 0..count)).collect(),
            ..Pass::default()
        });
        if settings.splats == Splats::Sizes { self.resolve(builder, map, colours, &textures) } else { textures[0] }
    }

    /// What a splat program reads: the map's view, numbers, the map's receivers, photons.
    fn splat_bindings(&self, builder: &mut FrameBuilder<'_>, photons: &Photons, map: &Map) -> BindGroupId {
        // Distance between photons where the light is neither gathered nor spread, in the middle of what it reaches.
        let middle = self.own.reached.center();
        let area = |view: &TexelView| view.area_at(v3(middle.x, middle.y, middle.z));
        let distance = (area(&photons.view) / area(&map.texels)).sqrt();
        let size = self.settings.splat_size;
        let diameter = if self.settings.splats == Splats::Fixed { size * distance } else { size };
        let shape = Vec4::new(diameter, photons.columns, distance, 1.0 / self.moments as f32);
        let numbers = builder.uniform(&format!("splats {}", self.light.number), &SplatsUniform { shape });
        let map_view = builder.uniform(&format!("map view {}", self.light.number), &map.texels);
        let mut entries = vec![BindEntry::Uniform(map_view, 0), BindEntry::Uniform(numbers, 0)];
        entries.extend([map.position, map.normal].map(BindEntry::texture));
        entries.extend_from_slice(&photons.entries);
        builder.frame.bind_group(entries)
    }

    /// Draws the photons into every level of a pyramid, and picks one level for each texel.
    fn pyramid(&self, builder: &mut FrameBuilder<'_>, source: Source, map: &Map, bound: &[(BindGroupId, u32)]) -> TextureId {
        let (number, (width, height)) = (self.light.number, size(&map.texels));
        let levels = width.max(height).ilog2() + 1;
        let desc = TextureDescriptor::d2(format!("map_pyramid {number}"), width, height, FORMAT);
        let pyramid = builder.frame.texture(TextureDescriptor { mip_level_count: levels, ..desc });
        let pipeline = builder.frame.pipeline(RenderPipelineDescriptor {
            primitive: PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() },
            targets: vec![target(FORMAT, Some(ADDITIVE))],
            ..RenderPipelineDescriptor::new("splats", pyramid::program(source))
        });
        for level in 0..levels {
            let color =
                clear(pyramid).map(|cleared| ColorAttachment { view: AttachmentView { texture: pyramid, level, layer: 0 }, ..cleared });
            builder.frame.passes.push(Pass {
                label: format!("splats {number} level {level}"),
                color: vec![color],
                draws: bound.iter().map(|&(bindings, count)| Draw::new(pipeline, bindings, 0..count)).collect(),
                ..Pass::default()
            });
        }
        let picked = self.map_texture(builder, map, "caustic_map");
        let bindings = builder.frame.bind_group(vec![BindEntry::texture(pyramid)]);
        let pipeline = builder.fullscreen("pick_level", pyramid::pick(), &[FORMAT], None);
        builder.frame.passes.push(Pass {
            label: format!("resolve {number}"),
            color: vec![clear(picked)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        picked
    }

    /// Picks one of four sizes for each texel.
    fn resolve(&self, builder: &mut FrameBuilder<'_>, map: &Map, colours: bool, textures: &[TextureId]) -> TextureId {
        let picked = self.map_texture(builder, map, "caustic_map");
        let light = self.light.uniform.intensity.truncate();
        let colour = (light / light.element_sum().max(f32::MIN_POSITIVE)).extend(0.0);
        let colour = builder.uniform(&format!("grey light {}", self.light.number), &colour);
        // The first texture, the counts, and then the other colours.
        let order: &[usize] = if colours { &[0, 3, 1, 2] } else { &[0, 1] };
        let entries = std::iter::once(BindEntry::Uniform(colour, 0)).chain(order.iter().map(|&k| BindEntry::texture(textures[k])));
        let bindings = builder.frame.bind_group(entries.collect());
        let pipeline = builder.fullscreen("resolve", sizes::resolve(colours, self.settings.blend), &[FORMAT], None);
        builder.frame.passes.push(Pass {
            label: format!("resolve {}", self.light.number),
            color: vec![clear(picked)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        picked
    }

    /// Whether photons can have several colours: by mirrors, glass or water that are not grey.
    fn has_colours(&self, builder: &FrameBuilder<'_>) -> bool {
        let grey = |c: Vec3| c.x == c.y && c.y == c.z;
        let coloured = |material: &Material| match material {
            Material::Mirror { reflectance } => !grey(*reflectance),
            Material::Dielectric { absorption, .. } => !grey(*absorption),
            Material::Diffuse { .. } => false,
        };
        let water = builder.scene.water.is_some() && !grey(builder.scene.medium.sigma_t());
        self.settings.size_colours && (water || builder.receivers.groups.iter().any(|group| coloured(&group.material)))
    }

    /// Adds the map's light to the pixels.
    pub fn gather(&self, builder: &mut FrameBuilder<'_>, map: &Map, texture: TextureId, targets: &CausticTargets) {
        let map_view = builder.uniform(&format!("gather view {}", self.light.number), &map.texels);
        let textures = [builder.position, builder.normal, map.position, map.normal, texture, builder.albedo].map(BindEntry::texture);
        let bindings = builder.frame.bind_group(std::iter::once(BindEntry::Uniform(map_view, 0)).chain(textures).collect());
        let (states, attachments) = additive(&[Some(targets.irradiance_sum(self.light))]);
        let lit = match builder.water {
            None => Lit::All,
            Some(_) if self.light.in_water => Lit::Dry,
            Some(_) => Lit::UnderWater,
        };
        let pipeline = builder
            .frame
            .pipeline(RenderPipelineDescriptor { targets: states, ..RenderPipelineDescriptor::new("gather", gather::program(lit)) });
        builder.frame.passes.push(Pass {
            label: format!("gather {}", self.light.number),
            color: attachments,
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
    }

    fn map_texture(&self, builder: &mut FrameBuilder<'_>, map: &Map, part: &str) -> TextureId {
        let (width, height) = size(&map.texels);
        builder.frame.texture(TextureDescriptor::d2(format!("{part} {}", self.light.number), width, height, FORMAT))
    }
}

/// The picture as a map: what the eye sees, texel by texel.
pub(super) fn eye_map(builder: &FrameBuilder<'_>) -> Map {
    let camera = &builder.camera;
    let axis = builder.scene.camera.forward_ws();
    let at = |x: f32| camera.world_from_clip.project_point3(Vec3::new(x, 0.0, 0.5));
    let (middle, beside) = (at(0.0), at(2.0 * camera.size_px.z));
    // For a perspective camera, on the plane at distance 1.
    let distance = if camera.eye_ws.w == 0.0 { 1.0 } else { (middle - camera.eye_ws.truncate()).dot(axis) };
    let side = middle.distance(beside) / distance;
    let texels = TexelView {
        view: LightView { clip_from_world: camera.clip_from_world, position_ws: camera.eye_ws },
        axis_ws: axis.extend(side * side),
        size_tx: camera.size_px,
    };
    Map { texels, position: builder.position, normal: builder.normal }
}

fn size(view: &TexelView) -> (u32, u32) {
    (view.size_tx.x as u32, view.size_tx.y as u32)
}
