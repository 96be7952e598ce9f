//! The closed forms against brute force: bundles of rays, refracted and reflected as vectors, that are followed one by one and counted where
//! they land. No line of this is shared with `truths`.

use std::f64::consts::{PI, TAU};

use super::truths::{optics, ring, scatter, sphere, sphere::Rings, water};

type V = [f64; 3];

fn add(a: V, b: V, factor: f64) -> V {
    [a[0] + b[0] * factor, a[1] + b[1] * factor, a[2] + b[2] * factor]
}

fn scale(a: V, factor: f64) -> V {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: V) -> V {
    scale(a, 1.0 / dot(a, a).sqrt())
}

fn mirror(d: V, n: V) -> V {
    add(d, n, -2.0 * dot(d, n))
}

/// The refracted direction and the share that passes, in the vector form of Snell's law and with the amplitudes of Fresnel; the normal may
/// point either way.
fn pass(d: V, n: V, n1: f64, n2: f64) -> Option<(V, f64)> {
    let n = if dot(d, n) > 0.0 { scale(n, -1.0) } else { n };
    let eta = n1 / n2;
    let c = -dot(d, n);
    let k = 1.0 - eta * eta * (1.0 - c * c);
    if k < 0.0 {
        return None;
    }
    let ct = k.sqrt();
    let through = add(scale(d, eta), n, eta * c - ct);
    let s = 2.0 * n1 * c / (n1 * c + n2 * ct);
    let p = 2.0 * n1 * c / (n2 * c + n1 * ct);
    Some((through, 0.5 * (n2 * ct) / (n1 * c) * (s * s + p * p)))
}

#[track_caller]
fn close(seen: f64, wanted: f64, relative: f64) {
    assert!((seen / wanted - 1.0).abs() <= relative, "{seen} is not within {relative} of {wanted}");
}

fn deg(angle: f64) -> f64 {
    angle.to_radians()
}

/// The point `index` of a sequence that fills the unit square evenly (M. Roberts' R2): no row of it lies along the edge of a texel.
fn spread(index: u32) -> (f64, f64) {
    let part = |step: f64| (0.5 + step * f64::from(index)).fract();
    (part(0.754_877_666_246_692_7), part(0.569_840_290_998_053_2))
}

/// Adds to the texel of a row that `place` falls into.
fn count(texels: &mut [f64], low: f64, high: f64, place: f64, what: f64) {
    let at = (place - low) / (high - low) * texels.len() as f64;
    if at >= 0.0 && at < texels.len() as f64 {
        texels[at as usize] += what;
    }
}

/// What crosses each boundary of a pile of level layers downwards and upwards, for light from above: power is handed from layer to layer until
/// next to nothing moves any more.
fn pile(angle: f64, indices: &[f64]) -> Vec<[f64; 2]> {
    let boundaries = indices.len() - 1;
    let sine = libm::sin(angle);
    let passes = |from: usize, to: usize| {
        let s = sine / indices[from];
        let down = if from < to { -1.0 } else { 1.0 };
        pass([s, down * (1.0 - s * s).sqrt(), 0.0], [0.0, 1.0, 0.0], indices[from], indices[to]).map_or(0.0, |(_, share)| share)
    };
    // Power about to meet boundary k from above, and from below.
    let mut moving = vec![[0.0; 2]; boundaries];
    moving[0][0] = 1.0;
    let mut crossed = vec![[0.0; 2]; boundaries];
    for _ in 0..2000 {
        let mut next = vec![[0.0; 2]; boundaries];
        for k in 0..boundaries {
            let [above, below] = moving[k];
            let (down, up) = (above * passes(k, k + 1), below * passes(k + 1, k));
            crossed[k][0] += down;
            crossed[k][1] += up;
            if k + 1 < boundaries {
                next[k + 1][0] += down + below - up;
            }
            if k > 0 {
                next[k - 1][1] += up + above - down;
            }
        }
        moving = next;
    }
    crossed
}

