use std::path::Path;

use super::*;
use crate::{Scene, SceneError};

crate::choices! {
    /// A choice of two words.
    pub(crate) enum Brush {
        /// The default.
        FlatBrush,
        /// The paper's.
        Roller,
    }
}

crate::settings! {
    /// Settings with a row of each type, some of them shared.
    pub(crate) struct Paint("paint") {
        shared radiometry;
        /// What paints,
        /// on two lines.
        brush: Brush = Brush::FlatBrush, paper Brush::Roller, note "decision P1";
        shared grid, said "64x64";
        shared depth_below_floor, paper 0.5, note "deep";
        /// Coats of paint.
        coats: u32 = 2, in 1..=9, unit "layers", said "many";
        /// Drops along x and z.
        drops: (u32, u32) = (4, 2), in 1..=64, coarse (1, 1);
        /// Whether it dries.
        dries: bool = true, paper false;
        shared samples;
    }
}

/// What a scene is read for in the tests of this crate.
pub(crate) const PAINT: &[&dyn Settings] = &[Paint::DEFAULTS];

fn parse(techniques: &str) -> Result<Scene, SceneError> {
    let text = format!("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), techniques: {techniques})");
    crate::parse(&text, "t", Path::new(""), PAINT)
}

#[test]
fn rows_give_defaults_the_papers_values_and_coarse_ones() {
    let defaults = Paint {
        radiometry: Radiometry::Physical,
        brush: Brush::FlatBrush,
        grid: None,
        depth_below_floor: 0.04,
        coats: 2,
        drops: (4, 2),
        dries: true,
        samples: 1,
    };
    assert_eq!((Paint::default(), Paint::DEFAULTS), (defaults, &defaults));
    let paper = Paint { radiometry: Radiometry::Paper, brush: Brush::Roller, depth_below_floor: 0.5, dries: false, ..defaults };
    assert_eq!(Paint::PAPER, paper);
    assert!(*defaults.paper() == *paper.boxed() && *defaults.paper() != *defaults.boxed());
    let mut coarse = Paint { samples: 4, ..defaults };
    coarse.coarsen();
    assert_eq!(coarse, Paint { grid: Some((33, 33)), drops: (1, 1), samples: 1, ..defaults });
}

#[test]
fn rows_tell_what_they_are() {
    let rows = defaults().rows();
    let row = |name: &str| rows.iter().find(|row| row.name == name).unwrap();
    assert_eq!(
        rows.iter().map(|row| row.name).collect::<Vec<_>>().join(" "),
        "radiometry brush grid depth_below_floor coats drops dries samples"
    );
    let brush = row("brush");
    assert_eq!((brush.key, brush.doc(), brush.note), ("paint.brush", "What paints, on two lines.", "decision P1"));
    assert_eq!(
        (row("coats").unit, row("coats").said, row("grid").said, row("depth_below_floor").unit),
        ("layers", "many", "64x64", "of the depth")
    );
    let allowed = |name: &str| (row(name).field)(Paint::DEFAULTS).unwrap().allowed((row(name).limits)()).to_string();
    assert_eq!(allowed("brush"), "one of flat_brush, roller");
    assert_eq!(allowed("grid"), "none, or COLUMNSxROWS with each from 2 to 4096");
    assert_eq!(allowed("depth_below_floor"), "a number from 0 to 1000");
    assert_eq!(allowed("coats"), "a whole number from 1 to 9");
    assert_eq!(allowed("drops"), "COLUMNSxROWS, each from 1 to 64");
    assert_eq!(allowed("dries"), "true or false");
}

fn defaults() -> &'static dyn Settings {
    Paint::DEFAULTS
}

