//! Warnings of an identification as data. Their sentences are made here, in [`std::fmt::Display`].

use std::fmt;
use std::mem::{Discriminant, discriminant};

use rig_output::{format_significant, format_unit, format_value, listed};
use serde::{Serialize, Serializer};

use crate::estimator::Estimator;
use rig_model::robot::CONTRADICTED;

/// Independent stretches of a recording from which the intervals of the parameters are reliable.
pub const LEAST_STRETCHES: f64 = 8.0;
/// Correlation times of the residuals in an independent stretch.
pub const MEMORIES: f64 = 10.0;

/// A warning of an identification. As text and as JSON it is one or more sentences.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// The torque led to another cut-off than the spectrum of the position, Hz.
    CutoffByTorque {
        /// Chosen cut-off.
        cutoff: f64,
        /// That of the spectrum.
        by_spectrum: f64,
    },
    /// Some joints are explained clearly better with a cut-off of their own.
    OwnCutoffs(Vec<OwnCutoff>),
    /// A recording was interpolated to an even step; the sentence of the preparation.
    Interpolated(String),
    /// A hold-out recording has another sample rate than the training data.
    OtherRate {
        /// The recording.
        label: String,
        /// Its sample rate and that of the training data, Hz.
        rates: [f64; 2],
        /// One row in this number is judged.
        decimation: usize,
        /// Highest frequency of its errors and of those of the training data, Hz.
        edges: [f64; 2],
    },
    /// The residual follows the rate of the torque.
    TorqueLead {
        /// Joint whose torque alone does; `None` for all.
        joint: Option<String>,
        /// Time by which the torque was recorded before it acts, s; negative if after.
        lead: f64,
        /// Sample period, s.
        sample: f64,
    },
    /// The given torque lead is many samples long.
    LongLead {
        /// Samples.
        samples: f64,
    },
    /// An estimator had not settled.
    Unsettled {
        /// The estimator.
        by: Unsettled,
        /// Its passes.
        passes: usize,
        /// Last motion of a parameter in standard deviations, if known.
        moved: Option<f64>,
    },
    /// Too few independent stretches for reliable intervals: fewer than [`LEAST_STRETCHES`].
    FewStretches {
        /// Correlation time of the residuals, s.
        memory: f64,
        /// Independent stretches.
        stretches: f64,
    },
    /// The motion tells some parameters apart badly.
    IllConditioned {
        /// Condition number of the scaled regressor.
        condition: f64,
    },
    /// Inertias or viscous friction that came out below zero: each with its joint, value, standard deviation and unit.
    BelowZero(Vec<String>),
    /// Joints with one kind of finding, the worst first.
    Joints(Vec<JointFinding>),
    /// The prior rests on stand-ins.
    StandIns,
    /// The estimate by instrumental variables is not to be trusted; the reason, a clause.
    Distrusted(String),
    /// The estimator leaves much more than the weighted fit.
    LargerResidual {
        /// The estimator.
        estimator: Estimator,
        /// Joints and ratios of the residuals.
        joints: Vec<(String, f64)>,
        /// True if the comparison recommends the estimator.
        trusted: bool,
    },
    /// No physically consistent set is given; the reason.
    Inconsistent(String),
    /// Described effects that the torque for a given motion does not show; a sentence.
    EffectsLeftOut(String),
    /// The torques of joints are the described gravity times a factor.
    TorqueScale(Vec<TorqueScale>),
    /// The torques of the joints contradict each other, which one of these factors explains.
    TorqueDisagrees(Vec<TorqueFactor>),
    /// A sentence of the program that read the recordings or judged the values.
    Other(String),
}

/// The torque of a joint over that of the described gravity.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueScale {
    /// The joint.
    pub joint: String,
    /// The factor, 1.
    pub factor: f64,
    /// Its standard deviation.
    pub std: f64,
    /// True if the torque of a joint before it shows the described masses, and refutes heavier ones.
    pub masses_confirmed: bool,
}

