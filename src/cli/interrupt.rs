//! Ctrl-C and termination: the program stops at once, but never in the middle of writing a file.
//!
//! The handler runs in a thread of its own. It waits for the file that is being written (milliseconds, because files are encoded in memory first) and
//! ends the process while no temporary file exists. Road not taken: a flag polled by the renderer would react more slowly, and every loop of the
//! library would have to check it.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::Context as _;

/// Exit code after an interrupt: 128 plus the number of SIGINT, as in shells.
pub const EXIT_INTERRUPTED: u8 = 130;

/// Locked while a temporary file exists.
static WRITING: Mutex<()> = Mutex::new(());

/// Set by the first interrupt of a verb that saves its state.
static ASKED: AtomicBool = AtomicBool::new(false);

/// Installs the handler; may be called once per process.
///
/// # Errors
/// If the system refuses the handler.
pub fn install() -> anyhow::Result<()> {
    ctrlc::set_handler(end).context("cannot watch for Ctrl-C")
}

/// Installs a handler for a verb that polls [`is_asked`] and then saves its state. The first interrupt only sets the flag; a second one ends the
/// process.
///
/// # Errors
/// If the system refuses the handler.
pub fn install_patient() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            end();
        }
    })
    .context("cannot watch for Ctrl-C")
}

/// Whether an interrupt has requested the end.
pub fn is_asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

fn end() {
    let _no_file_is_open = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    process::exit(i32::from(EXIT_INTERRUPTED));
}

/// Runs `write` completely before an interrupt can take effect.
pub fn uninterrupted<T>(write: impl FnOnce() -> T) -> T {
    let _writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
