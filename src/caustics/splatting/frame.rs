//! Builds the frame: for each light its photons, their splats in the caustic map, and the map's light on the receivers.

use std::sync::Arc;

use glam::Vec3;

use nephroid_pipeline::frame::{AttachmentView, BindEntry, BindGroupId, ColorAttachment, Draw, Pass, TextureId};
use nephroid_pipeline::state::{ADDITIVE, PrimitiveState, PrimitiveTopology, TextureFormat};
use nephroid_pipeline::{Buffer, RenderPipelineDescriptor, TextureDescriptor};
use nephroid_math::vector::v3;
use nephroid_scene::geom::{Aabb, Mesh};
use nephroid_scene::water::{HeightField, Water};
use nephroid_scene::{Material, Radiometry, Scene};

use super::exact::{self, ExactPhotons, PhotonRecord};
use super::photons::{self, Fate, PhotonsUniform};
use super::settings::{CurvatureFrom, Gather, Intersection, Lens, Splats, Splatting, Views};
use super::splats::{self, Source, SplatsUniform};
use super::views::{LightViews, Stage, Wanted};
use super::{SplattingError, differential, gather, pyramid, sizes};
use crate::builder::state::{additive, clear, target};
use crate::builder::{CausticTargets, FrameBuilder, FrameLight, ViewOptions};
use crate::passes::fullscreen;
use crate::passes::light_buffer::{self, Keep, LightBuffer, SurfaceDraw, SurfaceUniform};
use crate::passes::light_view::{LightView, TexelView};
use crate::passes::water_surface::WaterVertex;
use crate::receivers::Receivers;
use crate::surfaces::Surfaces;
use crate::{RenderError, Tally, TechniqueFrame};

/// Format of everything that holds light.
const FORMAT: TextureFormat = TextureFormat::Rgba32Float;

/// How the technique views the scene.
#[must_use]
pub fn view(settings: &Splatting) -> ViewOptions {
    ViewOptions {
        eye_refraction: settings.eye_refraction,
        samples: settings.samples,
        surface_shadows: true,
        underwater_shadows: true,
        shadow_map_size: settings.shadow_map_size,
        stencil: false,
    }
}

/// What frames of one scene share.
pub struct Shared {
    /// The objects.
    pub receivers: Receivers,
    /// The objects, to be hit by rays.
    pub surfaces: Surfaces,
    /// The objects' vertices, with curvature.
    pub vertices: Arc<Buffer>,
}

/// The photons of a light, and where splats read them.
struct Photons {
    source: Source,
    entries: Vec<BindEntry>,
    count: u32,
}

/// Where splats are drawn, and the receivers that are seen there.
struct Map {
    texels: TexelView,
    position: TextureId,
    normal: TextureId,
}

/// Surfaces as light buffers draw them.
struct Surfaced {
    all: Vec<SurfaceDraw>,
    glass: Vec<SurfaceDraw>,
    diffuse: Vec<SurfaceDraw>,
}

