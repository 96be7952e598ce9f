//! Splats from the photon's own differential, past the paper: a photon lights what its cell of the view lights.
//!
//! The neighbours of a photon in the view, or the differential of its ray, say how the map of the light bends there: a step of one texel in the view moves the light by the columns of
//! the Jacobian J, in texels of the caustic map. The splat is the square of `splat_size` by `splat_size` cells around the photon, sent through J: a
//! parallelogram, narrow where light is gathered, long where it is drawn out, without a lens. Its kernel is a product of quadratic B-splines in the
//! coordinates of the view, of three cells if `splat_size` is 3. These add up to 1 over a grid of cells: where the light bends evenly, a caustic has no
//! noise at all.
//!
//! A parallelogram narrower than a texel is widened, which leaves its directions as they are: of `J = Q + R`, Q a turn and R a reflection, both scaled,
//! the singular values are |Q| ± |R|, and only these lengths are changed. Neighbours across an edge are recognised by a step that is several times the
//! step on the other side. A photon without neighbours gets a round splat of its beam.

use std::sync::Arc;

use nephroid_math::lanes::{Lanes, Mask};
use nephroid_math::vector::{V2, V4, v2, v4};
use nephroid_pipeline::sampler::load;
use nephroid_pipeline::shader::{
    FragmentInput, FragmentOutput, FragmentShader, Interpolation, Program, Varying, VertexInput, VertexOutput, VertexShader,
};
use nephroid_pipeline::{BindingKind, Bindings};

use super::exact::PhotonRecord;
use super::photons::Fate;
use super::splats::{MOST_DIAMETER_TX, Photon, SPRITE_MARGIN_TX, Source, SplatsUniform, clear_others, photon, splat_wgsl, sprite};
use crate::passes::light_view::TexelView;

/// Least width of a cell in the map, in texels. Splines of one texel add up to 1 at texel centres wherever they lie; narrower ones do not.
const LEAST_CELL_TX: f32 = 1.0;

/// Greatest width, in texels: the splat of three of them is no larger than a sprite may be, whichever way it lies.
const MOST_CELL_TX: f32 = MOST_DIAMETER_TX / 4.3;

/// Step over the step on the other side beyond which the longer one leads across an edge.
const EDGE: f32 = 4.0;

/// Distance of a neighbour from the photon's tangent plane, over its distance, beyond which it lies on another receiver.
const CREASE: f32 = 0.3;

/// How steps of the light are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// By where the neighbours of a photon in textures land.
    Neighbours,
    /// By the differentials of the rays of photons in textures, bound after these: steps along x and y.
    Rays,
    /// By records.
    Records,
}

/// The program.
#[must_use]
pub fn program(steps: Steps) -> Arc<Program> {
    let varying = |name| Varying { name, components: 4, interpolation: Interpolation::Flat };
    let textures = Source::Textures;
    let (name, source, wgsl) = match steps {
        Steps::Neighbours => ("differential_splats", textures, splat_wgsl!(textures, "neighbours.wgsl", "differential.wgsl")),
        Steps::Rays => ("differential_splats_of_rays", textures, splat_wgsl!(textures, "ray_steps.wgsl", "differential.wgsl")),
        Steps::Records => ("differential_splats_of_records", Source::Records, splat_wgsl!(Source::Records, "differential.wgsl")),
    };
    let mut bindings = source.bindings();
    if steps == Steps::Rays {
        bindings.extend([BindingKind::Texture; 2]);
    }
    Arc::new(Program {
        varyings: vec![varying("place"), varying("inverse"), varying("flux")],
        bindings,
        wgsl: Some(wgsl),
        ..Program::new(name, Vertex { source, steps }, Fragment)
    })
}

/// Two columns: what one step along x and along y of the view moves in the map.
struct Jacobian<L> {
    x: V2<L>,
    y: V2<L>,
}

/// Quadratic B-spline: 1 over all integers' translates, 0 from 3/2 on.
#[inline(always)]
fn spline<L: Lanes>(t: L) -> L {
    let t = t.abs();
    let tail = Lanes::max(-t + 1.5, t.like(0.0));
    L::select(t.lt(t.like(0.5)), -(t * t) + 0.75, tail * tail * 0.5)
}

/// Share of a texel whose centre lies `offset` from the photon, before division by the sum.
#[inline(always)]
fn weight<L: Lanes>(offset: V2<L>, inverse: &Jacobian<L>) -> L {
    let (a, b) = (inverse.x.dot(offset), inverse.y.dot(offset));
    spline(a) * spline(b)
}

