//! Fit of a candidate's shapes, and the tests for its acceptance.

use std::sync::Arc;

use rig_shared::effects::{Kind, SHAPES};

use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::fit::evidence::Evidence;
use crate::fit::least_squares::NOT_NEGATIVE;
use crate::levels::{LEAST_GAIN, SIGNIFICANT};
use crate::rows::regression::Column;
use crate::search::refusal::Refusal;

/// Least ratio of the gain to its standard deviation.
pub(crate) const LEAST_SIGMAS: f64 = 2.0;
/// Least gain beside a near-collinear effect. Both have one form only, so a model without it leaves less.
const LEAST_GAIN_BESIDE_ITS_DOUBLE: f64 = 0.0075;
/// Least ratio of such a small gain to its standard deviation.
const LEAST_SIGMAS_BESIDE_ITS_DOUBLE: f64 = 3.0;
/// Gain that is real even if it varies strongly between blocks. Noise alone gave a fifth: on an elastic link, for a
/// motion with dwells.
const MUCH: f64 = 0.3;
/// The same for an elastic gear, which may ring in few blocks. Not for backlash: it fits a single contact.
const MUCH_OF_A_SPRING: f64 = 0.5;
/// Least ratio of such a gain to its standard deviation: an effect at the highest torque shows in few blocks.
const LEAST_SIGMAS_OF_MUCH: f64 = 1.0;
/// Standard deviations of the sign test over blocks that suffice instead, as a few loud blocks hide the variation.
const SIGNS: f64 = 3.0;
/// Least gain of a gear: its three or four shapes fit much that is no gear.
const LEAST_GAIN_OF_GEARS: f64 = 0.1;
/// Least gain of a backlash that the observer supports.
const LEAST_GAIN_OF_HEARD: f64 = 0.05;
/// Least ratio of the gain to its standard deviation for trying the observer on it.
const CLEAR_SIGMAS: f64 = 4.0;

/// Share of a step's gain from which on an alternative is equal, if the blocks show no difference.
const AS_GOOD: f64 = 0.9;
/// Largest RMS ratio of an equal alternative to the step. A larger one means a missing effect.
const LEAVES: f64 = 1.2;
/// Standard deviations of a paired block difference below which alternatives are equal.
const NO_DIFFERENCE: f64 = 2.5;

/// A candidate with fitted shapes.
#[derive(Clone, Debug)]
pub(crate) struct FittedCandidate {
    /// Which.
    pub(crate) candidate: Candidate,
    /// Its shapes.
    pub(crate) shapes: [f64; SHAPES],
    /// Its columns.
    pub(crate) columns: Arc<Vec<Column>>,
    /// Test results of the columns.
    pub(crate) evidence: Evidence,
    /// Name of the degenerate part: a shape at its lower search bound, a gain outside its bounds, or the stiffness of a
    /// spring that is a constant. For gears also an overdamped swing, or too small a share of the torque.
    pub(crate) at_bound: Option<&'static str>,
    /// True for a backlash that the observer supports.
    pub(crate) accepted_by_observer: bool,
    /// True if a near-collinear effect is in the model.
    pub(crate) near_collinear: bool,
    /// Set for an observer-based gear. Its columns are then a known torque, with gains of 1.
    pub(crate) followed: Option<Followed>,
    /// Shapes of a gear by the other of two methods, if both were used: open-loop and observer-based.
    pub(crate) otherwise: Option<[f64; SHAPES]>,
}

/// Settings of the observer of a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Followed {
    /// RMS of the torque noise on the rows, N·m.
    pub(crate) noise: f64,
}

impl FittedCandidate {
    /// Creates a candidate with given shapes and columns that no test has judged.
    pub(crate) fn unjudged(
        candidate: Candidate,
        shapes: [f64; SHAPES],
        columns: Vec<Column>,
    ) -> Self {
        Self {
            candidate,
            shapes,
            columns: Arc::new(columns),
            evidence: Evidence::default(),
            at_bound: None,
            accepted_by_observer: false,
            near_collinear: false,
            followed: None,
            otherwise: None,
        }
    }

