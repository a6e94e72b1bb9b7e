//! The result of a comparison.

use nalgebra::DMatrix;
use rig_identify::{Estimator, ModelKind};
use rig_model::robot::IdentifiedBand;
use serde::Serialize;

/// A grade; the page on comparisons states the rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grade {
    /// No significant difference, and none of the torque that matters.
    Agree,
    /// Significant differences that change no joint's torque by more than the tolerance.
    DifferWithoutEffect,
    /// Significant differences that change a joint's torque by more than the tolerance.
    DifferAndMatter,
    /// No significant difference, but torques that differ by more than the tolerance: the errors are too large to tell.
    Undecided,
    /// No parameter is shown by every set.
    NotComparable,
}

/// The result; serialises to `compare.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// `rig-compare/1`
    pub schema: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Equations fitted.
    pub model: ModelKind,
    /// Estimator.
    pub estimator: Estimator,
    /// Share of a joint's torque RMS above which a difference matters.
    pub tolerance: f64,
    /// Probability of a false alarm over all tests together; level of the remainder of a hypothesis.
    pub family_level: f64,
    /// Level of the joint test, and of the tests of single parameters after Holm's correction.
    pub test_level: f64,
    /// Grade.
    pub grade: Grade,
    /// Its reasons, sentences.
    pub reasons: Vec<String>,
    /// The sets.
    pub sets: Vec<SetSummary>,
    /// The parameters.
    pub parameters: Vec<PooledParameter>,
    /// Test of all parameters that every set shows.
    pub joint_test: Option<JointTest>,
    /// By set, the same test of all other sets; empty for two sets.
    pub without: Vec<JointTest>,
    /// Pairs of parameters that trade torque.
    pub trades: Vec<Trade>,
    /// Tested causes of the difference.
    pub causes: Option<Causes>,
    /// Torque residuals of each set's parameters on each set's motion.
    pub torque: TorqueMatrix,
    /// Warnings, sentences.
    pub warnings: Vec<String>,
    /// One warning of each kind: that of the set with the largest residual.
    #[serde(skip)]
    pub brief_warnings: Vec<String>,
    /// Content for the written description.
    #[serde(skip)]
    pub pooled: Pooled,
}

/// The pooled values in the form that a description is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct Pooled {
    /// Parameters × standard parameters.
    pub combination: DMatrix<f64>,
    /// Column of the standard regressor that names each parameter.
    pub columns: Vec<usize>,
    /// Values.
    pub values: Vec<f64>,
    /// Covariance.
    pub covariance: DMatrix<f64>,
    /// RMS torque, speed and acceleration of each joint in the liveliest set.
    pub sizes: [Vec<f64>; 3],
    /// Band of each set.
    pub bands: Vec<IdentifiedBand>,
}

/// A set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetSummary {
    /// Name.
    pub name: String,
    /// Its recordings.
    pub recordings: Vec<String>,
    /// Number of combinations that it shows.
    pub rank: usize,
    /// Degrees of freedom of its covariance.
    pub degrees_of_freedom: usize,
    /// Weight of the regressor's covariance in its own, 0 to 1.
    pub shrinkage: f64,
    /// Time after which the motion repeats, s; absent if it does not. The degrees of freedom are then those of one motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeats_after: Option<f64>,
    /// Rows that were used, over all joints.
    pub rows: u64,
    /// By joint, RMS of the residual over RMS of the torque.
    pub relative_error: Vec<f64>,
    /// Parameters that another set shows and this one does not.
    pub not_shown: Vec<String>,
}

/// Value of a parameter in a set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SetValue {
    /// Index of the set.
    pub set: usize,
    /// Value, SI.
    pub value: f64,
    /// Standard deviation within the set.
    pub std: f64,
}

/// A parameter over all sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PooledParameter {
    /// The combination in the notation of the literature.
    pub expression: String,
    /// ASCII
    pub unit: String,
    /// Pooled value, SI.
    pub value: f64,
    /// Its standard error: the larger of that by the errors within the sets and that by the scatter of the sets.
    pub std: f64,
    /// Half the 95 % interval: the larger of the two.
    pub half_interval: f64,
    /// Degrees of freedom with which Student's t times `std` is `half_interval`.
    pub degrees_of_freedom: f64,
    /// Typical standard deviation within a set.
    pub within: f64,
    /// Standard deviation between sets beyond the errors within them.
    pub between: f64,
    /// Values of the sets that show it.
    pub sets: Vec<SetValue>,
    /// Test of equality; absent if only one set shows the parameter.
    pub test: Option<Heterogeneity>,
}

