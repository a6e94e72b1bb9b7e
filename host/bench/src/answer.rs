//! What a method says of a recording, reduced to what is scored.

use std::collections::{BTreeMap, BTreeSet};

use rig_shared::effects::Kind;
use serde::Serialize;

use crate::BenchError;
use rig_diagnose::experiment::PULLS_OFF;
use rig_diagnose::outcome::{Diagnosis, Value, Verdict};
use rig_scenario::Made;

/// An effect that a method names.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Named {
    /// Best name.
    pub effect: String,
    /// All names that it holds possible, the best among them.
    pub set: Vec<String>,
    /// Of the best name.
    pub parameters: BTreeMap<String, Value>,
}

/// What a method says.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Answer {
    /// In the order found.
    pub named: Vec<Named>,
    /// Whether it names no effect and says that values of the description have changed.
    pub changed: bool,
    /// Whether it says that something is left that it cannot name.
    pub remainder: bool,
    /// Share of the hold-out's gap that it closes; none where it names nothing.
    pub gap_closed: Option<f64>,
    /// Effects that it says the recording cannot show.
    pub not_testable: Vec<String>,
    /// What it would record next.
    pub next: Option<Proposed>,
}

/// An experiment that a method proposes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Proposed {
    /// Which.
    pub kind: String,
    /// Names that it is to separate.
    pub separates: Vec<String>,
    /// The motion, where the rig can run it as it is, or with what pulls on it taken off; a [`rig_excite::TrajectoryFile`].
    #[serde(skip)]
    pub trajectory: Option<String>,
}

/// A method to be judged.
pub trait Method: Sync {
    /// In words.
    fn name(&self) -> &'static str;

    /// What it says, with these effects left out of its library.
    ///
    /// # Errors
    /// Where it cannot work at all.
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
    /// As a result has it.
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
                kind: next.kind.clone(),
                separates: next.separates.clone(),
                trajectory: (next.trajectory.clone())
                    .filter(|_| !next.hands || next.kind == PULLS_OFF),
            }),
        }
    }
}

/// A name and those that a recording of torque, motor position and voltage, as the benchmark's are, cannot tell from it.
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

/// A name and those that no recording of torque and motor position can tell from it, itself among them.
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

/// Whether two effects together are one of them with other parameters, as far as a recording of torque, motor position and voltage
/// goes: partners of one function, or a spring and a constant torque, which another rest of the spring holds as well.
pub(super) fn one_holds_both(a: &str, b: &str) -> bool {
    let springs = [Kind::Spring.about().name, Kind::TorqueOffset.about().name];
    let [spring, constants] = [springs[0], springs[1]].map(same_by_voltage);
    let held = |one: &str, other: &str| spring.contains(one) && constants.contains(other);
    exact_class(a).contains(b) || held(a, b) || held(b, a)
}

/// Whether `named` is `truth` but for exact partners.
pub fn is_right(named: &str, truth: &str) -> bool {
    exact_class(truth).contains(named)
}
