//! The simulated motion of one recording.

use crate::pages::parts;
use rig_model::robot::{Joint, Robot};
use rig_output::format_significant;
use rig_report::{Axis, Block, Column, Plot, Role, Section, Series, Table};
use rig_validate::{Checked, Motion, MotionCheck};

/// Composes the section of recording `k`, counted from 0.
pub(super) fn section(robot: &Robot, checked: &Checked, name: &str, k: usize) -> Section {
    let section = Section::new(format!("motion-{}", k + 1), format!("Motion: {name}"), "");
    match &checked.motion {
        Motion::NotSimulated { why } => section.with(parts::warning(format!(
            "The motion was not simulated. {why}"
        ))),
        Motion::Simulated {
            joints,
            remarks,
            samples,
            ..
        } => {
            let mut section = section
                .with(Block::List(remarks.clone()))
                .with(steps(joints));
            for (joint, check) in robot.joints.iter().zip(joints) {
                section.blocks.extend(plots(joint, check, *samples));
            }
            section
        }
    }
}

/// Errors of the simulation, and its change with half the step, for each joint.
fn steps(joints: &[MotionCheck]) -> Block {
    Block::Table(Table {
        caption: "Simulation and measurement".into(),
        columns: vec![
            Column::text("Joint"),
            Column::number("Position RMS", ""),
            Column::number("largest", ""),
            Column::number("half step", ""),
            Column::number("Torque RMS", ""),
            Column::number("largest", ""),
            Column::number("half step", ""),
            Column::number("At limit", ""),
        ],
        rows: joints
            .iter()
            .map(|m| {
                let unit = parts::unit(&m.torque_unit);
                vec![
                    m.joint.clone(),
                    parts::length(m.position_rms_error, &m.position_unit),
                    parts::length(m.position_max_error, &m.position_unit),
                    parts::length(m.position_step_change, &m.position_unit),
                    format!("{} {unit}", format_significant(m.torque_rms_error, 3)),
                    format!("{} {unit}", format_significant(m.torque_max_error, 3)),
                    format!("{} {unit}", format_significant(m.torque_step_change, 2)),
                    parts::count(m.saturated),
                ]
            })
            .collect(),
        note: "Errors of the simulation. Half step: RMS change of the simulation when its step is halved. At limit: samples at which the torque limit cut the controller's command.".into(),
    })
}

/// Draws the motion of one joint, measured and simulated.
fn plots(joint: &Joint, m: &MotionCheck, samples: u64) -> Vec<Block> {
    let n = parts::count(samples);
    vec![
        Block::Plot(tracking(joint, m, &n)),
        Block::Plot(error(joint, m, &n)),
        Block::Plot(torque(joint, m, &n)),
        Block::Plot(position(joint, m, &n)),
    ]
}

/// Factor and prefix of the unit in which errors of the position are drawn.
fn scale(m: &MotionCheck) -> (f64, &'static str) {
    if m.tracking_rms < 1e-3 {
        (1e6, "µ")
    } else {
        (1e3, "m")
    }
}

/// The difference of two series, times `scale`.
fn less(a: &[f64], b: &[f64], scale: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| scale * (a - b)).collect()
}

/// Draws the tracking error, measured and simulated. `n`: number of samples, as text.
fn tracking(joint: &Joint, m: &MotionCheck, n: &str) -> Plot {
    let position = parts::units(joint.kind)[0];
    let s = &m.series;
    let (scale, prefix) = scale(m);
    let mut plot = Plot::new(
        format!(
            "Joint {}: tracking error (reference less position)",
            joint.name
        ),
        Axis::new("time", "s"),
        Axis::new("tracking error", &format!("{prefix}{position}")),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        s.t.clone(),
        less(&s.reference, &s.measured, scale),
    ))
    .with(Series::line(
        "simulated",
        Role::Model,
        s.t.clone(),
        less(&s.reference, &s.simulated, scale),
    ))
    .note(format!(
        "n = {n}, measured RMS {}; the error of the simulation is {} % of it.",
        parts::length(m.tracking_rms, position),
        parts::percent(m.tracking_relative_error)
    ));
    plot.height = 260;
    plot
}

/// Draws the error of the simulated position.
fn error(joint: &Joint, m: &MotionCheck, n: &str) -> Plot {
    let position = parts::units(joint.kind)[0];
    let s = &m.series;
    let (scale, prefix) = scale(m);
    let mut plot = Plot::new(
        format!(
            "Joint {}: position error (measured less simulated)",
            joint.name
        ),
        Axis::new("time", "s"),
        Axis::new("error", &format!("{prefix}{position}")),
    )
    .with(Series::line(
        "error",
        Role::Residual,
        s.t.clone(),
        less(&s.measured, &s.simulated, scale),
    ))
    .note(format!(
        "n = {n}, RMS {}.",
        parts::length(m.position_rms_error, position)
    ));
    plot.height = 220;
    plot
}

/// Draws the torque, measured and simulated.
fn torque(joint: &Joint, m: &MotionCheck, n: &str) -> Plot {
    let (what, torque) = (parts::effort(joint.kind), parts::units(joint.kind)[2]);
    let s = &m.series;
    let mut plot = Plot::new(
        format!("Joint {}: {what}, measured and simulated", joint.name),
        Axis::new("time", "s"),
        Axis::new(what, torque),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        s.t.clone(),
        s.torque_measured.clone(),
    ))
    .with(Series::line(
        "simulated",
        Role::Model,
        s.t.clone(),
        s.torque_simulated.clone(),
    ))
    .note(format!(
        "n = {n}, RMS error {} {torque}, {} % of the {what}'s RMS; not filtered.",
        format_significant(m.torque_rms_error, 3),
        parts::percent(m.torque_relative_error)
    ));
    plot.height = 280;
    plot
}

/// Draws the position, measured and simulated.
fn position(joint: &Joint, m: &MotionCheck, n: &str) -> Plot {
    let unit = parts::units(joint.kind)[0];
    let s = &m.series;
    let mut plot = Plot::new(
        format!("Joint {}: position, measured and simulated", joint.name),
        Axis::new("time", "s"),
        Axis::new("position", unit),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        s.t.clone(),
        s.measured.clone(),
    ))
    .with(Series::line("simulated", Role::Model, s.t.clone(), s.simulated.clone()).dashed())
    .note(format!(
        "n = {n}, RMS error {}, largest {}.",
        parts::length(m.position_rms_error, unit),
        parts::length(m.position_max_error, unit)
    ));
    plot.height = 240;
    plot
}