impl TorqueScale {
    /// Returns true if both are the same factor of the same joint: within their standard deviations, and by far nearer to
    /// each other than to one.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let apart = (self.factor - other.factor).abs();
        let near = (CONTRADICTED * self.std.hypot(other.std)).min(0.5 * (self.factor - 1.0).abs());
        self.joint == other.joint && apart < near
    }

    /// Says what the torques of some joints are.
    fn of_joints(list: &[Self]) -> String {
        let said = |confirmed: bool| -> Vec<String> {
            let own = list.iter().filter(|own| own.masses_confirmed == confirmed);
            own.map(|own| format!("{} of {}", format_value(own.factor, own.std), own.joint))
                .collect()
        };
        let (certain, open) = (said(true), said(false));
        let mut text = Vec::new();
        if !certain.is_empty() {
            text.push(format!(
                "The torque over that of the described gravity is {} (± one standard deviation), while a joint before it shows the described masses: the torque constant or gear ratio {}.",
                listed(&certain),
                match certain.len() {
                    1 => "is off by this factor",
                    _ => "of each is off by its factor",
                }
            ));
        }
        if !open.is_empty() {
            text.push(format!(
                "The torque over that of the described gravity is {} (± one standard deviation): either the described masses are off by {}. These data do not tell which; weigh the links.",
                listed(&open),
                match open.len() {
                    1 => "this factor, or the torque constant is",
                    _ => "these factors, or the torque constants are",
                }
            ));
        }
        text.join(" ")
    }
}

/// Least factor of a position by a unit, a ratio or counts.
const FACTOR_OF_POSITION: f64 = 1.4;

/// The torque of a joint over what the torques of the other joints show.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueFactor {
    /// The joint.
    pub joint: String,
    /// The factor, 1.
    pub factor: f64,
    /// Its standard deviation.
    pub std: f64,
}

impl TorqueFactor {
    /// Returns true if both are the same factor of the same joint: within their standard deviations, and by far nearer to
    /// each other than to one.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let apart = (self.factor - other.factor).abs();
        let near = (CONTRADICTED * self.std.hypot(other.std)).min(0.5 * (self.factor - 1.0).abs());
        self.joint == other.joint && apart < near
    }

    /// Says which of some joints may be off.
    fn of_joints(list: &[Self]) -> String {
        let each: Vec<String> = (list.iter())
            .map(|own| {
                format!(
                    "that of {} {} times",
                    own.joint,
                    format_value(own.factor, own.std)
                )
            })
            .collect();
        let which = match list.len() {
            1 => "its torque constant or gear ratio is off by this factor",
            _ => {
                "the torque constant or gear ratio of one of them is off by its factor, and these data do not tell which"
            }
        };
        let far =
            |own: &Self| own.factor > FACTOR_OF_POSITION || own.factor < 1.0 / FACTOR_OF_POSITION;
        let or = match list.iter().any(far) {
            true => ", or its position by the inverse",
            false => "",
        };
        format!(
            "The torques of the joints contradict each other. One factor explains it: {} what the others show (± one standard deviation); {which}{or}.",
            each.join(", or ")
        )
    }
}

/// A cut-off that explains the torque of one joint best.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnCutoff {
    /// The joint.
    pub joint: String,
    /// Hz
    pub cutoff: f64,
    /// Share of the residual that it takes away, 1.
    pub less: f64,
}

/// An estimator in passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unsettled {
    /// The robust fit.
    Robust,
    /// Output error.
    OutputError,
    /// Maximum likelihood.
    Likelihood,
    /// Instrumental variables.
    Instrumental,
}

/// A set of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Training data.
    Training,
    /// Hold-out.
    Holdout,
}

/// What was found at one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFinding {
    /// Name of the joint.
    pub joint: String,
    /// Units of its position and of its torque.
    pub units: (&'static str, &'static str),
    /// What was found.
    pub what: AtJoint,
}

/// A finding at a joint.
#[derive(Clone, Debug, PartialEq)]
pub enum AtJoint {
    /// It stands still at a position in all training recordings.
    Still(f64),
    /// Share of the torque that the model leaves, 1.
    Unexplained(f64),
    /// The residual on the hold-out is larger than on the training data.
    WorseOnHoldout {
        /// On the hold-out, N·m or N.
        rms: f64,
        /// Ratio to that on the training data.
        times: f64,
    },
    /// It moves by less than a share of its range.
    Creeps {
        /// Largest travel, rad or m.
        travel: f64,
        /// The share, 1.
        share: f64,
    },
    /// Every row was left out.
    NoRow {
        /// Of which recordings.
        part: Part,
        /// Speed below which rows are left out, rad/s or m/s.
        slowest: f64,
    },
    /// It moves by no more than the noise of its encoder.
    OnlyNoise {
        /// In which recordings.
        part: Part,
        /// Speed below which rows are left out, rad/s or m/s.
        slowest: f64,
    },
}

