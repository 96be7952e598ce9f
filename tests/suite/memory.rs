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

/// What every verb does under a limit of 256 MiB: it is refused within a second with what to lower, or it runs and takes no more than a tenth beyond.
#[cfg(target_os = "linux")]
#[test]
fn verbs_keep_to_their_memory_limit() {
    const LIMIT_MIB: u64 = 256;
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let (exr, png) = (out("a.exr"), out("a.png"));
    let scene = |name: &str| crate::support::path("scenes").join(name).display().to_string();
    let (flat, ball, lido) = (scene("analytic/flat_water.ron"), scene("ball.ron"), scene("lido.ron"));
    let plane = "trace.plane=-1,-0.9,-1;0,0,2;2,0,0;8192x8192";
    let runs: [(bool, &[&str]); 12] = [
        (false, &["render", &flat, "--size", "48x48", "--set", "caustic_volumes.grid=4096x4096", "-o", &exr]),
        (false, &["render", &flat, "--technique", "splatting", "--set", "splatting.photons=4096", "-o", &exr]),
        (false, &["render", &flat, "--technique", "light-volumes", "--set", "light_volumes.grid=1025x1025", "-o", &exr]),
        (false, &["render", &ball, "--size", "16384x16384", "-o", &exr]),
        (true, &["render", &flat, "--size", "48x48", "--technique", "caustic-volumes", "-o", &exr]),
        (true, &["render", &lido, "--size", "320x180", "--technique", "caustic-volumes", "-o", &exr, "-o", &png]),
        (false, &["trace", &flat, "--size", "16384x16384", "--photons", "1k", "-o", &exr]),
        (false, &["trace", &flat, "--size", "48x48", "--photons", "1k", "--set", plane, "-o", &exr]),
        (true, &["trace", &flat, "--size", "400x400", "--photons", "1k", "-o", &exr]),
        (false, &["compare", &flat, "--size", "4096x4096", "--photons", "1k", "-o", &png]),
        (true, &["compare", &flat, "--techniques", "caustic-volumes", "--size", "200x200", "--photons", "1k", "-o", &png]),
        (true, &["compare", &exr, &exr, "-o", &png]),
    ];
    for (runs, words) in runs {
        let limit = LIMIT_MIB.to_string();
        let start = std::time::Instant::now();
        let (output, peak) = crate::support::program::measured(&[words, &["--memory-limit", &limit]].concat());
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.success(), runs, "{words:?}: {text}");
        assert!(peak < LIMIT_MIB * 11 / 10 * 1024, "{words:?} took {} MiB", peak / 1024);
        if !runs {
            assert!(text.contains("more than the limit of 256 MiB") && text.contains("(lower "), "{words:?}: {text}");
            assert!(start.elapsed().as_secs_f64() < 1.0 && peak < 64 * 1024, "{words:?} took {} MiB", peak / 1024);
        }
    }
}