#[test]
fn files_are_read_by_the_table() {
    let scene = parse("(paint: (brush: Roller, grid: (64, 32), depth_below_floor: 1, coats: 9, drops: (1, 2), dries: false))").unwrap();
    let expected = Paint {
        brush: Brush::Roller,
        grid: Some((64, 32)),
        depth_below_floor: 1.0,
        coats: 9,
        drops: (1, 2),
        dries: false,
        ..Paint::default()
    };
    assert_eq!(scene.techniques.get::<Paint>(), &expected);
    assert_eq!(parse("(paint: (grid: None))").unwrap().techniques, parse("()").unwrap().techniques);
    assert_eq!(parse("(paint: (grid: Some((64, 32))))").unwrap().techniques.get::<Paint>().grid, Some((64, 32)));
    let text = ron::to_string(&scene.techniques).unwrap();
    assert_eq!(parse(&text).unwrap().techniques, scene.techniques, "{text}");
}

#[test]
fn errors_in_files_name_the_place_the_value_and_the_values_allowed() {
    // Columns count from 1; the settings begin at column 77.
    let start = "(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), techniques: ".len() + 1;
    for (techniques, at, rest) in [
        ("(pain: ())", 1, "found unknown field `techniques.pain` (did you mean `paint`?), expected one of: paint"),
        (
            "(paint: (coat: 1))",
            9,
            "found unknown field `techniques.paint.coat` (did you mean `coats`?), expected one of: radiometry, brush, grid, depth_below_floor, \
             coats, drops, dries, samples",
        ),
        ("(paint: (coats: 1, coats: 2))", 19, "techniques.paint.coats: found a second `coats`, expected each field once"),
        ("(paint: (coats: 1.5))", 16, "techniques.paint.coats: found `1.5`, expected a whole number"),
        ("(paint: (coats: 10))", 16, "techniques.paint.coats: found 10, expected a whole number from 1 to 9"),
        ("(paint: (drops: (1, 0)))", 20, "techniques.paint.drops[1]: found 0, expected a whole number from 1 to 64"),
        ("(paint: (drops: (1)))", 16, "techniques.paint.drops: found `(1)`, expected a tuple of size 2"),
        (
            "(paint: (depth_below_floor: -1))",
            28,
            "techniques.paint.depth_below_floor: found -1, expected a number from 0 to 1000 of the depth",
        ),
        (
            "(paint: (brush: Roler))",
            16,
            "techniques.paint.brush: found `Roler`, expected one of: FlatBrush, Roller (did you mean `Roller`?)",
        ),
        ("(paint: (brush: Roller(1)))", 16, "techniques.paint.brush: found `Roller(1)`, expected `Roller` alone"),
        ("(paint: 5)", 8, "techniques.paint: found `5`, expected values in (parentheses)"),
        ("(paint: (5))", 9, "techniques.paint: found `5`, expected the name of a field and a colon before it"),
        ("5", 0, "techniques: found `5`, expected values in (parentheses)"),
    ] {
        assert_eq!(parse(techniques).unwrap_err().to_string(), format!("t:1:{}: {rest}", start + at), "{techniques}");
    }
    let unknown =
        crate::parse("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)), techniques: (paint: ()))", "t", Path::new(""), &[]);
    assert!(unknown.unwrap_err().to_string().contains("unknown field `techniques.paint`"));
}

#[test]
fn groups_are_found_by_their_type() {
    let mut scene = crate::parse("(camera: Perspective(position: (0, 2, 5), target: (0, 0, 0)))", "t", Path::new(""), &[]).unwrap();
    assert_eq!((scene.techniques.get::<Paint>(), scene.techniques.iter().count()), (Paint::DEFAULTS, 0));
    scene.techniques.edit::<Paint>().coats = 7;
    assert_eq!((scene.techniques.get::<Paint>().coats, scene.techniques.iter().count()), (7, 1));
    assert_eq!(scene.get("paint.coats").unwrap().as_deref(), Some("7"));
    scene.techniques.edit::<Paint>().coats = 70;
    assert_eq!(scene.validate().unwrap_err().to_string(), "techniques.paint.coats: found 70, expected a whole number from 1 to 9");
    scene.techniques.replace(Box::new(Paint::PAPER));
    assert_eq!((scene.techniques.get::<Paint>(), scene.techniques.iter().count()), (&Paint::PAPER, 1));
}
