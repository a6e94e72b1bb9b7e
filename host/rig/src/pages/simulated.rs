//! The pages of simulated robots that were identified off-line and on-line.

use super::context::Context;
use super::parts;
use rig_compare::{Holdout, SimulatedEstimate, SimulatedRobot};
use rig_output::{format_significant, format_unit, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, Link, Plot, Role, Section, Series, Style, Table, Tone,
};

/// Words about what all estimates share.
const RECURSION: &str = "On-line: the recursion of the firmware's estimator over the rows in their order, without forgetting. Its rows come from the same zero-phase preparation as off-line, so the figure shows the convergence of the recursion and not the delay of a causal filter.";

/// Composes the page of one robot.
pub fn simulated_robot(found: &SimulatedRobot, context: &Context) -> Document {
    let mut sections = vec![accuracy(found), values(found)];
    sections.push(convergence(found));
    sections.push(holdout(found));
    if !found.notes.is_empty() {
        sections.push(
            Section::new("notes", "Simulated robots", "").with(Block::List(found.notes.clone())),
        );
    }
    sections.push(parts::repeat(context));
    Document {
        title: format!("{}: simulated and identified", found.robot),
        subtitle: "The description is the truth here: simulated, recorded with noise and quantisation, identified off-line and on-line by the differential and the integral model, and compared with the truth.".into(),
        summary: summary(found),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

/// Composes the page over all robots.
pub fn simulated_overview(all: &[(String, SimulatedRobot)], context: &Context) -> Document {
    let mut columns = vec![
        Column::text("Robot"),
        Column::number("Parameters", ""),
        Column::number("Motion", "s"),
        Column::number("Cut-off", "Hz"),
        Column::number("Rows", "1/s"),
    ];
    let names = all.first().map_or(Vec::new(), |(_, first)| {
        first.estimates.iter().map(words).collect()
    });
    columns.extend(names.iter().map(|name| Column::number(name.clone(), "%")));
    let errors = all.iter().map(|(name, r)| {
        let mut cells = vec![
            name.clone(),
            r.parameters.len().to_string(),
            format_significant(r.seconds, 3),
            format_significant(r.cutoff, 3),
            format_significant(r.rows_per_second, 3),
        ];
        cells.extend(r.estimates.iter().map(|e| parts::percent(e.torque_error)));
        cells
    });
    let errors = Table {
        caption: "Torque error of the identified parameters on the training motion".into(),
        columns,
        rows: errors.collect(),
        note: "RMS over all joints, as a share of the torque: the identified parameters' torque less the true one, without noise.".into(),
    };
    let mut columns = vec![Column::text("Robot"), Column::text("Joint")];
    columns.extend(names.iter().map(|name| Column::number(name.clone(), "%")));
    columns.push(Column::number("true parameters", "%"));
    columns.push(Column::number("rows counted", "%"));
    let rows = all.iter().flat_map(|(name, r)| {
        let own = move |h| [vec![name.clone()], joint_row(h)].concat();
        r.holdout.iter().map(own)
    });
    let joints = Table {
        caption: "Residual on the hold-out motion, measured less predicted".into(),
        columns,
        rows: rows.collect(),
        note: COUNTED.into(),
    };
    let reports = all.iter().map(|(folder, r)| Link {
        text: format!("{folder} ({})", r.robot),
        address: format!("{folder}/report.html"),
    });
    Document {
        title: format!("{} simulated robots compared", all.len()),
        subtitle: "Each robot was simulated from its description, recorded with noise and quantisation, and identified off-line and on-line by the differential and the integral model.".into(),
        summary: all
            .iter()
            .map(|(name, r)| {
                let best = r.estimates.iter().map(|e| e.torque_error).fold(f64::INFINITY, f64::min);
                Fact::new(name.clone(), parts::percent(best))
                    .unit("%")
                    .note("smallest torque error of the four estimates")
            })
            .collect(),
        sections: vec![
            Section::new("errors", "Estimation error", "").with(Block::Table(errors)),
            Section::new("holdout", "Measured and predicted torque", "").with(Block::Table(joints)),
            Section::new("reports", "Reports of the robots", RECURSION)
                .with(Block::Links(reports.collect())),
            parts::repeat(context),
        ],
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn words(estimate: &SimulatedEstimate) -> String {
    format!("{}, {}", estimate.way, estimate.model)
}

fn covered(estimate: &SimulatedEstimate) -> [usize; 2] {
    let known = || estimate.values.iter().flatten().filter_map(|v| v.covers);
    [known().filter(|covers| *covers).count(), known().count()]
}

/// Writes how many of the known intervals hold the truth.
fn inside_of(estimate: &SimulatedEstimate) -> String {
    match covered(estimate) {
        [_, 0] => "not known".to_owned(),
        [inside, all] => format!("{inside} of {all}"),
    }
}

fn summary(found: &SimulatedRobot) -> Vec<Fact> {
    found
        .estimates
        .iter()
        .map(|e| {
            let [inside, all] = covered(e);
            Fact::new(words(e), parts::percent(e.torque_error))
                .unit("% torque error")
                .note(format!("intervals that hold the truth: {}", inside_of(e)))
                .tone(match all {
                    0 => Tone::Plain,
                    _ if 10 * inside >= 9 * all => Tone::Good,
                    _ => Tone::Notice,
                })
        })
        .collect()
}

fn accuracy(found: &SimulatedRobot) -> Section {
    let rows = found
        .estimates
        .iter()
        .map(|e| vec![words(e), parts::percent(e.torque_error), inside_of(e)]);
    Section::new(
        "accuracy",
        "Estimation error",
        "The torque error is the RMS torque of the difference to the true parameters on the training motion, as a share of the torque, over all joints.",
    )
    .with(Block::Table(Table {
        caption: "Four identifications of one recording".into(),
        columns: vec![
            Column::text("Identification"),
            Column::number("Torque error", "%"),
            Column::number("95 % intervals that hold the truth", ""),
        ],
        rows: rows.collect(),
        note: format!(
            "Position cut off at {} Hz, {} rows/s, windows of the integral model {} s; rows below {} rad/s or m/s are left out. Fewer than 95 % hold the truth where errors other than noise exceed the error by noise, such as joints that stick at reversals. The torque error tells how much this matters.",
            format_significant(found.cutoff, 3),
            format_significant(found.rows_per_second, 3),
            format_significant(found.window, 2),
            format_significant(found.min_speed.iter().copied().fold(0.0, f64::max), 2)
        ),
    }))
}

fn values(found: &SimulatedRobot) -> Section {
    let section = Section::new(
        "values",
        "Identified and true parameters",
        "± one standard deviation",
    );
    ["off-line", "on-line"]
        .into_iter()
        .fold(section, |section, way| {
            section.with(Block::Table(values_of(found, way)))
        })
}

/// The parameters by the estimates of one way.
fn values_of(found: &SimulatedRobot, way: &str) -> Table {
    let estimates: Vec<&SimulatedEstimate> =
        found.estimates.iter().filter(|e| e.way == way).collect();
    let mut columns = vec![
        Column::text("Parameter"),
        Column::text("Unit"),
        Column::number("Truth", ""),
    ];
    columns.extend(estimates.iter().map(|e| Column::number(e.model, "")));
    let rows = found.parameters.iter().enumerate().map(|(k, p)| {
        let mut cells = vec![
            p.expression.clone(),
            format_unit(&p.unit),
            format_significant(p.truth, 5),
        ];
        cells.extend(estimates.iter().map(|e| match &e.values[k] {
            None => "not shown".to_owned(),
            Some(v) => match v.std {
                Some(std) => format_value(v.value, std),
                None => format_significant(v.value, 5),
            },
        }));
        cells
    });
    Table {
        caption: format!("Base parameters, {way}"),
        columns,
        rows: rows.collect(),
        note: "fv, fc and Ia of a joint also hold the friction and inertia of coupled motors that each of its motions turns alike, seen at the joint, so they may differ from the description's values. fvm, fcm and Iam belong to a motor.".into(),
    }
}

fn convergence(found: &SimulatedRobot) -> Section {
    let mut plot = Plot::new(
        "Torque error of the on-line estimates",
        Axis::new("time", "s"),
        Axis::log("torque error", "% of the torque"),
    );
    let roles = [Role::Measured, Role::Model];
    let online = found
        .estimates
        .iter()
        .filter(|e| !e.convergence[0].is_empty());
    for (e, role) in online.zip(roles) {
        let [t, error] = &e.convergence;
        let percent = error.iter().map(|e| 100.0 * e).collect();
        plot = plot.with(Series::line(words(e), role, t.clone(), percent));
    }
    Section::new(
        "convergence",
        "How fast does the on-line estimate converge?",
        RECURSION,
    )
    .with(Block::Plot(plot))
}

/// What the residuals on the hold-out hold.
const COUNTED: &str = "Share of the torque RMS of the joint, on the rows that count: slow ones and those near a reversal, where friction has any value between its two signs, are left out, and the figures show them too. The true parameters leave the noise and the error of the filtered motion.";

fn joint_row(h: &Holdout) -> Vec<String> {
    let mut cells = vec![h.joint.clone()];
    cells.extend(h.relative_error.iter().map(|e| parts::percent(*e)));
    cells.push(parts::percent(h.relative_error_of_truth));
    cells.push(parts::percent(h.used));
    cells
}

fn holdout(found: &SimulatedRobot) -> Section {
    let mut columns = vec![Column::text("Joint")];
    columns.extend(
        found
            .estimates
            .iter()
            .map(|e| Column::number(words(e), "%")),
    );
    columns.push(Column::number("true parameters", "%"));
    columns.push(Column::number("rows counted", "%"));
    let mut section = Section::new(
        "holdout",
        "Measured and predicted torque",
        "The hold-out is another designed motion, which no identification used.",
    )
    .with(Block::Table(Table {
        caption: "Residual on the hold-out as a share of the torque".into(),
        columns,
        rows: found.holdout.iter().map(joint_row).collect(),
        note: COUNTED.into(),
    }));
    for h in &found.holdout {
        let [t, measured, predicted] = h.series.clone();
        let residual = (measured.iter().zip(&predicted))
            .map(|(measured, predicted)| measured - predicted)
            .collect();
        let mut plot = Plot::new(
            format!("Joint {}: torque on the hold-out", h.joint),
            Axis::new("time", "s"),
            Axis::new("torque", h.unit),
        )
        .with(Series::new(
            "measured",
            Role::Measured,
            Style::Points,
            t.clone(),
            measured,
        ))
        .with(Series::line("predicted", Role::Model, t.clone(), predicted))
        .with(Series::line("residual", Role::Residual, t, residual));
        plot = plot.note(format!(
            "Predicted by the off-line differential model; all rows. RMS torque of the {} % that the table counts: {} {}.",
            parts::percent(h.used),
            format_significant(h.torque_rms, 3),
            h.unit
        ));
        plot.height = 240;
        section = section.with(Block::Plot(plot));
    }
    section
}
