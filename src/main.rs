//! The program `nephroid`: parse, run, exit code. Everything else is in the library.

use std::io::Write as _;
use std::process::ExitCode;

use nephroid::caustics::TECHNIQUES;
use nephroid::cli::{self, Outcome, Parsed};

fn main() -> ExitCode {
    let command = match cli::parse(std::env::args_os()) {
        Ok(Parsed::Command(command)) => command,
        Ok(Parsed::Answered) => return ExitCode::SUCCESS,
        Err(message) => return fail(&message),
    };
    match cli::run(command, TECHNIQUES) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Differs) => ExitCode::from(cli::EXIT_DIFFERS),
        Ok(Outcome::Interrupted) => ExitCode::from(cli::EXIT_INTERRUPTED),
        Err(error) => fail(&cli::error_chain(&error)),
    }
}

/// Says what went wrong, once. A closed stderr is no reason to panic.
fn fail(message: &str) -> ExitCode {
    let _ = writeln!(std::io::stderr(), "nephroid: {message}");
    ExitCode::from(cli::EXIT_ERROR)
}
