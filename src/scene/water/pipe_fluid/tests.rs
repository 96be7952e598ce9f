//! Wave speed, conservation, walls, drops, bodies and spray.

use glam::Vec2;

use super::super::{GRAVITY_M_PER_S2, HeightField, Water, WaterModel};
use super::*;

fn basin(size_m: Vec2, cells: (u32, u32), settings: FluidSettings) -> Water {
    let settings = FluidSettings { cells: Some(cells), ..settings };
    Water { size_m, grid: (cells.0 + 1, cells.1 + 1), model: WaterModel::PipeFluid(settings), ..Water::default() }
}

fn fluid(water: &Water) -> PipeFluid {
    assert_eq!(water.validate(), Ok(()));
    let WaterModel::PipeFluid(settings) = &water.model else { unreachable!("the water is a fluid") };
    PipeFluid::new(settings, water)
}

/// A standing wave in a basin without damping.
fn standing(size_m: Vec2, cells: (u32, u32), half_waves: (u32, u32)) -> Water {
    let initial = InitialState::Cosine { half_waves, amplitude_m: 0.01 };
    basin(size_m, cells, FluidSettings { depth_m: 0.5, damping_per_s: 0.0, initial, ..FluidSettings::default() })
}

/// Amplitude of a mode of the basin: the projection of the heights on it.
fn mode_amplitude(fluid: &PipeFluid, cells: (u32, u32), half_waves: (u32, u32)) -> f64 {
    let along = |count: u32, i: u32, n: u32| libm::cos(std::f64::consts::PI * f64::from(count) * (f64::from(i) + 0.5) / f64::from(n));
    let heights = fluid.cell_heights_m();
    let (mut sum, mut norm) = (0.0, 0.0);
    for row in 0..cells.1 {
        for column in 0..cells.0 {
            let shape = along(half_waves.0, column, cells.0) * along(half_waves.1, row, cells.1);
            sum += shape * heights[(row * cells.0 + column) as usize];
            norm += shape * shape;
        }
    }
    sum / norm
}

/// Period of a mode from the first and the last of its falling zero crossings.
fn measured_period(water: &Water, cells: (u32, u32), half_waves: (u32, u32), periods: u32) -> f64 {
    let mut fluid = fluid(water);
    let dt = fluid.step_s();
    let (mut before, mut crossings) = (mode_amplitude(&fluid, cells, half_waves), Vec::new());
    while crossings.len() <= periods as usize {
        let time = fluid.time_s();
        fluid.advance(dt);
        let now = mode_amplitude(&fluid, cells, half_waves);
        if before > 0.0 && now <= 0.0 {
            crossings.push(time + (fluid.time_s() - time) * before / (before - now));
        }
        before = now;
    }
    (crossings[periods as usize] - crossings[0]) / f64::from(periods)
}

#[test]
fn standing_wave_has_the_period_of_its_speed() {
    // T16: period 2π/(v·|k|) with v = √(g·d), within 0.2 %, along both axes, the diagonal, and on cells that are not square.
    let v = (GRAVITY_M_PER_S2 * 0.5).sqrt();
    let pi = std::f64::consts::PI;
    for (size, cells, half_waves) in [
        (Vec2::new(8.0, 0.5), (128, 8), (2, 0)),
        (Vec2::new(0.5, 8.0), (8, 128), (0, 2)),
        (Vec2::new(4.0, 4.0), (64, 64), (2, 2)),
        (Vec2::new(6.0, 4.0), (64, 64), (2, 1)),
    ] {
        let k = (pi * f64::from(half_waves.0) / f64::from(size.x), pi * f64::from(half_waves.1) / f64::from(size.y));
        let expected = std::f64::consts::TAU / (v * (k.0 * k.0 + k.1 * k.1).sqrt());
        let period = measured_period(&standing(size, cells, half_waves), cells, half_waves, 5);
        assert!((period / expected - 1.0).abs() < 2e-3, "{cells:?} {half_waves:?}: {period} s, expected {expected} s");
    }
}

