//! The page of a validation.

use super::context::Context;
use super::parts;
use rig_model::robot::{Joint, Robot};
use rig_output::format_significant;
use rig_report::{Axis, Block, Column, Document, Fact, Plot, Role, Section, Series, Table, Tone};
use rig_validate::{Checked, Motion, MotionCheck, Validation};

/// Composes the page of a validation.
pub fn validation(robot: &Robot, found: &Validation, context: &Context) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&found.warnings, &context.warnings]));
    sections.push(overview(found));
    let names = names(found);
    for (k, (checked, name)) in found.recordings.iter().zip(&names).enumerate() {
        sections.push(torque(robot, checked, name, k));
        sections.push(motion(robot, checked, name, k));
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
        .extend(parts::treatment(&robot.joints, &found.treatment));
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
                blocks: parts::residual_tests(joint, &check.residual, period),
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
    let warnings = found.warnings.len() + context.warnings.len();
    facts.push(if warnings == 0 {
        Fact::new("Warnings", "none").tone(Tone::Good)
    } else {
        Fact::new("Warnings", warnings.to_string())
            .note("at the top of the page")
            .tone(Tone::Warning)
    });
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
        "All figures",
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
            .extend(parts::torque_plots(joint, &check.residual, name));
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

fn motion(robot: &Robot, checked: &Checked, name: &str, k: usize) -> Section {
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
                section.blocks.extend(motion_plots(joint, check, *samples));
            }
            section
        }
    }
}

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

fn motion_plots(joint: &Joint, m: &MotionCheck, samples: u64) -> Vec<Block> {
    let [position, _, torque] = parts::units(joint.kind);
    let s = &m.series;
    let n = parts::count(samples);
    let time = || Axis::new("time", "s");
    let mut place = Plot::new(
        format!("Joint {}: position, measured and simulated", joint.name),
        time(),
        Axis::new("position", position),
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
        parts::length(m.position_rms_error, position),
        parts::length(m.position_max_error, position)
    ));
    place.height = 240;
    let scale = if m.tracking_rms < 1e-3 {
        (1e6, "µ")
    } else {
        (1e3, "m")
    };
    let less = |a: &[f64], b: &[f64]| {
        a.iter()
            .zip(b)
            .map(|(a, b)| scale.0 * (a - b))
            .collect::<Vec<_>>()
    };
    let mut tracking = Plot::new(
        format!(
            "Joint {}: tracking error (reference less position)",
            joint.name
        ),
        time(),
        Axis::new("tracking error", &format!("{}{position}", scale.1)),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        s.t.clone(),
        less(&s.reference, &s.measured),
    ))
    .with(Series::line(
        "simulated",
        Role::Model,
        s.t.clone(),
        less(&s.reference, &s.simulated),
    ))
    .note(format!(
        "n = {n}, measured RMS {}; the error of the simulation is {} % of it.",
        parts::length(m.tracking_rms, position),
        parts::percent(m.tracking_relative_error)
    ));
    tracking.height = 260;
    let mut error = Plot::new(
        format!(
            "Joint {}: position error (measured less simulated)",
            joint.name
        ),
        time(),
        Axis::new("error", &format!("{}{position}", scale.1)),
    )
    .with(Series::line(
        "error",
        Role::Residual,
        s.t.clone(),
        less(&s.measured, &s.simulated),
    ))
    .note(format!(
        "n = {n}, RMS {}.",
        parts::length(m.position_rms_error, position)
    ));
    error.height = 220;
    let what = parts::effort(joint.kind);
    let mut torques = Plot::new(
        format!("Joint {}: {what}, measured and simulated", joint.name),
        time(),
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
    torques.height = 280;
    vec![
        Block::Plot(tracking),
        Block::Plot(error),
        Block::Plot(torques),
        Block::Plot(place),
    ]
}
