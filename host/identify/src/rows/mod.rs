//! Rows of a model: their definition, computation and accumulation.

pub(crate) mod cache;
pub(crate) mod differential;
pub(crate) mod directions;
pub(crate) mod equation;
pub(crate) mod factor;
pub(crate) mod integral;
pub(crate) mod momentum;
pub(crate) mod motor_momentum;
pub(crate) mod one_way;
pub(crate) mod plan;
pub(crate) mod planned;
pub(crate) mod slow;
pub(crate) mod stream;
pub(crate) mod tally;

#[cfg(test)]
mod rows_test;
