//! Formulas, files, validation, and that all ways to a surface agree.

use glam::{Vec2, Vec3};

use super::*;

fn water(model: WaterModel) -> Water {
    let water = Water { size_m: Vec2::new(4.0, 3.0), center_m: Vec2::new(0.5, -0.25), level_m: 1.5, model, ..Water::default() };
    assert_eq!(water.validate(), Ok(()));
    water
}

/// One of every model, moving where it can.
fn models() -> Vec<WaterModel> {
    let waves = vec![
        PlaneWave { direction_deg: 25.0, ..PlaneWave::default() },
        PlaneWave { amplitude_m: 0.01, wavelength_m: 0.4, direction_deg: -100.0, phase_rad: 1.0, motion: Motion::Depth(0.2) },
    ];
    vec![
        WaterModel::Flat,
        WaterModel::Waves(waves),
        WaterModel::CircularCosine(CircularCosine { core_m: 0.2, ..CircularCosine::default() }),
        WaterModel::AxisCosine(AxisCosine { axis: Axis::Z, ..AxisCosine::default() }),
        WaterModel::PipeFluid(FluidSettings { rain: Some(Rain::default()), ..FluidSettings::default() }),
        WaterModel::FftOcean(OceanSettings { resolution: 64, ..OceanSettings::default() }),
    ]
}

#[test]
fn flat_water_is_level() {
    let field = water(WaterModel::Flat).surface(7.0);
    assert_eq!((field.columns, field.rows), (64, 64));
    assert!(field.heights_ws.iter().all(|h| *h == 1.5));
    assert!(field.normals_ws.iter().all(|n| *n == Vec3::Y));
    assert_eq!(field.position_ws(0, 0), Vec3::new(-1.5, 1.5, -1.75));
    assert!((field.position_ws(63, 63) - Vec3::new(2.5, 1.5, 1.25)).length() < 1e-6);
}

#[test]
fn sine_water_is_a_cos_kx() {
    // T4's surface: a = 0.02 m, k = 2π/m.
    let wave = PlaneWave { motion: Motion::Steady, ..PlaneWave::default() };
    let water = Water { level_m: 0.0, ..water(WaterModel::Waves(vec![wave])) };
    for i in 0..2000 {
        let x = i as f32 * 0.013 - 11.0;
        let (height, normal) = water.height_normal(x, 0.3, 42.0).unwrap();
        let k = std::f64::consts::TAU;
        let (s, c) = libm::sincos(k * f64::from(x));
        assert!((f64::from(height) - 0.02 * c).abs() < 1e-8);
        let expected = normal_from_slope(Vec2::new((-0.02 * k * s) as f32, 0.0));
        assert!((normal - expected).length() < 3e-7);
        // Steady along z and in time.
        assert_eq!(water.height_normal(x, -5.0, 0.0), Some((height, normal)));
    }
    // Curvature at the crest, −a·k², gives the focus n/((n − 1)·a·k²) = 5.0699 m.
    let h = 1e-2_f32;
    let y = |x| f64::from(water.height_normal(x, 0.0, 0.0).unwrap().0);
    let curvature = (y(h) - 2.0 * y(0.0) + y(-h)) / f64::from(h * h);
    assert!((-1.333 / (0.333 * curvature) - 5.0699).abs() < 0.02);
}

#[test]
fn waves_travel_along_their_direction_at_their_speed() {
    let wave = PlaneWave { direction_deg: 90.0, motion: Motion::Speed(0.5), ..PlaneWave::default() };
    let water = water(WaterModel::Waves(vec![wave]));
    let at = |x, z, t| water.height_normal(x, z, t).unwrap().0;
    assert_eq!(at(0.0, 0.0, 0.0), 1.52);
    for t in [0.3, 2.0, 5.7] {
        assert!((at(3.0, 0.5 * t, t) - 1.52).abs() < 1e-6, "the crest is not where it should be at {t} s");
    }
    assert!((Motion::DeepWater.angular_frequency(2.0) - (GRAVITY_M_PER_S2 * 2.0_f64).sqrt()).abs() < 1e-12);
    assert!((Motion::Depth(1e3).angular_frequency(2.0) - Motion::DeepWater.angular_frequency(2.0)).abs() < 1e-12);
    let shallow = Motion::Depth(0.01).angular_frequency(0.1) / (GRAVITY_M_PER_S2 * f64::from(0.01_f32)).sqrt();
    assert!((shallow - 0.1).abs() < 1e-6);
}

