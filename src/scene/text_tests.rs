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
    let found = find(text, &path(steps)).unwrap();
    (&text[found.value], found.depth)
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
    check(TEXT).unwrap();
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
fn find_gives_the_name_of_a_field() {
    let found = find(TEXT, &path("camera.near_m")).unwrap();
    assert_eq!(&TEXT[found.name.unwrap()], "near_m");
    assert_eq!(find(TEXT, &path("list[0]")).unwrap().name, None);
}

#[test]
fn find_all_gives_every_duplicate() {
    let twice = "(a: 1, b: 2, a: (a: 3))";
    let found = find_all(twice, &path("a"));
    assert_eq!(found.iter().map(|f| &twice[f.value.clone()]).collect::<Vec<_>>(), ["1", "(a: 3)"]);
    assert_eq!(found[1].name, Some(13..14));
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
fn offset_of_inverts_position_of() {
    for (offset, _) in TEXT.char_indices() {
        assert_eq!(offset_of(TEXT, Position::of(TEXT, offset)), offset);
    }
    assert_eq!(offset_of("ab\n", Position { line: 9, column: 9 }), 3);
}

#[test]
fn find_at_is_the_inverse_of_find() {
    let at = |part: &str| find_at(TEXT, TEXT.find(part).unwrap()).map(|(path, range)| (path.to_string(), &TEXT[range]));
    assert_eq!(at("-2e3"), Some(("camera.position[1]".to_owned(), "-2e3")));
    assert_eq!(at("2e3"), Some(("camera.position[1]".to_owned(), "-2e3")));
    assert_eq!(at("8, 9"), Some(("aim[1]".to_owned(), "8")));
    assert_eq!(at("'x'"), Some(("list[1].b".to_owned(), "'x'")));
    assert_eq!(at("near_m").unwrap().0, "camera");
    assert_eq!(at("// A comment"), None);
}

#[test]
fn check_names_the_place_of_each_kind_of_slip() {
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
        let error = check(text).unwrap_err();
        assert_eq!((error.offset, error.found.as_str(), error.expected.as_str()), (offset, found, expected), "{text}");
        assert_eq!(find(text, &path("a")), None);
        assert_eq!(find_all(text, &path("a")), []);
    }
}

#[test]
fn check_refuses_deep_nesting_at_the_first_bracket_too_many() {
    for open in ["(", "[", "{", "Some(", "(a:", "A("] {
        let text = open.repeat(1_000_000);
        let error = check(&text).unwrap_err();
        assert!(error.expected.contains("48 brackets"), "{open}: {error:?}");
        assert!(error.offset < 49 * open.len());
    }
    let deepest = format!("{}{}", "[".repeat(MAX_DEPTH), "]".repeat(MAX_DEPTH));
    assert_eq!(check(&deepest), Ok(()));
}

#[test]
fn excerpt_is_one_short_line() {
    assert_eq!(excerpt("abc", 0..3), "abc");
    assert_eq!(excerpt("a\nb", 0..3), "a…");
    assert_eq!(excerpt(&"ä".repeat(100), 0..200).chars().count(), MAX_EXCERPT + 1);
    assert_eq!(excerpt("abc", 2..9), "");
}
