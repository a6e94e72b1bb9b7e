//! The page of an identification.

use std::f64::consts::TAU;

use super::context::Context;
use super::{parts, residuals, treatment};
use rig_identify::{Identification, ModelKind};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, NoteKind, Plot, Role, Section, Series, Style, Table, Tone,
};

/// Largest number of parameters that get a card each; more share one card.
const CARDS: usize = 6;
/// Largest number of confidence ellipses.
const ELLIPSES: usize = 4;
/// Correlation below which no ellipse is drawn: it would be nearly upright and add nothing to the table.
const CORRELATED: f64 = 0.3;

/// Composes the page of an identification.
pub fn identification(robot: &Robot, found: &Identification, context: &Context) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&found.warnings, &context.warnings]));
    sections.push(parameters(found));
    sections.push(not_excited(found));
    sections.push(fit(robot, found));
    sections.extend(super::estimators::sections(robot, found));
    sections.push(confidence(found));
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
        summary: summary(found, context),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), context.command),
    }
}

fn summary(found: &Identification, context: &Context) -> Vec<Fact> {
    let worst = |of: &dyn Fn(&rig_identify::JointFigures) -> Option<f64>| {
        found.joints.iter().filter_map(of).reduce(f64::max)
    };
    let several = if found.joints.len() > 1 {
        ", worst joint"
    } else {
        ""
    };
    let train = worst(&|j| Some(j.train_relative_error));
    let mut facts = Vec::new();
    match worst(&|j| j.holdout_relative_error) {
        Some(held) => facts.push(
            Fact::new("Residual on the hold-out", parts::percent(held))
                .unit("%")
                .note(format!(
                    "residual RMS over torque RMS{several}; on the training data {} %",
                    train.map_or("–".into(), parts::percent)
                ))
                .tone(if held > 0.3 {
                    Tone::Warning
                } else {
                    Tone::Plain
                }),
        ),
        None => facts.push(
            Fact::new(
                "Residual on the training data",
                train.map_or("–".into(), parts::percent),
            )
            .unit("%")
            .note(format!(
                "residual RMS over torque RMS{several}; no hold-out was given"
            ))
            .tone(Tone::Warning),
        ),
    }
    let warnings = found.warnings.len() + context.warnings.len();
    facts.push(if warnings == 0 {
        Fact::new("Warnings", "none").tone(Tone::Good)
    } else {
        Fact::new("Warnings", warnings.to_string())
            .note("at the top of the page")
            .tone(Tone::Warning)
    });
    facts.push(
        Fact::new(
            "Condition number",
            format_significant(found.condition_number, 2),
        )
        .note(format!(
            "{} with columns scaled to one length",
            format_significant(found.details.estimate.scaled_condition, 2)
        )),
    );
    if found.base_parameters.len() <= CARDS {
        for b in &found.base_parameters {
            facts.push(
                Fact::new(&b.expression, format_value(b.value, half(b.interval)))
                    .unit(parts::unit(&b.unit))
                    .note("± half the 95 % interval"),
            );
        }
    } else {
        let mut relative: Vec<f64> = found
            .base_parameters
            .iter()
            .map(|b| b.relative_std_percent)
            .collect();
        relative.sort_by(f64::total_cmp);
        let median = relative
            .get(relative.len() / 2)
            .copied()
            .unwrap_or(f64::NAN);
        facts.push(
            Fact::new("Base parameters", found.base_parameters.len().to_string()).note(format!(
                "median relative standard deviation {} %",
                format_significant(median, 2)
            )),
        );
    }
    if !found.not_excited.is_empty() {
        facts.push(
            Fact::new("Not excited", found.not_excited.len().to_string())
                .note("combinations that these data alone do not determine")
                .tone(Tone::Warning),
        );
    }
    facts
}

fn half(interval: [f64; 2]) -> f64 {
    0.5 * (interval[1] - interval[0])
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
        "How well the model fits",
        "Measured torque, and torque predicted with the identified parameters, behind the same filters. The hold-out was not used in the fit.",
    );
    if found.joints.len() > 1 {
        let optional = |v: Option<f64>, f: &dyn Fn(f64) -> String| v.map_or("–".into(), f);
        section = section.with(Block::Table(Table {
            caption: "Residuals by joint".into(),
            columns: vec![
                Column::text("Joint"),
                Column::text("Unit"),
                Column::number("Residual RMS, training", ""),
                Column::number("Residual RMS, hold-out", ""),
                Column::number("Residual, training", "%"),
                Column::number("Residual, hold-out", "%"),
                Column::number("Rows used, training", "%"),
                Column::number("Residual on all rows, training", "%"),
                Column::number("Rows used, hold-out", "%"),
                Column::number("Residual on all rows, hold-out", "%"),
            ],
            rows: found
                .joints
                .iter()
                .zip(&robot.joints)
                .map(|(j, joint)| {
                    vec![
                        j.name.clone(),
                        parts::units(joint.kind)[2].into(),
                        format_significant(j.train_residual_rms, 3),
                        optional(j.holdout_residual_rms, &|v| format_significant(v, 3)),
                        parts::percent(j.train_relative_error),
                        optional(j.holdout_relative_error, &parts::percent),
                        parts::percent(j.train_rows_share),
                        parts::percent(j.train_relative_error_all_rows),
                        optional(j.holdout_rows_share, &parts::percent),
                        optional(j.holdout_relative_error_all_rows, &parts::percent),
                    ]
                })
                .collect(),
            note: "Residual in %: residual RMS over torque RMS. Rows used: share of the rows in the fit and in these figures, without slow rows and rows at the torque limit.".into(),
        }));
    }
    for (j, joint) in robot.joints.iter().enumerate() {
        if let Some(report) = found
            .details
            .holdout_residuals
            .as_ref()
            .and_then(|h| h.get(j))
        {
            section
                .blocks
                .extend(residuals::torque_plots(joint, report, "hold-out"));
        }
        if let Some(report) = found.details.train.get(j) {
            section
                .blocks
                .extend(residuals::torque_plots(joint, report, "training data"));
        }
    }
    section.with(parts::info(
        "Drag over a plot to zoom; double-click to reset.",
    ))
}