/// Builds the frame.
///
/// # Errors
/// If a light has no view of what it should see.
pub fn build(
    scene: &Scene,
    shared: &Shared,
    field: Option<&HeightField>,
    layers: &[&str],
    settings: &Splatting,
) -> Result<TechniqueFrame, RenderError> {
    let mut builder = FrameBuilder::new(scene, &shared.receivers, field, &view(settings));
    let targets = CausticTargets::new(&mut builder, &layers.iter().copied().filter(|l| *l == "caustic_irradiance").collect::<Vec<_>>(), "");
    let surfaces = surfaces(&mut builder, shared, field);
    let wet = field.filter(|_| settings.intersection == Intersection::Exact).zip(scene.water.as_ref());
    let with_water = wet.map(|(field, water)| shared.surfaces.with(mesh_of(field), body_of(water, scene)));
    let rays = with_water.as_ref().unwrap_or(&shared.surfaces);
    let stage = Stage { receivers: &shared.receivers, surfaces: &shared.surfaces, water: scene.water.as_ref().zip(field) };
    let wanted = Wanted {
        views: settings.views,
        photons: settings.photons,
        map_size: settings.map_size,
        all_paths: settings.intersection == Intersection::Exact && settings.radiometry == Radiometry::Physical,
    };
    if settings.gather == Gather::Eye && builder.margin > 0 {
        return Err(SplattingError::EyeThroughWater.into());
    }
    let mut totals = Totals::default();
    let mut tallies = Vec::new();
    builder.lights(|builder, light| {
        let Some(views) = LightViews::new(&stage, light.number, &scene.lights[light.number], &wanted)? else {
            totals.dark += 1;
            nothing(builder, light, &targets);
            return Ok(());
        };
        let pass = LightPass { light, views: &views, settings };
        let receivers = || pass.light_buffer(builder, "receivers", &views.map, Keep::Nearest, &surfaces.diffuse);
        let receivers = (settings.gather == Gather::Light || settings.intersection == Intersection::Image).then(receivers);
        let photons = match (settings.intersection, &receivers) {
            (Intersection::Image, Some(receivers)) => pass.photons(builder, &surfaces, receivers, &mut tallies),
            _ => pass.exact_photons(builder, rays, &mut totals),
        };
        let map = match (settings.gather, &receivers) {
            (Gather::Light, Some(seen)) => Map { texels: views.map, position: seen.position, normal: seen.normal },
            _ => eye_map(builder),
        };
        totals.rays += u64::from(views.photons.size_tx.x as u32) * u64::from(views.photons.size_tx.y as u32);
        totals.fitted += u64::from(settings.views == Views::Scene && !views.whole);
        totals.parallel += u64::from(views.map.view.position_ws.w != views.photons.view.position_ws.w);
        let texture = pass.splats(builder, &photons, &map);
        pass.gather(builder, &map, texture, &targets);
        Ok(())
    })?;
    let (counters, audit) = totals.named(shared.receivers.triangles);
    Ok(TechniqueFrame { counters, audit, tallies, ..builder.finish(targets.contributions()) })
}

/// What is counted while the frame is built.
#[derive(Default)]
struct Totals {
    /// Rays of light: texels of the photons' views.
    rays: u64,
    /// Lights that reach no receiver by way of mirrors, glass or water.
    dark: u64,
    /// Lamps that do not see the whole scene from one side, although their views should hold it.
    fitted: u64,
    /// Lamps whose map has parallel rays.
    parallel: u64,
    exact: Option<ExactTotals>,
}

/// Sums over exact photons.
#[derive(Default)]
struct ExactTotals {
    /// Rays that meet a mirror, glass or water.
    rays: u64,
    /// Their light.
    arrived_w: f64,
    /// Photons in the map.
    photons: u64,
    /// Their light.
    landed_w: f64,
    /// Photons on receivers outside of the map.
    beyond: u64,
}

impl Totals {
    fn named(&self, triangles: u64) -> (Vec<(String, u64)>, Vec<(String, f64)>) {
        let mut counters = vec![
            ("receiver_triangles".to_owned(), triangles),
            ("photon_rays".to_owned(), self.rays),
            ("lights_without_caustics".to_owned(), self.dark),
            ("lights_amid_the_scene".to_owned(), self.fitted),
            ("maps_of_parallel_rays".to_owned(), self.parallel),
        ];
        let mut audit = Vec::new();
        if let Some(exact) = &self.exact {
            let count = |name: &str, count| (name.to_owned(), count);
            counters.extend([count("photon_rays_arrived", exact.rays), count(LANDED, exact.photons), count("photons_beyond_the_map", exact.beyond)]);
            audit.extend([(ARRIVED.to_owned(), exact.arrived_w), (LANDED.to_owned(), exact.landed_w)]);
        }
        (counters, audit)
    }
}

/// Entry for all light that arrives at mirrors, glass or water.
const ARRIVED: &str = "photons_arrived";

/// Entry for light that lands on receivers.
const LANDED: &str = "photons_landed";

/// Names of fates in counters and audit.
const FATES: &[(u32, &str)] = &[
    (Fate::Landed as u32, LANDED),
    (Fate::TotallyReflected as u32, "photons_totally_reflected"),
    (Fate::NoExit as u32, "photons_in_open_glass"),
    (Fate::Missed as u32, "photons_missed"),
    (Fate::NotFound as u32, "photons_not_found"),
];

