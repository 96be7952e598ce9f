//! `nephroid list`: lists techniques, scenes, adapters and settings.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::{Subcommand, ValueHint};
use serde::Serialize;

use crate::caustics::Techniques;
use crate::cli::{drivers, output, renderer};

/// Bytes of a scene file that are read to find its first comment.
const HEADER_BYTES: u64 = 4096;

/// Greatest depth of folders that are searched; ends any loop of mounts.
const MAX_DEPTH: usize = 16;

/// The arguments as typed.
#[derive(Debug, clap::Args)]
pub struct LowArgs {
    #[command(subcommand)]
    what: What,

    /// Print JSON
    #[arg(long, global = true)]
    json: bool,
}

/// What to list.
#[derive(Debug, Subcommand)]
enum What {
    /// Ways to compute caustics, with the paper of each
    Techniques,
    /// Scene files in a folder and below, with the first line of each
    Scenes {
        /// The folder
        #[arg(default_value = "scenes", value_hint = ValueHint::DirPath)]
        folder: PathBuf,
    },
    /// Vulkan drivers, what they lack, and the rasterizer rules they are held to (in builds with the feature `wgpu`)
    Adapters,
    /// Keys that `render --set KEY=VALUE` knows, with their defaults
    Settings,
}

/// One line of `list scenes`.
#[derive(Serialize)]
struct SceneLine {
    path: String,
    summary: String,
}

/// Prints the requested list.
///
/// # Errors
/// If a folder or file cannot be read, there is no adapter to list, or stdout cannot be written to.
pub fn run(low: &LowArgs, techniques: Techniques) -> anyhow::Result<()> {
    match &low.what {
        What::Techniques => print(low, &renderer::technique_lines(techniques), |line| [line.name, line.summary, line.paper]),
        What::Adapters => print(low, &drivers::adapters()?, |line| {
            [line.name.as_str(), line.driver.as_str(), line.version.as_str(), line.kind.as_str(), line.rules, line.missing.as_str()]
        }),
        What::Scenes { folder } => print(low, &scenes(folder)?, |line| [line.path.as_str(), line.summary.as_str()]),
        What::Settings => {
            print(low, &renderer::setting_lines(techniques), |line| [line.key, &line.default, line.unit, line.doc, &line.allowed])
        }
    }
}

/// Prints lines as JSON or as columns.
fn print<'a, T: Serialize, const N: usize>(low: &LowArgs, lines: &'a [T], cells: impl Fn(&'a T) -> [&'a str; N]) -> anyhow::Result<()> {
    if low.json {
        output::json(&lines)?;
    } else {
        output::text(&output::columns(&lines.iter().map(cells).collect::<Vec<_>>()))?;
    }
    Ok(())
}

/// All `*.ron` files of a folder and its subfolders, sorted. Links to folders are not followed.
///
/// # Errors
/// If a folder cannot be read.
pub fn scene_paths(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    collect(folder, MAX_DEPTH, &mut paths)?;
    paths.sort();
    Ok(paths)
}

/// All scenes of a folder and its subfolders, each with its first comment.
fn scenes(folder: &Path) -> anyhow::Result<Vec<SceneLine>> {
    scene_paths(folder)?.iter().map(|path| Ok(SceneLine { path: path.display().to_string(), summary: summary(path)? })).collect()
}

/// Adds the scene files below `folder`.
fn collect(folder: &Path, depth: usize, paths: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let cannot = || format!("cannot list the folder {}", folder.display());
    for entry in fs::read_dir(folder).with_context(cannot)? {
        let entry = entry.with_context(cannot)?;
        let path = entry.path();
        if entry.file_type().with_context(cannot)?.is_dir() {
            if depth > 0 {
                collect(&path, depth - 1, paths)?;
            }
        } else if path.extension().is_some_and(|extension| extension == "ron") {
            // To open a pipe would wait for a writer.
            if fs::metadata(&path).with_context(|| format!("cannot read {}", path.display()))?.is_file() {
                paths.push(path);
            }
        }
    }
    Ok(())
}

/// The first line of the comment at the head of a scene file; empty without one.
fn summary(path: &Path) -> anyhow::Result<String> {
    let mut header = Vec::new();
    let cannot = || format!("cannot read {}", path.display());
    File::open(path).with_context(cannot)?.take(HEADER_BYTES).read_to_end(&mut header).with_context(cannot)?;
    let header = String::from_utf8_lossy(&header);
    let first = header.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("");
    Ok(first.strip_prefix("//").unwrap_or("").trim_start_matches(['/', '!']).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_found_in_order_with_their_first_comment() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("analytic")).unwrap();
        fs::write(path("pool.ron"), "\n//! A pool at noon.\n// More.\n()").unwrap();
        fs::write(path("analytic/flat.ron"), "(camera: ())").unwrap();
        fs::write(path("notes.txt"), "// no scene").unwrap();
        #[cfg(unix)]
        let _socket = std::os::unix::net::UnixListener::bind(path("socket.ron")).unwrap();
        let lines = scenes(folder.path()).unwrap();
        let found: Vec<_> = lines.iter().map(|line| (Path::new(&line.path), line.summary.as_str())).collect();
        assert_eq!(found, [(&*path("analytic/flat.ron"), ""), (&*path("pool.ron"), "A pool at noon.")]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = scenes(Path::new("no/such/folder")).err().unwrap();
        assert_eq!(error.to_string(), "cannot list the folder no/such/folder");
    }
}
