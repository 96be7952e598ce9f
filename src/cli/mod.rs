//! The command line: one verb per file, each in two steps.
//!
//! A verb's `LowArgs` are exactly the arguments as typed; each flag is checked alone, without side effects. `HiArgs` are the resolved arguments:
//! defaults filled in, contradictions refused, files found. Only then does the verb run.
//!
//! This is the only layer that uses the terminal, the clock, signals and the current folder. Results go to stdout, as text or with `--json`; progress
//! and errors go to stderr. Exit codes: 0 done, 1 compared and different, 2 error, 130 interrupted. Files are written whole or not at all, also if
//! the program is interrupted.

mod args;
mod compare;
mod crosscheck;
mod drivers;
mod files;
mod interrupt;
mod list;
mod output;
mod pace;
mod progress;
mod render;
mod renderer;
mod tables;
mod trace;
mod truth;

use std::ffi::OsString;
use std::fmt::Write as _;
use std::io;

use clap::{Parser, Subcommand, error::ErrorKind};

use crate::caustics::Techniques;

pub use renderer::{SettingLine, TechniqueLine, setting_lines, technique_lines};

/// Exit code of a comparison that finds a difference.
pub const EXIT_DIFFERS: u8 = 1;

/// Exit code of a run that was interrupted and can be continued.
pub const EXIT_INTERRUPTED: u8 = interrupt::EXIT_INTERRUPTED;

/// Exit code of every error, including usage errors and comparisons that could not be made.
pub const EXIT_ERROR: u8 = 2;

/// Renders real-time caustics on a deterministic software GPU.
#[derive(Debug, Parser)]
#[command(name = "nephroid", version, propagate_version = true, subcommand_required = true)]
struct Line {
    #[command(subcommand)]
    command: Command,
}

/// What the user wants done: one verb with its arguments as typed.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to PNG and EXR
    Render(Box<render::LowArgs>),
    /// Compare the software GPU with a Vulkan driver, attachment by attachment (in builds with the feature `wgpu`)
    Crosscheck(Box<crosscheck::LowArgs>),
    /// Trace photons through a scene: what the techniques are judged by
    Trace(Box<trace::LowArgs>),
    /// Compare two pictures, or techniques with the ground truth of a scene
    Compare(Box<compare::LowArgs>),
    /// Measure a paper's tables again, beside its own numbers
    Tables(tables::LowArgs),
    /// List the techniques, the scenes in a folder, the drivers, or what --set can change
    List(list::LowArgs),
}

/// Result of parsing a command line without errors.
#[derive(Debug)]
pub enum Parsed {
    /// A command to run.
    Command(Command),
    /// Help or version was requested and has been printed.
    Answered,
}

/// Parses a command line, program name first.
///
/// # Errors
/// With a message for stderr.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Parsed, String> {
    match Line::try_parse_from(arguments) {
        Ok(line) => Ok(Parsed::Command(line.command)),
        Err(answer) if matches!(answer.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            // A closed pipe is not an error: the reader has read enough.
            let _ = answer.print();
            Ok(Parsed::Answered)
        }
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            Err(format!("a command is missing\n\n{}", error.render().to_string().trim_end()))
        }
        Err(error) => {
            let text = error.render().to_string();
            Err(text.strip_prefix("error: ").unwrap_or(&text).trim_end().to_owned())
        }
    }
}

/// Outcome of a command that ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Done, and no comparison has found a difference.
    Done,
    /// Done, and a comparison has found a difference.
    Differs,
    /// Interrupted; the state for continuing has been saved.
    Interrupted,
}

/// Runs a command with these techniques.
///
/// # Errors
/// With the error of the verb and its causes.
pub fn run(command: Command, techniques: Techniques) -> anyhow::Result<Outcome> {
    let result = match command {
        Command::Render(low) => render::HiArgs::resolve(*low, techniques).and_then(|args| render::run(&args)).map(|()| Outcome::Done),
        Command::Crosscheck(low) => crosscheck::HiArgs::resolve(*low, techniques).and_then(|args| crosscheck::run(&args)),
        Command::Trace(low) => trace::HiArgs::resolve(*low, techniques).and_then(|args| trace::run(&args)),
        Command::Compare(low) => compare::HiArgs::resolve(*low, techniques).and_then(|args| compare::run(&args)),
        Command::Tables(low) => tables::run(&low, techniques).map(|()| Outcome::Done),
        Command::List(low) => list::run(&low, techniques).map(|()| Outcome::Done),
    };
    match result {
        // `nephroid list scenes | head -1` is not an error.
        Err(error) if error.downcast_ref::<io::Error>().is_some_and(|io| io.kind() == io::ErrorKind::BrokenPipe) => Ok(Outcome::Done),
        other => other,
    }
}

/// An error and its causes in one line. A cause that the error's text already contains is not repeated.
#[must_use]
pub fn error_chain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            // Writing to a string cannot fail.
            let _ = write!(text, ": {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_definition_is_consistent() {
        use clap::CommandFactory as _;
        Line::command().debug_assert();
    }

    #[test]
    fn causes_are_told_once() {
        let quoted = anyhow::anyhow!("disk full").context("cannot write a.png: disk full");
        assert_eq!(error_chain(&quoted), "cannot write a.png: disk full");
        let bare = anyhow::anyhow!("disk full").context("cannot write a.png");
        assert_eq!(error_chain(&bare), "cannot write a.png: disk full");
    }
}
