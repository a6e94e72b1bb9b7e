//! Dynamics over whole recordings: one call, many samples.
//!
//! The unit of work is a recording. Signals come as one column of samples a joint (`&[Vec<f64>]`, `&[&[f64]]`,
//! `[[f64; N]; n]`, …), all columns of the same length N. Results go into flat slices of the caller, column after
//! column, each of N samples: entry `c` of sample `k` is `out[c * N + k]`. No memory is allocated per sample.
//!
//! [`ModelBatch`] uses the parameters of a robot. [`ChainBatch`] computes regressors, which need only the geometry. The
//! differential regressor is large (14·n² columns, more than half of them zero) and has its own store,
//! [`RegressorBlock`]. A block can hold a whole recording. To filter, accumulate or multiply the regressor,
//! [`ChainBatch::each_differential_block`] delivers it in pieces; pieces of [`BLOCK`] samples are still in the cache.
//!
//! All of this exists for `f64` and for `f32`: the type of the signals and results decides. With `f32` twice as many
//! samples fill a vector register. Descriptions stay in `f64`; what depends on them alone is computed in it.
//!
//! The caller starts the threads; [`over_threads`] cuts a recording into stretches.

mod chain;
mod dispatch;
mod error;
mod gears;
#[cfg(test)]
mod gears_test;
mod model;
mod signals;
#[cfg(test)]
mod single_tests;
#[cfg(test)]
mod tests;
mod threads;

pub use chain::{ChainBatch, RegressorBlock};
pub use dispatch::Number;
pub use error::BatchError;
pub use model::{Derivatives, ModelBatch};
pub use rig_shared::multibody::block::lower;
pub use threads::{BLOCK, each_by, over_threads};
