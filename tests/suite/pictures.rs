//! The pictures of the documentation: each has a command, and what the command draws at a small size is the committed picture, made smaller.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use nephroid::image;

use crate::support::path;
use crate::support::program::run;

/// By how much the small pictures are smaller, along both sides.
const SMALLER: u32 = 5;

/// Mean distance of display values, at most 1 each: edges fall differently into larger pixels.
const DISTANCE: f64 = 0.03;

/// Display values of a picture, pixel by pixel.
struct Shown {
    size: (u32, u32),
    pixels: Vec<[f64; 3]>,
}

impl Shown {
    fn read(path: &Path) -> Self {
        let picture = image::read(path).unwrap_or_else(|error| panic!("cannot read {}: {error}", path.display()));
        let layer = picture.layers.get(image::png::DECODED_NAME).expect("a PNG has one layer");
        let size = (layer.width(), layer.height());
        let pixels = layer.rgb().into_iter().map(|rgb| rgb.map(|value| f64::from(value).sqrt())).collect();
        Self { size, pixels }
    }

    /// Means over squares of [`SMALLER`] pixels.
    fn smaller(&self) -> Self {
        let size = (self.size.0 / SMALLER, self.size.1 / SMALLER);
        let mean = |k: u32| {
            let (x, y) = (k % size.0 * SMALLER, k / size.0 * SMALLER);
            let mut sum = [0.0; 3];
            for (dx, dy) in (0..SMALLER * SMALLER).map(|part| (part % SMALLER, part / SMALLER)) {
                let pixel = self.pixels[((y + dy) * self.size.0 + x + dx) as usize];
                sum = [0, 1, 2].map(|c: usize| sum[c] + pixel[c] / f64::from(SMALLER * SMALLER));
            }
            sum
        };
        Self { size, pixels: (0..size.0 * size.1).map(mean).collect() }
    }

    fn distance(&self, other: &Self) -> f64 {
        assert_eq!(self.size, other.size);
        let pairs = self.pixels.iter().flatten().zip(other.pixels.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() / (3 * self.pixels.len()) as f64
    }
}

/// Files and command of each row of the table of `docs/pictures.md`.
fn rows() -> Vec<(Vec<String>, String)> {
    let text = fs::read_to_string(path("docs/pictures.md")).expect("the page is readable");
    let code = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let cells = text.lines().filter(|line| line.starts_with("| `")).map(|line| line.split('|').skip(1).collect::<Vec<_>>());
    cells.map(|cells| (code(cells[0]), code(cells[1])[0].clone())).collect()
}

/// The files of a row: one, or all of a sequence from the first to the last.
fn files(names: &[String]) -> Vec<String> {
    let [first, last] = names else { return names.to_vec() };
    let (start, number) = first.trim_end_matches(".png").rsplit_once('.').expect("a numbered file");
    let end: u32 = last.trim_end_matches(".png").rsplit('.').next().and_then(|n| n.parse().ok()).expect("a number");
    (number.parse().expect("a number")..=end).map(|n: u32| format!("{start}.{n:04}.png")).collect()
}

#[test]
fn every_picture_has_a_command() {
    let listed: BTreeSet<String> = rows().iter().flat_map(|(names, _)| files(names)).collect();
    let there = fs::read_dir(path("docs/images")).expect("the folder is readable");
    let there: BTreeSet<String> = there.map(|file| format!("docs/images/{}", file.expect("a file").file_name().display())).collect();
    assert_eq!(listed, there);
}

#[test]
fn commands_draw_the_pictures_of_the_documentation() {
    let (mut small, mut commands) = (Vec::new(), 0);
    for (names, command) in rows() {
        let words: Vec<&str> = command.split(' ').collect();
        let ["nephroid", verb, scene, rest @ ..] = words.as_slice() else { continue };
        commands += 1;
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let mut arguments: Vec<String> = vec![(*verb).to_owned(), path(scene).display().to_string()];
        for pair in rest.chunks_exact(2) {
            let value = match pair[0] {
                "--size" => {
                    let (width, height) = pair[1].split_once('x').expect("a size");
                    let side = |text: &str| text.parse::<u32>().expect("a number") / SMALLER;
                    format!("{}x{}", side(width), side(height))
                }
                "-o" => "picture.png".to_owned(),
                _ => pair[1].to_owned(),
            };
            arguments.extend([pair[0].to_owned(), value]);
        }
        if *verb == "compare" {
            arguments.extend(["--photons", "1M"].map(str::to_owned));
        }
        let output = run(folder.path(), &arguments.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        let files = files(&names);
        for (number, name) in files.iter().enumerate() {
            let drawn = if files.len() == 1 { "picture.png".to_owned() } else { format!("picture.{number:04}.png") };
            let drawn = Shown::read(&folder.path().join(drawn));
            // The report of a comparison has text, which does not scale.
            if *verb == "render" {
                small.push((name.clone(), Shown::read(&path(name)).smaller(), drawn));
            }
        }
    }
    assert!(commands >= 6 && small.len() >= 12, "{commands} commands, {} pictures", small.len());
    for (name, committed, drawn) in &small {
        let distance = committed.distance(drawn);
        println!("{name}: {distance:.4}");
        assert!(distance < DISTANCE, "{name}: {distance}");
    }
    // The pictures of the lamp differ among themselves: those above the surface from those below.
    let [above, below] = ["0000", "0007"].map(|n| small.iter().find(|(name, ..)| name.contains(n)).expect("a frame"));
    let distance = above.1.distance(&below.2);
    assert!(distance > DISTANCE, "the check cannot tell frames: {distance}");
}