#[test]
fn sheets_and_water_share_light_as_a_pile_of_layers_does() {
    for angle in [0.0, 20.0, 45.0, 60.0, 75.0, 85.0].map(deg) {
        let (over, under) = (pile(angle, &[1.0, 1.5, 1.0, 1.333]), pile(angle, &[1.0, 1.333, 2.4, 1.333]));
        let stack = optics::SheetOverWater::new(angle, 1.5, 1.333);
        close(stack.entered(), over[2][0], 1e-9);
        // What the water reflects goes up; what leaves the sheet at its lower side, and what that reflects, goes down.
        close(stack.down() - stack.up(), over[2][0], 1e-9);
        close(stack.up() * (1.0 - stack.sheet), over[0][1] - pile(angle, &[1.0, 1.5, 1.0])[0][1], 1e-9);
        close(optics::sheet_under_water(angle, 2.4, 1.333), under[2][0], 1e-9);
        close(1.0 - optics::sheet_reflectance(angle, 1.5), pile(angle, &[1.0, 1.5, 1.0])[1][0], 1e-9);
    }
}

#[test]
fn still_water_has_the_known_values() {
    for (angle, value) in [(0.0, 0.979_627), (30.0, 0.847_461), (45.0, 0.687_380), (60.0, 0.470_155), (75.0, 0.203_852)] {
        let seen = optics::still_water(deg(angle), 1.333, 0.0, 1.0);
        assert!((seen - value).abs() < 5.0e-7, "{angle}: {seen}");
    }
    for angle in [0.0, 1e-5, 1e-3, 0.3, 1.2, 1.55] {
        let d = [libm::sin(angle), -libm::cos(angle), 0.0];
        let (_, share) = pass(d, [0.0, 1.0, 0.0], 1.0, 1.333).unwrap();
        assert!((optics::transmittance(angle, 1.333) - share).abs() < 1e-9, "{angle}");
        // From the inside at the angle of refraction, as much is reflected.
        let inside = optics::refraction_angle(angle, 1.333).unwrap();
        assert!((optics::reflectance(inside, 1.0 / 1.333) - (1.0 - share)).abs() < 1e-9, "{angle}");
    }
    assert_eq!(optics::reflectance(0.9, 1.0 / 1.333), 1.0);
}

#[test]
fn leaning_water_shrinks_bundles_as_stated() {
    for slope in [[0.25, 0.1], [-0.4, 0.3], [0.0, 0.0]] {
        for (azimuth, elevation) in [(30.0, 90.0), (30.0, 60.0), (200.0, 45.0), (100.0, 35.0)] {
            let light = optics::sunlight(deg(azimuth), deg(elevation));
            let normal = unit([-slope[0], 1.0, -slope[1]]);
            let (through, share) = pass(light, normal, 1.0, 1.333).unwrap();
            // Three corners of a triangle on the surface, and where their rays meet a level.
            let corners = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]].map(|[x, z]| [x, slope[0] * x + slope[1] * z, z]);
            let landed = corners.map(|p| add(p, through, (-2.0 - p[1]) / through[1]));
            let area = |p: [V; 3]| cross(add(p[1], p[0], -1.0), add(p[2], p[0], -1.0));
            let entered = -dot(area(corners), light).abs();
            let seen = -entered * share / area(landed)[1].abs();
            close(optics::leaning_water(light, slope, 1.333), seen, 1e-9);
        }
    }
    let level = optics::leaning_water(optics::sunlight(0.3, deg(45.0)), [0.0, 0.0], 1.333);
    close(level, optics::still_water(deg(45.0), 1.333, 0.0, 1.0), 1e-12);
}

