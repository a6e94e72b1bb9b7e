//! The experiment that is proposed for an open set of names, run on the same rig, and what is said with it.

use std::path::Path;

use serde::Serialize;

use super::answer::{Answer, Method};
use super::cases::Case;
use crate::diagnose::DiagnoseError;
use crate::diagnose::experiment::FILE;
use crate::diagnose::scenario::Made;
use crate::excite::TrajectoryFile;

/// What came of a proposed experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Followed {
    /// What is said with its recording beside the others; none where it asks for hands or has failed.
    pub answer: Option<Answer>,
    /// Why it has failed.
    pub failure: Option<String>,
}

/// Follows what is proposed where the first name is open; none where it is not, or nothing is proposed for it.
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
    if let Some(trajectory) = &next.trajectory {
        match again(case, made, method, trajectory) {
            Ok(answer) => followed.answer = Some(answer),
            Err(error) => followed.failure = Some(error.to_string()),
        }
    }
    Some(followed)
}

fn again(
    case: &Case,
    made: &Made,
    method: &dyn Method,
    trajectory: &str,
) -> Result<Answer, DiagnoseError> {
    let file = TrajectoryFile::from_toml(trajectory, Path::new(FILE))
        .map_err(|error| DiagnoseError::Scenario(error.to_string()))?;
    let mut more = made.clone();
    more.further.push(case.scenario.proposed(made, &file)?);
    method.answer(&more, &case.without)
}
