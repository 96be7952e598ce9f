use super::tree::Tree;
use super::*;

/// `a.b[2]` as a path; names in capitals are variants all the same.
fn path(text: &str) -> Path {
    let mut steps = Vec::new();
    for part in text.split('.').filter(|part| !part.is_empty()) {
        let (name, indices) = part.split_once('[').map_or((part, ""), |(name, rest)| (name, rest));
        steps.push(Step::Name(name.to_owned()));
        for index in indices.split('[').filter(|index| !index.is_empty()) {
            steps.push(Step::Index(index.trim_end_matches(']').parse().unwrap()));
        }
    }
    Path(steps)
}

/// The source text of the value that `steps` leads to, and how far it was followed.
fn value<'t>(text: &'t str, steps: &str) -> (&'t str, usize) {
    let tree = Tree::parse(text).unwrap();
    let (node, depth) = tree.find(&path(steps));
    (tree.source(node), depth)
}

const TEXT: &str = r##"#![enable(implicit_some)]
// A comment with ) and "quotes".
Scene(
    title: "a \"b\" ( [", /* block /* nested ) */ ( */
    camera: Perspective(position: (1.0, -2e3, +.5), near_m : 0.1,),
    raw: r#"x " ) y"#,
    list: [Point(a: 1), Spot(a: 2, r#b: 'x'), Some(Spot(a: 3))],
    aim: Along(7, 8, 9),
    waves: Waves([(a: 4), (a: 5)]), pair: Old((1, 2)), maybe: Some((1, 2)), flat: Some(1, 2), rgb: Solid(3, 4, 5),
    map: {"k": [4, 5], "l": 6},
    paren: ')', quote: '\'', bytes: b"\")", byte: b'(',
)
"##;

#[test]
fn find_follows_fields_indices_variants_and_options() {
    assert_eq!(value(TEXT, "title"), (r#""a \"b\" ( [""#, 1));
    assert_eq!(value(TEXT, "camera.position[1]"), ("-2e3", 3));
    assert_eq!(value(TEXT, "camera.Perspective.position[2]"), ("+.5", 4));
    assert_eq!(value(TEXT, "camera.Perspective.near_m"), ("0.1", 3));
    assert_eq!(value(TEXT, "camera.Perspective").0.split('(').next(), Some("Perspective"));
    assert_eq!(value(TEXT, "raw"), (r##"r#"x " ) y"#"##, 1));
    assert_eq!(value(TEXT, "list[1].a"), ("2", 3));
    assert_eq!(value(TEXT, "list[1].b"), ("'x'", 3));
    assert_eq!(value(TEXT, "list[2].a"), ("3", 3));
    assert_eq!(value(TEXT, "aim.Along[2]"), ("9", 3));
    assert_eq!(value(TEXT, "aim.Along"), ("Along(7, 8, 9)", 2));
    assert_eq!(value(TEXT, "aim"), ("Along(7, 8, 9)", 1));
    assert_eq!(value(TEXT, "pair.Old[1]"), ("2", 3));
    assert_eq!(value(TEXT, "pair.Old"), ("(1, 2)", 2));
    assert_eq!(value(TEXT, "waves.Waves[1].a"), ("5", 4));
    assert_eq!(value(TEXT, "waves[1].a"), ("5", 3));
    assert_eq!(value(TEXT, "maybe[1]"), ("2", 2));
    assert_eq!(value(TEXT, "flat[1]"), ("2", 2));
    assert_eq!(value(TEXT, "rgb.Solid[1]"), ("4", 3));
    assert_eq!(value(TEXT, "map.k[1]"), ("5", 3));
    assert_eq!(value(TEXT, "paren"), ("')'", 1));
    assert_eq!(value(TEXT, "quote"), (r"'\''", 1));
    assert_eq!(value(TEXT, "bytes"), (r#"b"\")""#, 1));
    assert_eq!(value(TEXT, "byte"), ("b'('", 1));
}

#[test]
fn find_stops_at_the_deepest_value_there_is() {
    assert_eq!(value(TEXT, "camera.far_m").1, 1);
    assert_eq!(value(TEXT, "list[9].a").1, 1);
    assert_eq!(value(TEXT, "nothing.at.all").1, 0);
    assert!(value(TEXT, "").0.starts_with("Scene("));
}

#[test]
fn path_to_leads_back_to_what_find_found() {
    let tree = Tree::parse(TEXT).unwrap();
    for steps in [
        "camera.position[1]",
        "camera.near_m",
        "list[1].b",
        "list[2].a",
        "aim[1]",
        "waves[1].a",
        "pair[1]",
        "maybe[1]",
        "flat[0]",
        "rgb[2]",
        "map.k[1]",
        "map.l",
        "byte",
    ] {
        let (node, depth) = tree.find(&path(steps));
        assert_eq!((tree.path_to(node).to_string().as_str(), depth), (steps, path(steps).0.len()));
    }
    assert_eq!(tree.path_to(Tree::ROOT), Path::default());
    assert_eq!(tree.header(), "#![enable(implicit_some)]\n// A comment with ) and \"quotes\".\n");
}

#[test]
fn fields_start_at_their_names() {
    let tree = Tree::parse(TEXT).unwrap();
    let start = |steps| &TEXT[tree.start(tree.find(&path(steps)).0)..];
    assert!(start("camera.near_m").starts_with("near_m : 0.1"));
    assert!(start("list[1].b").starts_with("r#b: 'x'"));
    assert!(start("list[0]").starts_with("Point(a: 1)"));
}

#[test]
fn position_counts_lines_and_characters_from_one() {
    let text = "aä\r\n😀x\n";
    let at = |offset| Position::of(text, offset);
    assert_eq!(at(0), Position { line: 1, column: 1 });
    assert_eq!(at(1), Position { line: 1, column: 2 });
    assert_eq!(at(2), Position { line: 1, column: 2 }, "an offset inside of a character is that character's");
    assert_eq!(at(5), Position { line: 2, column: 1 });
    assert_eq!(at(9), Position { line: 2, column: 2 });
    assert_eq!(at(11), Position { line: 3, column: 1 });
    assert_eq!(at(99), at(11));
}

#[test]
fn parse_names_the_place_of_each_kind_of_slip() {
    // The text, the byte offset, what was found and what was expected there.
    for (text, offset, found, expected) in [
        ("", 0, "the end of the file", "a value"),
        ("(a: 1", 0, "`(` that is never closed", "`)` before the end of the file"),
        ("(a: [1, 2)", 9, "`)`", "`,` or `]`"),
        ("(a: [1, 2,, 3])", 10, "`,`", "a value"),
        ("(a: 1 b: 2)", 6, "`b`", "`,` or `)`"),
        ("(a: 1) trailing", 7, "`trailing`", "the end of the file"),
        ("(a: )", 4, "`)`", "a value"),
        ("(a: \"x)", 4, "a string that is never closed", "`\"` before the end of the file"),
        ("(a: r#\"x\")", 4, "a raw string that is never closed", "`\"#` before the end of the file"),
        ("(a: 'x)", 4, "a character that is never closed", "`'` before the end of the file"),
        ("(a: 1 /* x", 6, "a comment that is never closed", "`*/` before the end of the file"),
        ("#![enable(", 0, "an attribute that is never closed", "`]` before the end of the file"),
        ("{1 2}", 3, "`2`", "`:`"),
        ("(a: ;)", 4, "`;`", "a value"),
        ("(a: Some(1 2))", 11, "`2`", "`,` or `)`"),
        ("\u{feff}()", 0, "`\\u{feff}`", "a value"),
    ] {
        let error = Tree::parse(text).err().unwrap();
        assert_eq!((error.offset, error.found.as_str(), error.expected.as_str()), (offset, found, expected), "{text}");
    }
}

#[test]
fn parse_refuses_deep_nesting_at_the_first_bracket_too_many() {
    for open in ["(", "[", "{", "Some(", "(a:", "A("] {
        let text = open.repeat(1_000_000);
        let error = Tree::parse(&text).err().unwrap();
        assert!(error.expected.contains("48 brackets"), "{open}: {error:?}");
        assert!(error.offset < 49 * open.len());
    }
    let deepest = format!("{}{}", "[".repeat(MAX_DEPTH), "]".repeat(MAX_DEPTH));
    assert!(Tree::parse(&deepest).is_ok());
}

#[test]
fn excerpt_is_one_short_line() {
    assert_eq!(excerpt("abc", 0..3), "abc");
    assert_eq!(excerpt("a\nb", 0..3), "a…");
    assert_eq!(excerpt(&"ä".repeat(100), 0..200).chars().count(), MAX_EXCERPT + 1);
    assert_eq!(excerpt("abc", 2..9), "");
}
