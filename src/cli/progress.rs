//! A progress bar on stderr, only on a terminal and only for work that takes longer than a second.

use std::io::{IsTerminal as _, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Time between two updates of the bar.
const TICK: Duration = Duration::from_millis(100);

/// A progress bar over a known number of steps; removed from the screen when dropped.
pub struct Progress {
    bar: ProgressBar,
    /// Dropping the sender wakes the thread that waits to show the bar.
    waiting: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    /// A bar of `step_count` steps. It is hidden for the first second, and always if stderr is not a terminal.
    pub fn new(step_count: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(step_count), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{spinner} [{bar:24}] {pos}/{len} {msg} {elapsed}") {
            bar.set_style(style.progress_chars("=> "));
        }
        let waiting = stderr().is_terminal().then(|| {
            let (sender, receiver) = channel::<()>();
            let shown = bar.clone();
            let thread = thread::spawn(move || {
                if receiver.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                    shown.set_draw_target(ProgressDrawTarget::stderr());
                    shown.enable_steady_tick(TICK);
                }
            });
            (sender, thread)
        });
        Self { bar, waiting }
    }

    /// Sets the message that describes the current step.
    pub fn step(&self, message: impl Into<String>) {
        self.bar.set_message(message.into());
    }

    /// Sets the number of finished steps.
    pub fn reach(&self, steps: u64) {
        self.bar.set_position(steps);
    }

    /// Finishes one step.
    pub fn done(&self) {
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.waiting.take() {
            drop(sender);
            // A failure to draw the bar is ignored.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}
