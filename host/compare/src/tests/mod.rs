//! Tests on recordings made from closed-form equations or by forward dynamics, which share no code with the fitted regressor.
#![allow(clippy::unwrap_used, clippy::panic)]

mod causes;
mod made;
mod pooled;
mod simulated;
mod unlike;
