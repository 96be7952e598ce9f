//! The passes that techniques share, and no shipped scene has yet, against their twins on every driver; a fault in each is noticed.

use std::sync::Arc;

use nephroid::frame::Frame;
use nephroid::gpu::crosscheck::{Mode, Report, crosscheck};
use nephroid::gpu::{Gpu, adapters};
use nephroid::passes::compose::LayerUniform;
use nephroid::passes::downsample::DownsampleUniform;
use nephroid::passes::filter::KernelUniform;
use nephroid::passes::light_view::LightView;
use nephroid::passes::rotating_filter::RotatingUniform;
use nephroid::pipeline::{Buffer, Device, DeviceOptions};

use crate::support::shared_passes::frame;

/// Every adapter here, opened.
fn gpus() -> Vec<Gpu> {
    let gpus: Vec<Gpu> = adapters().into_iter().map(|adapter| Gpu::open(adapter).expect("the adapter opens")).collect();
    if gpus.is_empty() {
        assert!(std::env::var_os("NEPHROID_REQUIRE_ADAPTER").is_none(), "an adapter is required, and there is none");
        eprintln!("not run: there is no Vulkan adapter");
    }
    gpus
}

fn compare(gpu: &Gpu, on_cpu: &Frame, on_gpu: &Frame, mode: Mode) -> Report {
    let device = Device::new(DeviceOptions::default()).expect("threads start");
    let rules = gpu.adapter().family().candidates()[0].1;
    let [on_cpu, on_gpu] = [on_cpu, on_gpu].map(|frame| Frame { rules, ..frame.clone() });
    crosscheck(gpu, &device, &on_cpu, &on_gpu, mode, &nephroid::caustics::TECHNIQUES.bounds(""), |_, _| {}).expect("the frame runs")
}

#[test]
fn every_pass_agrees_with_its_twin() {
    for gpu in gpus() {
        for mode in [Mode::FreeRunning, Mode::Resynchronised] {
            let frame = frame();
            let report = compare(&gpu, &frame, &frame, mode);
            let wrong: Vec<_> = report.attachments.iter().filter(|a| !a.within).collect();
            assert!(report.agrees(), "{}, {mode:?}: {wrong:?} {:?}", gpu.adapter().title(), report.vertices);
        }
    }
}

/// Changes the uniform of a pass or draw.
fn change<T: bytemuck::Pod>(frame: &mut Frame, label: &str, change: impl Fn(&mut T)) {
    let buffer = frame.buffers.iter_mut().find(|b| b.label == label).expect("the pass has a uniform of its name");
    let mut uniform: T = *bytemuck::from_bytes(buffer.data.bytes());
    change(&mut uniform);
    buffer.data = Arc::new(Buffer::from_value(&uniform));
}

#[test]
fn a_fault_in_any_pass_is_found_in_that_pass() {
    type Plant = (&'static str, fn(&mut Frame));
    let plants: [Plant; 6] = [
        ("light_buffer 0", |f| change::<LightView>(f, "light_buffer 0", |u| u.clip_from_world.w_axis.x += 0.1)),
        ("light_buffer 1", |f| change::<LightView>(f, "light_buffer 1", |u| u.position_ws = -u.position_ws)),
        ("low pass across", |f| change::<KernelUniform>(f, "low pass across", |u| u.weights[0].y *= 1.01)),
        ("rotating", |f| change::<RotatingUniform>(f, "rotating", |u| u.rotations.swap(1, 2))),
        ("half depth", |f| change::<DownsampleUniform>(f, "half depth", |u| u.sizes[0] += 8)),
        ("composed", |f| change::<LayerUniform>(f, "composed 1", |u| u.ratio.z = 1.0e6)),
    ];
    for gpu in gpus() {
        let good = frame();
        for (pass, plant) in &plants {
            let mut bad = good.clone();
            plant(&mut bad);
            // In the resynchronised mode the driver draws the vertices of the good frame.
            let report = compare(&gpu, &good, &bad, Mode::FreeRunning);
            let wrong = report.attachments.iter().find(|a| !a.within).map(|a| a.pass.as_str());
            assert_eq!(wrong, Some(*pass), "{}", gpu.adapter().title());
        }
    }
}
