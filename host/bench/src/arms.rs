//! Benchmark of arms with one faulty joint.

use rig_shared::effects::Kind;
use serde::Serialize;

use super::answer::is_right;
use super::counted::counted;
use super::error::BenchError;
use super::table::{Rows, percent};
use super::wilson::Proportion;
use rig_data::prepare::Recording;
use rig_diagnose::outcome::{Diagnosis, Verdict};
use rig_diagnose::{Options, diagnose};
use rig_numerics::statistics::median_of_finite;
use rig_scenario::{ABOVE_FLOOR, Arm, ArmScenario, CallsFor, Fault};

/// One case with an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmCase {
    /// Name of the arm.
    pub arm: &'static str,
    /// Scenario that is recorded.
    pub scenario: ArmScenario,
}

/// Answer of the diagnosis for a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmOutcome {
    /// Name of the arm.
    pub arm: &'static str,
    /// Seed of motion, noise and fault.
    pub seed: u64,
    /// Names of the fault and of its joint; none without a fault.
    pub hidden: Option<(&'static str, String)>,
    /// The fault and its values as text.
    pub fault: String,
    /// Residual of the fault after a refit of the description, over the noise floor of its joint; none without a fit.
    pub size: Option<f64>,
    /// Effect and joint of each step.
    pub named: Vec<(String, String)>,
    /// Verdict; none if the diagnosis failed.
    pub verdict: Option<Verdict>,
    /// Share of the gap on the hold-out that the first effect closes at its joint.
    pub gap_closed: Option<f64>,
    /// Error of the simulated motion at the joint of the first effect: ratio of after to before.
    pub motion: Option<f64>,
    /// Reason of a failure.
    pub failure: Option<String>,
    #[serde(skip)]
    calls_for: Option<CallsFor>,
}

/// Returns the cases: each arm without a fault and with each of its faults, once for each seed.
///
/// # Errors
/// [`BenchError::Scenario`].
pub fn arm_cases(first_seed: u64, seeds: u64) -> Result<Vec<ArmCase>, BenchError> {
    let mut cases = Vec::new();
    for seed in first_seed..first_seed + seeds {
        for (name, arm) in Arm::ALL {
            let faults = arm.faults().into_iter().map(Some);
            for fault in std::iter::once(None).chain(faults) {
                cases.push(ArmCase {
                    arm: name,
                    scenario: ArmScenario::drawn(arm, fault, seed)?,
                });
            }
        }
    }
    Ok(cases)
}

