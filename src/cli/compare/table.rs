//! Results of a comparison, as a table or as JSON.

use serde::Serialize;

use crate::cli::{Outcome, output};
use crate::report::{Verdict, number};

use super::Bound;

/// Results of a comparison.
#[derive(Debug)]
pub struct Results {
    /// Description of the reference.
    pub reference: String,
    /// Facts about the reference and the comparison, by name.
    pub facts: Vec<(String, String)>,
    /// Bodies of glass in a scene whose triangles faced in, and were turned over.
    pub bodies_turned: u64,
    /// One column per judged picture.
    pub columns: Vec<Column>,
    /// Names of the pictures written.
    pub files: Vec<String>,
}

/// Results of one judged picture.
#[derive(Debug)]
pub struct Column {
    /// Name of the picture.
    pub name: String,
    /// Value of each measure.
    pub verdicts: Vec<Verdict>,
    /// Value of each measure for the light that comes straight from the lights, if it is compared. Bounds are not for these.
    pub direct: Option<Vec<Verdict>>,
    /// Further facts about the picture, by name.
    pub facts: Vec<(String, String)>,
    /// What the scene contains and a technique does not draw; `None` for a picture of which that is not known.
    pub not_drawn: Option<Vec<&'static str>>,
}

#[derive(Serialize)]
struct Report<'a> {
    reference: &'a str,
    facts: serde_json::Map<String, serde_json::Value>,
    bodies_turned: u64,
    agrees: bool,
    exceeded: Vec<String>,
    files: &'a [String],
    results: Vec<serde_json::Value>,
}

/// Prints the results. Returns whether all bounds are kept.
///
/// # Errors
/// If stdout cannot be written to.
pub fn tell(results: &Results, bounds: &[Bound], json: bool) -> anyhow::Result<Outcome> {
    let exceeded = exceeded(results, bounds);
    if json {
        let facts = |facts: &[(String, String)]| facts.iter().map(|(name, value)| (name.clone(), value.clone().into())).collect();
        let column = |column: &Column| {
            let values = |verdicts: &[Verdict]| {
                let value = |verdict: &Verdict| verdict.value.as_ref().map_or(serde_json::Value::Null, |&value| value.into());
                verdicts.iter().map(|verdict| (verdict.name.to_owned(), value(verdict))).collect::<serde_json::Map<_, _>>()
            };
            let mut all: serde_json::Map<String, serde_json::Value> =
                [("name".to_owned(), column.name.clone().into())].into_iter().collect();
            all.extend(values(&column.verdicts));
            if let Some(direct) = &column.direct {
                all.insert("direct".to_owned(), serde_json::Value::Object(values(direct)));
            }
            all.insert("facts".to_owned(), serde_json::Value::Object(facts(&column.facts)));
            all.extend(column.not_drawn.as_ref().map(|lacks| ("not_drawn".to_owned(), lacks.clone().into())));
            serde_json::Value::Object(all)
        };
        output::json(&Report {
            reference: &results.reference,
            facts: facts(&results.facts),
            bodies_turned: results.bodies_turned,
            agrees: exceeded.is_empty(),
            exceeded: exceeded.clone(),
            files: &results.files,
            results: results.columns.iter().map(column).collect(),
        })?;
    } else {
        output::text(&text(results, &exceeded))?;
    }
    Ok(if exceeded.is_empty() { Outcome::Done } else { Outcome::Differs })
}

/// Every bound that is exceeded. A measure without a value exceeds every bound.
fn exceeded(results: &Results, bounds: &[Bound]) -> Vec<String> {
    let mut exceeded = Vec::new();
    for column in &results.columns {
        for bound in bounds {
            let verdict = column.verdicts.iter().find(|verdict| verdict.name == bound.measure.name);
            let (name, limit) = (bound.measure.name, bound.value);
            match verdict.map(|verdict| &verdict.value) {
                Some(Ok(value)) if bound.measure.is_within(*value, limit) => {}
                Some(Ok(value)) => exceeded.push(format!("{}: {name} is {}, the bound is {limit}", column.name, number(*value, 4))),
                Some(Err(error)) => exceeded.push(format!("{}: {name} has no value ({error}), the bound is {limit}", column.name)),
                None => {
                    exceeded.push(format!("{}: {name} has no value (the reference carries no errors), the bound is {limit}", column.name))
                }
            }
        }
    }
    exceeded
}

fn text(results: &Results, exceeded: &[String]) -> String {
    let mut text = format!("reference: {}\n", results.reference);
    let pairs = |facts: &[(String, String)]| {
        let rows: Vec<[&str; 3]> = facts.iter().map(|(name, value)| ["", name.as_str(), value.as_str()]).collect();
        output::columns(&rows)
    };
    text.push_str(&pairs(&results.facts));
    for column in &results.columns {
        text.push_str(&format!("{}\n", column.name));
        let values = |verdicts: &[Verdict]| -> Vec<(String, String)> {
            let value = |verdict: &Verdict| verdict.value.as_ref().map_or_else(|error| format!("- ({error})"), |&v| number(v, 4));
            verdicts.iter().map(|verdict| (verdict.name.to_owned(), value(verdict))).collect()
        };
        text.push_str(&pairs(&values(&column.verdicts)));
        text.push_str(&pairs(&column.facts));
        if let Some(direct) = &column.direct {
            text.push_str(&format!("{}, direct light\n", column.name));
            text.push_str(&pairs(&values(direct)));
        }
    }
    for file in &results.files {
        text.push_str(&format!("  {file}\n"));
    }
    for line in exceeded {
        text.push_str(&format!("exceeded: {line}\n"));
    }
    text
}