#[test]
fn sine_wave_folds_light_as_a_bundle_of_rays_does() {
    let wave = water::Sine::SHIPPED;
    close(wave.focus_depth(), 5.069_863, 1e-6);
    assert!(wave.stretch(0.0, wave.level(wave.focus_depth())).abs() < 1e-12, "the focus under the crest is exact");
    for part in [0.3, 0.9, 1.0, 1.15, 1.6] {
        let depth = part * wave.focus_depth();
        let y = wave.level(depth);
        // On the crest's axis, before the focus, the paraxial formula is exact.
        if part < 1.0 {
            close(wave.irradiance(0.0, y), optics::transmittance(0.0, 1.333) / (1.0 - part), 1e-9);
        }
        let step = 1e-6;
        for x in [0.013, 0.21, 0.4, -0.7] {
            let slope = (wave.landing(x + step, y) - wave.landing(x - step, y)) / (2.0 * step);
            assert!((wave.stretch(x, y) - slope).abs() < 1e-7);
        }
        // A bundle of rays over a range from which all light that lands in the texels comes.
        let (low, high, rays) = (-0.1, 0.15, 2_000_000);
        let mut texels = [0.0; 25];
        for i in 0..rays {
            let x = -0.5 + (f64::from(i) + 0.5) / f64::from(rays);
            let surface = [x, 0.02 * libm::cos(TAU * x), 0.0];
            let normal = unit([0.02 * TAU * libm::sin(TAU * x), 1.0, 0.0]);
            let (through, share) = pass([0.0, -1.0, 0.0], normal, 1.0, 1.333).unwrap();
            let landed = add(surface, through, (y - surface[1]) / through[1]);
            count(&mut texels, low, high, landed[0], share * 25.0 / (high - low) / f64::from(rays));
        }
        for (i, seen) in texels.into_iter().enumerate() {
            let from = low + (high - low) * i as f64 / 25.0;
            close(wave.mean(from, from + 0.01, y), seen, 1e-4);
        }
        // Away from folds, the value at a point is the mean of a small texel.
        for x in [0.05, 0.123, 0.31] {
            close(wave.mean(x - 1e-6, x + 1e-6, y), wave.irradiance(x, y), 1e-4);
        }
        let one_period = wave.mean(-0.5, 0.5, y);
        let entered = super::truths::integrate(0.0, 1.0, 8, |x| wave.entering(x));
        close(one_period, entered, 1e-9);
    }
}

#[test]
fn folds_and_cusps_of_the_sine_wave_follow_their_laws() {
    let wave = water::Sine::SHIPPED;
    let f = wave.focus_depth();
    assert_eq!(wave.fold(wave.level(0.9 * f)), None);
    let y = wave.level(1.3 * f);
    let (fold, strength) = (wave.fold(y).unwrap(), wave.fold_strength(y).unwrap());
    assert_eq!((wave.sheet_count(fold - 1e-4, y), wave.sheet_count(fold + 1e-4, y)), (3, 1));
    // The two sheets alone: what is left is the third, which has no fold here.
    let third = wave.irradiance(fold + 1e-9, y);
    for distance in [1e-8, 1e-6, 1e-5] {
        close(wave.irradiance(fold - distance, y) - third, strength / distance.sqrt(), 30.0 * distance.sqrt());
        close(wave.mean(fold - distance, fold, y) - third, 2.0 * strength / distance.sqrt(), 30.0 * distance.sqrt());
    }
    // Half the width of the bright band grows as the depth behind the focus to the power 3/2.
    let width = |part: f64| wave.fold(wave.level((1.0 + part) * f)).unwrap();
    let power = |a: f64, b: f64| libm::log(width(b) / width(a)) / libm::log(b / a);
    assert!((power(0.001, 0.002) - 1.5).abs() < 2e-3, "{}", power(0.001, 0.002));
    assert!((power(0.1, 0.2) - 1.5).abs() < 0.1, "{}", power(0.1, 0.2));
}

