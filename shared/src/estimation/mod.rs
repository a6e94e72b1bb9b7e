//! On-line estimation of linear parameters.

pub mod gradient;
pub mod least_squares;
pub mod one_link;
pub mod recursive;
mod report;
mod rows;
mod settings;
pub mod ud;
pub mod uncertainty;

#[cfg(test)]
mod cost;
#[cfg(test)]
mod tests;

pub use one_link::OneLinkEstimator;
pub use report::{Report, Update};
pub use rows::{Learning, RowCounter, RowCounts};
pub use settings::{EstimatorKind, EstimatorSettings, SettingsFault};
