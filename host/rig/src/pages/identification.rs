//! The page of an identification.

mod confidence;
mod summary;

use super::context::Context;
use super::{parts, residuals, treatment};
use rig_identify::{Identification, JointFigures, ModelKind};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_value};
use rig_report::{Axis, Block, Column, Document, NoteKind, Plot, Role, Section, Table};

/// Composes the page of an identification.
pub fn identification(robot: &Robot, found: &Identification, context: &Context) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&found.sentences(), &context.warnings]));
    let fit = fit(robot, found);
    // The figure of all joints comes before the long table of an arm.
    if robot.joints.len() > 1 {
        sections.extend([fit, parameters(found), not_excited(found)]);
    } else {
        sections.extend([parameters(found), not_excited(found), fit]);
    }
    sections.extend(super::estimators::sections(robot, found));
    sections.push(confidence::section(found));
    sections.push(data(robot, found));
    sections.push(residuals(robot, found));
    sections.push(parts::repeat(context));
    let model = match found.model {
        ModelKind::Differential => "torque as a function of acceleration, velocity and position",
        ModelKind::Integral => "work equal to the change of energy over windows",
    };
    let estimator = found.estimator.words();
    Document {
        title: format!("{}: identified parameters", found.robot),
        subtitle: format!("{} base parameters by {estimator}, {model}.", found.rank),
        summary: summary::facts(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn parameters(found: &Identification) -> Section {
    let rows = found
        .base_parameters
        .iter()
        .map(|b| {
            let decimals = |v: f64| {
                // The ends of the interval get as many decimals as the value.
                format_value(v, b.std)
                    .split(" ± ")
                    .next()
                    .unwrap_or_default()
                    .trim_start_matches('(')
                    .to_owned()
            };
            let plain = !format_value(b.value, b.std).starts_with('(');
            let end = |v: f64| {
                if plain {
                    decimals(v)
                } else {
                    format_significant(v, 4)
                }
            };
            vec![
                b.expression.clone(),
                parts::unit(&b.unit),
                format_value(b.value, b.std),
                format!("{} … {}", end(b.interval[0]), end(b.interval[1])),
                format_significant(b.relative_std_percent, 2),
                format_significant(b.classical_relative_std_percent, 2),
            ]
        })
        .collect();
    let e = &found.details.estimate;
    Section::new(
        "parameters",
        "Parameters",
        "Combinations of parameters that the torque depends on. The standard deviations allow for the correlation of the residual in time. The classical ones, common in the literature, assume a white residual and are too small otherwise.",
    )
    .with(Block::Table(Table {
        caption: "Base parameters".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::text("Unit"),
            Column::number("Value ± std", ""),
            Column::number("95 % interval", ""),
            Column::number("Std", "%"),
            Column::number("Classical", "%"),
        ],
        rows,
        note: format!(
            "Std: standard deviation. {} rows; the residual is correlated over {} of them, so they count as {} independent rows. Intervals by Student's t with {} degrees of freedom.",
            parts::count(e.rows),
            format_significant(e.memory_rows, 2),
            parts::count(e.effective_rows as u64),
            e.degrees_of_freedom
        ),
    }))
    .with(parts::names_of_parameters())
}

fn not_excited(found: &Identification) -> Section {
    if found.not_excited.is_empty() {
        return Section::new("not-excited", "Parameters that were not excited", "").with(
            Block::Note {
                kind: NoteKind::Good,
                text: "The motion makes every base parameter of the model identifiable.".into(),
            },
        );
    }
    Section::new(
        "not-excited",
        "Parameters that were not excited",
        "These data do not separate the following combinations from others, or determine them less well than prior knowledge does. In the second case a value from least squares is noise, and a value from ridge or consistent is mostly that of the description.",
    )
    .with(Block::Table(Table {
        caption: "Combinations that the motion does not excite".into(),
        columns: vec![
            Column::text("Combination"),
            Column::text("Reason"),
            Column::text("Motion that would excite it"),
        ],
        rows: found
            .not_excited
            .iter()
            .map(|n| vec![n.combination.clone(), n.why.clone(), n.motion.clone()])
            .collect(),
        note: String::new(),
    }))
}

fn fit(robot: &Robot, found: &Identification) -> Section {
    let mut section = Section::new(
        "fit",
        "Residual of the fit",
        "Measured torque, and torque predicted with the identified parameters, behind the same filters. The hold-out was not used in the fit.",
    );
    if found.joints.len() > 1 {
        section = section.with(Block::Plot(by_joint(found)));
        section = section.with(Block::Table(residuals_by_joint(robot, found)));
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        let mut blocks = Vec::new();
        let held = found.details.holdout_residuals.as_ref();
        if let Some(report) = held.and_then(|h| h.get(j)) {
            blocks.extend(residuals::torque_plots(joint, report, "hold-out"));
        }
        if let Some(report) = found.details.train.get(j) {
            blocks.extend(residuals::torque_plots(joint, report, "training data"));
        }
        let of = robot.joints.len();
        section
            .blocks
            .extend(parts::of_joint(&joint.name, of, "torque over time", blocks));
    }
    section.with(parts::info(
        "Drag over a plot to zoom; double-click to reset.",
    ))
}

/// Lists the residuals of all joints; without a hold-out those of the training data alone.
fn residuals_by_joint(robot: &Robot, found: &Identification) -> Table {
    let has_holdout = (found.joints.iter()).any(|joint| joint.holdout_rows_share.is_some());
    let columns = |of: &str| {
        [
            Column::number(format!("Residual RMS, {of}"), ""),
            Column::number(format!("Residual, {of}"), "%"),
            Column::number(format!("Rows used, {of}"), "%"),
            Column::number(format!("Residual on all rows, {of}"), "%"),
        ]
    };
    let mut table = Table {
        caption: "Residuals by joint".into(),
        columns: vec![Column::text("Joint"), Column::text("Unit")],
        rows: Vec::new(),
        note: "Residual in %: residual RMS over torque RMS. Rows used: share of the rows in the fit and in these figures, without slow rows and rows at the torque limit.".into(),
    };
    table.columns.extend(columns("training"));
    if has_holdout {
        table.columns.extend(columns("hold-out"));
    }
    let optional = |v: Option<f64>, f: &dyn Fn(f64) -> String| v.map_or("–".into(), f);
    for (j, joint) in found.joints.iter().zip(&robot.joints) {
        let mut row = vec![
            j.name.clone(),
            parts::units(joint.kind)[2].into(),
            format_significant(j.train_residual_rms, 3),
            parts::percent(j.train_relative_error),
            parts::percent(j.train_rows_share),
            parts::percent(j.train_relative_error_all_rows),
        ];
        if has_holdout {
            row.extend([
                optional(j.holdout_residual_rms, &|v| format_significant(v, 3)),
                optional(j.holdout_relative_error, &parts::percent),
                optional(j.holdout_rows_share, &parts::percent),
                optional(j.holdout_relative_error_all_rows, &parts::percent),
            ]);
        }
        table.rows.push(row);
    }
    table
}

/// Draws the residual of every joint beside those of the others.
fn by_joint(found: &Identification) -> Plot {
    let names: Vec<&str> = found.joints.iter().map(|j| j.name.as_str()).collect();
    let share = |of: &dyn Fn(&JointFigures) -> f64| -> Vec<f64> {
        found.joints.iter().map(|j| 100.0 * of(j)).collect()
    };
    let mut bars = vec![("training", Role::Before, share(&|j| j.train_relative_error))];
    if found
        .joints
        .iter()
        .any(|j| j.holdout_relative_error.is_some())
    {
        let held = share(&|j| j.holdout_relative_error.unwrap_or(f64::NAN));
        bars.push(("hold-out", Role::After, held));
    }
    parts::joint_bars(
        "Residual of all joints",
        &names,
        Axis::new("residual RMS over torque RMS", "%"),
        bars,
        "On the rows that count; the table has the figures on all rows too.",
    )
}

fn data(robot: &Robot, found: &Identification) -> Section {
    let d = &found.details;
    let surveys = |list: &[rig_data::prepare::Survey], used: &str| {
        list.iter()
            .map(|s| {
                vec![
                    s.label.clone(),
                    used.to_owned(),
                    parts::count(s.rows),
                    format_significant(s.sample_rate, 4),
                    format_significant(s.rows as f64 / s.sample_rate, 3),
                ]
            })
            .collect::<Vec<_>>()
    };
    let mut rows = surveys(&d.training, "training");
    rows.extend(surveys(&d.holdout, "hold-out"));
    let mut section = Section::new("data", "Treatment of the data", "").with(Block::Table(Table {
        caption: "Recordings".into(),
        columns: vec![
            Column::text("Recording"),
            Column::text("Used for"),
            Column::number("Rows", ""),
            Column::number("Rate", "Hz"),
            Column::number("Duration", "s"),
        ],
        rows,
        note: String::new(),
    }));
    section
        .blocks
        .extend(treatment::treatment(&robot.joints, &d.treatment));
    if let Some((_, why)) = &d.window {
        section = section.with(Block::Text(format!("Windows of the integral model: {why}")));
    }
    if d.masked.is_empty() {
        return section.with(Block::Text("No row was masked.".into()));
    }
    section.with(Block::Table(Table {
        caption: "Rows left out of the fit (after decimation)".into(),
        columns: vec![
            Column::text("Joint"),
            Column::number("Rows", ""),
            Column::text("Why"),
        ],
        rows: d
            .masked
            .iter()
            .map(|m| {
                let joint = m.joint.checked_sub(1).and_then(|j| robot.joints.get(j));
                vec![
                    joint.map_or("all".into(), |j| j.name.clone()),
                    parts::count(m.rows),
                    m.why.clone(),
                ]
            })
            .collect(),
        note: format!("{} rows were used.", parts::count(d.estimate.rows)),
    }))
}

fn residuals(robot: &Robot, found: &Identification) -> Section {
    let d = &found.details;
    let mut section = Section::new(
        "residuals",
        "Tests of the residual",
        "A residual that depends on one of these quantities shows that the model lacks an effect. The tests use the training data.",
    );
    let period = 1.0 / d.treatment.kept_rate();
    for (joint, report) in robot.joints.iter().zip(&d.train) {
        let blocks = residuals::residual_tests(joint, report, period);
        let of = robot.joints.len();
        section.blocks.extend(parts::of_joint(
            &joint.name,
            of,
            "tests of the residual",
            blocks,
        ));
    }
    section
}
