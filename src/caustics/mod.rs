//! The techniques.
