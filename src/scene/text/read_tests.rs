use serde::Deserialize;

use super::super::Path;
use super::*;

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Chest {
    side: Option<f32>,
    #[serde(default)]
    name: String,
    #[serde(default)]
    cells: Option<(u32, u32)>,
    #[serde(default)]
    open: bool,
}

#[derive(Debug, PartialEq, Deserialize)]
enum Thing {
    Nothing,
    One(f32),
    Pair((f32, f32)),
    Both(u32, u32),
    Many(Vec<u32>),
    Held(Chest),
    Free { a: u32 },
}

fn tried<T: DeserializeOwned>(text: &str) -> Result<T, (Path, String, Problem)> {
    let tree = Tree::parse(text).unwrap();
    let extensions = ron::Deserializer::from_str(tree.header()).unwrap().extensions();
    read(&tree, extensions).map_err(|Misfit { node, problem }| (tree.path_to(node), tree.source(node).to_owned(), problem))
}

#[track_caller]
fn accepted<T: DeserializeOwned>(text: &str) -> T {
    tried(text).unwrap_or_else(|error| panic!("{text}: {error:?}"))
}

/// Checks that the value `source` at `path` is refused, because `expected` should stand there.
#[track_caller]
fn refused<T: DeserializeOwned + fmt::Debug>(text: &str, path: &str, source: &str, expected: &str) {
    let (seen_path, seen_source, problem) = tried::<T>(text).unwrap_err();
    let wanted = Problem::Expected(expected.to_owned());
    assert_eq!((seen_path.to_string().as_str(), seen_source.as_str(), problem), (path, source, wanted), "{text}");
}

