// Photons, and the differentials of their rays.

const MOST_STRETCH: f32 = 1.0e4;

struct Targets {
    @location(0) position: vec4<f32>,
    @location(1) direction: vec4<f32>,
    @location(2) flux: vec4<f32>,
    @location(3) step_x: vec4<f32>,
    @location(4) step_y: vec4<f32>,
    @location(5) losses: vec4<f32>,
}

fn step_of(photon: Photon, forms: vec3<f32>, step: vec3<f32>) -> vec4<f32> {
    let axes = view_axes(view.view.clip_from_world);
    let across = step - photon.d * dot(step, photon.d);
    let arriving = onto(Differential(step, across * photon.divergence), photon.d, photon.normal);
    let turned = turn_of(axes, forms, photon.normal, arriving.position);
    var bend = refracted_step(arriving, photon.d, photon.normal, turned, 1.0 / photon.index);
    if photon.mirror {
        bend = reflected_step(arriving, photon.d, photon.normal, turned);
    }
    if photon.glass {
        let leaving = photon.leaving;
        let within = onto(transferred(bend, select(0.0, leaving.thickness, thick)), photon.inside, leaving.normal);
        let turned_back = turn_of(axes, leaving.forms, leaving.normal, within.position);
        bend = refracted_step(within, photon.inside, leaving.normal, turned_back, photon.index);
    }
    let there = transferred(bend, photon.distance).position;
    let known = photon.position.w == LANDED && dot(there, there) < photon.width * (MOST_STRETCH * MOST_STRETCH);
    return select(vec4<f32>(), vec4<f32>(there, 1.0), known);
}

@fragment
fn fs(@builtin(position) pixel: vec4<f32>) -> Targets {
    let texel = floor(pixel.xy);
    let photon = photon_in(texel);
    let forms = texel_or_zero(front_curvatures, texel).yzw;
    let steps = steps_at(view, photon.p);
    let bends = array<vec4<f32>, 2>(step_of(photon, forms, steps.x), step_of(photon, forms, steps.y));
    return Targets(photon.position, photon.direction, photon.flux, bends[0], bends[1], photon.losses);
}