#[test]
fn circular_cosine_is_round_and_axis_cosine_straight() {
    let silent = Ripples { amplitude_m: 0.0, ..Ripples::default() };
    let center_m = Vec2::new(0.3, 0.1);
    let rings = CircularCosine { center_m, scale: 2.0, ripples: silent, motion: Motion::Steady, ..CircularCosine::default() };
    let round = water(WaterModel::CircularCosine(rings));
    for angle in 0..36 {
        let (s, c) = nephroid_math::space::sin_cos_deg(angle as f32 * 10.0);
        let (height, normal) = round.height_normal(0.3 + 0.7 * c as f32, 0.1 + 0.7 * s as f32, 0.0).unwrap();
        assert!((f64::from(height) - 1.5 - 0.08 * libm::cos(std::f64::consts::TAU * 0.7)).abs() < 1e-6);
        assert!((normal.x * s as f32 - normal.z * c as f32).abs() < 1e-6, "the slope is not radial");
    }
    assert_eq!(round.height_normal(0.3, 0.1, 0.0), Some((1.58, Vec3::Y)));

    let axis = AxisCosine { axis: Axis::Z, ripples: silent, motion: Motion::Steady, ..AxisCosine::default() };
    let straight = water(WaterModel::AxisCosine(axis));
    assert_eq!(straight.height_normal(-9.0, 0.25, 0.0), straight.height_normal(9.0, 0.25, 3.0));
    assert!((straight.height_normal(0.0, 2.0, 0.0).unwrap().0 - 1.54).abs() < 1e-6);
}

#[test]
fn scale_of_the_papers_models_scales_everything() {
    let base = water(WaterModel::AxisCosine(AxisCosine::default()));
    let triple = water(WaterModel::AxisCosine(AxisCosine { scale: 3.0, ..AxisCosine::default() }));
    for i in 0..100 {
        let (x, z) = (i as f32 * 0.037, i as f32 * -0.021);
        let (a, b) = (base.height_normal(x, z, 1.0).unwrap().0 - 1.5, triple.height_normal(x, z, 1.0).unwrap().0 - 1.5);
        assert!((3.0 * a - b).abs() < 1e-5);
    }
}

#[test]
fn noise_moves_the_surface() {
    let ripples = Ripples { amplitude_m: 0.05, ..Ripples::default() };
    let model = |seed| {
        WaterModel::CircularCosine(CircularCosine { amplitude_m: 0.0, ripples: Ripples { seed, ..ripples }, ..CircularCosine::default() })
    };
    let (one, two) = (water(model(1)).surface(0.4), water(model(2)).surface(0.4));
    let (low, high) = one.height_range_ws();
    assert!(high - low > 0.03 && high < 1.56 && low > 1.44);
    assert_ne!(one.heights_ws, two.heights_ws);
    assert_ne!(one.heights_ws, water(model(1)).surface(0.6).heights_ws);
}

#[test]
fn normals_of_formulas_match_finite_differences() {
    for model in models() {
        let water = water(model);
        let Some(formula) = water.formula(1.7) else { continue };
        for i in 0..400 {
            let (x, z) = (-1.4 + (i % 20) as f32 * 0.19, -1.6 + (i / 20) as f32 * 0.13);
            let step = 2e-3;
            let h = |x, z| f64::from(formula.height_and_slope(x, z).0);
            let difference = Vec2::new(
                ((h(x + step, z) - h(x - step, z)) / f64::from((x + step) - (x - step))) as f32,
                ((h(x, z + step) - h(x, z - step)) / f64::from((z + step) - (z - step))) as f32,
            );
            let (_, slope) = formula.height_and_slope(x, z);
            assert!((slope - difference).length() < 2e-3, "{:?} at ({x}, {z}): {slope}, differences {difference}", water.model);
        }
    }
}

