//! Serial chains of any length.
