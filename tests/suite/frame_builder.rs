//! The frame that techniques share: what contributions do to the picture and to the layers, and the loop over lights.

use std::sync::Arc;

use nephroid::caustics::builder::{Contributions, FrameBuilder, FrameLight, ViewOptions, cut_level};
use nephroid::caustics::{LayerSource, Receivers, RenderError, TechniqueFrame};
use nephroid::frame::{CpuExecutor, Executor, Frame, FrameError, FrameOutput, TextureId};
use nephroid::passes::geometry_buffer::ReceiverVertex;
use nephroid::pipeline::state::TextureFormat;
use nephroid::pipeline::{Device, DeviceOptions, TextureDescriptor};
use nephroid::scene::water::HeightField;
use nephroid::scene::{EyeRefraction, Scene};

use crate::support::{scene_of_size, with_coarse_parts};

fn executor() -> CpuExecutor {
    CpuExecutor::new(Device::new(DeviceOptions::default()).expect("threads start"), 1 << 30)
}

const VIEW: ViewOptions = ViewOptions {
    eye_refraction: EyeRefraction::Snell,
    samples: 1,
    surface_shadows: true,
    underwater_shadows: true,
    shadow_map_size: 64,
    stencil: false,
};

/// Surroundings of the eye: dry, above water, under water.
fn scenes() -> [(&'static str, Scene); 3] {
    let small = |name| with_coarse_parts(scene_of_size(name, (48, 32)));
    let mut dry = small("pool.ron");
    dry.water = None;
    [("dry", dry), ("above water", small("pool.ron")), ("under water", small("columns.ron"))]
}

fn surface(scene: &Scene) -> Option<HeightField> {
    scene.water.as_ref().map(|water| water.simulator().surface_with_grid(17, 17, scene.time_s))
}

/// A texture of the builder's size with one value in all texels.
fn constant(builder: &mut FrameBuilder<'_>, label: &str, value: [f32; 3]) -> TextureId {
    let (width, height) = builder.size;
    let texel: Vec<u8> = value.into_iter().chain([1.0]).flat_map(f32::to_le_bytes).collect();
    let bytes: Arc<[u8]> = texel.repeat((width * height) as usize).into();
    builder.frame.texture_with(TextureDescriptor::d2(label, width, height, TextureFormat::Rgba32Float), vec![bytes])
}

/// A frame of all lights with constant contributions.
fn build(scene: &Scene, irradiance: [f32; 3], in_scattered: Option<[f32; 3]>) -> TechniqueFrame {
    let receivers = Receivers::new(scene, cut_level(scene, VIEW.eye_refraction)).expect("the scene's meshes");
    let water = surface(scene);
    let mut builder = FrameBuilder::new(scene, &receivers, water.as_ref(), &VIEW);
    builder.lights(|_, _| Ok(())).expect("no pass is added");
    let irradiance = constant(&mut builder, "constant irradiance", irradiance);
    let in_scattered = in_scattered.map(|radiance| constant(&mut builder, "constant radiance", radiance));
    builder.finish(Contributions { in_scattered, ..Contributions::new(irradiance) })
}

fn layer<'a>(built: &'a TechniqueFrame, name: &str) -> Option<&'a LayerSource> {
    built.layers.iter().find(|layer| layer.name == name)
}

/// All texels of a layer's texture, margin included.
fn texels(built: &TechniqueFrame, output: &FrameOutput<'_>, name: &str) -> Vec<[f32; 4]> {
    let source = layer(built, name).unwrap_or_else(|| panic!("there is a layer `{name}`"));
    let surface = output.texture(source.texture).surface(0, 0);
    let texel = |i: u32| [0, 1, 2, 3].map(|c| surface.get(i % surface.width, i / surface.width, c));
    (0..surface.width * surface.height).map(texel).collect()
}

fn pass_labels(frame: &Frame) -> Vec<&str> {
    frame.passes.iter().map(|pass| pass.label.as_str()).collect()
}

#[test]
fn in_scattered_radiance_adds_to_the_picture_exactly() {
    let radiance = [0.25, 3.0, 0.1];
    let mut executor = executor();
    for (what, scene) in scenes() {
        let without = build(&scene, [1.0; 3], None);
        let with = build(&scene, [1.0; 3], Some(radiance));
        let plain = texels(&without, &executor.run(&without.frame, None).expect("the frame runs"), "color");
        let output = executor.run(&with.frame, None).expect("the frame runs");
        let lit = texels(&with, &output, "color");
        // The sum of two floats, rounded once; alpha is as it was.
        let expected: Vec<[f32; 4]> = plain.iter().map(|p| [p[0] + radiance[0], p[1] + radiance[1], p[2] + radiance[2], p[3]]).collect();
        assert!(lit == expected, "{what}: the picture did not grow by the radiance");
        assert!(plain.iter().any(|p| *p != plain[0]), "{what}: an even picture proves little");
        // A thousandth more radiance would be noticed.
        let more = radiance[2] * 1.001;
        assert!(plain.iter().zip(&lit).any(|(p, l)| p[2] + more != l[2]), "{what}: the comparison cannot fail");
        // Surfaces are lit as before, and the radiance is a layer of its own.
        assert!(texels(&with, &output, "godrays").iter().all(|texel| texel[..3] == radiance), "{what}");
        let shaded = |built: &TechniqueFrame| built.frame.texture_named("radiance").expect("the pass `shade` has a target");
        let after = output.texture(shaded(&with)).read_bytes(0, 0);
        let output = executor.run(&without.frame, None).expect("the frame runs");
        assert!(output.texture(shaded(&without)).read_bytes(0, 0) == after, "{what}: the radiance of surfaces changed");
    }
}