#[test]
fn crossed_waves_gather_light_as_a_bundle_of_rays_does() {
    let crossed = water::Crossed::SHIPPED;
    let f = crossed.wave.focus_depth();
    for part in [0.25, 0.5, 0.75] {
        let y = crossed.level(part * f);
        close(crossed.irradiance(0.0, 0.0, y), crossed.under_crest(part * f), 1e-7);
        let side = 0.04;
        let centers = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.06], [0.25, 0.2], [0.44, 0.38]];
        let mut texels = [0.0; 5];
        let mut whole = 0.0;
        let rays = 2_000_000;
        for i in 0..rays {
            let (x, z) = spread(i);
            let (x, z) = (x - 0.25, z - 0.25);
            let surface = [x, 0.04 * (libm::cos(TAU * x) + libm::cos(TAU * z)), z];
            let normal = unit([0.04 * TAU * libm::sin(TAU * x), 1.0, 0.04 * TAU * libm::sin(TAU * z)]);
            let (through, share) = pass([0.0, -1.0, 0.0], normal, 1.0, 1.333).unwrap();
            let landed = add(surface, through, (y - surface[1]) / through[1]);
            whole += share / f64::from(rays);
            for (texel, c) in texels.iter_mut().zip(centers) {
                if (landed[0] - c[0]).abs() < 0.5 * side && (landed[2] - c[1]).abs() < 0.5 * side {
                    *texel += share / f64::from(rays) / (side * side);
                }
            }
        }
        for (seen, c) in texels.into_iter().zip(centers) {
            close(crossed.mean(c[0], c[1], side, y), seen, 3e-3);
        }
        close(crossed.mean_of_period(), whole, 1e-5);
        // The mean of the closed form over a period is what entered, too.
        let cells = 20;
        let mut mean = 0.0;
        for i in 0..cells {
            for j in 0..cells {
                let at = |k: i32| (f64::from(k) + 0.5) / f64::from(cells);
                mean += crossed.mean(at(i), at(j), 1.0 / f64::from(cells), y) / f64::from(cells * cells);
            }
        }
        close(mean, crossed.mean_of_period(), 1e-4);
    }
}

/// Follows the light of one ray through a ball of radius 1 at the origin, all of its parts above a share of 1e-7, to where each part crosses
/// the level y below the ball going down.
fn through_ball(x: f64, z: f64, ior: f64, y: f64, landed: &mut Vec<(V, f64)>) {
    let start = [x, (1.0 - x * x - z * z).sqrt(), z];
    let down = [0.0, -1.0, 0.0];
    let mut leave = |from: V, along: V, share: f64| {
        if along[1] < 0.0 {
            landed.push((add(from, along, (y - from[1]) / along[1]), share));
        }
    };
    let (mut along, share) = pass(down, start, 1.0, ior).unwrap();
    leave(start, mirror(down, start), 1.0 - share);
    let (mut at, mut left) = (start, share);
    for _ in 0..40 {
        if left < 1e-7 {
            break;
        }
        at = add(at, along, -2.0 * dot(at, along));
        let (out, share) = pass(along, at, ior, 1.0).unwrap_or((along, 0.0));
        leave(at, out, left * share);
        along = mirror(along, at);
        left *= 1.0 - share;
    }
}