/// Diagnoses every case in `threads` threads. Calls `progress` with the number of finished cases and their total.
///
/// # Errors
/// A scenario cannot be made. A failed diagnosis is an outcome.
pub fn run_arms(
    cases: &[ArmCase],
    threads: usize,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<ArmOutcome>, BenchError> {
    counted(cases, threads, progress, ArmCase::ask)
}

impl ArmCase {
    fn ask(&self) -> Result<ArmOutcome, BenchError> {
        let made = self.scenario.make()?;
        let fault = self.scenario.fault;
        let name = |joint: usize| made.robot.joints[joint].name.clone();
        let mut outcome = ArmOutcome {
            arm: self.arm,
            seed: self.scenario.seed,
            hidden: fault.map(|(joint, fault)| (fault.name(), name(joint))),
            fault: fault.map_or_else(String::new, |(_, fault)| format!("{fault:?}")),
            size: None,
            named: Vec::new(),
            verdict: None,
            gap_closed: None,
            motion: None,
            failure: None,
            calls_for: fault.map(|(_, fault)| fault.calls_for()),
        };
        let training: Vec<&dyn Recording> =
            made.train.iter().map(|r| r as &dyn Recording).collect();
        let options = Options {
            threads: 1,
            ..Options::default()
        };
        let result = diagnose(
            &made.robot,
            &training,
            &[&made.holdout],
            &options,
            &mut |_| (),
        );
        match result {
            Ok((diagnosis, _)) => outcome.hear(&diagnosis, fault),
            Err(error) => outcome.failure = Some(error.to_string()),
        }
        Ok(outcome)
    }
}

impl ArmOutcome {
    fn hear(&mut self, said: &Diagnosis, fault: Option<(usize, Fault)>) {
        let steps = said.steps.iter();
        self.named = (steps.map(|s| (s.effect.clone(), s.joint.clone()))).collect();
        self.verdict = Some(said.verdict);
        self.gap_closed = said.steps.first().map(|s| s.gap_closed);
        let first = said.steps.first().and_then(|s| s.motion_rms);
        self.motion = first.map(|[before, after]| after / before);
        self.size = fault.and_then(|(joint, fault)| {
            let w = said.waterfall.get(joint)?;
            // A refit removes a change of values, so the residual of the description is its size.
            let refitted = usize::from(fault.calls_for() != CallsFor::ParameterChange);
            let before = w.train.get(refitted)?;
            Some((before * before - w.floor * w.floor).max(0.0).sqrt() / w.floor)
        });
    }

    /// Returns true if the fault is above the floor. If nothing was fitted its size is unknown, and it counts as above.
    fn above(&self) -> bool {
        self.size.is_none_or(|size| size >= ABOVE_FLOOR)
    }

    fn calls_for(&self, what: CallsFor) -> bool {
        self.calls_for == Some(what) && self.above()
    }

    /// Returns true if effect and joint are right. A tilt of the base counts at any joint.
    fn is_right(&self, (effect, joint): &(String, String)) -> bool {
        let right = |(fault, place): &(&str, String)| {
            is_right(effect, fault) && (joint == place || *fault == Kind::GravityTilt.about().name)
        };
        self.hidden.as_ref().is_some_and(right)
    }

    fn right_first(&self) -> bool {
        self.named.first().is_some_and(|first| self.is_right(first))
    }

    fn exact(&self) -> bool {
        self.named.len() == 1 && self.right_first()
    }

    /// Returns true if the diagnosis has a name or says that values have changed (a false alarm without a fault).
    fn alarmed(&self) -> bool {
        !self.named.is_empty() || self.verdict == Some(Verdict::ParameterChange)
    }

    /// Returns true if the diagnosis only says that values of the description have changed.
    fn changed(&self) -> bool {
        let other = |(effect, _): &(String, String)| effect != Kind::Payload.about().name;
        self.verdict == Some(Verdict::ParameterChange) && !self.named.iter().any(other)
    }

    fn remainder(&self) -> bool {
        self.verdict == Some(Verdict::Remainder)
    }
}

/// Outcomes of one arm.
type Own<'a> = Vec<&'a ArmOutcome>;
/// Question to an outcome.
type Is = fn(&ArmOutcome) -> bool;

/// Returns the figures as Markdown, one column for each arm.
pub fn arm_table(outcomes: &[ArmOutcome]) -> String {
    let arms: Vec<(&str, Own)> = (Arm::ALL.iter())
        .map(|(name, _)| (*name, outcomes.iter().filter(|o| o.arm == *name).collect()))
        .collect();
    let mut rows = Rows::new("arms, one joint at fault", &arms);
    names(&mut rows);
    other_verdicts(&mut rows);
    improvement(&mut rows);
    rows.row("failed, or data said to be at fault", "0", &|own| {
        let fault = |o: &&&ArmOutcome| matches!(o.verdict, None | Some(Verdict::DataFault));
        own.iter().filter(fault).count().to_string()
    });
    rows.text
}

/// Returns the proportion of `is` among the outcomes that are `of`.
fn share(of: Is, is: Is) -> impl Fn(&Own) -> String {
    move |own| Proportion::of(own.iter().filter(|o| of(o)).map(|o| is(o))).to_string()
}

/// Returns true if the fault calls for its name.
fn named(outcome: &ArmOutcome) -> bool {
    outcome.calls_for(CallsFor::Name)
}

/// Adds the rows on right and wrong names.
fn names(rows: &mut Rows<Own>) {
    rows.row(
        "right name and joint first, above the floor",
        "≥ 97 %",
        &share(named, ArmOutcome::right_first),
    );
    rows.row(
        "exactly that name",
        "≥ 95 %",
        &share(named, ArmOutcome::exact),
    );
    rows.row(
        "false alarm, nothing wrong",
        "≤ 2 %",
        &share(|o| o.hidden.is_none(), ArmOutcome::alarmed),
    );
    rows.row(
        "a wrong name, below the floor",
        "",
        &share(
            |o| o.calls_for.is_some() && !o.above(),
            |o| o.named.iter().any(|name| !o.is_right(name)),
        ),
    );
}

/// Adds the rows on faults without a name in the library.
fn other_verdicts(rows: &mut Rows<Own>) {
    rows.row(
        "wrong values of the description: that is said, and no other name",
        "",
        &share(
            |o| o.calls_for(CallsFor::ParameterChange),
            ArmOutcome::changed,
        ),
    );
    rows.row(
        "fault outside the library: a name and no remainder",
        "≤ 10 %",
        &share(
            |o| o.calls_for(CallsFor::Remainder),
            |o| !o.named.is_empty() && !o.remainder(),
        ),
    );
    rows.row(
        "fault outside the library: a remainder",
        "≥ 95 %",
        &share(|o| o.calls_for(CallsFor::Remainder), ArmOutcome::remainder),
    );
}

/// Adds the rows on what a right first effect improves.
fn improvement(rows: &mut Rows<Own>) {
    let middle = |of: fn(&ArmOutcome) -> Option<f64>| {
        move |own: &Own| {
            let right = own.iter().filter(|o| named(o) && o.right_first());
            percent(median_of_finite(right.filter_map(|o| of(o)).collect()))
        }
    };
    rows.row(
        "gap closed on the hold-out at the joint, median",
        "≥ 97 %",
        &middle(|o| o.gap_closed),
    );
    rows.row(
        "error of the simulated motion, of what it was before, median",
        "",
        &middle(|o| o.motion),
    );
}

#[cfg(test)]
mod tests;
