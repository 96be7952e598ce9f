//! What is refused before anything is drawn: one bad value for each rule, which must give exactly the rule's cause, and the nearest good value,
//! which must be accepted. What is allowed beyond WebGPU must be accepted, too.
//!
//! The rules are the rows of `docs/validation.md`, and a test holds both lists together.

mod allowed;
mod draws;
mod frames;
mod passes;
mod pipelines;
mod textures;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A rule, and what became of its bad and of its good value.
struct Row {
    rule: &'static str,
    /// What the bad value gave.
    seen: String,
    /// Whether that is the rule's cause.
    expected: bool,
    /// Why the good value was refused, if it was.
    refused: Option<String>,
}

/// `rule!(name: bad value => pattern of the cause, good value)`, both values as results.
macro_rules! rule {
    ($rule:literal: $bad:expr => $cause:pat, $good:expr) => {{
        let bad = $bad;
        let expected = matches!(&bad, Err($cause));
        crate::validation::Row { rule: $rule, seen: format!("{bad:?}"), expected, refused: $good.err().map(|error| error.to_string()) }
    }};
}
use rule;

fn rows() -> Vec<Row> {
    let parts = [pipelines::targets(), pipelines::depth_and_stencil(), pipelines::vertices(), pipelines::programs()];
    let parts = parts.into_iter().chain([textures::textures(), textures::views(), textures::samplers()]);
    let parts = parts.chain([passes::bindings(), passes::attachments(), draws::draws(), draws::vertices()]);
    parts.chain([frames::bind_groups(), frames::passes(), frames::streams(), allowed::allowed()]).flatten().collect()
}

#[test]
fn every_rule_names_its_cause_and_accepts_the_nearest_good_value() {
    let rows = rows();
    for Row { rule, seen, expected, refused } in &rows {
        assert!(*expected, "{rule}: the bad value gave {seen}");
        assert!(refused.is_none(), "{rule}: the good value was refused: {}", refused.as_deref().unwrap_or(""));
    }
    assert_eq!(rows.iter().map(|row| row.rule).collect::<BTreeSet<_>>().len(), rows.len(), "two rows have one name");
}

#[test]
fn the_page_lists_every_rule_that_is_tested_and_no_other() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/validation.md")).expect("the page is there");
    let listed: BTreeSet<&str> = page.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    let tested: BTreeSet<&str> = rows().iter().map(|row| row.rule).collect();
    assert_eq!(listed.difference(&tested).collect::<Vec<_>>(), Vec::<&&str>::new(), "on the page alone");
    assert_eq!(tested.difference(&listed).collect::<Vec<_>>(), Vec::<&&str>::new(), "in the tests alone");
}

#[test]
fn a_wrong_cause_and_a_refused_neighbour_are_seen() {
    let row = rule!("negative": Err::<(), &str>("that") => "this", Err::<(), &str>("no"));
    assert!(!row.expected && row.refused.is_some(), "{}: {}", row.rule, row.seen);
}