/// Clears the sums of the first light if it has no caustics.
fn nothing(builder: &mut FrameBuilder<'_>, light: &FrameLight, targets: &CausticTargets) {
    if light.is_first() {
        builder.frame.passes.push(Pass { label: format!("gather {}", light.number), color: vec![clear(targets.irradiance)], ..Pass::default() });
    }
}

/// The vertices of all objects, with mean curvature in `normal_ws.w` for mirrors and glass if it is wanted.
#[must_use]
pub fn vertices(receivers: &Receivers, settings: &Splatting) -> Arc<Buffer> {
    if settings.splats != Splats::Lens || settings.curvature != CurvatureFrom::Mesh {
        return receivers.vertices.clone();
    }
    let mut mesh = receivers.mesh.clone();
    let mut vertices = crate::receivers::vertices_of(&mesh);
    for group in receivers.groups.iter().filter(|group| !matches!(group.material, Material::Diffuse { .. })) {
        let range = group.indices.start as usize..group.indices.end as usize;
        mesh.indices.clear();
        mesh.indices.extend_from_slice(&receivers.mesh.indices[range]);
        let curvatures = mesh.curvatures();
        for &index in &mesh.indices {
            vertices[index as usize].normal_ws.w = curvatures[index as usize].mean_per_m();
        }
    }
    Arc::new(Buffer::from_slice(&vertices))
}

/// The surfaces of the scene, ready to be drawn.
fn surfaces(builder: &mut FrameBuilder<'_>, shared: &Shared, field: Option<&HeightField>) -> Surfaced {
    let vertices = builder.frame.buffer("surfaces", shared.vertices.clone());
    let indices = builder.frame.buffer("surface indices", shared.receivers.indices.clone());
    let (mut all, mut glass, mut diffuse) = (Vec::new(), Vec::new(), Vec::new());
    for group in shared.receivers.groups.iter().filter(|group| !group.indices.is_empty()) {
        let draw =
            SurfaceDraw { vertices, indices: Some(indices), range: group.indices.clone(), surface: SurfaceUniform::from(&group.material) };
        match group.material {
            Material::Diffuse { .. } => diffuse.push(draw.clone()),
            Material::Dielectric { .. } => glass.push(draw.clone()),
            Material::Mirror { .. } => {}
        }
        all.push(draw);
    }
    if let Some((field, water)) = field.zip(builder.scene.water.as_ref()) {
        let curvature = mean_curvature(field);
        let vertex = |(i, (p, n)): (usize, (&Vec3, &Vec3))| WaterVertex { position_ws: p.extend(1.0), normal_ws: n.extend(curvature[i]) };
        let made: Vec<WaterVertex> = field.positions_ws().iter().zip(&field.normals_ws).enumerate().map(vertex).collect();
        let triangles = field.triangle_indices();
        let range = 0..triangles.len() as u32;
        let vertices = builder.frame.buffer("emitting water", Arc::new(Buffer::from_slice(&made)));
        let indices = builder.frame.buffer("emitting water indices", Arc::new(Buffer::from_slice(&triangles)));
        all.push(SurfaceDraw { vertices, indices: Some(indices), range, surface: SurfaceUniform::water(water.ior) });
    }
    Surfaced { all, glass, diffuse }
}

/// Mean curvature of the water at its vertices, 1/m, positive at crests: half the divergence of the normals, by differences of neighbours.
fn mean_curvature(field: &HeightField) -> Vec<f32> {
    let (columns, rows) = (field.columns, field.rows);
    let along = |a: usize, b: usize, pick: fn(Vec3) -> f32, length: f32| (pick(field.normals_ws[b]) - pick(field.normals_ws[a])) / length;
    let mut curvature = Vec::with_capacity((columns * rows) as usize);
    for row in 0..rows {
        for column in 0..columns {
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let (up, down) = (row.saturating_sub(1), (row + 1).min(rows - 1));
            let x = along(field.index(left, row), field.index(right, row), |n| n.x, field.spacing_m.x * (right - left) as f32);
            let z = along(field.index(column, up), field.index(column, down), |n| n.z, field.spacing_m.y * (down - up) as f32);
            curvature.push(0.5 * (x + z));
        }
    }
    curvature
}

