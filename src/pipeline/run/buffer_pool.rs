//! Buffers that are kept between passes: fresh memory pages cost more than filling them.

use std::sync::{Mutex, PoisonError};

/// A stack of buffers that nobody uses at the moment.
pub(crate) struct BufferPool<T>(Mutex<Vec<T>>);

impl<T> Default for BufferPool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Default> BufferPool<T> {
    /// Takes a buffer from the pool, or makes one.
    pub fn take(&self) -> T {
        // A poisoned lock only means that another thread panicked; the buffers are fine.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// Returns buffers; the first of them is the next to be taken.
    pub fn give_back(&self, buffers: impl IntoIterator<Item = T, IntoIter: DoubleEndedIterator>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(buffers.into_iter().rev());
    }
}
