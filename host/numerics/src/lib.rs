//! Statistics of samples, autocorrelation, autoregression, sums over vectors, singular values, and optimisers.
//!
//! The crates that estimate something use it. It does not depend on robots.
//!
//! ```
//! use rig_numerics::statistics::{median, rms};
//!
//! assert_eq!(rms(&[3.0, -3.0]), 3.0);
//! assert_eq!(median(vec![5.0, 1.0, 2.0]), Some(2.0));
//! ```

pub mod autocorrelation;
pub mod autoregression;
pub mod optimise;
pub mod statistics;
pub mod svd;
pub mod vector;