#[test]
fn waves_obey_the_dispersion_of_the_grid() {
    // Along x: sin(ωΔt/2) = (v·Δt/Δx)·sin(kΔx/2), down to six columns per wave.
    let cells = (96, 4);
    let size = Vec2::new(9.6, 0.4);
    for half_waves in [2_u32, 8, 16, 32] {
        let water = standing(size, cells, (half_waves, 0));
        let dt = fluid(&water).step_s();
        let k = std::f64::consts::PI * f64::from(half_waves) / f64::from(size.x);
        let v = (GRAVITY_M_PER_S2 * 0.5).sqrt();
        let omega = 2.0 / dt * libm::asin(v * dt / 0.1 * libm::sin(0.5 * k * 0.1));
        let period = measured_period(&water, cells, (half_waves, 0), 8);
        assert!((period * omega / std::f64::consts::TAU - 1.0).abs() < 2e-3, "{half_waves} half waves: {period} s");
    }
}

#[test]
fn waves_are_isotropic() {
    // 16 columns per wave along the axis and along the diagonal: the nine-point pipes agree to 1e-4 where four pipes differ by 3e-3.
    let side = 64;
    let axis = measured_period(&standing(Vec2::splat(4.0), (side, side), (8, 0)), (side, side), (8, 0), 6);
    let across = Vec2::splat(4.0 * std::f32::consts::SQRT_2);
    let diagonal = measured_period(&standing(across, (90, 90), (8, 8)), (90, 90), (8, 8), 6);
    assert!((axis / diagonal - 1.0).abs() < 4e-4, "{axis} s along the axis, {diagonal} s along the diagonal");
}

#[test]
fn standing_wave_neither_grows_nor_decays_without_damping() {
    let cells = (128, 8);
    let mut fluid = fluid(&standing(Vec2::new(8.0, 0.5), cells, (2, 0)));
    let mut largest: f64 = 0.0;
    fluid.advance_to(200.0);
    for _ in 0..600 {
        let dt = fluid.step_s();
        fluid.advance(dt);
        largest = largest.max(mode_amplitude(&fluid, cells, (2, 0)).abs());
    }
    assert!((largest / 0.01 - 1.0).abs() < 2e-3, "amplitude {largest} m after 200 s");
}

#[test]
fn damping_halves_the_rate_for_waves() {
    let cells = (64, 4);
    let mut water = standing(Vec2::new(4.0, 0.25), cells, (2, 0));
    let WaterModel::PipeFluid(settings) = &mut water.model else { unreachable!("the water is a fluid") };
    settings.damping_per_s = 0.5;
    let mut fluid = fluid(&water);
    let mut largest: f64 = 0.0;
    // One period is 1.8 s: the largest value in [8, 10] s is near e^{−0.25·t} at the crest.
    let mut at = 0.0;
    fluid.advance_to(8.0);
    while fluid.time_s() < 10.0 {
        let dt = fluid.step_s();
        fluid.advance(dt);
        let now = mode_amplitude(&fluid, cells, (2, 0)).abs();
        if now > largest {
            (largest, at) = (now, fluid.time_s());
        }
    }
    let expected = 0.01 * libm::exp(-0.25 * at);
    assert!((largest / expected - 1.0).abs() < 0.05, "{largest} m at {at} s, expected {expected} m");
}

fn drift(fluid: &PipeFluid) -> f64 {
    (fluid.volume_m3() - fluid.initial_volume_m3() - fluid.added_volume_m3()) / fluid.initial_volume_m3()
}

#[test]
fn volume_is_conserved_to_rounding() {
    let mut still = fluid(&standing(Vec2::new(8.0, 0.5), (128, 8), (3, 1)));
    still.advance_to(60.0);
    assert!(still.step_count() > 1000);
    assert!(drift(&still).abs() < 1e-12, "drift {}", drift(&still));
}

/// Everything at once, violently: columns run dry, spray flies.
fn storm() -> Water {
    let drop = Drop { time_s: 0.2, position_m: Vec2::new(0.4, -0.3), radius_m: 0.2, fall_height_m: 4.0 };
    let object = MovingObject {
        radius_m: 0.4,
        draft_m: 0.3,
        lowering_s: 0.1,
        path: ObjectPath::Circle { center_m: Vec2::ZERO, radius_m: 0.8, period_s: 2.0, start_deg: 0.0 },
        ..MovingObject::default()
    };
    basin(
        Vec2::new(3.0, 2.0),
        (48, 32),
        FluidSettings {
            depth_m: 0.15,
            drops: vec![drop],
            rain: Some(Rain { rate_per_s: 5.0, ..Rain::default() }),
            objects: vec![object],
            spray: Some(SpraySettings { threshold_m_per_s: 0.3, ..SpraySettings::default() }),
            ..FluidSettings::default()
        },
    )
}

