//! Preparation of a recording: filtered, differentiated and masked motion, with a record of each step.
//!
//! There are two passes. A [`Survey`] reads the whole recording (rate, ranges, spectrum of the position), and a
//! [`PreprocessingPlan`] is decided from it. Then [`each_motion`] returns the motion piece by piece. Filters are
//! zero-phase, and the pieces overlap by the memory of the filters, so the result does not depend on the cuts.
//!
//! Over 8 rows, the time may deviate from an even grid by 0.4 of a step. Recordings that deviate more are interpolated
//! to an even step; they are refused if a step is longer than five mean steps ([`surveyed`]).
//!
//! A delay between torque and position is not corrected here.

mod decimate;
mod error;
mod filter;
mod motion;
mod other_rate;
mod pieces;
mod preprocessing_plan;
mod rate;
pub mod record;
mod resample;
mod resampling;
mod spacing;
mod spectrum;
mod spool;
mod survey;
mod workers;

pub use crate::block::stretch;
pub use decimate::{Decimator, Stream};
pub use error::PrepareError;
pub use filter::{LowPass, central_difference, decimator_edge, second_difference};
pub use motion::later;
pub use motion::{JointMotion, Motion, each_motion, worked_motion};
pub use pieces::{Beginning, Changed, LongestPart, first_block, longest_part};
pub use pieces::{InMemory, Piece, Recording, Unburdened, each_piece};
pub use preprocessing_plan::MAX_CUTOFF_SHARE;
pub use preprocessing_plan::{Choice, CutoffTrial, Masked, PrepareOptions, PreprocessingPlan};
pub use rate::{same_rate, trimmed_rows};
pub use resample::Resampled;
pub use resampling::interpolation;
pub use resampling::{MaybeResampled, as_recordings, surveyed};
pub use spectrum::{NOISE_SHARE, PositionSpectrum, Welch};
pub use spool::Spooled;
pub use survey::{JointSurvey, Survey};
pub use workers::{each_of, threads};