fn confidence(found: &Identification) -> Section {
    let e = &found.details.estimate;
    let names: Vec<String> = found
        .base_parameters
        .iter()
        .map(|b| b.expression.clone())
        .collect();
    let n = names.len();
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
    pairs.sort_by(|x, y| {
        e.correlation[y.0][y.1]
            .abs()
            .total_cmp(&e.correlation[x.0][x.1].abs())
    });
    let mut section = Section::new(
        "confidence",
        "Correlation of the parameters",
        "Strongly correlated parameters can compensate each other: only their combination is well determined.",
    );
    let strong: Vec<_> = pairs
        .iter()
        .filter(|(a, b)| e.correlation[*a][*b].abs() > CORRELATED)
        .take(ELLIPSES)
        .collect();
    if strong.is_empty() && n > 1 {
        section = section.with(parts::info(format!(
            "No two parameters are correlated by more than {CORRELATED}."
        )));
    }
    for &&(a, b) in &strong {
        let Some(ellipse) = e.ellipse(a, b) else {
            continue;
        };
        let (x, y): (Vec<f64>, Vec<f64>) = (0..=180)
            .map(|k| (f64::from(k) * TAU / 180.0).sin_cos())
            .map(|(s, c)| {
                (
                    ellipse.centre[0] + c * ellipse.first[0] + s * ellipse.second[0],
                    ellipse.centre[1] + c * ellipse.first[1] + s * ellipse.second[1],
                )
            })
            .unzip();
        let unit = |k: usize| parts::unit(&found.base_parameters[k].unit);
        let mut plot = Plot::new(
            format!(
                "{} and {}: correlation {}",
                names[a],
                names[b],
                signed(e.correlation[a][b])
            ),
            Axis::new(&names[a], &unit(a)),
            Axis::new(&names[b], &unit(b)),
        )
        .with(Series::line("95 % region of both", Role::Model, x, y))
        .with(Series::new(
            "estimate, 95 % interval of one",
            Role::Measured,
            Style::ErrorBars {
                half_width: vec![half(e.interval[b])],
            },
            vec![e.values[a]],
            vec![e.values[b]],
        ))
        .note(format!(
            "Allows for correlation in time; {} rows count as {} independent rows.",
            parts::count(e.rows),
            parts::count(e.effective_rows as u64)
        ));
        plot.height = 260;
        section = section.with(Block::Plot(plot));
    }
    if n > 12 {
        // A wide matrix is hard to read, so only the strongest pairs are listed.
        section = section.with(Block::Table(Table {
            caption: "The twenty strongest correlations".into(),
            columns: vec![
                Column::text("Parameter"),
                Column::text("Parameter"),
                Column::number("Correlation", ""),
            ],
            rows: pairs
                .iter()
                .take(20)
                .map(|&(a, b)| {
                    vec![
                        names[a].clone(),
                        names[b].clone(),
                        signed(e.correlation[a][b]),
                    ]
                })
                .collect(),
            note: String::new(),
        }));
    } else if n > 1 {
        section = section.with(Block::Table(Table {
            caption: "Correlation of the estimates".into(),
            columns: std::iter::once(Column::text("Parameter"))
                .chain(names.iter().map(|name| Column::number(name, "")))
                .collect(),
            rows: (0..n)
                .map(|a| {
                    std::iter::once(names[a].clone())
                        .chain((0..n).map(|b| {
                            if a == b {
                                "1".into()
                            } else {
                                signed(e.correlation[a][b])
                            }
                        }))
                        .collect()
                })
                .collect(),
            note: String::new(),
        }));
    }
    section
}

fn signed(rho: f64) -> String {
    format!("{rho:+.2}").replace('-', "−")
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
        "Residual",
        "A residual that depends on one of these quantities shows that the model lacks an effect. The tests use the training data.",
    );
    let period = 1.0 / d.treatment.kept_rate();
    for (joint, report) in robot.joints.iter().zip(&d.train) {
        let blocks = residuals::residual_tests(joint, report, period);
        if robot.joints.len() == 1 {
            section.blocks.extend(blocks);
        } else {
            section.blocks.push(Block::Details {
                summary: format!("Joint {}", joint.name),
                blocks,
            });
        }
    }
    section
}
