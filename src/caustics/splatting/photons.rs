//! The photons of a light: one for each texel of a view from which mirrors, glass or water are seen [WD06 §3, Fig. 2].
//!
//! A mirror reflects its photon, the water's surface refracts it, and glass refracts it twice [Wyman 2005]: into the body at the front face, and out at
//! the back face, as far behind the front face as the light's own ray would meet it; or where the refracted ray passes behind the back faces, found by
//! halving. Where no back face is seen, light leaves through the side, across the light's ray. From there a photon flies to the first receiver.
//!
//! Targets, as large as the view; a photon that is not emitted has zeros:
//!
//! | Target | Format | x, y, z | w |
//! |---|---|---|---|
//! | `position` | Rgba32Float | where it lands, world space, m | [`Fate`] |
//! | `direction` | Rgba32Float | unit vector along which it arrives | diameter of its beam there, m, by the lens that it has passed |
//! | `flux` | Rgba32Float | what it carries at its end, W, linear RGB | what was sent to the first surface, W, summed over RGB |
//! | `step_x`, `step_y` | Rgba32Float | with [`Options::differentials`]: how far the light moves with one texel of the view along x and along y, at the photon and in no special plane, m | 1 if that is known, else 0 |
//! | `losses` | Rgba32Float | W, summed over RGB: what surfaces reflect; what water absorbs before its surface, or mirrors absorb; what water absorbs behind its surface, or glass | 0 |

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use nephroid_math::float::exp;
use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::optics::{beer_lambert_rgb, fresnel_reflectance_by, reflect, refract_by};
use nephroid_math::vector::{V2, V3, V4, v3, v4};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{FragmentInput, FragmentOutput, FragmentShader, Program};
use nephroid_pipeline::{BindingKind, Bindings, TextureView};

use super::lens::{Faces, beam_diameter};
use super::ray_differential::Differential;
use super::receiver_search::Receivers;
use super::settings::Search;
use crate::passes::fullscreen::FullscreenVertex;
use crate::passes::geometry_buffer::MaterialKind;
use crate::passes::light_view::TexelView;
use crate::passes::shadow_map::LightUniform;
use crate::passes::shape_operator::{turn, view_axes};

/// What has become of a photon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Not emitted: the light meets no mirror, no glass and no water there.
    None = 0,
    /// It lies on a receiver.
    Landed = 1,
    /// It was totally reflected, and is not followed further.
    TotallyReflected = 2,
    /// It met glass that has no back face behind its front face.
    NoExit = 3,
    /// It meets no receiver inside of the map.
    Missed = 4,
    /// The search for the receiver has failed.
    NotFound = 5,
}

/// Corrections of the place where light leaves glass by the tangent plane of the back face there.
const CORRECTIONS: u32 = 2;

/// Largest correction, in texels: more is an edge of the body.
const CORRECTION_TX: f32 = 4.0;

/// Step of the light, in widths of the photon's texel, beyond which it says nothing.
const MOST_STRETCH: f32 = 1.0e4;

/// Numbers of the pass.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PhotonsUniform {
    /// Corner of the box in which photons land, m. w: most steps of the search for receivers.
    pub box_min: Vec4,
    /// The corner opposite. w: halvings of the path inside glass.
    pub box_max: Vec4,
    /// Extinction coefficient behind the water's surface, 1/m. w: component along the view's axis of the deepest glass, m.
    pub sigma_t: Vec4,
}

/// What is fixed for a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// How receivers are searched.
    pub search: Search,
    /// Whether the light's losses at surfaces and inside of bodies are left out, as in the paper.
    pub lossless: bool,
    /// Whether back faces are interpolated between texels.
    pub smooth_exits: bool,
    /// Whether the lens has a thickness.
    pub thick: bool,
    /// Whether curvature comes from the normals of neighbouring texels.
    pub curvature_of_normals: bool,
    /// Whether the scene has water, which alone emits photons then.
    pub water: bool,
    /// Whether ray differentials are followed, by the shape operators of the faces.
    pub differentials: bool,
}

/// Bindings: photons' view, map's view, light, numbers; front position, normal, material, curvature; back position, normal, curvature; receivers'
/// position, normal.
pub const BINDINGS: [BindingKind; 13] = [
    BindingKind::Uniform(size_of::<TexelView>()),
    BindingKind::Uniform(size_of::<TexelView>()),
    BindingKind::Uniform(size_of::<LightUniform>()),
    BindingKind::Uniform(size_of::<PhotonsUniform>()),
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
    BindingKind::Texture,
];