#[test]
fn grid_and_formula_agree_to_the_bit() {
    for model in models() {
        let water = water(model);
        let field = water.surface_with_grid(17, 9, 0.8);
        for row in 0..9 {
            for column in 0..17 {
                let p = field.position_ws(column, row);
                if let Some((height, normal)) = water.height_normal(p.x, p.z, 0.8) {
                    assert_eq!((p.y, field.normals_ws[field.index(column, row)]), (height, normal));
                }
            }
        }
    }
}

#[test]
fn every_model_gives_a_sound_field() {
    for model in models() {
        let water = water(model);
        let field = water.surface_with_grid(30, 20, 2.2);
        assert_eq!((field.heights_ws.len(), field.normals_ws.len()), (600, 600));
        for (h, n) in field.heights_ws.iter().zip(&field.normals_ws) {
            assert!((h - 1.5).abs() < 0.5, "{:?}: height {h}", water.model);
            assert!((n.length() - 1.0).abs() < 1e-5 && n.y > 0.0, "{:?}: normal {n}", water.model);
        }
        assert_eq!(water.height_normal(0.0, 0.0, 0.0).is_some(), water.formula(0.0).is_some());
    }
}

#[test]
fn simulator_and_surface_agree_to_the_bit_in_any_order() {
    for model in models() {
        let water = water(model);
        let mut sim = water.simulator();
        for time in [0.0, 0.5, 0.52, 1.4, 0.3, 1.4, 0.0] {
            assert_eq!(sim.surface_at(time), water.surface(time), "{:?} at {time} s", water.model);
        }
        assert!(sim.spray().is_empty());
    }
}

#[test]
fn surfaces_move_continuously() {
    for model in models() {
        let water = water(model);
        let mut sim = water.simulator();
        let mut before = sim.surface_at(1.0);
        for i in 1..=50 {
            let now = sim.surface_at(1.0 + i as f32 * 1e-3);
            for (a, b) in before.heights_ws.iter().zip(&now.heights_ws) {
                // A millisecond at 3 m/s, which nothing here exceeds.
                assert!((a - b).abs() < 3e-3, "{:?}: {a} then {b}", water.model);
            }
            before = now;
        }
    }
}

#[test]
fn late_times_and_far_places_lose_no_accuracy() {
    let wave = PlaneWave { motion: Motion::Speed(1.0), wavelength_m: 1.0, ..PlaneWave::default() };
    let water = Water { level_m: 0.0, ..water(WaterModel::Waves(vec![wave])) };
    for t in [65_536.0, 1_048_576.0] {
        for i in 0..8 {
            let x = i as f32 / 8.0;
            let near = water.height_normal(x, 0.0, 0.0).unwrap().0;
            assert!((water.height_normal(x, 0.0, t).unwrap().0 - near).abs() < 1e-8);
            assert!((water.height_normal(x + t, 0.0, 0.0).unwrap().0 - near).abs() < 1e-8);
        }
    }
}

#[test]
fn descriptions_survive_a_file() {
    for model in models() {
        let water = water(model);
        let text = ron::to_string(&water).unwrap();
        assert_eq!(ron::from_str::<Water>(&text).unwrap(), water, "{text}");
    }
}

#[test]
fn descriptions_read_as_documented() {
    let text = "(
        center_m: (1, 2), size_m: (8, 6.5), level_m: -0.5, ior: 1.31, grid: (128, 96),
        model: PipeFluid((
            cells: Some((96, 64)), depth_m: 0.3,
            initial: Cosine(half_waves: (2, 0), amplitude_m: 0.05),
            drops: [(time_s: 0.5, position_m: (1, 2), radius_m: 0.1), ()],
            rain: Some((rate_per_s: 3)),
            objects: [(shape: Cylinder, path: Circle(center_m: (1, 2), radius_m: 1, period_s: 5, start_deg: 0)), (path: Keys([(0, (0, 0)), (2, (1, 1))]))],
            spray: Some((threshold_m_per_s: 1.5)),
        )),
    )";
    let water: Water = ron::from_str(text).unwrap();
    assert_eq!(water.validate(), Ok(()));
    assert_eq!((water.grid, water.ior), ((128, 96), 1.31));
    let WaterModel::PipeFluid(fluid) = water.model else { panic!("not a fluid") };
    assert_eq!(fluid.drops[1], Drop::default());
    assert_eq!(fluid.damping_per_s, FluidSettings::default().damping_per_s);

    let text = "(model: FftOcean((spectrum: Jonswap(fetch_m: 2000), wind_direction_deg: 45)))";
    let water: Water = ron::from_str(text).unwrap();
    let WaterModel::FftOcean(sea) = water.model else { panic!("not a sea") };
    assert_eq!(sea.spectrum, Spectrum::Jonswap { fetch_m: 2000.0, gamma: 3.3 });
    let water: Water = ron::from_str("(model: Waves([(wavelength_m: 2, motion: Speed(0.1)), (motion: Steady)]))").unwrap();
    assert_eq!(water.validate(), Ok(()));
    assert_eq!(ron::from_str::<Water>("()").unwrap(), Water::default());
}

