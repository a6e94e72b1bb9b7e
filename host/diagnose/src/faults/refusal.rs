//! Diagnosis of recordings with a certain fault.

use crate::outcome::{About, Before, DataFault, Diagnosis, FaultKind, Residual, Verdict};
use crate::result::sentences::verdict;
use rig_data::prepare::PrepareError;
use rig_model::robot::Robot;

/// Returns the fault of a recording that prevents its preparation.
pub(crate) fn of_preparing(error: &PrepareError) -> Option<DataFault> {
    let (kind, label) = match error {
        PrepareError::TooShort { label, .. } => (FaultKind::TooShort, label),
        PrepareError::NotMoving { label, .. } => (FaultKind::NotMoving, label),
        PrepareError::Broken { label, .. } | PrepareError::Irregular { label, .. } => {
            (FaultKind::Clock, label)
        }
        _ => return None,
    };
    Some(DataFault {
        kind,
        about: About::Preparation,
        recording: label.clone(),
        joint: String::new(),
        certain: true,
        of_description: false,
        column: None,
        text: error.to_string(),
    })
}

/// Returns a diagnosis with the faults alone: on such data no model is meaningful.
pub(crate) fn faulty(robot: &Robot, data_faults: Vec<DataFault>) -> Diagnosis {
    let mut diagnosis = Diagnosis {
        schema: "rig-diagnosis/1".into(),
        robot: robot.name.clone(),
        verdict: Verdict::DataFault,
        residual: Residual::Torque,
        words: Vec::new(),
        noise_floor_rms: Vec::new(),
        noise_floor_from: Vec::new(),
        left: Vec::new(),
        noise_floor_how: String::new(),
        motion_how: String::new(),
        treatment: None,
        torque_lead: Vec::new(),
        places: Vec::new(),
        described: Vec::new(),
        steps: Vec::new(),
        gap_closed: None,
        absorbed: Vec::new(),
        absorbed_before: Before::Described,
        by_motion: None,
        not_testable: Vec::new(),
        detectable: Vec::new(),
        next_experiment: None,
        remainder: None,
        data_faults,
        waterfall: Vec::new(),
        tried: Vec::new(),
        maps: Vec::new(),
        curves: Vec::new(),
    };
    diagnosis.words = verdict::verdict(&diagnosis, false);
    diagnosis
}
