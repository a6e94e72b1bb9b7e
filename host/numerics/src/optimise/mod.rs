//! Optimisers, one a file. Each is by hand for the reason at its head.

pub mod bfgs;
pub mod gauss_newton;
pub mod golden_section;
pub mod levenberg_marquardt;
pub mod non_negative;
pub mod simplex;