/// The WGSL sources that both programs share, and their own.
macro_rules! sources {
    ($($own:literal),+) => {
        concat!(
            include_str!("../../math/optics.wgsl"),
            include_str!("../passes/fullscreen.wgsl"),
            include_str!("../passes/shadow_map.wgsl"),
            include_str!("../passes/light_view.wgsl"),
            include_str!("../passes/texel_or_zero.wgsl"),
            include_str!("receiver_search.wgsl"),
            include_str!("lens.wgsl"),
            include_str!("photons.wgsl"),
            $(include_str!($own)),+
        )
    };
}

/// The program.
#[must_use]
pub fn program(options: Options) -> Arc<Program> {
    let flag = |name, value: bool| (name, f64::from(u8::from(value)));
    let (name, wgsl) = if options.differentials {
        ("photons_with_differentials", sources!("../passes/shape_operator.wgsl", "ray_differential.wgsl", "photons_bent.wgsl"))
    } else {
        ("photons", sources!("photons_plain.wgsl"))
    };
    Arc::new(Program {
        bindings: BINDINGS.to_vec(),
        wgsl: Some(wgsl),
        wgsl_constants: vec![
            ("search", f64::from(options.search as u8)),
            flag("lossless", options.lossless),
            flag("smooth_exits", options.smooth_exits),
            flag("thick", options.thick),
            flag("curvature_of_normals", options.curvature_of_normals),
            flag("water", options.water),
        ],
        ..Program::new(name, FullscreenVertex, Fragment { options })
    })
}

struct Fragment {
    options: Options,
}

