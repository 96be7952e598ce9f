//! Comparison of two files.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};

use super::table::{Column, Results};
use crate::cli::interrupt;
use crate::image::file::{Kind, Measure};
use crate::image::{LayerSet, STANDARD_LAYERS, file, png};
use crate::metrics::Pair;
use crate::report::{Figure, Judged, Verdict, judge, number};
use crate::scene::Account;

/// Layers that are compared if none is named; the first one that both files have is taken.
const USUAL_LAYERS: [&str; 2] = ["caustic_irradiance", "color"];

/// The files to compare.
#[derive(Debug)]
pub struct Request {
    /// The picture that is taken as the truth.
    pub reference: PathBuf,
    /// The picture that is judged.
    pub test: PathBuf,
    /// Name of the layer; `None` for the first of [`USUAL_LAYERS`] that both files have.
    pub layer: Option<String>,
    /// Most memory that the comparison may take, bytes.
    pub memory_limit_bytes: u64,
}

/// The program itself, bytes.
pub const PROGRAM_BYTES: u64 = 24 << 20;

/// Bytes of a pixel while two pictures are compared and the figure is drawn.
pub const PIXEL_BYTES: u64 = 180;

/// The memory of a comparison of two files.
fn account(reference: Measure, test: Measure) -> Account {
    let mut account = Account::default();
    account.add("the program", PROGRAM_BYTES, "");
    let layers = 4 * (reference.samples + test.samples) + reference.file_bytes.max(test.file_bytes);
    account.add("layers", layers, "the number of layers in the files");
    account.add("measures", reference.pixels.max(test.pixels) * PIXEL_BYTES, "the size of the pictures");
    account
}

/// Compares two files.
///
/// # Errors
/// If a file cannot be read, the pictures cannot be compared, or the figure cannot be written.
pub fn compare(request: &Request, picture: Option<&Path>) -> anyhow::Result<Results> {
    account(file::measure(&request.reference)?, file::measure(&request.test)?).check(request.memory_limit_bytes)?;
    let (reference, test) = (file::read(&request.reference)?, file::read(&request.test)?);
    ensure!(
        reference.kind == test.kind,
        "{} is {}, {} is {}: compare two files of one kind",
        request.reference.display(),
        reference.kind,
        request.test.display(),
        test.kind
    );
    let display = reference.kind == Kind::Display;
    ensure!(!display || request.layer.is_none(), "--layer is for two EXR files; a PNG holds one picture, which has no name");
    let (reference, test) = (reference.layers, test.layers);
    let name = if display { png::DECODED_NAME.to_owned() } else { layer_name(request, &reference, &test)? };
    let find = |set: &LayerSet, path: &Path| set.get(&name).cloned().with_context(|| missing(&name, set, path));
    let (a, b) = (find(&reference, &request.reference)?, find(&test, &request.test)?);
    ensure!(
        (a.width(), a.height()) == (b.width(), b.height()),
        "{} has {}x{} pixels, {} has {}x{}; both must have the same size",
        request.reference.display(),
        a.width(),
        a.height(),
        request.test.display(),
        b.width(),
        b.height()
    );
    let (left, right) = (a.rgb(), b.rgb());
    let mask = reference.get(&format!("{name}_valid")).map(|valid| valid.planes()[0].pixels().iter().map(|&v| v > 0.0).collect::<Vec<_>>());
    let variance = reference.get(&format!("{name}_error")).map(|errors| {
        let square = |rgb: [f32; 3]| rgb.map(|e| e * e);
        errors.rgb().into_iter().map(square).collect::<Vec<_>>()
    });
    let pair = Pair::with_mask(a.width(), a.height(), &left, &right, mask.as_deref())?;
    let verdicts = judge(&Judged { pair, areas_m2: None, variance: variance.as_deref(), display });
    let unit = STANDARD_LAYERS.iter().find(|layer| layer.name == name).map_or("", |layer| layer.unit);
    let mut files = Vec::new();
    if let Some(path) = picture {
        let title = format!("{} against {}", request.test.display(), request.reference.display());
        draw(path, &title, pair, ("Reference", "Test"), unit, &verdicts)?;
        files.push(path.display().to_string());
    }
    let facts = vec![("layer".to_owned(), name.clone()), ("pixels".to_owned(), format!("{} of {}", pair.count(), left.len()))];
    let column = Column { name: request.test.display().to_string(), verdicts, direct: None, facts: Vec::new(), not_drawn: None };
    let reference = request.reference.display().to_string();
    Ok(Results { reference, facts, bodies_turned: 0, columns: vec![column], files })
}

/// Draws the figure and writes it.
///
/// # Errors
/// If the figure is too large or cannot be written.
pub fn draw(path: &Path, title: &str, pair: Pair<'_>, names: (&str, &str), unit: &str, verdicts: &[Verdict]) -> anyhow::Result<()> {
    let metrics: Vec<(String, String)> = verdicts
        .iter()
        .filter_map(|verdict| verdict.value.as_ref().ok().map(|&value| (verdict.name.replace('_', " "), number(value, 3))))
        .collect();
    let figure = Figure { title, pair, reference_name: names.0, test_name: names.1, unit, metrics: &metrics };
    let bytes = figure.png().with_context(|| format!("cannot draw {}", path.display()))?;
    interrupt::uninterrupted(|| file::write_atomically(path, &bytes))?;
    Ok(())
}

fn layer_name(request: &Request, reference: &LayerSet, test: &LayerSet) -> anyhow::Result<String> {
    if let Some(name) = &request.layer {
        return Ok(name.clone());
    }
    let both = |name: &&str| reference.get(name).is_some() && test.get(name).is_some();
    match USUAL_LAYERS.iter().find(|name| both(name)) {
        Some(name) => Ok((*name).to_owned()),
        None => bail!("neither {} is in both files; choose a layer with --layer", USUAL_LAYERS.join(" nor ")),
    }
}

fn missing(name: &str, set: &LayerSet, path: &Path) -> String {
    let known: Vec<&str> = set.names().collect();
    format!("{} has no layer `{name}`; it has: {}", path.display(), known.join(", "))
}