/// Test whether a parameter is the same in all sets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Heterogeneity {
    /// Cochran's Q.
    pub q: f64,
    /// Number of sets minus one.
    pub degrees_of_freedom: usize,
    /// Probability of a Q at least as large by chance.
    pub p: f64,
    /// The same after Holm's correction for the number of parameters.
    pub p_holm: f64,
    /// True if the difference is significant.
    pub differs: bool,
}

/// Test whether all parameters are the same in all sets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JointTest {
    /// Sum of squares in units of the covariances.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a sum at least as large by chance.
    pub p: f64,
    /// True if the difference is significant.
    pub differs: bool,
}

/// Two parameters that take over torque from each other.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trade {
    /// Expressions.
    pub pair: [String; 2],
    /// Correlation of their errors within a set.
    pub correlation: f64,
    /// The two sets that differ most.
    pub sets: [String; 2],
    /// Their differences of the two parameters, second set minus first, SI.
    pub differences: [f64; 2],
    /// RMS torque of each difference alone, and of both together, in units of the residual.
    pub torque: [f64; 3],
}

/// Causes of the difference as hypotheses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Causes {
    /// The hypotheses, the most likely first.
    pub hypotheses: Vec<Hypothesis>,
    /// Name of the cause, if one explains the difference and is better than the others.
    pub named: Option<String>,
    /// The answer, a sentence.
    pub sentence: String,
    /// The comparison after the zero of a joint was corrected, if a zero differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corrected: Option<Corrected>,
}

/// The sets compared again, with positions whose zero was corrected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Corrected {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// By set, what its recorded positions were too large by, with its standard deviation, rad (m). The set to which the
    /// others were corrected has 0.
    pub shifts: Vec<[f64; 2]>,
    /// Test of all parameters, identified again from the corrected positions; the zeros stay free.
    pub joint_test: JointTest,
    /// Hypotheses on what still differs, the most likely first; empty if nothing does.
    pub hypotheses: Vec<Hypothesis>,
    /// Name of the second cause, if there is one.
    pub named: Option<String>,
    /// The answer, a sentence.
    pub sentence: String,
}

/// A hypothesis on what differs between the sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hypothesis {
    /// Name: nothing, scale, friction, offset, gravity, payload, zero, anything.
    pub name: &'static str,
    /// What may differ, words.
    pub what: String,
    /// Number of free values.
    pub free: usize,
    /// Remaining sum of squares.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a remainder at least as large by chance; 1 without degrees of freedom.
    pub p: f64,
    /// Logarithm of the likelihood ratio to "nothing".
    pub log_likelihood_ratio: f64,
    /// Akaike's criterion, less that of the best hypothesis.
    pub aic: f64,
    /// Odds against the best hypothesis: exp(aic/2).
    pub odds_against: f64,
    /// True if the remainder is consistent with chance.
    pub explains: bool,
    /// By set, the scale with its standard deviation relative to the first set; only for "scale".
    pub scales: Vec<[f64; 2]>,
    /// By set, the shift of the zero with its standard deviation relative to the first set, rad (m); only for "zero".
    pub shifts: Vec<[f64; 2]>,
    /// Index of the joint, from 0; only for "zero".
    pub joint: Option<usize>,
}

/// Torque residuals of each set's parameters on each set's motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorqueMatrix {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// By joint, `[motion][parameters]`: RMS of the residual, N·m or N. The last parameters are the pooled ones.
    pub residual: Vec<Vec<Vec<f64>>>,
    /// By joint and motion: RMS torque, N·m or N.
    pub torque: Vec<Vec<f64>>,
    /// By joint, `[motion][parameters]`: RMS added to that of the set's own fit, over the RMS torque.
    pub added: Vec<Vec<Vec<f64>>>,
}

impl TorqueMatrix {
    /// Returns the largest added residual of one set's parameters on another's motion: share, joint, motion, parameters.
    pub fn worst(&self) -> Option<(f64, usize, usize, usize)> {
        (0..self.added.len())
            .filter_map(|j| {
                self.worst_of(j)
                    .map(|(share, motion, set)| (share, j, motion, set))
            })
            .fold(None, |worst, found| match worst {
                Some(most) if most.0 >= found.0 => Some(most),
                _ => Some(found),
            })
    }

    /// Returns the same for one joint: share, motion, parameters.
    pub fn worst_of(&self, joint: usize) -> Option<(f64, usize, usize)> {
        let mut worst: Option<(f64, usize, usize)> = None;
        let by_motion = self.added.get(joint)?;
        for (motion, row) in by_motion.iter().enumerate() {
            // The last entry belongs to the pooled values.
            for (set, share) in row.iter().take(by_motion.len()).enumerate() {
                let more = worst.is_none_or(|(most, ..)| *share > most);
                if set != motion && share.is_finite() && more {
                    worst = Some((*share, motion, set));
                }
            }
        }
        worst
    }
}