#[test]
fn without_in_scattered_radiance_there_is_no_layer_and_no_draw_for_it() {
    for (what, scene) in scenes() {
        let without = build(&scene, [0.0; 3], None);
        let with = build(&scene, [0.0; 3], Some([0.0; 3]));
        assert!(layer(&without, "godrays").is_none() && layer(&with, "godrays").is_some(), "{what}");
        assert_eq!(pass_labels(&without.frame), pass_labels(&with.frame), "{what}");
        let draws = |built: &TechniqueFrame| built.frame.passes.last().expect("the picture").draws.len();
        assert_eq!(draws(&without), if scene.water.is_some() { 2 } else { 1 }, "{what}");
        assert_eq!(draws(&with), draws(&without) + 1, "{what}");
    }
}

#[test]
fn irradiance_adds_albedo_over_pi_times_itself_to_the_radiance_of_receivers() {
    let irradiance = [2.0, 1.0, 0.5];
    let mut executor = executor();
    let (_, dry) = &scenes()[0];
    let radiance = |executor: &mut CpuExecutor, irradiance| {
        let built = build(dry, irradiance, None);
        let output = executor.run(&built.frame, None).expect("the frame runs");
        let shaded = texels(&built, &output, "color");
        (shaded, texels(&built, &output, "albedo"), texels(&built, &output, "position"))
    };
    let (dark, albedo, position) = radiance(&mut executor, [0.0; 3]);
    let (lit, ..) = radiance(&mut executor, irradiance);
    let mut diffuse = 0;
    for (k, position) in position.iter().enumerate() {
        if position[3] != 1.0 {
            assert_eq!(lit[k], dark[k], "only diffuse receivers take irradiance");
            continue;
        }
        diffuse += 1;
        for c in 0..3 {
            let expected = f64::from(dark[k][c]) + f64::from(albedo[k][c]) * f64::from(irradiance[c]) * std::f64::consts::FRAC_1_PI;
            assert!((f64::from(lit[k][c]) - expected).abs() <= 1.0e-6 * expected.max(1.0), "{} in place of {expected}", lit[k][c]);
        }
    }
    assert!(diffuse > 100, "{diffuse} samples show a diffuse receiver");
}

#[test]
fn lights_come_in_order_each_after_its_own_passes_and_errors_end_the_loop() {
    let (_, mut scene) = scenes()[1].clone();
    scene.lights = vec![scene.lights[0]; 2];
    let receivers = Receivers::new(&scene, None).expect("the scene's meshes");
    let water = surface(&scene);
    let mut builder = FrameBuilder::new(&scene, &receivers, water.as_ref(), &VIEW);
    let mut seen = Vec::new();
    let mut record = |builder: &mut FrameBuilder<'_>, light: &FrameLight| {
        let last = builder.frame.passes.last().expect("the light's own passes").label.clone();
        seen.push((light.number, light.is_first(), last));
        Ok(())
    };
    builder.lights(&mut record).expect("no pass is added");
    assert_eq!(seen, [(0, true, "light 0".to_owned()), (1, false, "light 1".to_owned())]);

    let mut calls = 0;
    let failed = builder.lights(|_, light| {
        calls += 1;
        Err(RenderError::Frame(FrameError::Backend(format!("light {}", light.number))))
    });
    assert!(matches!(failed, Err(RenderError::Frame(FrameError::Backend(of))) if of == "light 0"));
    assert_eq!(calls, 1);
}

#[test]
fn receivers_are_cut_at_the_water_and_keep_their_area() {
    let (_, scene) = &scenes()[1];
    let level = cut_level(scene, VIEW.eye_refraction).expect("the eye looks through water");
    let [whole, cut] = [None, Some(level)].map(|cut| Receivers::new(scene, cut).expect("the scene's meshes"));
    let crossing = |receivers: &Receivers| {
        let crosses =
            |t: [u32; 3]| receivers.mesh.corners(t).iter().any(|p| p.y > level) && receivers.mesh.corners(t).iter().any(|p| p.y < level);
        receivers.mesh.triangles().filter(|&t| crosses(t)).count()
    };
    assert!(crossing(&whole) > 0, "nothing is cut");
    assert_eq!(crossing(&cut), 0);
    let area = |receivers: &Receivers| {
        let of = |t: [u32; 3]| {
            let [a, b, c] = receivers.mesh.corners(t).map(|p| p.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        };
        receivers.mesh.triangles().map(of).sum::<f64>()
    };
    assert!((area(&cut) / area(&whole) - 1.0).abs() < 1.0e-6, "{} in place of {}", area(&cut), area(&whole));
    for receivers in [&whole, &cut] {
        // Groups and buffers are of the same mesh.
        let last = receivers.groups.last().expect("an object");
        assert_eq!(last.indices.end as usize, receivers.mesh.indices.len());
        assert_eq!(receivers.triangles as usize, receivers.mesh.triangle_count());
        assert_eq!(receivers.vertices.len(), receivers.mesh.vertex_count() * size_of::<ReceiverVertex>());
        assert_eq!(receivers.indices.len(), receivers.mesh.indices.len() * size_of::<u32>());
    }
}
