//! Arms of several joints with one joint at fault.

use serde::Serialize;

use super::answer::is_right;
use super::counted;
use super::score::median;
use super::table::{Rows, percent};
use super::wilson::Proportion;
use crate::BenchError;
use rig_data::prepare::Recording;
use rig_diagnose::outcome::{Diagnosis, Verdict};
use rig_diagnose::{Options, diagnose};
use rig_scenario::{ABOVE_FLOOR, Arm, ArmScenario, CallsFor, Fault};

/// One arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmCase {
    /// Its name.
    pub arm: &'static str,
    /// What is recorded.
    pub scenario: ArmScenario,
}

/// What is said of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ArmOutcome {
    /// Which arm.
    pub arm: &'static str,
    /// Of motion, noise and fault.
    pub seed: u64,
    /// Name of the fault and of its joint; none where nothing is wrong.
    pub hidden: Option<(&'static str, String)>,
    /// The fault itself, in words.
    pub fault: String,
    /// What a refit of the description leaves of it, over the noise floor of its joint; none where it was not fitted.
    pub size: Option<f64>,
    /// Effect and joint of each name.
    pub named: Vec<(String, String)>,
    /// The verdict; none where the diagnosis failed.
    pub verdict: Option<Verdict>,
    /// Share of the hold-out's gap that the first name closes at its joint.
    pub gap_closed: Option<f64>,
    /// Error of the simulated motion of the first name's joint after and before it, as a ratio.
    pub motion: Option<f64>,
    /// Why the diagnosis failed.
    pub failure: Option<String>,
    #[serde(skip)]
    calls_for: Option<CallsFor>,
}

/// Each arm with nothing wrong and with each of its faults, once a seed.
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

/// Diagnoses every case, `threads` at a time; `progress` hears how many of how many are done.
///
/// # Errors
/// A scenario that cannot be made. A diagnosis that fails is an outcome.
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
            // A refit takes up what values of the description it is: that is then its size.
            let refitted = usize::from(fault.calls_for() != CallsFor::ParameterChange);
            let before = w.train.get(refitted)?;
            Some((before * before - w.floor * w.floor).max(0.0).sqrt() / w.floor)
        });
    }

    /// Whether the fault is large enough to be seen; where nothing was fitted that is not known, and held against the diagnosis.
    fn above(&self) -> bool {
        self.size.is_none_or(|size| size >= ABOVE_FLOOR)
    }

    fn calls_for(&self, what: CallsFor) -> bool {
        self.calls_for == Some(what) && self.above()
    }

    /// Whether a name is that of the fault, on its joint. A tilt is one of the base.
    fn is_right(&self, (effect, joint): &(String, String)) -> bool {
        let right = |(fault, place): &(&str, String)| {
            is_right(effect, fault) && (joint == place || *fault == "gravity_tilt")
        };
        self.hidden.as_ref().is_some_and(right)
    }

    fn right_first(&self) -> bool {
        self.named.first().is_some_and(|first| self.is_right(first))
    }

    fn exact(&self) -> bool {
        self.named.len() == 1 && self.right_first()
    }

    /// Whether it names something, or finds values changed, although nothing is wrong.
    fn alarmed(&self) -> bool {
        !self.named.is_empty() || self.verdict == Some(Verdict::ParameterChange)
    }

    /// Whether it says that values of the description have changed, and nothing else.
    fn changed(&self) -> bool {
        let other = |(effect, _): &(String, String)| effect != "payload";
        self.verdict == Some(Verdict::ParameterChange) && !self.named.iter().any(other)
    }

    fn remainder(&self) -> bool {
        self.verdict == Some(Verdict::Remainder)
    }
}

/// The figures as Markdown, one column an arm.
pub fn arm_table(outcomes: &[ArmOutcome]) -> String {
    let arms: Vec<(&str, Vec<&ArmOutcome>)> = (Arm::ALL.iter())
        .map(|(name, _)| (*name, outcomes.iter().filter(|o| o.arm == *name).collect()))
        .collect();
    let mut rows = Rows::new("arms, one joint at fault", &arms);
    let mut row = |name: &str, aim: &str, of: &dyn Fn(&[&ArmOutcome]) -> String| {
        rows.row(name, aim, &|own| of(own));
    };
    type Is = fn(&ArmOutcome) -> bool;
    let share = |of: Is, is: Is| {
        move |own: &[&ArmOutcome]| {
            Proportion::of(own.iter().filter(|o| of(o)).map(|o| is(o))).to_string()
        }
    };
    let named: Is = |o| o.calls_for(CallsFor::Name);
    let middle = |of: fn(&ArmOutcome) -> Option<f64>| {
        move |own: &[&ArmOutcome]| {
            let right = own.iter().filter(|o| named(o) && o.right_first());
            percent(median(right.filter_map(|o| of(o)).collect()))
        }
    };
    row(
        "right name and joint first, above the floor",
        "≥ 97 %",
        &share(named, ArmOutcome::right_first),
    );
    row(
        "exactly that name",
        "≥ 95 %",
        &share(named, ArmOutcome::exact),
    );
    row(
        "false alarm, nothing wrong",
        "≤ 2 %",
        &share(|o| o.hidden.is_none(), ArmOutcome::alarmed),
    );
    row(
        "a wrong name, below the floor",
        "",
        &share(
            |o| o.calls_for.is_some() && !o.above(),
            |o| o.named.iter().any(|name| !o.is_right(name)),
        ),
    );
    row(
        "wrong values of the description: that is said, and no other name",
        "",
        &share(
            |o| o.calls_for(CallsFor::ParameterChange),
            ArmOutcome::changed,
        ),
    );
    row(
        "fault outside the library: a name and no remainder",
        "≤ 10 %",
        &share(
            |o| o.calls_for(CallsFor::Remainder),
            |o| !o.named.is_empty() && !o.remainder(),
        ),
    );
    row(
        "fault outside the library: a remainder",
        "≥ 95 %",
        &share(|o| o.calls_for(CallsFor::Remainder), ArmOutcome::remainder),
    );
    row(
        "gap closed on the hold-out at the joint, median",
        "≥ 97 %",
        &middle(|o| o.gap_closed),
    );
    row(
        "error of the simulated motion, of what it was before, median",
        "",
        &middle(|o| o.motion),
    );
    row("failed, or data said to be at fault", "0", &|own| {
        let fault = |o: &&&ArmOutcome| matches!(o.verdict, None | Some(Verdict::DataFault));
        own.iter().filter(fault).count().to_string()
    });
    rows.text
}

#[cfg(test)]
mod tests;
