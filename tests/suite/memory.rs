//! What the paper's frame takes of the machine's memory. The test runs itself again in a process of its own, so that nothing else counts.

use nephroid::caustics::caustic_volumes::CausticVolumes;
use nephroid::caustics::{RenderOptions, Renderer};

/// Most resident memory since the process began, bytes.
#[cfg(target_os = "linux")]
fn peak_resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("a line with the peak");
    let kib: u64 = line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number of KiB");
    kib * 1024
}

/// 64 x 64 grid, 512 x 512 pixels [SF05 §4]: below 256 MiB, and no less than what its textures are known to take.
#[cfg(target_os = "linux")]
#[test]
fn paper_frame_stays_below_256_mib_resident() {
    const ALONE: &str = "NEPHROID_TEST_ALONE";
    if std::env::var_os(ALONE).is_none() {
        let program = std::env::current_exe().expect("the test knows its file");
        let this = "memory::paper_frame_stays_below_256_mib_resident";
        let run = std::process::Command::new(program).args(["--exact", this, "--nocapture"]).env(ALONE, "1").output().expect("it runs");
        let text = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success() && text.contains("peak resident"), "{text}{}", String::from_utf8_lossy(&run.stderr));
        return;
    }
    let mut scene = crate::support::scene_of_size("pots.ron", (512, 512));
    *scene.techniques.edit::<CausticVolumes>() = CausticVolumes { grid: Some((65, 65)), ..CausticVolumes::PAPER };
    let mut renderer = Renderer::new(&scene, &RenderOptions { memory_limit_bytes: 256 << 20, ..RenderOptions::default() }).expect("device");
    let textures = renderer.build(&scene).expect("a frame").frame.memory().resources();
    for frame in 0..3 {
        scene.time_s = 1.0 + frame as f32 / 30.0;
        renderer.run(&scene, None).expect("within the limit");
    }
    let peak = peak_resident();
    println!("peak resident: {} MiB, of which the frame's resources {} MiB", peak >> 20, textures >> 20);
    assert!(peak < 256 << 20, "{} MiB", peak >> 20);
    assert!(peak > textures, "{peak} bytes cannot hold {textures}");
}
