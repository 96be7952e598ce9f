//! Buffers that are kept between passes: allocating fresh memory pages costs more than filling them.

use std::sync::{Mutex, PoisonError};

/// A stack of buffers that are not in use.
pub(crate) struct BufferPool<T>(Mutex<Vec<T>>);

impl<T> Default for BufferPool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Default> BufferPool<T> {
    /// Takes a buffer from the pool, or makes a new one.
    pub fn take(&self) -> T {
        // A poisoned lock means only that another thread panicked; the buffers are intact.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// Returns buffers to the pool; the first of them will be taken first.
    pub fn give_back(&self, buffers: impl IntoIterator<Item = T, IntoIter: DoubleEndedIterator>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(buffers.into_iter().rev());
    }
}