#[test]
fn ball_focuses_as_a_bundle_of_rays_does() {
    for (ior, paraxial, at_seven_tenths) in [(1.5, 1.5, 1.2778), (1.333, 2.0015, 1.6260)] {
        let ball = sphere::Ball { ior, behind_center: 2.0 };
        assert!((ball.focus() - paraxial).abs() < 5e-5 && (ball.crossing(1e-6) - paraxial).abs() < 5e-5);
        assert!((ball.crossing(0.7) - at_seven_tenths).abs() < 5e-5, "{}", ball.crossing(0.7));
    }
    let rays = 3_000_000;
    for z in [1.2, 1.35, 1.8] {
        let ball = sphere::Ball { ior: 1.5, behind_center: z };
        let rectangles: [[[f64; 2]; 2]; 7] = [
            [[-0.1, 0.1], [-0.1, 0.1]],
            [[-0.8, 0.8], [-0.8, 0.8]],
            [[0.0, 0.2], [0.0, 0.2]],
            [[0.3, 0.5], [-0.1, 0.1]],
            [[0.2, 0.5], [0.3, 0.6]],
            [[0.9, 1.4], [0.0, 0.5]],
            [[-0.5, -0.3], [-0.4, 0.0]],
        ];
        let mut texels = [0.0; 7];
        let mut landed = Vec::new();
        for i in 0..rays {
            let (x, z_in) = spread(i);
            let (x, z_in) = (2.0 * x - 1.0, 2.0 * z_in - 1.0);
            if x * x + z_in * z_in < 1.0 {
                landed.clear();
                through_ball(x, z_in, 1.5, -z, &mut landed);
                for (place, share) in &landed {
                    for (texel, [x, z]) in texels.iter_mut().zip(rectangles) {
                        if (x[0]..x[1]).contains(&place[0]) && (z[0]..z[1]).contains(&place[2]) {
                            *texel += share * 4.0 / f64::from(rays) / ((x[1] - x[0]) * (z[1] - z[0]));
                        }
                    }
                }
            }
        }
        for (seen, [x, z]) in texels.into_iter().zip(rectangles) {
            close(ball.mean(x, z), seen, 5e-3);
        }
        // The value at a point is the mean of a small texel.
        for r in [0.11, 0.43] {
            close(ball.mean([r - 3e-3, r + 3e-3], [-3e-3, 3e-3]), ball.irradiance(r, 0..7), 1e-2);
        }
    }
    let far = sphere::Ball { ior: 1.5, behind_center: 1.8 };
    close(far.irradiance(1e-5, 1..2), far.on_axis(), 1e-6);
    // Light reflected inside twice is focused on the axis as well: a spike of 1/r, six orders of magnitude thinner.
    close(far.irradiance(0.02, 0..7), far.irradiance(0.02, 1..2), 1e-3);
}

#[test]
fn cap_focuses_as_a_bundle_of_rays_does() {
    let rays = 3_000_000;
    for z in [0.3, 0.5] {
        let cap = sphere::Cap { ior: 2.5, behind_center: z };
        close(cap.focus_depth(), 5.0 / 3.0, 1e-12);
        close(cap.crossing(1e-6) + 1.0, 5.0 / 3.0, 1e-9);
        let rectangles = [[[-0.1, 0.1], [-0.1, 0.1]], [[0.05, 0.15], [-0.05, 0.05]], [[-0.6, 0.6], [-0.6, 0.6]]];
        let mut texels = [0.0; 3];
        for i in 0..rays {
            let (x, z_in) = spread(i);
            let (x, z_in) = (2.0 * x - 1.0, 2.0 * z_in - 1.0);
            let b2 = x * x + z_in * z_in;
            if b2 < 1.0 {
                let entry = [x, (1.0 - b2).sqrt(), z_in];
                let (through, share) = pass([0.0, -1.0, 0.0], entry, 1.0, 2.5).unwrap();
                let landed = add(entry, through, (-z - entry[1]) / through[1]);
                // Nothing meets the ball's other side first, down to the floor of the scene.
                let on_floor = add(entry, through, (-0.6 - entry[1]) / through[1]);
                assert!(dot(landed, landed) < 1.0 && dot(on_floor, on_floor) < 1.0);
                for (texel, [x, z]) in texels.iter_mut().zip(rectangles) {
                    if (x[0]..x[1]).contains(&landed[0]) && (z[0]..z[1]).contains(&landed[2]) {
                        *texel += share * 4.0 / f64::from(rays) / ((x[1] - x[0]) * (z[1] - z[0]));
                    }
                }
            }
        }
        for (seen, [x, z]) in texels.into_iter().zip(rectangles) {
            close(cap.mean(x, z), seen, 5e-3);
        }
        for r in [0.02, 0.06] {
            close(cap.mean([r - 5e-4, r + 5e-4], [-5e-4, 5e-4]), cap.irradiance(r), 5e-3);
        }
    }
    let before = sphere::Cap { ior: 2.5, behind_center: 0.3 };
    close(before.irradiance(1e-5), before.on_axis(), 1e-6);
}