/// The passes of one light.
struct LightPass<'a> {
    light: &'a FrameLight,
    views: &'a LightViews,
    settings: &'a Splatting,
}

impl LightPass<'_> {
    fn light_buffer(&self, builder: &mut FrameBuilder<'_>, of: &str, view: &TexelView, keep: Keep, draws: &[SurfaceDraw]) -> LightBuffer {
        let label = format!("light_buffer {of} {}", self.light.number);
        light_buffer::add(&mut builder.frame, &label, &view.view, size(view), keep, draws)
    }

    fn paper(&self) -> bool {
        self.settings.radiometry == Radiometry::Paper
    }

    /// Emits photons and finds where they land.
    fn photons(&self, builder: &mut FrameBuilder<'_>, surfaces: &Surfaced, receivers: &LightBuffer, tallies: &mut Vec<Tally>) -> Photons {
        let (view, settings, number) = (&self.views.photons, self.settings, self.light.number);
        let front = self.light_buffer(builder, "front", view, Keep::Nearest, &surfaces.all);
        let back = self.light_buffer(builder, "back", view, Keep::Farthest, &surfaces.glass);
        let (width, height) = size(view);
        let mut texture = |part| builder.frame.texture(TextureDescriptor::d2(format!("photon_{part} {number}"), width, height, FORMAT));
        let [position, direction, flux] = ["position", "direction", "flux"].map(&mut texture);
        let numbers = PhotonsUniform {
            box_min: self.views.reached.min.extend(settings.search_steps as f32),
            box_max: self.views.reached.max.extend(settings.exit_steps as f32),
            sigma_t: builder.scene.medium.sigma_t().extend(self.views.deepest),
        };
        let numbers = builder.uniform(&format!("photons {number}"), &numbers);
        let own_view = builder.uniform(&format!("photon view {number}"), view);
        let map_view = builder.uniform(&format!("receivers view {number}"), &self.views.map);
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
        };
        let pipeline = builder.fullscreen("photons", photons::program(options), &[FORMAT; 3], None);
        builder.frame.passes.push(Pass {
            label: format!("photons {number}"),
            color: vec![clear(position), clear(direction), clear(flux)],
            draws: vec![Draw::new(pipeline, bindings, fullscreen::VERTICES)],
            ..Pass::default()
        });
        tallies.push(Tally { fates: position, values: flux, names: FATES, arrived: ARRIVED });
        let entries = [position, direction, flux].map(BindEntry::texture).to_vec();
        Photons { source: Source::Textures, entries, count: width * height }
    }

    /// Follows photons through the triangles of the scene.
    fn exact_photons(&self, builder: &mut FrameBuilder<'_>, surfaces: &Surfaces, totals: &mut Totals) -> Photons {
        let light = &builder.scene.lights[self.light.number];
        let everywhere = Aabb { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) };
        let reached = if self.settings.gather == Gather::Eye { everywhere } else { self.views.reached };
        let ExactPhotons { mut records, beyond, arrived, arrived_w, landed_w } =
            exact::follow(surfaces, light, &self.views.photons, reached, self.paper());
        let sum = totals.exact.get_or_insert_with(ExactTotals::default);
        *sum = ExactTotals {
            rays: sum.rays + arrived,
            arrived_w: sum.arrived_w + arrived_w,
            photons: sum.photons + records.len() as u64,
            landed_w: sum.landed_w + landed_w,
            beyond: sum.beyond + beyond,
        };
        let count = records.len() as u32;
        if records.is_empty() {
            // A storage binding has at least one element.
            records.push(PhotonRecord::default());
        }
        let buffer = builder.frame.buffer(format!("photons {}", self.light.number), Arc::new(Buffer::from_slice(&records)));
        Photons { source: Source::Records, entries: vec![BindEntry::Storage(buffer)], count }
    }

    /// Draws the photons into the caustic map.
    fn splats(&self, builder: &mut FrameBuilder<'_>, photons: &Photons, map: &Map) -> TextureId {
        let (settings, source) = (self.settings, photons.source);
        // Distance between photons where the light is neither gathered nor spread, in the middle of what it reaches.
        let middle = self.views.reached.center();
        let area = |view: &TexelView| view.area_at(v3(middle.x, middle.y, middle.z));
        let distance = (area(&self.views.photons) / area(&map.texels)).sqrt();
        let by_beam = settings.splats != Splats::Fixed;
        let diameter = if by_beam { settings.splat_size } else { settings.splat_size * distance };
        let shape = glam::Vec4::new(diameter, self.views.photons.size_tx.x, distance, 0.0);
        let numbers = builder.uniform(&format!("splats {}", self.light.number), &SplatsUniform { shape });
        let map_view = builder.uniform(&format!("map view {}", self.light.number), &map.texels);
        let mut entries = vec![BindEntry::Uniform(map_view, 0), BindEntry::Uniform(numbers, 0)];
        entries.extend([map.position, map.normal].map(BindEntry::texture));
        entries.extend_from_slice(&photons.entries);
        let bindings = builder.frame.bind_group(entries);
        let colours = self.has_colours(builder);
        let (program, parts): (_, &[&str]) = match settings.splats {
            Splats::Fixed | Splats::Lens => (splats::round(source, by_beam, self.paper()), &["caustic_map"]),
            Splats::Pyramid => return self.pyramid(builder, photons, map, bindings),
            Splats::Differential => (differential::program(source), &["caustic_map"]),
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
            draws: vec![Draw::new(pipeline, bindings, 0..photons.count)],
            ..Pass::default()
        });
        if settings.splats == Splats::Sizes { self.resolve(builder, map, colours, &textures) } else { textures[0] }
    }

    /// Draws the photons into every level of a pyramid, and picks one level for each texel.
    fn pyramid(&self, builder: &mut FrameBuilder<'_>, photons: &Photons, map: &Map, bindings: BindGroupId) -> TextureId {
        let (number, (width, height)) = (self.light.number, size(&map.texels));
        let levels = width.max(height).ilog2() + 1;
        let desc = TextureDescriptor::d2(format!("map_pyramid {number}"), width, height, FORMAT);
        let pyramid = builder.frame.texture(TextureDescriptor { mip_level_count: levels, ..desc });
        let pipeline = builder.frame.pipeline(RenderPipelineDescriptor {
            primitive: PrimitiveState { topology: PrimitiveTopology::PointList, ..PrimitiveState::default() },
            targets: vec![target(FORMAT, Some(ADDITIVE))],
            ..RenderPipelineDescriptor::new("splats", pyramid::program(photons.source))
        });
        for level in 0..levels {
            let color = clear(pyramid).map(|cleared| ColorAttachment { view: AttachmentView { texture: pyramid, level, layer: 0 }, ..cleared });
            builder.frame.passes.push(Pass {
                label: format!("splats {number} level {level}"),
                color: vec![color],
                draws: vec![Draw::new(pipeline, bindings, 0..photons.count)],
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
    fn gather(&self, builder: &mut FrameBuilder<'_>, map: &Map, texture: TextureId, targets: &CausticTargets) {
        let map_view = builder.uniform(&format!("gather view {}", self.light.number), &map.texels);
        let textures = [builder.position, builder.normal, map.position, map.normal, texture].map(BindEntry::texture);
        let bindings = builder.frame.bind_group(std::iter::once(BindEntry::Uniform(map_view, 0)).chain(textures).collect());
        let (states, attachments) = additive(&[Some(targets.irradiance_sum(self.light))]);
        let pipeline =
            builder.frame.pipeline(RenderPipelineDescriptor { targets: states, ..RenderPipelineDescriptor::new("gather", gather::program()) });
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
fn eye_map(builder: &FrameBuilder<'_>) -> Map {
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

/// The water's surface as a mesh, and as the boundary of a body.
fn mesh_of(field: &HeightField) -> Mesh {
    Mesh { positions: field.positions_ws(), normals: field.normals_ws.clone(), indices: field.triangle_indices(), ..Mesh::default() }
}

fn body_of(water: &Water, scene: &Scene) -> Material {
    Material::Dielectric { ior: water.ior, abbe: None, absorption: scene.medium.sigma_t() }
}

fn size(view: &TexelView) -> (u32, u32) {
    (view.size_tx.x as u32, view.size_tx.y as u32)
}
