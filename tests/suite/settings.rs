//! The settings of every technique: what follows from their tables of rows, on the command line, in lists and in the docs.

use std::fmt::Write as _;
use std::path::PathBuf;

use nephroid::caustics::Technique;
use nephroid::cli;
use nephroid::scene::{Allowed, Row, Scene, Setting, SettingError};

use crate::support::{self, techniques};

/// For one row: a value other than the default, a text that is no value, and a value out of range if there is one.
type Samples = (String, &'static str, Option<String>);

fn samples(allowed: &Allowed, default: &str) -> Samples {
    match allowed {
        Allowed::Truth => ((default != "true").to_string(), "maybe", None),
        Allowed::Names(names) => (names.iter().find(|name| *name != default).expect("two names").clone(), "no such name", None),
        Allowed::Count(low, high) => {
            let other = if default == high.to_string() { low } else { high };
            (other.to_string(), "1.5", Some((high + 1).to_string()))
        }
        Allowed::Number(low, high) => {
            let other = (low + high) / 2.0;
            (other.to_string(), "inf", Some((high * 2.0 + 1.0).to_string()))
        }
        Allowed::Pair(low, high) | Allowed::PairOrNone(low, high) => {
            let other = if default == format!("{high}x{low}") { (low, low) } else { (high, low) };
            (format!("{}x{}", other.0, other.1), "64", Some(format!("{low}x{}", high + 1)))
        }
    }
}

fn scene() -> Scene {
    let text = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)))";
    techniques().parse(text, "settings", &PathBuf::new()).expect("a scene")
}

/// Every row of every technique, with its key in the list of all settings.
fn rows() -> Vec<(&'static dyn Technique, &'static Row, Setting)> {
    let settings = techniques().settings();
    let key = |row: &Row| settings.iter().find(|setting| setting.key == row.key).expect("every row has a key").clone();
    techniques()
        .iter()
        .flat_map(|&technique| technique.settings().rows().iter().map(move |row| (technique, row)))
        .map(|(t, row)| (t, row, key(row)))
        .collect()
}

fn allowed(technique: &dyn Technique, row: &Row) -> Allowed {
    (row.field)(technique.settings()).expect("a row of its own table").allowed((row.limits)())
}

#[test]
fn every_row_is_set_read_and_refused_by_its_key() {
    for (technique, row, setting) in rows() {
        let allowed = allowed(technique, row);
        let (other, unreadable, outside) = samples(&allowed, &setting.default);
        let mut changed = scene();
        let key = row.key;
        assert_eq!(changed.get(key).unwrap().as_deref(), Some(&*setting.default), "{key}");
        assert_ne!(other, *setting.default, "{key}");
        changed.set(key, &other).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(changed.get(key).unwrap().as_deref(), Some(other.as_str()), "{key}");
        let others = |scene: &Scene| scene.settings().iter().filter(|s| s.key != key).map(|s| s.get(scene)).collect::<Vec<_>>();
        assert_eq!(others(&changed), others(&scene()), "{key} changed another setting");
        let before = changed.clone();
        let error = changed.set(key, unreadable).unwrap_err();
        assert!(matches!(&error, SettingError::Value { .. }) && error.to_string().contains(&allowed.to_string()), "{error}");
        if let Some(outside) = outside {
            let error = changed.set(key, &outside).unwrap_err();
            assert!(matches!(error, SettingError::Conflict { .. }), "{key}: {error}");
        }
        assert_eq!(changed, before, "{key}");
    }
}

#[test]
fn every_row_is_documented_and_listed() {
    let lines = cli::setting_lines(techniques());
    for (_, row, setting) in rows() {
        assert!(row.doc().ends_with('.'), "{}: {}", row.key, row.doc());
        assert!(row.doc().starts_with(char::is_uppercase), "{}: {}", row.key, row.doc());
        let line = lines.iter().find(|line| line.key == row.key).expect("every row is listed");
        assert_eq!((line.doc, line.unit, &line.default), (row.doc(), row.unit, &setting.default));
    }
    let mut keys: Vec<&str> = lines.iter().map(|line| line.key).collect();
    let count = keys.len();
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), count, "a key is there twice");
    let listed: Vec<&str> = cli::technique_lines(techniques()).iter().map(|line| line.name).collect();
    assert_eq!(listed, techniques().names().collect::<Vec<_>>());
}

#[test]
fn coarse_and_paper_settings_are_valid() {
    for technique in techniques().iter() {
        let mut changed = scene();
        changed.techniques.replace(technique.settings().paper());
        changed.techniques.coarsen();
        assert_eq!(changed.validate(), Ok(()), "{}", technique.name());
    }
}

/// The page of a technique.
fn page(technique: &dyn Technique) -> PathBuf {
    let folder = support::own_folder(technique).unwrap_or_else(|| support::path("docs/techniques"));
    folder.join(format!("{}.md", technique.name()))
}

/// The table of settings as the technique's page has it.
fn table(technique: &dyn Technique) -> String {
    let mut text = "| Key | Default | Paper | Values | Meaning |\n|---|---|---|---|---|\n".to_owned();
    let (defaults, paper) = (technique.settings(), technique.settings().paper());
    for row in defaults.rows() {
        let field = (row.field)(defaults).expect("a row of its own table");
        let of_paper = (row.field)(&*paper).expect("a row of its own table").text();
        let said = match row.said {
            "" if of_paper != field.text() => of_paper,
            said => said.to_owned(),
        };
        let unit = if row.unit.is_empty() { String::new() } else { format!(", {}", row.unit) };
        let values = field.allowed((row.limits)()).to_string();
        let note = if row.note.is_empty() { String::new() } else { format!(" ({})", row.note) };
        let meaning = row.doc().trim_end_matches('.');
        writeln!(text, "| `{}` | {} | {said} | {values}{unit} | {meaning}{note} |", row.name, field.text()).expect("writing to a string");
    }
    text
}

/// Where the table of settings is in a page.
fn table_of(page: &str) -> Option<std::ops::Range<usize>> {
    let start = page.find("| Key |")?;
    let length = page[start..].split_inclusive('\n').take_while(|line| line.starts_with('|')).map(str::len).sum::<usize>();
    Some(start..start + length)
}

/// The pages of all techniques against their rows. `REPLACE=1` writes the tables.
#[test]
fn pages_have_the_table_of_the_rows() {
    for &technique in techniques().iter() {
        let path = page(technique);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let place = table_of(&text).unwrap_or_else(|| panic!("{} has no table of settings", path.display()));
        let table = table(technique);
        if std::env::var_os("REPLACE").is_some() {
            std::fs::write(&path, format!("{}{table}{}", &text[..place.start], &text[place.end..])).expect("the page can be written");
            continue;
        }
        assert_eq!(&text[place], table, "{} has another table than the rows: run with REPLACE=1", path.display());
    }
}

#[test]
fn a_table_with_one_word_changed_is_another() {
    let table = table(techniques()[0]);
    let page = format!("# Page\n\n{table}\nMore.\n");
    assert_eq!(&page[table_of(&page).expect("a table")], table);
    let changed = page.replacen("2048", "1024", 1);
    assert_ne!(&changed[table_of(&changed).expect("a table")], table);
    assert_eq!(table_of("no table"), None);
}