/// A photon on its way to the receivers.
struct Flight<L> {
    origin: V3<L>,
    ray: V3<L>,
    /// Share of the light that is left.
    share: V3<L>,
    /// The surfaces that it has passed, as a lens.
    faces: Faces<L>,
}

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, bindings: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let view: &TexelView = bindings.uniform(0);
        let light: &LightUniform = bindings.uniform(2);
        let numbers: &PhotonsUniform = bindings.uniform(3);
        let (position, normal) = (bindings.texture(4), bindings.texture(5));
        let kind = input.texel_here(normal, 3);
        let (zero, one) = (kind.like(0.0), kind.like(1.0));
        let white = v3(one, one, one);
        let is = [MaterialKind::Mirror, MaterialKind::Dielectric, MaterialKind::Water];
        let [mirror, glass, surface] = [0, 1, 2].map(|k: usize| is[k] as u8 as f32 + 1.0);
        let (mirror, glass, surface) = (kind.equals(kind.like(mirror)), kind.equals(kind.like(glass)), kind.equals(kind.like(surface)));
        let emits = if self.options.water { surface } else { mirror | glass };
        output.color[0] = v4(zero, zero, zero, zero);
        output.color[1] = output.color[0];
        output.color[2] = output.color[0];
        output.color[3] = output.color[0];
        if self.options.differentials {
            output.color[4] = output.color[0];
            output.color[5] = output.color[0];
        }
        if !emits.any() {
            return;
        }

        let p: V3<L> = input.texel3_here(position);
        let n = input.texel3_here(normal);
        let front = bindings.texture(6);
        let colour = input.texel3_here(front);
        // n₂/n₁ at the front face; 1 for mirrors, so that all lanes compute with numbers.
        let index = L::select(mirror, one, input.texel_here(front, 3));
        let incident = light.at(p);
        let d = incident.direction;
        let width = view.area_at(p);
        let sent = incident.irradiance * width;
        let mut arriving = sent;
        let mut before_surface = zero;
        if light.water.x < 0.0 && !self.options.lossless {
            let kept = light.kept(p);
            arriving = sent.hadamard(kept);
            before_surface = sum(sent.hadamard(white - kept));
        }
        let curvature = if self.options.curvature_of_normals {
            curvature_of_normals(position, normal, input.position.x.floor(), input.position.y.floor())
        } else {
            input.texel_here(bindings.texture(7), 0)
        };

        let cos = -n.dot(d);
        let (inside, enters) = refract_by(d, n, one / index);
        let enters = enters | mirror;
        let reflected_in = fresnel_reflectance_by(cos, one / index);
        let passes = one - reflected_in;
        let entered = v3(passes, passes, passes);
        let mut flight = Flight {
            origin: p,
            ray: V3::select(mirror, reflect(d, n), inside),
            share: V3::select(mirror, colour, entered),
            faces: Faces { index, front: curvature, back: zero, thickness: zero },
        };
        let all = zero.equals(zero);
        let (mut exits, mut closed) = (all, all);
        let (mut in_glass, mut reflected_out) = (white, zero);
        let axes = view_axes(&view.view.clip_from_world);
        let divergence =
            if light.position_ws.w == 0.0 { zero } else { one / (p - V3::splat(input.token, light.position_ws.truncate())).length() };
        let mut bends = [Differential { position: v3(zero, zero, zero), direction: v3(zero, zero, zero) }; 2];
        if self.options.differentials {
            let forms = forms_of(load(bindings.texture(7), input.position.x.floor(), input.position.y.floor(), 0, 0));
            for (bend, step) in bends.iter_mut().zip(view.steps_at(p)) {
                let across = step - d * step.dot(d);
                let arriving = Differential { position: step, direction: across * divergence }.onto(d, n);
                let turned = turn(axes, forms, n, arriving.position);
                let (back, through) = (arriving.reflected(d, n, turned), arriving.refracted(d, n, turned, one / index));
                bend.position = arriving.position;
                bend.direction = V3::select(mirror, back.direction, through.direction);
            }
        }
        if !self.options.water && glass.any() {
            let exit = self.exit(bindings, (input.position.x.floor(), input.position.y.floor()), p, d, inside);
            let (out, passes_out) = refract_by(inside, exit.normal, index);
            reflected_out = fresnel_reflectance_by(-inside.dot(exit.normal), index);
            let leaves = one - reflected_out;
            let kept = absorbed(colour, exit.thickness);
            in_glass = kept;
            exits = !glass | passes_out;
            closed = !glass | exit.exists;
            if self.options.differentials {
                let path = if self.options.thick { exit.thickness } else { zero };
                for bend in &mut bends {
                    let within = bend.transferred(path).onto(inside, exit.normal);
                    let turned = turn(axes, exit.forms, exit.normal, within.position);
                    let left = within.refracted(inside, exit.normal, turned, index);
                    bend.position = V3::select(glass, left.position, bend.position);
                    bend.direction = V3::select(glass, left.direction, bend.direction);
                }
            }
            flight = Flight {
                origin: V3::select(glass, exit.position, flight.origin),
                ray: V3::select(glass & passes_out, out, flight.ray),
                share: V3::select(glass, kept * (passes * leaves), flight.share),
                faces: Faces {
                    back: L::select(glass, exit.curvature, zero),
                    thickness: L::select(glass, exit.thickness, zero),
                    ..flight.faces
                },
            };
        }

        let receivers = Receivers {
            texels: bindings.uniform(1),
            position: bindings.texture(11),
            normal: bindings.texture(12),
            box_ws: [numbers.box_min, numbers.box_max],
        };
        let landing = receivers.find(self.options.search, numbers.box_min.w as u32, flight.origin, flight.ray);
        // A ray that ends nowhere has no length: its light is counted as it left the surface.
        let length_m = L::select(landing.landed, Lanes::max(landing.distance, zero), zero);
        let kept = if self.options.water { beer_lambert_rgb(numbers.sigma_t.truncate(), length_m) } else { white };
        let share = if self.options.lossless {
            V3::select(mirror, colour, white)
        } else if self.options.water {
            flight.share.hadamard(kept)
        } else {
            flight.share
        };
        let beam = beam_diameter(&flight.faces, mirror, divergence, landing.distance, self.options.thick);
        let beam = beam * width.sqrt();

        let fate = |fate: Fate| fate as u8 as f32;
        let mut ends = L::select(landing.missed, zero.like(fate(Fate::Missed)), zero.like(fate(Fate::NotFound)));
        ends = L::select(landing.landed, zero.like(fate(Fate::Landed)), ends);
        ends = L::select(enters & exits, ends, zero.like(fate(Fate::TotallyReflected)));
        ends = L::select(closed, ends, zero.like(fate(Fate::NoExit)));
        let emitted = emits & sum(arriving).gt(zero);
        let lands = emitted & ends.equals(zero.like(fate(Fate::Landed)));
        let nothing = v3(zero, zero, zero);
        let at = V3::select(lands, landing.position, nothing);
        let ray = V3::select(lands, flight.ray, nothing);
        // Light that ends before it has passed all surfaces keeps what it has there.
        let followed = enters & exits & closed;
        let entered = arriving * passes;
        let mut flux = V3::select(followed, arriving.hadamard(share), arriving);
        let mut losses = [zero; 3];
        if self.options.lossless {
            losses[1] = L::select(mirror, sum(arriving.hadamard(white - colour)), zero);
        } else {
            let within = glass & enters & closed;
            let at_back = entered.hadamard(in_glass);
            flux = V3::select(glass & enters & !closed, entered, V3::select(within & !exits, at_back, flux));
            let front = L::select(enters & !mirror, sum(arriving) * reflected_in, zero);
            losses[0] = front + L::select(within & exits, sum(at_back) * reflected_out, zero);
            losses[1] = before_surface + L::select(mirror, sum(arriving.hadamard(white - colour)), zero);
            let behind = L::select(followed, sum(arriving.hadamard(flight.share).hadamard(white - kept)), zero);
            losses[2] = L::select(within, sum(entered.hadamard(white - in_glass)), behind);
        }
        let flux = V3::select(emitted, flux, nothing);
        output.color[0] = v4(at.x, at.y, at.z, L::select(emitted, ends, zero));
        output.color[1] = v4(ray.x, ray.y, ray.z, L::select(lands, beam, zero));
        output.color[2] = v4(flux.x, flux.y, flux.z, L::select(emitted, sum(sent), zero));
        let lost = V3::select(emitted, v3(losses[0], losses[1], losses[2]), nothing);
        output.color[if self.options.differentials { 5 } else { 3 }] = v4(lost.x, lost.y, lost.z, zero);
        if self.options.differentials {
            for (k, bend) in bends.iter().enumerate() {
                let step = bend.transferred(landing.distance).position;
                // Beyond all sense next to total reflection, and where the light sees a face edge-on.
                let known = lands & step.dot(step).lt(width * (MOST_STRETCH * MOST_STRETCH));
                let step = V3::select(known, step, nothing);
                output.color[3 + k] = v4(step.x, step.y, step.z, L::select(known, one, zero));
            }
        }
    }
}