#[test]
fn unknown_fields_are_errors() {
    for text in [
        "(depth: 1)",
        "(model: Waves([(amplitude: 1)]))",
        "(model: CircularCosine((ripples: (size: 1))))",
        "(model: AxisCosine((axis: Y)))",
        "(model: PipeFluid((drop: [])))",
        "(model: PipeFluid((drops: [(mass: 1)])))",
        "(model: PipeFluid((initial: Hump(center_m: (0, 0), radius_m: 1, height_m: 1, x: 1))))",
        "(model: PipeFluid((objects: [(path: Circle(center_m: (0, 0), radius_m: 1, period_s: 1, start_deg: 0, x: 0))])))",
        "(model: FftOcean((spectrum: Phillips(beta: 1))))",
        "(model: Lake)",
    ] {
        assert!(ron::from_str::<Water>(text).is_err(), "{text}");
    }
}

#[test]
fn validation_names_field_value_and_range() {
    let error = Water { ior: 7.5, ..Water::default() }.validate().unwrap_err();
    assert_eq!(error.to_string(), "water: ior is 7.5; allowed: 0.25 ..= 4");
    let cases = [
        ("(center_m: (0, 1e9))", "center_m"),
        ("(size_m: (0, 1))", "size_m"),
        ("(size_m: (NaN, 1))", "size_m"),
        ("(level_m: inf)", "level_m"),
        ("(ior: NaN)", "ior"),
        ("(grid: (1, 64))", "grid"),
        ("(grid: (64, 4097))", "grid"),
        ("(model: Waves([(), (wavelength_m: 0)]))", "model.waves[1].wavelength_m"),
        ("(model: Waves([(amplitude_m: inf)]))", "model.waves[0].amplitude_m"),
        ("(model: Waves([(direction_deg: NaN)]))", "model.waves[0].direction_deg"),
        ("(model: Waves([(phase_rad: NaN)]))", "model.waves[0].phase_rad"),
        ("(model: Waves([(motion: Speed(1e9))]))", "model.waves[0].motion"),
        ("(model: Waves([(motion: Depth(0))]))", "model.waves[0].motion"),
        ("(model: CircularCosine((core_m: -1)))", "model.core_m"),
        ("(model: CircularCosine((scale: -1)))", "model.scale"),
        ("(model: CircularCosine((center_m: (0, NaN))))", "model.center_m"),
        ("(model: AxisCosine((wavelength_m: -1)))", "model.wavelength_m"),
        ("(model: AxisCosine((ripples: (octaves: 0))))", "model.ripples.octaves"),
        ("(model: AxisCosine((ripples: (feature_m: 0))))", "model.ripples.feature_m"),
        ("(model: PipeFluid((cells: Some((1, 8)))))", "model.cells"),
        ("(model: PipeFluid((cells: Some((8, 1000000)))))", "model.cells"),
        ("(model: PipeFluid((cells: Some((8, 64)))))", "model.cells: length over width of a column"),
        ("(model: PipeFluid((depth_m: 0)))", "model.depth_m"),
        ("(model: PipeFluid((damping_per_s: -1)))", "model.damping_per_s"),
        ("(model: PipeFluid((initial: Cosine(half_waves: (1, 0), amplitude_m: 0.3))))", "model.initial.amplitude_m"),
        ("(model: PipeFluid((initial: Hump(center_m: (0, 0), radius_m: 0, height_m: 1))))", "model.initial.radius_m"),
        ("(model: PipeFluid((drops: [(), (position_m: (6, 0))])))", "model.drops[1].position_m"),
        ("(model: PipeFluid((drops: [(fall_height_m: 0)])))", "model.drops[0].fall_height_m"),
        ("(model: PipeFluid((rain: Some((rate_per_s: 1e9)))))", "model.rain.rate_per_s"),
        ("(model: PipeFluid((objects: [(draft_m: 0.6)])))", "model.objects[0].draft_m"),
        ("(model: PipeFluid((objects: [(path: Keys([]))])))", "model.objects[0].path: the number of keys"),
        ("(model: PipeFluid((objects: [(path: Keys([(1, (0, 0)), (1, (0, 0))]))])))", "model.objects[0].path[1]"),
        ("(model: PipeFluid((spray: Some((jitter: 2)))))", "model.spray.jitter"),
        ("(model: FftOcean((resolution: 100)))", "model.resolution"),
        ("(model: FftOcean((resolution: 1073741824)))", "model.resolution"),
        ("(model: FftOcean((patch_m: 0)))", "model.patch_m"),
        ("(model: FftOcean((depth_m: Some(0))))", "model.depth_m"),
        ("(model: FftOcean((loop_s: Some(NaN))))", "model.loop_s"),
        ("(model: FftOcean((spectrum: Phillips(alpha: -1))))", "model.spectrum.alpha"),
        ("(model: FftOcean((spectrum: Jonswap(gamma: 0))))", "model.spectrum.gamma"),
    ];
    for (text, field) in cases {
        let water: Water = ron::from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let error = water.validate().expect_err(text);
        assert_eq!(error.field, field, "{text}: {error}");
    }
}