/// Follows a ray inside an upright cylinder of radius 1 to the floor y = 0, adding up reflections; `None` where it meets the outside of the wall
/// or no wall at all.
fn in_ring(mut at: V, mut along: V, height: f64) -> Option<(V, u32)> {
    let mut reflections = 0;
    loop {
        // Next meeting with the full cylinder.
        let a = along[0] * along[0] + along[2] * along[2];
        let b = at[0] * along[0] + at[2] * along[2];
        let c = at[0] * at[0] + at[2] * at[2] - 1.0;
        let root = (b * b - a * c).max(0.0).sqrt();
        let floor = -at[1] / along[1];
        let met = [(-b - root) / a, (-b + root) / a].into_iter().find(|&t| {
            let y = at[1] + t * along[1];
            t > 1e-9 && (0.0..height).contains(&y)
        });
        match met {
            Some(t) if t < floor => {
                at = add(at, along, t);
                let inward = unit([-at[0], 0.0, -at[2]]);
                if dot(along, inward) > 0.0 {
                    return None;
                }
                along = mirror(along, inward);
                reflections += 1;
            }
            _ => return (reflections > 0).then(|| (add(at, along, floor), reflections)),
        }
    }
}

#[test]
fn parallel_light_in_a_ring_lands_as_rays_do() {
    let ring = ring::Nephroid { elevation: deg(45.0), height: 0.8, reflectance: 1.0 };
    close(ring.reach(), 0.8, 1e-12);
    close(ring.clean_radius(), 0.84_f64.sqrt(), 1e-12);
    // The ray that touches the caustic does so at t = ½ cos φ, on the nephroid.
    for angle in [0.0, 0.4, -1.0] {
        let t = 0.5 * libm::cos(angle);
        let p = [-libm::cos(angle) + t * libm::cos(2.0 * angle), libm::sin(angle) - t * libm::sin(2.0 * angle)];
        let q = ring::Nephroid::caustic(PI - angle);
        assert!((p[0] - q[0]).abs() + (p[1] - q[1]).abs() < 1e-12, "{p:?} {q:?}");
    }
    let along = optics::sunlight(0.0, deg(45.0));
    let (texels_per_side, low, high) = (12, -0.6, 0.6);
    let mut texels = [0.0; 144];
    let (mut once, mut more) = (0, 0);
    let rays = 3_000_000;
    for i in 0..rays {
        // Over a level square at the height of the rim, through which all light passes that reaches the inside of the wall.
        let (x, z) = spread(i);
        let top = [2.0 * x - 1.0, 0.8, 2.0 * z - 1.0];
        if top[0] * top[0] + top[2] * top[2] < 1.0
            && let Some((landed, reflections)) = in_ring(top, along, 0.8)
        {
            let r = libm::hypot(landed[0], landed[2]);
            if r < ring.clean_radius() - 1e-9 {
                assert_eq!(reflections, 1, "{landed:?}");
            }
            if reflections == 1 {
                once += 1
            } else {
                more += 1
            }
            let bin = |x: f64| ((x - low) / (high - low) * f64::from(texels_per_side)).floor();
            let (column, row) = (bin(landed[0]), bin(landed[2]));
            if (0.0..12.0).contains(&column) && (0.0..12.0).contains(&row) {
                texels[row as usize * 12 + column as usize] += 4.0 / f64::from(rays) / 0.01 * libm::sin(deg(45.0));
            }
        }
    }
    assert!(once > 10 * more && more > 0);
    for (index, seen) in texels.into_iter().enumerate() {
        let cell = |k: usize| [low + 0.1 * k as f64, low + 0.1 * (k + 1) as f64];
        let wanted = ring.mean(cell(index % 12), cell(index / 12));
        assert!((seen - wanted).abs() < 0.005 * wanted + 1e-3, "{index}: {seen} against {wanted}");
    }
    for p in [[-0.3, 0.1], [-0.7, 0.2], [-0.45, 0.02]] {
        let cell = |c: f64| [c - 2e-3, c + 2e-3];
        close(ring.mean(cell(p[0]), cell(p[1])), ring.irradiance(p[0], p[1]), 5e-3);
    }
}