/// Kind of a warning: two warnings of one kind differ in numbers and names only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WarningKind {
    of: Discriminant<Warning>,
    by: Option<Unsettled>,
    at_joint: Option<(Discriminant<AtJoint>, Option<Part>)>,
}

impl Warning {
    /// Returns the kind.
    pub fn kind(&self) -> WarningKind {
        WarningKind {
            of: discriminant(self),
            by: match self {
                Self::Unsettled { by, .. } => Some(*by),
                _ => None,
            },
            at_joint: match self {
                Self::Joints(list) => list.first().map(|own| own.what.kind()),
                _ => None,
            },
        }
    }

    /// Returns one warning per kind of finding, the largest first; the kinds in the order of their first members.
    pub(crate) fn of_joints(findings: Vec<JointFinding>) -> Vec<Self> {
        let rank = |own: &JointFinding| (own.what.kind(), own.what.size());
        let kinds = rig_output::worst_first(findings, rank);
        kinds.into_iter().map(Self::Joints).collect()
    }
}

impl AtJoint {
    fn kind(&self) -> (Discriminant<Self>, Option<Part>) {
        let part = match self {
            Self::NoRow { part, .. } | Self::OnlyNoise { part, .. } => Some(*part),
            _ => None,
        };
        (discriminant(self), part)
    }

    /// Severity among findings of one kind.
    fn size(&self) -> f64 {
        match self {
            Self::Unexplained(share) => *share,
            Self::WorseOnHoldout { times, .. } => *times,
            _ => 0.0,
        }
    }
}

impl JointFinding {
    fn sentence(&self) -> String {
        let name = &self.joint;
        let (length, effort) = self.units;
        let part = |part: &Part| match part {
            Part::Training => "training data",
            Part::Holdout => "hold-out",
        };
        match &self.what {
            AtJoint::Still(at) => format!(
                "Joint {name} stands still at {at} {length} in all training recordings. Its torque was not used, because at rest friction or a brake carries any part of it: its friction, constant torque and drive inertia are those of the description or guesses, and its link counts as one with the link before it. Record a motion of it for more, or make it fixed in the description (type=\"fixed\" in a URDF) where it never moves."
            ),
            AtJoint::Unexplained(share) => format!(
                "Joint {name}: the model leaves {:.0} % of the torque unexplained on the data it was fitted to. Look at its zero, axis and lengths in the description, at the order of the columns, and at the robot for what no rigid model has.",
                100.0 * share
            ),
            AtJoint::WorseOnHoldout { rms, times } => format!(
                "Joint {name}: the residual on the hold-out ({} {}) is {times:.1} times that on the training data.",
                format_significant(*rms, 4),
                format_unit(effort)
            ),
            AtJoint::Creeps { travel, share } => format!(
                "Joint {name} moves by {} {length} in all training recordings, less than {share} of its range. That may be no more than its drive or gear giving way: friction and inertia of such a motion are not those of one that turns the joint. Record a larger motion of it, or make it fixed in the description.",
                format_significant(*travel, 2)
            ),
            AtJoint::OnlyNoise { part: own, slowest } => format!(
                "Joint {name} stands still in the {} but for the noise of its encoder: no row is faster than {} {length}/s, so nothing is said of its torque there. Record a motion of it for more, or make it fixed in the description (type=\"fixed\" in a URDF) where it never moves.",
                part(own),
                format_significant(*slowest, 2)
            ),
            AtJoint::NoRow { part: own, slowest } => format!(
                "Joint {name}: every row of the {} was left out (slower than {} {length}/s, or at the torque limit), so nothing is said of its torque there; look at its position for jumps, or give --min-speed.",
                part(own),
                format_significant(*slowest, 2)
            ),
        }
    }

    /// The joint with its number, after the sentence of another one.
    fn short(&self) -> String {
        let name = &self.joint;
        let (length, effort) = self.units;
        match &self.what {
            AtJoint::Still(at) => format!("{name} (at {at} {length})"),
            AtJoint::Unexplained(share) => format!("{name} ({:.0} %)", 100.0 * share),
            AtJoint::WorseOnHoldout { rms, times } => format!(
                "{name} ({} {}, {times:.1} times)",
                format_significant(*rms, 4),
                format_unit(effort)
            ),
            AtJoint::Creeps { travel, .. } => {
                format!("{name} ({} {length})", format_significant(*travel, 2))
            }
            AtJoint::OnlyNoise { slowest, .. } | AtJoint::NoRow { slowest, .. } => {
                format!("{name} ({} {length}/s)", format_significant(*slowest, 2))
            }
        }
    }
}

