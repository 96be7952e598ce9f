//! Results on stdout: columns for readers, JSON for programs.

use std::io::{self, Write};

use serde::Serialize;

/// Prints one JSON value, indented, with a newline.
///
/// # Errors
/// If stdout cannot be written to.
pub fn json(value: &impl Serialize) -> io::Result<()> {
    let mut out = io::stdout().lock();
    serde_json::to_writer_pretty(&mut out, value).map_err(io::Error::from)?;
    writeln!(out)?;
    out.flush()
}

/// Prints text unchanged.
///
/// # Errors
/// If stdout cannot be written to.
pub fn text(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Prints a line to the standard error: what a reader of the results should know.
pub fn note(text: &str) {
    // Without a standard error there is nobody to tell.
    let _ = writeln!(io::stderr().lock(), "nephroid: {text}");
}

/// Formats rows as columns: every column except the last is padded to its longest cell, with two blanks between columns and no trailing blanks.
pub fn columns<const N: usize>(rows: &[[&str; N]]) -> String {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(widths) {
            line.push_str(cell);
            line.extend(std::iter::repeat_n(' ', width + 2 - cell.chars().count()));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

/// Formats a titled list of names and values, with numbers aligned right; empty without lines.
pub fn section(title: &str, lines: &[(&str, String)]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let width = lines.iter().map(|(_, value)| value.len()).max().unwrap_or(0);
    let padded: Vec<_> = lines.iter().map(|(name, value)| (name, format!("{value:>width$}"))).collect();
    let rows: Vec<_> = padded.iter().map(|(name, value)| ["", **name, value.as_str()]).collect();
    format!("{title}\n{}", columns(&rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_without_trailing_blanks() {
        assert_eq!(columns(&[["a", "one"], ["long", ""], ["ab", "two"]]), "a     one\nlong\nab    two\n");
        assert_eq!(columns::<2>(&[]), "");
    }

    #[test]
    fn sections_line_up() {
        assert_eq!(
            section("energy", &[("in", "10.5 W".into()), ("absorbed", "2.25 W".into())]),
            "energy\n  in        10.5 W\n  absorbed  2.25 W\n"
        );
        assert_eq!(section("energy", &[]), "");
    }
}
