//! Model mathematics over whole recordings: one call, many samples.
//!
//! The unit of work is a recording. Signals come as one column of samples a joint (`&[Vec<f64>]`, `&[&[f64]]`,
//! `[[f64; N]; n]`, …, all columns of the same length N); results go into flat slices of the caller, column after
//! column, each of N samples: entry `c` of sample `k` is `out[c * N + k]`. Nothing is allocated a sample.
//!
//! [`ModelBatch`] computes with the parameters of a robot, [`ChainBatch`] its regressors, which need the geometry
//! alone. The differential regressor is large (14·n² columns, more than half of them zero) and has a store of its own,
//! [`RegressorBlock`]. With room for the recording it holds all of it; where the regressor is only going to be filtered,
//! accumulated or multiplied, [`ChainBatch::each_differential_block`] hands it over in pieces as long as the block, and
//! those of [`BLOCK`] samples are then still in the cache.
//!
//! Threads are the caller's business; [`over_threads`] cuts a recording into stretches.

mod chain;
mod dispatch;
mod error;
mod model;
mod signals;
#[cfg(test)]
mod tests;
mod threads;

pub use chain::{ChainBatch, RegressorBlock};
pub use error::BatchError;
pub use model::ModelBatch;
pub use rig_shared::multibody::block::lower;
pub use threads::{each_by, over_threads};

/// Samples of a block whose regressor stays in the cache.
pub const BLOCK: usize = 64;
