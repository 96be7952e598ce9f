//! Ctrl-C and termination: stop at once, but never in the middle of a file.
//!
//! The handler runs in a thread of its own. It waits for the file being written, a matter of milliseconds because files are encoded in
//! memory first, and ends the process while no temporary file exists. A flag polled by the renderer was the alternative: it would be
//! slower to react, and every loop of the library would have to know of it.

use std::process;
use std::sync::{Mutex, PoisonError};

use anyhow::Context as _;

/// Exit code after an interrupt: 128 and the number of SIGINT, as shells have it.
const EXIT_INTERRUPTED: i32 = 130;

/// Held while a temporary file exists.
static WRITING: Mutex<()> = Mutex::new(());

/// Installs the handler; once per process.
pub fn install() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        let _no_file_is_open = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        process::exit(EXIT_INTERRUPTED);
    })
    .context("cannot watch for Ctrl-C")
}

/// Runs `write` to its end before any interrupt takes effect.
pub fn uninterrupted<T>(write: impl FnOnce() -> T) -> T {
    let _writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
