//! The program as a user runs it, in folders of its own.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// A small scene: a sun above water above a floor.
pub const SMALL_SCENE: &str = include_str!("../data/small.ron");

/// The program, in a folder.
pub fn nephroid(folder: &Path) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("nephroid"));
    command.current_dir(folder);
    command
}

/// Runs the program in a folder.
pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    nephroid(folder).args(arguments).output().expect("the program runs")
}

/// Runs the program, which must succeed without a word on stderr; what it printed.
#[track_caller]
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let stderr = String::from_utf8(output.stderr).expect("errors are text");
    assert_eq!((output.status.code(), stderr.as_str()), (Some(0), ""), "{arguments:?}");
    String::from_utf8(output.stdout).expect("results are text")
}

/// Runs the program with arguments that must be refused: exit code 2, one `nephroid: ...`, no output, and no new file. The message.
#[track_caller]
pub fn refuse(folder: &Path, arguments: &[&str]) -> String {
    let before = files_below(folder);
    let output = run(folder, arguments);
    let stderr = String::from_utf8(output.stderr).expect("errors are text");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{arguments:?}: {stderr}");
    assert_eq!(files_below(folder), before, "{arguments:?}");
    assert_eq!(stderr.matches("nephroid: ").count(), 1, "{arguments:?}: {stderr}");
    stderr.strip_prefix("nephroid: ").expect("an error begins with the name of the program").trim_end().to_owned()
}

/// Paths of all files below a folder, from there, sorted.
pub fn files_below(folder: &Path) -> Vec<String> {
    fn collect(root: &Path, folder: &Path, names: &mut Vec<String>) {
        for entry in fs::read_dir(folder).expect("the folder is readable") {
            let path = entry.expect("the entry is readable").path();
            if path.is_dir() {
                collect(root, &path, names);
            } else {
                names.push(path.strip_prefix(root).expect("the file is below the folder").display().to_string());
            }
        }
    }
    let mut names = Vec::new();
    collect(folder, folder, &mut names);
    names.sort();
    names
}

/// Runs the program and watches it from outside: its output, and the most resident memory that it had, KiB.
#[cfg(target_os = "linux")]
pub fn measured(arguments: &[&str]) -> (Output, u64) {
    let program = assert_cmd::cargo::cargo_bin!("nephroid");
    let mut command = std::process::Command::new(program);
    let command = command.args(arguments).stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    // The peak only grows, so the last look before the end is the one that counts.
    while child.try_wait().expect("the program runs").is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let number = text.lines().find(|line| line.starts_with("VmHWM:")).and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
        peak = number.map_or(peak, |kib: u64| peak.max(kib));
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    (child.wait_with_output().expect("the program ran"), peak)
}