impl Unsettled {
    fn words(self) -> &'static str {
        match self {
            Self::Robust => "The robust fit",
            Self::OutputError => "Output error",
            Self::Likelihood => "Maximum likelihood",
            Self::Instrumental => "Instrumental variables",
        }
    }
}

/// Explains a much larger residual than that of the weighted fit.
fn what_it_means(estimator: Estimator, trusted: bool) -> &'static str {
    match estimator {
        Estimator::Consistent => {
            "The weighted fit is free to follow what the model lacks with values that no body has, and another motion need not bear them out."
        }
        Estimator::Ridge => {
            "The weighted fit is free to follow what the model lacks with values far from the description's, and another motion need not bear them out."
        }
        _ if trusted => "Noise in the motion hides as much from the weighted fit.",
        _ => {
            "What it assumes of the noise does not hold here, so do not take its values for better ones."
        }
    }
}

/// Describes a torque-rate lead.
fn lead_text(joint: Option<&str>, lead: f64, sample: f64) -> String {
    let samples = lead / sample;
    let size = format!("{:.2} ms ({:.1} samples)", 1e3 * lead.abs(), samples.abs());
    let what = match samples < 0.0 {
        true => format!("was recorded some {size} after it acted, as behind a filter"),
        false => format!("was recorded some {size} before it acts"),
    };
    let torque = match joint {
        Some(joint) => format!("the torque of joint \"{joint}\""),
        None => "the torque".to_owned(),
    };
    let mend = match joint {
        Some(_) => "If it was, or the position the other way round, give the columns of all joints by one clock".to_owned(),
        None if samples < 0.0 => {
            "If it was, give both by one clock, or that time, negative, as --torque-lead".to_owned()
        }
        // A command that is held acts half a sample later.
        None if samples > 1.0 => {
            "If the position came late, give both by one clock, or that time as --torque-lead".to_owned()
        }
        None => format!(
            "If the recorded torque is a command that is held until the next, give half a sample, --torque-lead {}",
            format_significant(0.5 * sample, 2)
        ),
    };
    format!(
        "What is left of {torque} goes with its rate of change, as if it {what} (noise of the position that a controller feeds back makes that look longer): inertia and friction are then off by more than their intervals say. {mend}."
    )
}

impl Warning {
    /// Returns the sentence of a warning about the preparation of the recordings.
    fn of_preparation(&self) -> Option<String> {
        Some(match self {
            Self::CutoffByTorque {
                cutoff,
                by_spectrum,
            } => format!(
                "The cut-off of the position filter, {} Hz, was chosen by the torque. The spectrum of the position alone gives {} Hz: the noise of the position is not white (time stamps with jitter, a coarse encoder, or a position that was filtered before it was recorded). Compare the figure of the torque residual over the cut-off; --cutoff sets another one.",
                format_significant(*cutoff, 3),
                format_significant(*by_spectrum, 3)
            ),
            Self::OwnCutoffs(joints) => {
                let alone = joints.iter().map(|own| {
                    let (hz, less) = (format_significant(own.cutoff, 3), 100.0 * own.less);
                    format!("joint {} with {hz} Hz ({less:.0} % less)", own.joint)
                });
                format!(
                    "One cut-off serves all joints. Alone, the torque of some would be explained better with another one: {}. Their friction near reversals or the noise of their positions differs; compare the figure of the torque residual over the cut-off.",
                    alone.collect::<Vec<_>>().join(", ")
                )
            }
            Self::OtherRate {
                label,
                rates: [own, training],
                decimation,
                edges: [edge, trained],
            } => format!(
                "{label} is sampled at {own} Hz, the training data at {training} Hz: its errors are of one row in {decimation} and up to {edge:.3} Hz, those of the training data up to {trained:.3} Hz."
            ),
            Self::TorqueLead {
                joint,
                lead,
                sample,
            } => lead_text(joint.as_deref(), *lead, *sample),
            Self::LongLead { samples } => format!(
                "--torque-lead shifts the torque by {} samples, where a command that is held acts half a sample late: it is given in s.",
                format_significant(*samples, 3)
            ),
            _ => return None,
        })
    }

