//! Results of a conformance run, as data and as Markdown.

use std::fmt::{self, Write};

use serde::Serialize;

use super::cases::{Case, Expectation, Kind};
use super::explain::Explanation;
use super::probes::Probe;
use super::shrink::Reproducer;
use crate::AdapterLine;

/// Result of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// No pixel differs.
    Identical,
    /// Pixels differ within the named bound.
    Within,
    /// Pixels differ, no more than the known reason of the case allows.
    Differs,
    /// Pixels differ beyond the expectation.
    Unexpected,
}

/// Results of one case on one driver.
#[derive(Clone, Debug, Serialize)]
pub struct CaseReport {
    /// Name of the case: topic and variant.
    pub name: &'static str,
    /// Description of the case.
    pub what: &'static str,
    /// Kind of the primitives.
    pub kind: Kind,
    /// Number of primitives drawn.
    pub primitives: u64,
    /// Number of pixels compared, over all attachments.
    pub pixels: u64,
    /// Number of pixels with any differing bit under the driver's preset.
    pub differing: u64,
    /// Number of pixels beyond the case's bound.
    pub outliers: u64,
    /// Greatest difference in units in the last place; for normalized formats, in steps.
    pub max_ulp: u64,
    /// Greatest relative error.
    pub max_relative: f64,
    /// The expected result.
    pub expectation: Expectation,
    /// The result.
    pub verdict: Verdict,
    /// A minimal drawing that differs, if a pixel differs.
    pub reproducer: Option<Reproducer>,
    /// Differences from `REFERENCE`, by the rule that causes them.
    pub reference: Explanation,
}

impl CaseReport {
    pub(super) fn new(case: &Case, expectation: Expectation) -> Self {
        Self {
            name: case.name,
            what: case.what,
            kind: case.kind,
            primitives: 0,
            pixels: 0,
            differing: 0,
            outliers: 0,
            max_ulp: 0,
            max_relative: 0.0,
            expectation,
            verdict: Verdict::Identical,
            reproducer: None,
            reference: Explanation::default(),
        }
    }

    /// Whether the result is as expected and, if the preset must be exact, every pixel that differs from `REFERENCE` is explained by a rule.
    #[must_use]
    pub fn passes(&self) -> bool {
        match self.verdict {
            Verdict::Identical | Verdict::Within => self.reference.unexplained == 0,
            Verdict::Differs => true,
            Verdict::Unexpected => false,
        }
    }

    /// The verdict in words, for a table.
    fn in_words(&self) -> String {
        match (self.verdict, self.expectation) {
            (Verdict::Identical, _) => "identical".to_owned(),
            (Verdict::Within, Expectation::Within(bound, name)) => format!("within {bound:e} (`{name}`)"),
            (Verdict::Within, _) => "within".to_owned(),
            (Verdict::Differs, Expectation::Differs(reason, _)) => format!("differs: {reason}"),
            (Verdict::Differs, _) => "differs".to_owned(),
            (Verdict::Unexpected, _) => format!("**unexpected**: {} pixels beyond the bound", self.outliers),
        }
    }
}

/// Results of a conformance run on one driver.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The driver.
    pub adapter: AdapterLine,
    /// Name of the preset that the driver was compared with.
    pub rules: &'static str,
    /// Share of each case's drawings that was drawn.
    pub share: f64,
    /// Results by case.
    pub cases: Vec<CaseReport>,
    /// Results of the calibration probes.
    pub probes: Vec<Probe>,
}

impl Report {
    /// Number of triangles drawn.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        self.cases.iter().filter(|case| case.kind == Kind::Triangles).map(|case| case.primitives).sum()
    }

    /// Whether every case passes.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.cases.iter().all(CaseReport::passes)
    }

    /// Number of differing pixels in the cases of triangles that must be identical.
    #[must_use]
    pub fn differing_where_exact(&self) -> u64 {
        let exact = self.cases.iter().filter(|case| case.expectation == Expectation::Exact && case.kind == Kind::Triangles);
        exact.map(|case| case.differing).sum()
    }

    /// The report as a chapter of `docs/conformance.md`.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, out: &mut String) -> fmt::Result {
        let AdapterLine { name, driver, version, .. } = &self.adapter;
        writeln!(out, "## {name}\n\nDriver: {driver} {version}. Preset: `{}`.\n", self.rules)?;
        let must = self.cases.iter().filter(|case| case.expectation == Expectation::Exact && case.kind == Kind::Triangles);
        writeln!(
            out,
            "{} triangles in all; in those of the cases that must be identical ({}), {} pixels differ under the preset.\n",
            self.triangles(),
            must.map(|case| case.primitives).sum::<u64>(),
            self.differing_where_exact()
        )?;
        writeln!(out, "| Case | Primitives | Pixels | Differing | Max ulp | Max relative | Verdict |")?;
        writeln!(out, "| --- | ---: | ---: | ---: | ---: | ---: | --- |")?;
        for case in &self.cases {
            writeln!(
                out,
                "| {} | {} | {} | {} | {} | {:.1e} | {} |",
                case.name,
                case.primitives,
                case.pixels,
                case.differing,
                case.max_ulp,
                case.max_relative,
                case.in_words()
            )?;
        }
        writeln!(out, "\n### Under `REFERENCE`\n\nPixels that differ, by the rule that makes them differ.\n")?;
        writeln!(out, "| Case | Differing | By rule | Not explained |\n| --- | ---: | --- | ---: |")?;
        for case in self.cases.iter().filter(|case| case.reference.differing > 0) {
            let by_rule: Vec<String> = case.reference.by_rule.iter().map(|count| format!("{} {}", count.rule, count.pixels)).collect();
            writeln!(out, "| {} | {} | {} | {} |", case.name, case.reference.differing, by_rule.join(", "), case.reference.unexplained)?;
        }
        writeln!(out, "\n### Probes\n\n| | Probe | Driver | `REFERENCE` |\n| ---: | --- | --- | --- |")?;
        for probe in &self.probes {
            writeln!(out, "| {} | {} | {} | {} |", probe.number, probe.name, probe.driver, probe.reference)?;
        }
        let differing: Vec<_> = self.cases.iter().filter_map(|case| Some((case.name, case.reproducer.as_ref()?))).collect();
        if !differing.is_empty() {
            writeln!(out, "\n### Reproducers\n\nOne for each case that differs beyond its bound: the fewest primitives that still do.")?;
            for (name, reproducer) in differing {
                writeln!(out, "\n{name} (drawing {}):\n\n```text\n{reproducer}```", reproducer.drawing)?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.markdown())
    }
}
