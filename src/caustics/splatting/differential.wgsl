// Splats from the photon's own differential: the twin of `differential.rs`.

const LEAST_CELL_TX: f32 = 1.0;
const MOST_CELL_TX: f32 = MOST_DIAMETER_TX / 4.3;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) place: vec4<f32>,
    @location(1) @interpolate(flat) inverse: vec4<f32>,
    @location(2) @interpolate(flat) flux: vec4<f32>,
}

fn spline(t_signed: f32) -> f32 {
    let t = abs(t_signed);
    let tail = max(1.5 - t, 0.0);
    return select(tail * tail * 0.5, 0.75 - t * t, t < 0.5);
}

fn weight_at(offset: vec2<f32>, inverse: vec4<f32>) -> f32 {
    return spline(dot(inverse.xy, offset)) * spline(dot(inverse.zw, offset));
}

// Columns of a Jacobian, widened and narrowed to what a cell may be.
fn bounded(j: vec4<f32>) -> vec4<f32> {
    let turn_part = vec2<f32>(j.x + j.w, j.y - j.z) * 0.5;
    let reflection_part = vec2<f32>(j.x - j.w, j.y + j.z) * 0.5;
    let turn = sqrt(dot(turn_part, turn_part));
    let reflection = sqrt(dot(reflection_part, reflection_part));
    let large = clamp(turn + reflection, LEAST_CELL_TX, MOST_CELL_TX);
    let small = clamp(abs(turn - reflection), LEAST_CELL_TX, MOST_CELL_TX);
    let sum = (large + small) * 0.5;
    let difference = (large - small) * 0.5;
    let turns = turn >= reflection;
    let eh = select(vec2<f32>(1.0, 0.0), turn_part / turn, turn > 1.0e-12 && turn < 1.0e12) * select(difference, sum, turns);
    let fg = select(vec2<f32>(1.0, 0.0), reflection_part / reflection, reflection > 1.0e-12 && reflection < 1.0e12) * select(sum, difference, turns);
    return vec4<f32>(eh.x + fg.x, eh.y + fg.y, fg.y - eh.y, eh.x - fg.x);
}

@vertex
fn vs(@builtin(vertex_index) vertex_index: u32) -> Varyings {
    let photon = photon_of(vertex_index);
    if !photon.landed {
        return Varyings(sprite(photon), vec4<f32>(), vec4<f32>(), vec4<f32>());
    }
    let steps = steps_of(photon, vertex_index);
    let j = bounded(steps * (splats.shape.x / 3.0));
    let reach = (abs(j.xy) + abs(j.zw)) * 1.5;
    let inverse = vec4<f32>(j.w, -j.z, -j.y, j.x) * (1.0 / (j.x * j.w - j.y * j.z));
    let first = floor(photon.at - reach) + 0.5;
    let last = photon.at + reach;
    var sum = 0.0;
    for (var row = 0; row <= MOST_TEXELS; row++) {
        if !(first.y + f32(row) < last.y) {
            break;
        }
        for (var column = 0; column <= MOST_TEXELS; column++) {
            let centre = first + vec2<f32>(f32(column), f32(row));
            if !(centre.x < last.x) {
                break;
            }
            sum += weight_at(centre - photon.at, inverse);
        }
    }
    let share = 1.0 / sum;
    return Varyings(sprite(photon), vec4<f32>(photon.at, 0.0, 0.0), inverse, vec4<f32>(photon.flux * share, share));
}

@fragment
fn fs(in: Varyings) -> @location(0) vec4<f32> {
    return weight_at(in.position.xy - in.place.xy, in.inverse) * in.flux;
}
