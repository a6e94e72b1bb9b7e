//! The page of a validation.

mod motion;

use super::context::Context;
use super::{parts, residuals, treatment};
use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_report::{Block, Column, Document, Fact, Section, Table, Tone};
use rig_validate::{Checked, Motion, MotionCheck, Validation};

/// Composes the page of a validation.
pub fn validation(robot: &Robot, found: &Validation, context: &Context) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&found.warnings, &context.warnings]));
    sections.push(overview(found));
    let names = names(found);
    for (k, (checked, name)) in found.recordings.iter().zip(&names).enumerate() {
        sections.push(torque(robot, checked, name, k));
        sections.push(motion::section(robot, checked, name, k));
    }
    let mut data = Section::new(
        "data",
        "Treatment of the data for the torque",
        "The motion is compared without any filter. Slow rows count here, too. An identification may leave them out because its friction model does not hold at low speed; its figure for the hold-out can therefore be smaller.",
    );
    data.blocks.push(Block::List(
        found
            .recordings
            .iter()
            .map(|r| {
                format!(
                    "{}: {} rows at {} Hz",
                    r.recording,
                    parts::count(r.rows),
                    format_significant(r.sample_rate, 4)
                )
            })
            .chain(found.taken_off.clone())
            .collect(),
    ));
    data.blocks
        .extend(treatment::treatment(&robot.joints, &found.treatment));
    sections.push(data);
    let mut tests = Section::new(
        "residuals",
        "Torque residual",
        "A residual that depends on one of these quantities shows that the model lacks an effect.",
    );
    let period = 1.0 / found.treatment.kept_rate();
    for (checked, name) in found.recordings.iter().zip(&names) {
        for (joint, check) in robot.joints.iter().zip(&checked.torque) {
            tests.blocks.push(Block::Details {
                summary: format!("{name}, joint {}", joint.name),
                blocks: residuals::residual_tests(joint, &check.residual, period),
            });
        }
    }
    sections.push(tests);
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: validation", found.robot),
        subtitle: "Predictions of the description for these recordings; no parameter was changed."
            .into(),
        summary: summary(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn simulated(checked: &Checked) -> &[MotionCheck] {
    match &checked.motion {
        Motion::Simulated { joints, .. } => joints,
        Motion::NotSimulated { .. } => &[],
    }
}

fn summary(found: &Validation, context: &Context) -> Vec<Fact> {
    let worst = |values: Vec<f64>| values.into_iter().reduce(f64::max);
    let torque = worst(
        found
            .recordings
            .iter()
            .flat_map(|r| r.torque.iter().map(|t| t.residual.relative_error))
            .collect(),
    );
    let moved: Vec<&MotionCheck> = found.recordings.iter().flat_map(simulated).collect();
    let skipped = found
        .recordings
        .iter()
        .filter(|r| simulated(r).is_empty())
        .count();
    let mut facts = vec![
        Fact::new("Torque residual", torque.map_or("–".into(), parts::percent))
            .unit("%")
            .note("residual RMS over torque RMS, worst case")
            .tone(if torque.is_some_and(|t| t > 0.3) {
                Tone::Warning
            } else {
                Tone::Plain
            }),
    ];
    if moved.is_empty() {
        facts.push(
            Fact::new("Motion", "not simulated")
                .note("the section on motion gives the reason")
                .tone(Tone::Warning),
        );
    } else {
        let of = |f: &dyn Fn(&MotionCheck) -> f64| {
            worst(moved.iter().map(|m| f(m)).collect()).map_or("–".into(), parts::percent)
        };
        facts.push(
            Fact::new(
                "Error of the simulated motion",
                of(&|m| m.tracking_relative_error),
            )
            .unit("%")
            .note("position RMS error over the RMS of the tracking error, worst case"),
        );
        facts.push(
            Fact::new(
                "Error of the simulated torque",
                of(&|m| m.torque_relative_error),
            )
            .unit("%")
            .note("RMS error over torque RMS, closed loop, unfiltered, worst case"),
        );
        if skipped > 0 {
            facts.push(
                Fact::new("Recordings without simulation", skipped.to_string()).tone(Tone::Warning),
            );
        }
    }
    facts.push(parts::warning_count(
        found.warnings.len() + context.warnings.len(),
    ));
    facts
}

fn overview(found: &Validation) -> Section {
    let mut rows = Vec::new();
    for (checked, name) in found.recordings.iter().zip(names(found)) {
        for (j, check) in checked.torque.iter().enumerate() {
            let motion = simulated(checked).get(j);
            let of = |f: &dyn Fn(&MotionCheck) -> String| motion.map_or("–".into(), f);
            rows.push(vec![
                name.clone(),
                check.joint.clone(),
                format!(
                    "{} {}",
                    format_significant(check.residual.rms, 3),
                    parts::unit(&check.unit)
                ),
                parts::percent(check.residual.relative_error),
                of(&|m| parts::length(m.position_rms_error, &m.position_unit)),
                of(&|m| parts::percent(m.tracking_relative_error)),
                of(&|m| parts::percent(m.torque_relative_error)),
            ]);
        }
    }
    let replayed = (found.recordings.iter()).any(
        |r| matches!(&r.motion, Motion::Simulated { uncontrolled, .. } if !uncontrolled.is_empty()),
    );
    Section::new(
        "overview",
        "Overview",
        if replayed {
            "Torque: predicted for the measured motion. Simulation: the recorded torque drives the model, and a controller corrects the deviation from the recorded motion; the error of the simulated torque is the torque of this controller."
        } else {
            "Torque: predicted for the measured motion. Simulation: model and controller follow the recorded reference on their own."
        },
    )
    .with(Block::Table(Table {
        caption: "Prediction and measurement".into(),
        columns: vec![
            Column::text("Recording"),
            Column::text("Joint"),
            Column::number("Torque residual", ""),
            Column::number("of torque", "%"),
            Column::number("Simulated position", ""),
            Column::number("of tracking", "%"),
            Column::number("Simulated torque", "%"),
        ],
        rows,
        note: "All RMS: residual of the predicted torque and its share of the torque; error of the simulated position and its share of the tracking error; error of the simulated torque as a share of the torque. A dash: the motion was not simulated; the recording's section says why.".into(),
    }))
}

fn torque(robot: &Robot, checked: &Checked, name: &str, k: usize) -> Section {
    let mut section = Section::new(format!("torque-{}", k + 1), format!("Torque: {name}"), "");
    for (joint, check) in robot.joints.iter().zip(&checked.torque) {
        section
            .blocks
            .extend(residuals::torque_plots(joint, &check.residual, name));
    }
    section
}

/// File names of the recordings, or whole paths if two names are equal.
fn names(found: &Validation) -> Vec<String> {
    let labels = || found.recordings.iter().map(|r| r.recording.as_str());
    let short: Vec<&str> = labels()
        .map(|l| l.rsplit(['/', '\\']).next().unwrap_or(l))
        .collect();
    let unique = short.iter().collect::<std::collections::HashSet<_>>().len() == short.len();
    if unique {
        short.into_iter().map(str::to_owned).collect()
    } else {
        labels().map(str::to_owned).collect()
    }
}