#[test]
fn leaves_follow_the_rules_of_ron() {
    let numbers: Vec<f32> = accepted("[1, -2.5e3, +.5, 1_000.5, inf, -inf, 3f32, 0.25f32,]");
    assert_eq!(numbers, [1.0, -2500.0, 0.5, 1000.5, f32::INFINITY, f32::NEG_INFINITY, 3.0, 0.25]);
    assert_eq!(accepted::<Vec<u32>>("[0xff, 0b11, 0o17, 1_000, 7u32, +1]"), [255, 3, 15, 1000, 7, 1]);
    let texts: Vec<String> = accepted(
        r##"["a\n\u{e4}\x41", r"\n", r#"a"b"#, "two\
        lines"]"##,
    );
    assert_eq!(texts, ["a\nä\u{41}", "\\n", "a\"b", "twolines"]);
    assert_eq!(accepted::<Vec<bool>>("[true, false]"), [true, false]);

    for text in ["1.5", "3e2", "0x", "1u8", "_1", "one", "\"1\"", "'1'", "b'1'", "(1)", "[1]", "Some(1)", "1(2)"] {
        refused::<u32>(text, "scene", text, "a whole number");
    }
    refused::<u32>("-1", "scene", "-1", "a whole number from 0 to 4294967295");
    refused::<u32>("4294967296", "scene", "4294967296", "a whole number from 0 to 4294967295");
    refused::<u32>("0b12", "scene", "0b12", "a whole number in base 2");
    for text in ["1..2", "0x10", "nan", "1f64", "true", "1._0", "(1)"] {
        refused::<f32>(text, "scene", text, "a number");
    }
    refused::<String>("b\"a\"", "scene", "b\"a\"", "a text in double quotes");
    refused::<String>(r#""\q""#, "scene", r#""\q""#, "a text in double quotes, its escapes as in Rust (Unknown escape character)");
    refused::<bool>("True", "scene", "True", "true or false");
}

#[test]
fn options_are_read_with_and_without_some() {
    let side = |text: &str| accepted::<Chest>(text).side;
    assert_eq!(
        (side("()"), side("(side: None)"), side("Chest(side: 2)"), side("(side: Some ( 2 , ))")),
        (None, None, Some(2.0), Some(2.0))
    );
    let cells = |text: &str| accepted::<Chest>(text).cells;
    for text in ["(cells: (1, 2))", "(cells: Some(1, 2))", "(cells: Some((1, 2)))"] {
        assert_eq!(cells(text), Some((1, 2)), "{text}");
    }
    refused::<Chest>("(side: Some)", "side", "Some", "a number");
    refused::<Chest>("(side: Some())", "side", "Some()", "a value in the parentheses");
    refused::<Chest>("(side: Some(1, 2))", "side[1]", "2", "no more values");
    refused::<Chest>("(side: Some(x: 1))", "side", "Some(x: 1)", "values without names");
    refused::<Chest>("(side: None(1))", "side", "None(1)", "a number");
    refused::<Chest>("(cells: Some((1, 2), 3))", "cells[0]", "(1, 2)", "a whole number");
}

#[test]
fn variants_are_read_with_one_pair_of_parentheses_or_two() {
    let cube = || Chest { side: Some(1.0), name: String::new(), cells: None, open: false };
    for (text, thing) in [
        ("Nothing", Thing::Nothing),
        ("One(1)", Thing::One(1.0)),
        ("Pair(1, 2)", Thing::Pair((1.0, 2.0))),
        ("Pair((1, 2))", Thing::Pair((1.0, 2.0))),
        ("Both(1, 2)", Thing::Both(1, 2)),
        ("Many([])", Thing::Many(vec![])),
        ("Many([1, 2],)", Thing::Many(vec![1, 2])),
        ("Held(side: 1)", Thing::Held(cube())),
        ("Held((side: 1))", Thing::Held(cube())),
        ("Held /* one */ (Chest(side: 1),)", Thing::Held(cube())),
        ("Free(a: 1)", Thing::Free { a: 1 }),
        ("Free(r#a: 1, b: [(c: 2)])", Thing::Free { a: 1 }),
    ] {
        assert_eq!(accepted::<Thing>(text), thing, "{text}");
    }
    let all = "one of: Nothing, One, Pair, Both, Many, Held, Free";
    for text in ["7", "[Nothing]", "(Nothing)", "{}", "Other(1)"] {
        refused::<Thing>(text, "scene", text, all);
    }
    refused::<Thing>("\"Nothing\"", "scene", "\"Nothing\"", &format!("{all} (did you mean `Nothing`?)"));
    refused::<Thing>("Mani([])", "scene", "Mani([])", &format!("{all} (did you mean `Many`?)"));
    refused::<Thing>("Nothing()", "scene", "Nothing()", "`Nothing` alone");
    for text in ["One", "Many", "Held", "Free"] {
        refused::<Thing>(text, "scene", text, "values in (parentheses)");
    }
    refused::<Thing>("Many(1, 2)", "[1]", "2", "no more values");
    refused::<Thing>("Many([1, 2.5])", "[1]", "2.5", "a whole number");
    refused::<Thing>("Pair(1, 2, 3)", "[2]", "3", "no more values");
    refused::<Thing>("Pair(1)", "scene", "Pair(1)", "a tuple of size 2");
    refused::<Thing>("Pair(x: 1, y: 2)", "scene", "Pair(x: 1, y: 2)", "values without names");
    refused::<Thing>("Held(Bag(side: 1))", "scene", "Bag(side: 1)", "`Chest` or no name before the parenthesis");
}

#[test]
fn structs_name_the_field_that_is_wrong() {
    let problem = |text: &str| {
        let (path, source, problem) = tried::<Vec<Chest>>(text).unwrap_err();
        (path.to_string(), source, problem)
    };
    let allowed = &["side", "name", "cells", "open"];
    let unknown = |found: &str| Problem::UnknownField { found: found.to_owned(), allowed: allowed.to_vec() };
    assert_eq!(problem("[(), (sides: 1)]"), ("[1].sides".to_owned(), "1".to_owned(), unknown("sides")));
    assert_eq!(problem("[(open: true, open: 1)]"), ("[0].open".to_owned(), "1".to_owned(), Problem::DuplicateField("open")));
    let missing = tried::<Vec<(Thing, u32)>>("[(Nothing, 1), (Free(), 2)]").unwrap_err();
    assert_eq!((missing.0.to_string().as_str(), missing.1.as_str(), missing.2), ("[1][0]", "Free()", Problem::MissingField("a")));
    for text in ["7", "[]", "{}", "None"] {
        refused::<Chest>(text, "scene", text, "values in (parentheses)");
    }
    for text in ["(1)", "(1, 2)"] {
        assert_eq!(tried::<Chest>(text), Err((Path::default(), text.to_owned(), Problem::Unnamed(1))));
    }
    assert_eq!(tried::<Thing>("Held(1)").unwrap_err().2, Problem::Unnamed(1));
    refused::<(u32, u32)>("Chest(1, 2)", "scene", "Chest(1, 2)", "no name before the parenthesis");
    refused::<Vec<u32>>("(1, 2)", "scene", "(1, 2)", "a list in [square brackets]");
    refused::<u64>("1", "scene", "1", "a type that scene files have");
}

#[test]
fn attributes_of_the_file_count() {
    let named = "#![enable(explicit_struct_names)]";
    assert_eq!(accepted::<Chest>(&format!("{named} Chest(side: 1)")).side, Some(1.0));
    refused::<Chest>(&format!("{named} (side: 1)"), "scene", "(side: 1)", "`Chest` before the parenthesis");
    assert_eq!(accepted::<Thing>(&format!("{named} Held(open: true, side: None)")), accepted("Held(open: true)"));
}
