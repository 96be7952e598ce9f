//! Ctrl-C and termination: stop at once, but never in the middle of a file.
//!
//! The handler runs in a thread of its own. It waits for the file being written, a matter of milliseconds because files are encoded in
//! memory first, and ends the process while no temporary file exists. A flag polled by the renderer was the alternative: it would be
//! slower to react, and every loop of the library would have to know of it.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::Context as _;

/// Exit code after an interrupt: 128 and the number of SIGINT, as shells have it.
pub const EXIT_INTERRUPTED: u8 = 130;

/// Held while a temporary file exists.
static WRITING: Mutex<()> = Mutex::new(());

/// Set by the first interrupt of a verb that keeps what it has.
static ASKED: AtomicBool = AtomicBool::new(false);

/// Installs the handler; once per process.
pub fn install() -> anyhow::Result<()> {
    ctrlc::set_handler(end).context("cannot watch for Ctrl-C")
}

/// Installs a handler that only takes note of the first interrupt, for a verb that looks at [`is_asked`] often and then keeps what it has; a
/// second one ends the process.
pub fn install_patient() -> anyhow::Result<()> {
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::SeqCst) {
            end();
        }
    })
    .context("cannot watch for Ctrl-C")
}

/// Whether an interrupt has asked to end.
pub fn is_asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

fn end() {
    let _no_file_is_open = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    process::exit(i32::from(EXIT_INTERRUPTED));
}

/// Runs `write` to its end before any interrupt takes effect.
pub fn uninterrupted<T>(write: impl FnOnce() -> T) -> T {
    let _writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
