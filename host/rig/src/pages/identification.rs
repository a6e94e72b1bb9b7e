//! The page of an identification.

use std::f64::consts::TAU;

use super::{Context, parts};
use rig_identify::{Identification, ModelKind};
use rig_model::robot::Robot;
use rig_output::{format_significant, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, NoteKind, Plot, Role, Section, Series, Style, Table, Tone,
};

/// Up to so many parameters get a card each; more are summed up in one.
const CARDS: usize = 6;
/// Ellipses that are drawn.
const ELLIPSES: usize = 4;
/// Below this correlation an ellipse is upright and tells no more than the table.
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
        ModelKind::Differential => "torque against acceleration, velocity and position",
        ModelKind::Integral => "work against change of energy over windows",
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
            Fact::new("Left on data held back", parts::percent(held))
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
                "Left on the training data",
                train.map_or("–".into(), parts::percent),
            )
            .unit("%")
            .note(format!(
                "residual RMS over torque RMS{several}; no data were held back"
            ))
            .tone(Tone::Warning),
        ),
    }
    let warnings = found.warnings.len() + context.warnings.len();
    facts.push(if warnings == 0 {
        Fact::new("Warnings", "none").tone(Tone::Good)
    } else {
        Fact::new("Warnings", warnings.to_string())
            .note("on top of the page")
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
                .note("combinations that these data say nothing about on their own")
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
                // Ends of the interval with the digits of the value beside them.
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
        "The combinations of parameters that the torque depends on. Standard deviations allow for the correlation of the residual in time; the classical ones, as the literature prints them, take it as white and are too small where it is not.",
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
            "Std: standard deviation. {} rows; the residual remembers {} of them, so they count as {}. Intervals by Student's t with {} degrees of freedom.",
            parts::count(e.rows),
            format_significant(e.memory_rows, 2),
            parts::count(e.effective_rows as u64),
            e.degrees_of_freedom
        ),
    }))
}

fn not_excited(found: &Identification) -> Section {
    if found.not_excited.is_empty() {
        return Section::new("not-excited", "What was not excited", "").with(Block::Note {
            kind: NoteKind::Good,
            text: "The motion tells every base parameter of the model apart.".into(),
        });
    }
    Section::new(
        "not-excited",
        "What was not excited",
        "These data do not tell the following combinations apart from others, or say less of them than is known without data. A value given for one of the latter is noise with least squares, and mostly the description's with ridge and consistent.",
    )
    .with(Block::Table(Table {
        caption: "Combinations that the motion does not show".into(),
        columns: vec![
            Column::text("Combination"),
            Column::text("Why"),
            Column::text("A motion that would change that"),
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
        "Torque measured and predicted with the identified parameters, after the same filters. Data held back took no part in the fit.",
    );
    if found.joints.len() > 1 {
        let optional = |v: Option<f64>, f: &dyn Fn(f64) -> String| v.map_or("–".into(), f);
        section = section.with(Block::Table(Table {
            caption: "Residuals by joint".into(),
            columns: vec![
                Column::text("Joint"),
                Column::text("Unit"),
                Column::number("Residual RMS, training", ""),
                Column::number("Residual RMS, held back", ""),
                Column::number("Left, training", "%"),
                Column::number("Left, held back", "%"),
                Column::number("Rows used, training", "%"),
                Column::number("Left on all rows, training", "%"),
                Column::number("Rows used, held back", "%"),
                Column::number("Left on all rows, held back", "%"),
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
            note: "Left: residual RMS over torque RMS. Rows used: those that the fit and these figures count, without slow ones and ones at the torque limit.".into(),
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
                .extend(parts::torque_plots(joint, report, "data held back"));
        }
        if let Some(report) = found.details.train.get(j) {
            section
                .blocks
                .extend(parts::torque_plots(joint, report, "training data"));
        }
    }
    section.with(parts::info(
        "Drag over a plot to zoom, double-click to see all of it again.",
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
        "Which parameters are confused with which",
        "Parameters that are strongly correlated trade against each other: only their combination is well known.",
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
            "Correlation in time allowed for; {} rows that count as {}.",
            parts::count(e.rows),
            parts::count(e.effective_rows as u64)
        ));
        plot.height = 260;
        section = section.with(Block::Plot(plot));
    }
    if n > 12 {
        // A wide matrix reads badly; the pairs that matter do not.
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
    rows.extend(surveys(&d.holdout, "held back"));
    let mut section =
        Section::new("data", "What was done to the data", "").with(Block::Table(Table {
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
        .extend(parts::treatment(&robot.joints, &d.treatment));
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
        "What is left",
        "A residual that depends on something shows what the model leaves out. Tests are on the training data.",
    );
    let period = 1.0 / d.treatment.kept_rate();
    for (joint, report) in robot.joints.iter().zip(&d.train) {
        let blocks = parts::residual_tests(joint, report, period);
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