/// Sum over linear RGB.
#[inline(always)]
fn sum<L: Lanes>(v: V3<L>) -> L {
    v.x + v.y + v.z
}

/// Forms of a shape operator in a texel of a light buffer.
#[inline(always)]
fn forms_of<L: Lanes>(texel: V4<L>) -> V3<L> {
    v3(texel.y, texel.z, texel.w)
}

/// Where light leaves a body of glass.
struct Exit<L: Lanes> {
    position: V3<L>,
    /// Against the light inside.
    normal: V3<L>,
    /// Length of the path inside, m.
    thickness: L,
    curvature: L,
    /// The forms of its shape operator.
    forms: V3<L>,
    /// Whether there is a back face behind the front face at all.
    exists: L::Mask,
}

/// A back face.
struct Back<L: Lanes> {
    position: V3<L>,
    normal: V3<L>,
    exists: L::Mask,
}

impl Fragment {
    /// Where the ray `inside` from the front face at `p`, in the texel `(x, y)`, leaves the body. `d`: unit vector of the light.
    #[inline(always)]
    fn exit<L: Lanes>(&self, bindings: &Bindings<'_>, (x, y): (L, L), p: V3<L>, d: V3<L>, inside: V3<L>) -> Exit<L> {
        let view: &TexelView = bindings.uniform(0);
        let numbers: &PhotonsUniform = bindings.uniform(3);
        let (position, normal) = (bindings.texture(8), bindings.texture(9));
        let (zero, one) = (x.like(0.0), x.like(1.0));
        // Thickness along the light [Wyman 2005, d_V]. An open sheet has no back, or is its own.
        let there: V4<L> = load(position, x, y, 0, 0);
        let straight = there.xyz() - p;
        let first = straight.length();
        let exists = there.w.gt(zero) & straight.dot(d).gt(zero);
        let mut thickness = first;
        let steps = numbers.box_max.w as u32;
        if steps > 0 {
            // Inside as long as a back face lies farther from the light. No path is longer than down to the deepest glass.
            let (mut low, mut high) = (zero, -(self.depth(view, p) - numbers.sigma_t.w) / self.depth(view, inside));
            for _ in 0..steps {
                let middle = (low + high) * 0.5;
                let at = p + inside * middle;
                let texel = view.texel_at(at);
                let back = load(position, texel.x.floor(), texel.y.floor(), 0, 0);
                let within = back.w.gt(zero) & self.depth(view, back.xyz() - at).gt(zero);
                low = L::select(within, middle, low);
                high = L::select(within, high, middle);
            }
            thickness = (low + high) * 0.5;
            for _ in 0..CORRECTIONS {
                let back = self.back(position, normal, view.texel_at(p + inside * thickness));
                let distance = (back.position - p).dot(back.normal) / inside.dot(back.normal);
                let near = (distance - thickness).abs().lt(view.area_at(p).sqrt() * CORRECTION_TX);
                thickness = L::select(back.exists & near, distance, thickness);
            }
        }
        let end = p + inside * thickness;
        let at = view.texel_at(end);
        let back = self.back(position, normal, at);
        // Beside all back faces light leaves through the side, across the light's ray.
        let side = -(inside - d * inside.dot(d)).normalize();
        let facing = V3::select(back.exists, back.normal, side);
        let away = facing.dot(inside).gt(zero);
        let facing = V3::select(away, -facing, facing);
        let bends = load(bindings.texture(10), at.x.floor(), at.y.floor(), 0, 0);
        let curvature =
            if self.options.curvature_of_normals { curvature_of_normals(position, normal, at.x.floor(), at.y.floor()) } else { bends.x };
        let forms = V3::select(back.exists, forms_of(bends) * L::select(away, -one, one), v3(zero, zero, zero));
        Exit { position: end, normal: facing, thickness, curvature: L::select(back.exists, curvature, zero), forms, exists }
    }

