//! Answer of a method to a recording, reduced to the scored parts.

use std::collections::{BTreeMap, BTreeSet};

use rig_shared::effects::Kind;
use serde::Serialize;

use super::error::BenchError;
use rig_diagnose::experiment::ExperimentKind;
use rig_diagnose::outcome::{Diagnosis, Value, Verdict};
use rig_scenario::Made;

/// An effect that a method names.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Named {
    /// Best name.
    pub effect: String,
    /// All names that the method considers possible, including the best.
    pub set: Vec<String>,
    /// Parameters of the best name.
    pub parameters: BTreeMap<String, Value>,
}

/// Answer of a method.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Answer {
    /// Named effects, in the order found.
    pub named: Vec<Named>,
    /// True if the answer has no effect but says that values of the description have changed.
    pub changed: bool,
    /// True if the answer has an unexplained remainder.
    pub remainder: bool,
    /// Share of the gap on the hold-out that the effects close; none without effects.
    pub gap_closed: Option<f64>,
    /// Effects that the recording cannot show, by the answer.
    pub not_testable: Vec<String>,
    /// Proposed experiment.
    pub next: Option<Proposed>,
}

/// An experiment that a method proposes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Proposed {
    /// Kind of experiment.
    pub kind: ExperimentKind,
    /// Names that the experiment should separate.
    pub separates: Vec<String>,
    /// Motion as a [`rig_excite::TrajectoryFile`], if the rig can run it unchanged or without external loads.
    #[serde(skip)]
    pub trajectory: Option<String>,
}

/// A method to be judged.
pub trait Method: Sync {
    /// Name of the method.
    fn name(&self) -> &'static str;

    /// Answers to recordings, with the effects `without` removed from the library.
    ///
    /// # Errors
    /// The method cannot process the recordings.
    fn answer(&self, made: &Made, without: &[Kind]) -> Result<Answer, BenchError>;
}

/// [`rig_diagnose::diagnose`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Diagnose;

impl Method for Diagnose {
    fn name(&self) -> &'static str {
        "rig diagnose"
    }

    fn answer(&self, made: &Made, without: &[Kind]) -> Result<Answer, BenchError> {
        let options = rig_diagnose::Options {
            even_if_wrong: false,
            without: without.to_vec(),
            threads: 1,
            seed: made.truth.seed,
            sensor_zeros: (made.drive_off.as_ref())
                .map(|log| rig_diagnose::sensor_zeros(log))
                .transpose()?
                .unwrap_or_default(),
            clamped: (made.clamped.as_ref())
                .map(|log| rig_diagnose::clamped(log))
                .transpose()?
                .unwrap_or_default(),
            no_offsets: false,
        };
        let (diagnosis, _) = made.with_recordings(|training, held| {
            rig_diagnose::diagnose(&made.robot, training, held, &options, &mut |_| ())
        })?;
        Ok(Answer::of(&diagnosis))
    }
}

impl Answer {
    /// Converts the result of a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let named: Vec<Named> = (diagnosis.steps.iter())
            .map(|step| Named {
                effect: step.effect.clone(),
                set: step.set.clone(),
                parameters: step.parameters.clone(),
            })
            .collect();
        Self {
            changed: diagnosis.verdict == Verdict::ParameterChange && named.is_empty(),
            named,
            remainder: diagnosis.verdict == Verdict::Remainder,
            gap_closed: diagnosis.gap_closed,
            not_testable: diagnosis
                .not_testable
                .iter()
                .map(|n| n.effect.clone())
                .collect(),
            next: diagnosis.next_experiment.as_ref().map(|next| Proposed {
                kind: next.kind,
                separates: next.separates.clone(),
                trajectory: (next.trajectory.clone())
                    .filter(|_| !next.hands || next.kind == ExperimentKind::PullsOff),
            }),
        }
    }
}

/// Returns a name and all names that recordings of torque, motor position and voltage cannot distinguish from it.
pub(super) fn same_by_voltage(name: &str) -> BTreeSet<&str> {
    let told = |a: &str, b: &str| {
        (Kind::ALL.iter().map(|kind| kind.about()))
            .filter(|about| about.name == a)
            .flat_map(|about| about.confused)
            .any(|c| c.with == b && c.separated_by.contains("voltage"))
    };
    let mut class = exact_class(name);
    class.retain(|other| !told(name, other) && !told(other, name));
    class
}

/// Returns a name and all names that recordings of torque and motor position cannot distinguish from it.
pub fn exact_class(name: &str) -> BTreeSet<&str> {
    let mut class = BTreeSet::from([name]);
    for kind in Kind::ALL {
        let about = kind.about();
        for confusion in about.confused.iter().filter(|c| c.exact) {
            if about.name == name {
                class.insert(confusion.with);
            }
            if confusion.with == name {
                class.insert(about.name);
            }
        }
    }
    class
}

/// Returns true if one of two effects with other parameters equals both together, in recordings of torque, motor
/// position and voltage: two names of one function, or a spring and a constant torque (another rest position).
pub(super) fn one_holds_both(a: &str, b: &str) -> bool {
    let springs = [Kind::Spring.about().name, Kind::TorqueOffset.about().name];
    let [spring, constants] = [springs[0], springs[1]].map(same_by_voltage);
    let held = |one: &str, other: &str| spring.contains(one) && constants.contains(other);
    exact_class(a).contains(b) || held(a, b) || held(b, a)
}

/// Returns true if `named` is `truth` or indistinguishable from it.
pub fn is_right(named: &str, truth: &str) -> bool {
    exact_class(truth).contains(named)
}

/// [`rig_diagnose::evidence::find`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Evidence;

impl Method for Evidence {
    fn name(&self) -> &'static str {
        "evidence"
    }

    fn answer(&self, made: &Made, without: &[Kind]) -> Result<Answer, BenchError> {
        let options = rig_diagnose::Options {
            without: without.to_vec(),
            threads: 1,
            ..rig_diagnose::Options::default()
        };
        let finding = made.with_recordings(|training, _| {
            rig_diagnose::evidence::find(&made.robot, training, &options)
        })?;
        let named = finding.found.iter().map(|found| Named {
            effect: found.name.into(),
            set: found.set.iter().map(|name| (*name).into()).collect(),
            parameters: BTreeMap::new(),
        });
        Ok(Answer {
            named: named.collect(),
            remainder: !finding.unknown.is_empty() || !finding.doubtful.is_empty(),
            ..Answer::default()
        })
    }
}
