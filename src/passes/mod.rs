//! Passes that techniques share.