/// Where light goes with one texel of the view along x and y, in texels of the map. Without neighbours, the diameter of the beam.
#[inline(always)]
fn steps_of<L: Lanes>(steps: Steps, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, photon: &Photon<L>) -> Jacobian<L> {
    let (zero, one) = (photon.beam.like(0.0), photon.beam.like(1.0));
    let (alone_x, alone_y) = (v2(photon.beam, zero), v2(zero, photon.beam));
    match steps {
        Steps::Neighbours => {
            let (right, down) = (v2(one, zero), v2(zero, one));
            Jacobian { x: step(bindings, photon, right, alone_x), y: step(bindings, photon, down, alone_y) }
        }
        Steps::Rays => Jacobian { x: ray_step(bindings, photon, 7, alone_x), y: ray_step(bindings, photon, 8, alone_y) },
        Steps::Records => {
            let records: &[PhotonRecord] = bindings.storage(4);
            let x = input.per_vertex4(|i| records[i as usize].x_ws.to_array());
            let y = input.per_vertex4(|i| records[i as usize].y_ws.to_array());
            Jacobian { x: recorded(bindings, photon, x, alone_x), y: recorded(bindings, photon, y, alone_y) }
        }
    }
}

/// A step that a differential knows, along the ray onto the plane of the receiver.
#[inline(always)]
fn ray_step<L: Lanes>(bindings: &Bindings<'_>, photon: &Photon<L>, texture: usize, alone: V2<L>) -> V2<L> {
    let ray = load(bindings.texture(5), photon.texel.x, photon.texel.y, 0, 0).xyz();
    let step: V4<L> = load(bindings.texture(texture), photon.texel.x, photon.texel.y, 0, 0);
    let on_plane = step.xyz() - ray * (step.xyz().dot(photon.normal) / ray.dot(photon.normal));
    recorded(bindings, photon, v4(on_plane.x, on_plane.y, on_plane.z, step.w), alone)
}

/// A step that a record knows.
#[inline(always)]
fn recorded<L: Lanes>(bindings: &Bindings<'_>, photon: &Photon<L>, step_ws: V4<L>, alone: V2<L>) -> V2<L> {
    let map: &TexelView = bindings.uniform(0);
    let step = map.texel_at(photon.position + step_ws.xyz()) - photon.at;
    V2::select(step_ws.w.gt(step_ws.w.like(0.0)), step, alone)
}

/// The mean of the steps to both neighbours along `direction`, or the one that leads across no edge.
#[inline(always)]
fn step<L: Lanes>(bindings: &Bindings<'_>, photon: &Photon<L>, direction: V2<L>, alone: V2<L>) -> V2<L> {
    let (before, has_before) = neighbour(bindings, photon, photon.texel - direction);
    let (after, has_after) = neighbour(bindings, photon, photon.texel + direction);
    let (back, ahead) = (photon.at - before, after - photon.at);
    let (short, long) = (back.dot(back), ahead.dot(ahead));
    let edge = EDGE * EDGE;
    let has_before = has_before & !(has_after & short.gt(long * edge));
    let has_after = has_after & !(has_before & long.gt(short * edge));
    let both = (back + ahead) * short.like(0.5);
    let one = V2::select(has_before, back, V2::select(has_after, ahead, alone));
    V2::select(has_before & has_after, both, one)
}

/// Where the neighbour in a texel lies in the map, and whether it lies on the same receiver.
#[inline(always)]
fn neighbour<L: Lanes>(bindings: &Bindings<'_>, photon: &Photon<L>, texel: V2<L>) -> (V2<L>, L::Mask) {
    let map: &TexelView = bindings.uniform(0);
    let position: V4<L> = load(bindings.texture(4), texel.x, texel.y, 0, 0);
    let to = position.xyz() - photon.position;
    let landed = position.w.equals(position.w.like(Fate::Landed as u8 as f32));
    let same = landed & to.dot(photon.normal).abs().le(to.length() * CREASE);
    let nowhere = v2(position.w.like(0.0), position.w.like(0.0));
    (V2::select(same, map.texel_at(position.xyz()), nowhere), same)
}