#[test]
fn light_on_the_rim_lands_as_rays_do() {
    let ring = ring::Cardioid { light_height: 1.2, height: 0.6, reflectance: 1.0 };
    for alpha in [0.5, 2.0, PI] {
        // The ray from the light, mirrored, touches the caustic after a third of the chord.
        let (from, on) = ([1.0, 0.0, 0.0], [libm::cos(alpha), 0.0, libm::sin(alpha)]);
        let chord = add(on, from, -1.0);
        let along = unit(mirror(unit(chord), unit(on)));
        let p = add(on, along, dot(chord, chord).sqrt() / 3.0);
        let q = ring::Cardioid::caustic(alpha);
        assert!((p[0] - q[0]).abs() + (p[2] - q[1]).abs() < 1e-12, "{p:?} {q:?}");
    }
    // Rays of equal solid angle into the quarter of the sphere that is below the light and towards the ring.
    let rays = 5_000_000;
    let mut texels = [0.0; 144];
    for i in 0..rays {
        let (turn, down) = spread(i);
        let azimuth = 0.5 * PI + PI * turn;
        let level = (1.0 - down * down).sqrt();
        let along = [level * libm::cos(azimuth), -down, level * libm::sin(azimuth)];
        if let Some((landed, reflections)) = in_ring([1.0, 1.2, 0.0], along, 0.6) {
            assert_eq!(reflections, 1);
            let bin = |x: f64| ((x + 0.6) / 0.1).floor();
            let (column, row) = (bin(landed[0]), bin(landed[2]));
            if (0.0..12.0).contains(&column) && (0.0..12.0).contains(&row) {
                texels[row as usize * 12 + column as usize] += PI / f64::from(rays) / 0.01;
            }
        }
    }
    for (index, seen) in texels.into_iter().enumerate() {
        let cell = |k: usize| [-0.6 + 0.1 * k as f64, -0.6 + 0.1 * (k + 1) as f64];
        let wanted = ring.mean(cell(index % 12), cell(index / 12));
        assert!((seen - wanted).abs() < 0.005 * wanted + 1e-3, "{index}: {seen} against {wanted}");
    }
    for p in [[-0.2, 0.1], [0.3, -0.2], [-0.6, 0.3]] {
        let cell = |c: f64| [c - 2e-3, c + 2e-3];
        close(ring.mean(cell(p[0]), cell(p[1])), ring.irradiance(p[0], p[1]), 5e-3);
    }
}

#[test]
fn phase_function_integrates_to_one_and_its_mean_cosine_is_g() {
    for g in [-0.7, 0.0, 0.5, 0.9] {
        let over_sphere =
            |f: &dyn Fn(f64) -> f64| super::truths::integrate(-1.0, 1.0, 512, |c| TAU * f(c) * scatter::henyey_greenstein(c, g));
        close(over_sphere(&|_| 1.0), 1.0, 1e-9);
        assert!((over_sphere(&|c| c) - g).abs() < 1e-9);
        for cosine in [-1.0, -0.3, 0.0, 0.8, 1.0] {
            let ours = f64::from(nephroid_henyey_greenstein(cosine as f32, g as f32));
            close(ours, scatter::henyey_greenstein(cosine, g), 1e-5);
        }
    }
}

fn nephroid_henyey_greenstein(cosine: f32, g: f32) -> f32 {
    nephroid::math::optics::henyey_greenstein(cosine, g)
}

#[test]
fn lit_slab_is_the_sum_of_its_slices() {
    for (c, sigma_t) in [(0.0, 0.4), (0.7, 1.3), (-0.6, 0.4), (-1.0, 0.4)] {
        let slab = scatter::Slab { sigma_s: 0.2, sigma_t, irradiance: 0.9, phase: 0.05, light_path: 1.5, light_path_per_m: c, length: 2.0 };
        let slices = 100_000;
        let sum: f64 = (0..slices)
            .map(|i| {
                let s = 2.0 * (f64::from(i) + 0.5) / f64::from(slices);
                0.2 * 0.05 * 0.9 * libm::exp(-sigma_t * (1.5 + c * s)) * libm::exp(-sigma_t * s) * 2.0 / f64::from(slices)
            })
            .sum();
        close(slab.radiance(), sum, 1e-9);
    }
}