#[test]
fn times_are_validated() {
    let fluid = water(WaterModel::PipeFluid(FluidSettings::default()));
    assert!(fluid.validate_time(0.0).is_ok() && fluid.validate_time(60.0).is_ok());
    for time in [-1.0, f32::NAN, f32::INFINITY, 1e6] {
        assert_eq!(fluid.validate_time(time).unwrap_err().field, "time");
    }
    let flat = water(WaterModel::Flat);
    assert!(flat.validate_time(-1e6).is_ok() && flat.validate_time(f32::NAN).is_err());
    assert_eq!(flat.max_time_s(), None);
}

#[test]
fn bad_descriptions_do_not_panic() {
    let texts = [
        "(grid: (0, 0), size_m: (0, -1))",
        "(grid: (0, 0), size_m: (NaN, NaN), model: PipeFluid((depth_m: 0, cells: Some((0, 0)), rain: Some((rate_per_s: 5)))))",
        "(grid: (4, 4), model: PipeFluid((depth_m: NaN, objects: [(path: Keys([]))], drops: [(radius_m: 0, fall_height_m: 0)])))",
        "(grid: (4, 4), model: FftOcean((resolution: 0, patch_m: 0)))",
        "(grid: (4, 4), model: Waves([(wavelength_m: 0)]))",
    ];
    for text in texts {
        let water: Water = ron::from_str(text).unwrap();
        assert!(water.validate().is_err(), "{text}");
        let field = water.surface(0.01);
        assert_eq!(field.heights_ws.len(), (field.columns * field.rows) as usize);
    }
}

/// FNV-1a over the bits of all heights and normals.
fn hash(field: &HeightField) -> u64 {
    let normals = field.normals_ws.iter().flat_map(|n| n.to_array());
    let bytes = field.heights_ws.iter().copied().chain(normals).flat_map(|x| x.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn surfaces_have_the_same_bits_on_every_machine_and_build() {
    // A change here changes every picture of moving water: it belongs in the changelog.
    let expected: [u64; 6] = [
        0x5dff_4392_934c_1725,
        0x6341_7507_6613_08e2,
        0x1020_d739_4b84_ba70,
        0x6c92_ed13_53f2_1b62,
        0x7add_c199_da42_09ac,
        0x4089_ea73_fe05_3533,
    ];
    let got: Vec<u64> = models().into_iter().map(|model| hash(&water(model).surface_with_grid(40, 30, 1.25))).collect();
    assert_eq!(got, expected, "{got:#018x?}");
}