    /// Returns true for one of several gains that cannot be negative: the law stands without it. A law whose only gain is
    /// zero is none.
    pub(crate) fn may_be_zero(&self, gain: usize) -> bool {
        let gains = self.candidate.kind.about().gains;
        gains.len() == self.columns.len() && gains.len() > 1 && gains[gain].bounds == NOT_NEGATIVE
    }

    /// Returns the reason for refusal at a p-value corrected for `tried` trials; None if the candidate passes.
    pub(crate) fn refused(&self, tried: usize) -> Option<Refusal> {
        let e = &self.evidence;
        let p = self.corrected(tried);
        if let Some(part) = self.at_bound {
            Some(Refusal::AtBound(part))
        } else if p > SIGNIFICANT {
            Some(Refusal::Significance { p, trials: tried })
        } else if e.joint_gain < self.least_gain() {
            Some(Refusal::Gain {
                gain: e.joint_gain,
                least: self.least_gain(),
            })
        } else if self.in_too_few_blocks() {
            Some(Refusal::Variation {
                sigmas: e.gain_sigmas,
            })
        } else {
            None
        }
    }

    /// Returns true if the gain proves that something is missing, whatever its name.
    pub(crate) fn takes_much(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.corrected(tried) <= SIGNIFICANT
            && e.joint_gain >= MUCH
            && e.gain_sigmas >= LEAST_SIGMAS
    }

    /// Returns true if the gain is not clear of its variation between blocks. A gear fits many things. Any other effect
    /// may also pass by the number of blocks that it improves.
    pub(crate) fn in_too_few_blocks(&self) -> bool {
        let e = &self.evidence;
        let gear = is_gear(self.candidate.kind);
        let much = match self.candidate.kind {
            Kind::JointElasticity => e.joint_gain >= MUCH_OF_A_SPRING,
            _ => !gear && e.joint_gain >= MUCH,
        };
        let least = if much {
            LEAST_SIGMAS_OF_MUCH
        } else if self.near_collinear && e.joint_gain < LEAST_GAIN {
            LEAST_SIGMAS_BESIDE_ITS_DOUBLE
        } else {
            LEAST_SIGMAS
        };
        e.gain_sigmas < least && (gear || e.sign_sigmas() < SIGNS)
    }

    /// Returns true for a backlash that passes all tests except the least gain, because the link is open-loop.
    pub(crate) fn is_nearly_a_play(&self, tried: usize) -> bool {
        let e = &self.evidence;
        self.candidate.kind == Kind::Backlash
            && self.at_bound.is_none()
            && self.corrected(tried) <= SIGNIFICANT
            && (LEAST_GAIN_OF_HEARD..LEAST_GAIN_OF_GEARS).contains(&e.joint_gain)
            && e.gain_sigmas >= CLEAR_SIGMAS
    }

    pub(crate) fn least_gain(&self) -> f64 {
        if self.accepted_by_observer {
            LEAST_GAIN_OF_HEARD
        } else if self.near_collinear {
            LEAST_GAIN_BESIDE_ITS_DOUBLE
        } else if is_gear(self.candidate.kind) {
            LEAST_GAIN_OF_GEARS
        } else {
            LEAST_GAIN
        }
    }

    /// Returns the p-value corrected for `tried` trials.
    pub(crate) fn corrected(&self, tried: usize) -> f64 {
        self.evidence.corrected(tried)
    }
}

/// Returns true if the data support a rival equally well.
pub(crate) fn equal(own: &FittedCandidate, rival: &FittedCandidate) -> bool {
    rival.candidate.joint == own.candidate.joint
        && rival.evidence.gain >= AS_GOOD * own.evidence.gain
        && 1.0 - rival.evidence.gain <= LEAVES * (1.0 - own.evidence.gain)
        && own.evidence.ahead_of(&rival.evidence) < NO_DIFFERENCE
}

#[cfg(test)]
mod tests;
