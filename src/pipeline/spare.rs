//! Buffers that outlive what they were made for, because fresh pages are dear.

use std::sync::{Mutex, PoisonError};

/// A stack of them.
pub(super) struct Spare<T>(Mutex<Vec<T>>);

impl<T> Default for Spare<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Default> Spare<T> {
    /// One of them, or a new one.
    pub fn take(&self) -> T {
        // A poisoned lock only means that another thread panicked; the buffers are fine.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// Returns some, the first of them to be taken first.
    pub fn give_back(&self, buffers: impl IntoIterator<Item = T, IntoIter: DoubleEndedIterator>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(buffers.into_iter().rev());
    }
}
