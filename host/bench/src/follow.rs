//! Runs the experiment that a method proposes for an open set of names, and asks the method again.

use std::path::Path;

use serde::Serialize;

use super::answer::{Answer, Method};
use super::cases::Case;
use super::error::BenchError;
use rig_diagnose::experiment::{ExperimentKind, FILE, Family};
use rig_excite::TrajectoryFile;
use rig_scenario::Made;
use rig_scenario::ScenarioError;

/// Result of a proposed experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Followed {
    /// Answer with the additional recording; none if the method failed, or if the experiment needs other manual work
    /// than the removal of external loads.
    pub answer: Option<Answer>,
    /// Reason of a failure.
    pub failure: Option<String>,
}

/// Runs the proposed experiment if the first name is open; none if it is not open or no experiment is proposed for it.
pub(super) fn follow(
    case: &Case,
    made: &Made,
    method: &dyn Method,
    answer: &Answer,
) -> Option<Followed> {
    let open = &answer.named.first()?.set;
    let next = answer.next.as_ref()?;
    if open.len() < 2 || !next.separates.iter().all(|name| open.contains(name)) {
        return None;
    }
    let mut followed = Followed {
        answer: None,
        failure: None,
    };
    let more = match &next.trajectory {
        Some(trajectory) => Some(match next.kind {
            ExperimentKind::PullsOff => unburdened(case, made, trajectory),
            ExperimentKind::Motion(Family::LockedRotor) => clamped(case, made, trajectory),
            _ => moved(case, made, trajectory),
        }),
        None => (next.kind == ExperimentKind::DriveOffLog).then(|| at_rest(case, made)),
    };
    match more.map(|more| method.answer(&more?, &case.without)) {
        Some(Ok(answer)) => followed.answer = Some(answer),
        Some(Err(error)) => followed.failure = Some(error.to_string()),
        None => {}
    }
    Some(followed)
}

/// Adds a recording of the proposed motion.
fn moved(case: &Case, made: &Made, trajectory: &str) -> Result<Made, BenchError> {
    let mut more = made.clone();
    (more.further).push(case.scenario.proposed(made, &file(trajectory)?)?);
    Ok(more)
}

/// Adds a recording with the shaft clamped.
fn clamped(case: &Case, made: &Made, trajectory: &str) -> Result<Made, BenchError> {
    Ok(Made {
        clamped: Some(case.scenario.clamped(made, &file(trajectory)?)?),
        ..made.clone()
    })
}

/// Adds a recording of the proposed motion without external loads.
fn unburdened(case: &Case, made: &Made, trajectory: &str) -> Result<Made, BenchError> {
    let mut more = made.clone();
    let scenario = case.scenario.unburdened();
    (more.unburdened).push(scenario.proposed(made, &file(trajectory)?)?);
    Ok(more)
}

fn file(trajectory: &str) -> Result<TrajectoryFile, BenchError> {
    TrajectoryFile::from_toml(trajectory, Path::new(FILE))
        .map_err(|error| BenchError::Scenario(ScenarioError(error.to_string())))
}

/// Adds a recording with the drive off.
fn at_rest(case: &Case, made: &Made) -> Result<Made, BenchError> {
    Ok(Made {
        drive_off: Some(case.scenario.drive_off(made)?),
        ..made.clone()
    })
}
