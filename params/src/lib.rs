//! Parameter sets.