#[test]
fn volume_is_conserved_in_a_storm_and_no_column_is_overdrawn() {
    let mut fluid = fluid(&storm());
    let (mut driest, mut most_spray) = (f64::INFINITY, 0);
    for _ in 0..2000 {
        let dt = fluid.step_s();
        fluid.advance(dt);
        let lowest = fluid.cell_heights_m().into_iter().fold(f64::INFINITY, f64::min);
        driest = driest.min(lowest + f64::from(0.15_f32));
        most_spray = most_spray.max(fluid.spray().len());
        assert!(drift(&fluid).abs() < 1e-12, "drift {} at {} s", drift(&fluid), fluid.time_s());
    }
    assert!(most_spray > 50, "only {most_spray} particles");
    assert!(driest < 1e-6, "no column ran dry: the limit was not tested ({driest} m)");
    assert!(driest > -1e-12, "a column was overdrawn to {driest} m");
    assert!(fluid.added_volume_m3() > 0.0);
}

#[test]
fn spray_returns_to_the_surface() {
    let mut water = storm();
    let WaterModel::PipeFluid(settings) = &mut water.model else { unreachable!("the water is a fluid") };
    (settings.rain, settings.objects) = (None, Vec::new());
    settings.damping_per_s = 2.0;
    let mut fluid = fluid(&water);
    fluid.advance_to(0.6);
    assert!(!fluid.spray().is_empty());
    assert!(fluid.spray().iter().all(|p| p.volume_m3 > 0.0 && p.position_m.abs().cmple(glam::DVec2::new(1.5, 1.0)).all()));
    fluid.advance_to(20.0);
    assert!(fluid.spray().is_empty(), "{} particles never landed", fluid.spray().len());
    assert!(drift(&fluid).abs() < 1e-12);
}

#[test]
fn drop_adds_exactly_its_volume_and_pushes_down_first() {
    let drop = Drop { time_s: 0.1, position_m: Vec2::ZERO, radius_m: 0.1, fall_height_m: 1.0 };
    let water = basin(Vec2::splat(4.0), (64, 64), FluidSettings { drops: vec![drop], ..FluidSettings::default() });
    let mut fluid = fluid(&water);
    let dt = fluid.step_s();
    fluid.advance_to(0.1 - dt);
    assert_eq!(fluid.added_volume_m3(), 0.0);
    let mut lowest = f64::INFINITY;
    while fluid.time_s() < 0.2 {
        fluid.advance(dt);
        lowest = lowest.min(fluid.cell_heights_m()[32 * 64 + 32]);
    }
    assert!(lowest < -0.02, "no crater: {lowest} m");
    fluid.advance_to(3.0);
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
    assert!((fluid.added_volume_m3() / sphere - 1.0).abs() < 1e-6);
}

#[test]
fn drop_of_any_brevity_gives_the_same_impulse() {
    // Small drops sink in within less than a step; their share of the steps still sums to one.
    for radius in [1e-3_f32, 0.01, 0.3] {
        let drop = forces::ActiveDrop::new(0.123_456, glam::DVec2::ZERO, radius, 0.7);
        let dt = 0.017;
        let total: f64 = (0..2000).map(|i| drop.share(f64::from(i) * dt, f64::from(i + 1) * dt)).sum();
        assert!((total - 1.0).abs() < 1e-9, "radius {radius}: {total}");
    }
}

