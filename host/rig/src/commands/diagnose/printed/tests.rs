#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;

use super::*;
use rig_diagnose::outcome::Value;

#[test]
fn a_step_is_one_line_that_names_what_the_data_leave_open() {
    let mut step = Step {
        effect: "cogging".into(),
        law: None,
        joint: "link".into(),
        set: vec!["cogging".into()],
        parameters: BTreeMap::from([(
            "sine".into(),
            Value {
                value: 0.1,
                std: 0.01,
                unit: "N*m".into(),
            },
        )]),
        p_value: 1e-9,
        name_probability: f64::NAN,
        runner_up: None,
        runner_up_gap_closed: None,
        rms_unit: "N*m".into(),
        train_rms: [0.2, 0.1],
        holdout_rms: None,
        motion_rms: None,
        gap_closed: 0.5,
        why: String::new(),
    };
    assert_eq!(
        effect(1, &step, false),
        "1. cogging at joint link, closes 50.0 % of the remaining gap"
    );
    assert_eq!(
        effect(1, &step, true),
        "1. cogging at joint link, closes 50.0 % of the remaining gap of that joint"
    );
    step.set.push("torque_ripple".into());
    assert!(effect(2, &step, true).ends_with("; equally probable: torque_ripple"));
}