    /// Returns the sentence of a warning about the fit.
    fn of_fit(&self) -> Option<String> {
        Some(match self {
            Self::Unsettled { by, passes, moved } => {
                let still = moved.map_or_else(
                    || "; its values may still move".to_owned(),
                    |moved| {
                        format!(": a parameter still moves by {moved:.2} of its standard deviation")
                    },
                );
                format!("{} had not settled after {passes} passes{still}.", by.words())
            }
            Self::FewStretches { memory, stretches } => format!(
                "The residuals are correlated over {memory:.2} s, so the recording has only {stretches:.1} independent stretches. The intervals take it for eight and may be too narrow; record longer."
            ),
            Self::IllConditioned { condition } => format!(
                "The condition number of the scaled regressor is {condition:.0}: the motion tells some parameters apart badly; look at their intervals."
            ),
            Self::BelowZero(list) => format!(
                "Inertia or viscous friction came out below zero: {}. These recordings do not show it to be positive. Do not use such a value; a motion with more acceleration, or more speed for friction, tells more.",
                listed(list)
            ),
            Self::StandIns => "The prior rests on stand-ins for what the description does not state; values that the data do not determine are guesses.".to_owned(),
            Self::Distrusted(why) => format!(
                "Do not trust the estimate by instrumental variables over the weighted fit: {why}."
            ),
            Self::LargerResidual {
                estimator,
                joints,
                trusted,
            } => {
                let more = joints.iter();
                let more = more.map(|(joint, times)| format!("{times:.1} times at joint {joint}"));
                format!(
                    "On the training data {} leaves more than the weighted fit: {}. {}",
                    estimator.name(),
                    more.collect::<Vec<_>>().join(", "),
                    what_it_means(*estimator, *trusted)
                )
            }
            Self::Inconsistent(why) => {
                format!("No physically consistent set of standard parameters is given: {why}")
            }
            _ => return None,
        })
    }
}

/// Returns the sentence of the first finding, and the joints for which the same holds.
fn of_joints(list: &[JointFinding]) -> String {
    let Some((first, others)) = list.split_first() else {
        return String::new();
    };
    let short: Vec<String> = others.iter().map(JointFinding::short).collect();
    match short.as_slice() {
        [] => first.sentence(),
        _ => format!(
            "{} The same holds for {}.",
            first.sentence(),
            short.join(", ")
        ),
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joints(list) => f.write_str(&of_joints(list)),
            Self::TorqueScale(list) => f.write_str(&TorqueScale::of_joints(list)),
            Self::TorqueDisagrees(list) => f.write_str(&TorqueFactor::of_joints(list)),
            Self::Interpolated(text) | Self::EffectsLeftOut(text) | Self::Other(text) => {
                f.write_str(text)
            }
            own => {
                let text = own.of_preparation().or_else(|| own.of_fit());
                f.write_str(&text.unwrap_or_default())
            }
        }
    }
}

impl From<String> for Warning {
    fn from(text: String) -> Self {
        Self::Other(text)
    }
}

impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn joint(name: &str, what: AtJoint) -> JointFinding {
        JointFinding {
            joint: name.into(),
            units: ("rad", "N*m"),
            what,
        }
    }

    #[test]
    fn joints_of_one_kind_share_a_warning_and_the_worst_speaks() {
        let list = vec![
            joint("a", AtJoint::Unexplained(0.31)),
            joint("d", AtJoint::Still(0.5)),
            joint("b", AtJoint::Unexplained(0.52)),
        ];
        let warnings = Warning::of_joints(list);
        assert_eq!(warnings.len(), 2);
        let said = warnings[0].to_string();
        assert!(
            said.starts_with("Joint b: the model leaves 52 %")
                && said.ends_with("The same holds for a (31 %)."),
            "{said}"
        );
    }

    /// Numbers and names make no kind; another statement does, whatever words it begins with.
    #[test]
    fn a_kind_is_what_is_said_and_not_its_words() {
        let no_row = |name: &str, part| {
            Warning::Joints(vec![joint(name, AtJoint::NoRow { part, slowest: 0.1 })])
        };
        assert_eq!(
            no_row("a", Part::Training).kind(),
            no_row("wrist", Part::Training).kind()
        );
        assert_ne!(
            no_row("a", Part::Training).kind(),
            no_row("a", Part::Holdout).kind()
        );
        let unsettled = |by| Warning::Unsettled {
            by,
            passes: 9,
            moved: None,
        };
        assert_ne!(
            unsettled(Unsettled::Robust).kind(),
            unsettled(Unsettled::Likelihood).kind()
        );
        assert_eq!(
            serde_json::to_string(&Warning::StandIns).unwrap(),
            format!("\"{}\"", Warning::StandIns)
        );
    }
}