#[test]
fn waves_stay_symmetric_about_a_drop_in_the_middle() {
    let drop = Drop { radius_m: 0.15, ..Drop::default() };
    let water = basin(Vec2::splat(4.0), (64, 64), FluidSettings { drops: vec![drop], ..FluidSettings::default() });
    let mut fluid = fluid(&water);
    fluid.advance_to(2.5);
    let heights = fluid.cell_heights_m();
    for row in 0..64 {
        for column in 0..64 {
            let h = heights[row * 64 + column];
            for other in [heights[row * 64 + 63 - column], heights[(63 - row) * 64 + column], heights[column * 64 + row]] {
                assert!((h - other).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn water_at_rest_takes_the_shape_of_a_body() {
    let object = MovingObject { shape: ObjectShape::Sphere, radius_m: 0.6, draft_m: 0.1, ..MovingObject::default() };
    let settings = FluidSettings { damping_per_s: 4.0, objects: vec![object.clone()], ..FluidSettings::default() };
    let mut fluid = fluid(&basin(Vec2::splat(4.0), (64, 64), settings));
    fluid.advance_to(30.0);
    let heights = fluid.cell_heights_m();
    let at = |x: f64, z: f64| heights[((z + 2.0) / 0.0625) as usize * 64 + ((x + 2.0) / 0.0625) as usize];
    // The displaced water raises the rest; against that level the dip is the body.
    let level = at(-1.9, -1.9);
    assert!(level > 0.0);
    for x in [0.03125, 0.15625, 0.28125] {
        let r = (x * x + 0.03125 * 0.03125_f64).sqrt();
        let expected = object.underside(r, 0.1_f32.into(), 0.0625);
        assert!((level - at(x, 0.03125) - expected).abs() < 1e-4, "at {x}: {} instead of {expected}", level - at(x, 0.03125));
    }
}

#[test]
fn object_paths() {
    let keys = ObjectPath::Keys(vec![(1.0, Vec2::new(0.0, 0.0)), (3.0, Vec2::new(4.0, 2.0)), (4.0, Vec2::new(4.0, 0.0))]);
    for (time, x, z) in [(0.0, 0.0, 0.0), (2.0, 2.0, 1.0), (3.5, 4.0, 1.0), (9.0, 4.0, 0.0)] {
        assert_eq!(keys.at(time), glam::DVec2::new(x, z));
    }
    let circle = ObjectPath::Circle { center_m: Vec2::ONE, radius_m: 2.0, period_s: 4.0, start_deg: 0.0 };
    assert!((circle.at(1.0) - glam::DVec2::new(1.0, 3.0)).length() < 1e-12);
}

#[test]
fn surface_is_the_mean_of_four_columns() {
    let water = storm();
    let mut fluid = fluid(&water);
    fluid.advance_to(1.234);
    let cells = fluid.cell_heights_m();
    let field = fluid.sample(&water.layout(49, 33));
    for row in 1..32_usize {
        for column in 1..48_usize {
            let corner = (row - 1) * 48 + column - 1;
            let mean = 0.25 * (cells[corner] + cells[corner + 1] + cells[corner + 48] + cells[corner + 49]);
            assert!((f64::from(field.heights_ws[row * 49 + column]) - mean).abs() < 1e-6);
        }
    }
}

#[test]
fn normals_match_finite_differences() {
    let drop = Drop { radius_m: 0.15, ..Drop::default() };
    let water = basin(Vec2::new(4.0, 3.0), (32, 24), FluidSettings { drops: vec![drop], ..FluidSettings::default() });
    let mut fluid = fluid(&water);
    fluid.advance_to(1.3);
    // Sixteen vertices per column: the slope of the spline is continuous, so that differences converge to it.
    let fine = fluid.sample(&water.layout(32 * 16 + 1, 24 * 16 + 1));
    let steepest = fine.normals_ws.iter().map(|n| n.x.abs()).fold(0.0, f32::max);
    assert!(steepest > 0.03, "too calm for a test: {steepest}");
    let differences = HeightField::from_heights(fine.columns, fine.rows, fine.origin_ws, fine.spacing_m, fine.heights_ws.clone()).unwrap();
    let mut worst: f32 = 0.0;
    for row in 1..fine.rows - 1 {
        for column in 1..fine.columns - 1 {
            let i = fine.index(column, row);
            worst = worst.max((fine.normals_ws[i] - differences.normals_ws[i]).length());
        }
    }
    assert!(worst < 0.05 * steepest, "normals differ by {worst}, slopes reach {steepest}");
}

#[test]
fn water_volume_is_that_under_the_surface() {
    // The spline's weights sum to one over the mirrored columns, so a fine sampling integrates to the volume.
    let drop = Drop { radius_m: 0.15, position_m: Vec2::new(1.9, -1.4), ..Drop::default() };
    let water = basin(Vec2::new(4.0, 3.0), (32, 24), FluidSettings { drops: vec![drop], ..FluidSettings::default() });
    let mut fluid = fluid(&water);
    fluid.advance_to(1.3);
    let fine = fluid.sample(&water.layout(32 * 8 + 1, 24 * 8 + 1));
    let mut sum = 0.0;
    for row in 0..fine.rows {
        for column in 0..fine.columns {
            let edge = |i: u32, count: u32| if i == 0 || i + 1 == count { 0.5 } else { 1.0 };
            let height = f64::from(fine.heights_ws[fine.index(column, row)]) + 0.25;
            sum += height * edge(column, fine.columns) * edge(row, fine.rows);
        }
    }
    let volume = sum * f64::from(fine.spacing_m.x) * f64::from(fine.spacing_m.y);
    assert!((volume / fluid.volume_m3() - 1.0).abs() < 1e-5, "{volume} m³ under the surface, {} m³ of water", fluid.volume_m3());
}

#[test]
fn surface_between_steps_moves_continuously() {
    let mut fluid = fluid(&storm());
    let dt = fluid.step_s();
    let at = |fluid: &mut PipeFluid, time: f64| {
        fluid.advance_to(time);
        fluid.cell_heights_m()
    };
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let edge = 100.0 * dt;
    let (before, on, after) = (at(&mut fluid, edge - 1e-9), at(&mut fluid, edge), at(&mut fluid, edge + 1e-9));
    assert!(far(&before, &on) < 1e-6 && far(&on, &after) < 1e-6);
    let (start, middle) = (at(&mut fluid, edge), at(&mut fluid, edge + 0.5 * dt));
    let end = at(&mut fluid, edge + dt);
    let mean: Vec<f64> = start.iter().zip(&end).map(|(a, b)| 0.5 * (a + b)).collect();
    assert!(far(&middle, &mean) < 1e-9);
}

#[test]
fn time_alone_decides_the_state() {
    let water = storm();
    let mut straight = fluid(&water);
    straight.advance_to(2.0);
    let mut wandering = fluid(&water);
    for time in [0.3, 1.1, 3.0, 0.2, 1.9999, 2.0] {
        wandering.advance_to(time);
    }
    assert_eq!(straight.cell_heights_m(), wandering.cell_heights_m());
    assert_eq!(straight.spray(), wandering.spray());
    assert_eq!(straight.added_volume_m3(), wandering.added_volume_m3());
    wandering.advance(-2.0);
    assert_eq!((wandering.step_count(), wandering.time_s()), (0, 0.0));
}

#[test]
fn state_does_not_depend_on_the_number_of_threads() {
    // Large enough for several tasks, the last of them smaller.
    let WaterModel::PipeFluid(settings) = storm().model else { unreachable!("the storm is a fluid") };
    let water = basin(Vec2::new(3.0, 2.0), (151, 103), settings);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut fluid = fluid(&water);
            fluid.advance_to(0.7);
            (fluid.cell_heights_m(), fluid.spray().to_vec())
        })
    };
    let expected = on(1);
    assert!(!expected.1.is_empty());
    assert_eq!(on(3), expected);
}

#[test]
fn times_outside_the_range_are_brought_into_it() {
    let water = basin(Vec2::splat(1e5), (4, 4), FluidSettings::default());
    let mut fluid = fluid(&water);
    for (time, expected) in [(-1.0, 0.0), (f64::NAN, 0.0), (1e30, 3600.0)] {
        fluid.advance_to(time);
        assert_eq!(fluid.time_s(), expected);
    }
}

#[test]
#[ignore = "a measurement: run in release with --nocapture"]
fn step_cost() {
    for side in [64, 128] {
        let settings = FluidSettings { rain: Some(Rain::default()), ..FluidSettings::default() };
        let water = basin(Vec2::splat(10.0), (side, side), settings);
        let mut fluid = fluid(&water);
        let start = std::time::Instant::now();
        fluid.advance_to(20.0);
        let per_step = start.elapsed().as_secs_f64() * 1e3 / fluid.step_count() as f64;
        let start = std::time::Instant::now();
        for _ in 0..100 {
            std::hint::black_box(fluid.sample(&water.layout(side, side)));
        }
        let per_surface = start.elapsed().as_secs_f64() * 10.0;
        for time in [0.5, 1.0, 3.0, 20.0, 60.0] {
            fluid.advance_to(time);
            let field = fluid.sample(&water.layout(side, side));
            println!(
                "{time} s: heights {:?}, slope {}",
                field.height_range_ws(),
                field.normals_ws.iter().map(|n| n.x.abs()).fold(0.0, f32::max)
            );
        }
        println!("{side}x{side}: {per_step:.4} ms per step of {:.4} s, {per_surface:.3} ms per surface", fluid.step_s());
    }
}