/// Widens what is narrower than [`LEAST_CELL_TX`], and narrows what is wider than [`MOST_CELL_TX`].
#[inline(always)]
fn bounded<L: Lanes>(j: &Jacobian<L>) -> Jacobian<L> {
    let half = j.x.x.like(0.5);
    let one = j.x.x.like(1.0);
    let (tiny, huge) = (j.x.x.like(1.0e-12), j.x.x.like(1.0e12));
    // J = turn + reflection, ((e, −h), (h, e)) + ((f, g), (g, −f)).
    let (e, h) = ((j.x.x + j.y.y) * half, (j.x.y - j.y.x) * half);
    let (f, g) = ((j.x.x - j.y.y) * half, (j.x.y + j.y.x) * half);
    let (turn, reflection) = ((e * e + h * h).sqrt(), (f * f + g * g).sqrt());
    let large = Lanes::clamp(turn + reflection, LEAST_CELL_TX, MOST_CELL_TX);
    let small = Lanes::clamp((turn - reflection).abs(), LEAST_CELL_TX, MOST_CELL_TX);
    let turns = turn.ge(reflection);
    let (sum, difference) = ((large + small) * half, (large - small) * half);
    let (wide_turn, wide_reflection) = (L::select(turns, sum, difference), L::select(turns, difference, sum));
    // A part without length, or of a length beyond numbers, has no direction: any will do.
    let turn_is = turn.gt(tiny) & turn.lt(huge);
    let (e, h) = (L::select(turn_is, e / turn, one) * wide_turn, L::select(turn_is, h / turn, one * 0.0) * wide_turn);
    let reflection_is = reflection.gt(tiny) & reflection.lt(huge);
    let (f, g) = (
        L::select(reflection_is, f / reflection, one) * wide_reflection,
        L::select(reflection_is, g / reflection, one * 0.0) * wide_reflection,
    );
    Jacobian { x: v2(e + f, h + g), y: v2(g - h, e - f) }
}

struct Vertex {
    source: Source,
    steps: Steps,
}

impl VertexShader for Vertex {
    #[inline(always)]
    fn vertex<L: Lanes>(&self, bindings: &Bindings<'_>, input: &VertexInput<'_, L>, output: &mut VertexOutput<L>) {
        let photon = photon(self.source, bindings, input);
        output.position = sprite(bindings, &photon);
        if !photon.landed.any() {
            clear_others(&photon, 12, output);
            return;
        }
        let (zero, one) = (photon.beam.like(0.0), photon.beam.like(1.0));
        let Jacobian { x, y } = steps_of(self.steps, bindings, input, &photon);
        // Three knots of the splines span the splat.
        let cells = one.like(bindings.uniform::<SplatsUniform>(1).shape.x / 3.0);
        let j = bounded(&Jacobian { x: x * cells, y: y * cells });
        let reach = v2((j.x.x.abs() + j.y.x.abs()) * 1.5, (j.x.y.abs() + j.y.y.abs()) * 1.5);
        let inverse_determinant = one / j.x.perp_dot(j.y);
        let inverse = Jacobian {
            x: v2(j.y.y * inverse_determinant, -(j.y.x * inverse_determinant)),
            y: v2(-(j.x.y * inverse_determinant), j.x.x * inverse_determinant),
        };

        let first = v2((photon.at.x - reach.x).floor() + 0.5, (photon.at.y - reach.y).floor() + 0.5);
        let (rows, columns) = (photon.at.y + reach.y, photon.at.x + reach.x);
        let mut sum = zero;
        for row in 0..=MOST_DIAMETER_TX as u32 + 1 {
            let y = first.y + row as f32;
            if !(photon.landed & y.lt(rows)).any() {
                break;
            }
            for column in 0..=MOST_DIAMETER_TX as u32 + 1 {
                let x = first.x + column as f32;
                if !(photon.landed & x.lt(columns)).any() {
                    break;
                }
                sum = sum + weight(v2(x, y) - photon.at, &inverse);
            }
        }
        let share = one / sum;
        output.point_size = Lanes::max(reach.x, reach.y) * 2.0 + SPRITE_MARGIN_TX;
        output.varyings[0] = photon.at.x;
        output.varyings[1] = photon.at.y;
        output.varyings[2] = zero;
        output.varyings[3] = zero;
        output.varyings[4] = inverse.x.x;
        output.varyings[5] = inverse.x.y;
        output.varyings[6] = inverse.y.x;
        output.varyings[7] = inverse.y.y;
        output.set3(8, photon.flux * share);
        output.varyings[11] = share;
        clear_others(&photon, 12, output);
    }
}

struct Fragment;

impl FragmentShader for Fragment {
    #[inline(always)]
    fn fragment<L: Lanes>(&self, _: &Bindings<'_>, input: &FragmentInput<'_, L>, output: &mut FragmentOutput<L>) {
        let flat = input.flat_varyings();
        let at = input.position.x;
        let offset = v2(at - flat[0], input.position.y - flat[1]);
        let inverse = Jacobian { x: v2(at.like(flat[4]), at.like(flat[5])), y: v2(at.like(flat[6]), at.like(flat[7])) };
        let weight = weight(offset, &inverse);
        output.color[0] = v4(weight * flat[8], weight * flat[9], weight * flat[10], weight * flat[11]);
    }
}