    /// Component along the view's axis.
    #[inline(always)]
    fn depth<L: Lanes>(&self, view: &TexelView, v: V3<L>) -> L {
        v.dot(V3::splat(v.x.token(), view.axis_ws.truncate()))
    }

    /// The back face at texel coordinates.
    #[inline(always)]
    fn back<L: Lanes>(&self, position: &TextureView<'_>, normal: &TextureView<'_>, at: V2<L>) -> Back<L> {
        let (zero, one) = (at.x.like(0.0), at.x.like(1.0));
        if !self.options.smooth_exits {
            let (x, y) = (at.x.floor(), at.y.floor());
            let p = load(position, x, y, 0, 0);
            return Back { position: p.xyz(), normal: load(normal, x, y, 0, 0).xyz(), exists: p.w.gt(zero) };
        }
        let (x, y) = ((at.x - 0.5).floor(), (at.y - 0.5).floor());
        let (right, down) = (at.x - 0.5 - x, at.y - 0.5 - y);
        let mut p = v4(zero, zero, zero, zero);
        let mut n = v3(zero, zero, zero);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let weight = (if dx > 0.0 { right } else { one - right }) * (if dy > 0.0 { down } else { one - down });
            let texel: V4<L> = load(position, x + dx, y + dy, 0, 0);
            p = p + texel * (weight * texel.w);
            n = n + load(normal, x + dx, y + dy, 0, 0).xyz() * (weight * texel.w);
        }
        let exists = p.w.gt(zero);
        let inverse = one / L::select(exists, p.w, one);
        Back { position: p.xyz() * inverse, normal: n.normalize(), exists }
    }
}

/// Share of light left after `distance` in glass of an absorption, 1/m.
#[inline(always)]
fn absorbed<L: Lanes>(absorption: V3<L>, distance: L) -> V3<L> {
    v3(exp(-(absorption.x * distance)), exp(-(absorption.y * distance)), exp(-(absorption.z * distance)))
}

/// Mean curvature `H = ½∇·n`, 1/m, at a texel: the mean of the curvatures along both sides of the texture, from the texels beside it; 0 at the edge
/// of a surface.
#[inline(always)]
fn curvature_of_normals<L: Lanes>(position: &TextureView<'_>, normal: &TextureView<'_>, x: L, y: L) -> L {
    let zero = x.like(0.0);
    let mut sum = zero;
    let mut inside = zero.equals(zero);
    for (dx, dy) in [(1.0, 0.0), (0.0, 1.0)] {
        let (before, after) = (load(position, x - dx, y - dy, 0, 0), load(position, x + dx, y + dy, 0, 0));
        let (first, second) = (load(normal, x - dx, y - dy, 0, 0), load(normal, x + dx, y + dy, 0, 0));
        let step = after.xyz() - before.xyz();
        sum = sum + (second.xyz() - first.xyz()).dot(step) / step.dot(step);
        inside = inside & before.w.gt(zero) & after.w.gt(zero) & first.w.equals(second.w);
    }
    L::select(inside, sum * 0.5, zero)
}
