//! Encoder unwrapping and velocity.
