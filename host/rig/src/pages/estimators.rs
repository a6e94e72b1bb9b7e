//! Further sections of an identification: comparison of estimators, essential and full parameters.

use super::parts;
use rig_identify::{Compared, Comparison, EssentialSet, Identification, StandardSet};
use rig_model::robot::Robot;
use rig_output::format_significant;
use rig_report::{Block, Column, NoteKind, Section, Table};

/// Composes the sections that `found` has results for.
pub(super) fn sections(robot: &Robot, found: &Identification) -> Vec<Section> {
    let mut all = Vec::new();
    all.extend(found.comparison.as_ref().map(|c| compared(robot, found, c)));
    if !found.procedure.is_empty() {
        let mut section = Section::new("procedure", "Progress of the estimator", "");
        for sentence in &found.procedure {
            section = section.with(Block::Text(sentence.clone()));
        }
        all.push(section);
    }
    all.extend(found.essential.as_ref().map(essential));
    all.extend(
        found
            .standard_parameters
            .as_ref()
            .map(|set| standard(robot, found, set)),
    );
    all
}

fn percents(list: Option<&Vec<f64>>) -> String {
    list.map_or("–".into(), |errors| {
        errors
            .iter()
            .map(|e| parts::percent(*e))
            .collect::<Vec<_>>()
            .join(" ")
    })
}

/// The comparison of the estimators, with the recommendation.
fn compared(robot: &Robot, found: &Identification, comparison: &Comparison) -> Section {
    let mut section = Section::new(
        "estimators",
        "Comparison of estimators",
        "Every estimator predicts the torque on stretches of time that were left out of its fit.",
    )
    .with(Block::Note {
        kind: if comparison.recommended == found.estimator {
            NoteKind::Good
        } else {
            NoteKind::Warning
        },
        text: comparison.recommendation.clone(),
    })
    .with(Block::Table(table(robot, comparison)));
    if !comparison.repeated_holdout.is_empty() {
        section = section.with(Block::Text(format!(
            "These hold-outs repeat a training motion: {}. They do not show how well another motion is predicted.",
            comparison.repeated_holdout.join(", ")
        )));
    }
    if let Some(endogeneity) = &comparison.endogeneity {
        section = section.with(Block::Text(endogeneity.text.clone()));
    }
    let notes = progress(comparison);
    if !notes.is_empty() {
        section = section.with(Block::Details {
            summary: "Progress of each estimator".into(),
            blocks: notes,
        });
    }
    section
}

/// The table of the estimators that were compared.
fn table(robot: &Robot, comparison: &Comparison) -> Table {
    let joints: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    let held = comparison
        .estimators
        .iter()
        .any(|row| row.holdout_relative_error.is_some());
    let mut columns = vec![
        Column::text("Estimator"),
        Column::number("Residual, cross-validated", "%"),
    ];
    if held {
        columns.push(Column::number("Residual, hold-out", "%"));
    }
    columns.extend([
        Column::text("Physically consistent"),
        Column::number("Distance to consistent", "std"),
        Column::number("Largest shift", "std"),
    ]);
    Table {
        caption: "Estimators".into(),
        columns,
        rows: comparison
            .estimators
            .iter()
            .map(|row| cells(row, held))
            .collect(),
        note: format!(
            "Residual: residual RMS over torque RMS for each joint ({}), on {} stretches, each predicted from a fit to the others. Distance: from all parameters together to the nearest physically consistent set. Shift: largest difference from the weighted fit.",
            joints.join(", "),
            comparison.folds
        ),
    }
}

/// One row of the table. `held`: the table has a column for the hold-out.
fn cells(row: &Compared, held: bool) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or("–".into(), |v| format_significant(v, 2));
    let mut cells = vec![
        row.estimator.name().to_owned(),
        percents(row.cross_validated_relative_error.as_ref()),
    ];
    if held {
        cells.push(percents(row.holdout_relative_error.as_ref()));
    }
    cells.extend([
        match row.physically_consistent {
            Some(true) => "yes",
            Some(false) => "no",
            None => "–",
        }
        .to_owned(),
        number(row.distance_to_consistent),
        number(row.largest_shift),
    ]);
    cells
}

/// What each estimator said while it was fitted.
fn progress(comparison: &Comparison) -> Vec<Block> {
    let sentences = |row: &Compared| -> Vec<Block> {
        (row.said.iter())
            .map(|sentence| Block::Text(format!("{}: {sentence}", row.estimator.words())))
            .collect()
    };
    comparison.estimators.iter().flat_map(sentences).collect()
}

fn essential(set: &EssentialSet) -> Section {
    let intro = "The smallest set of parameters that explains the torque. The least certain parameter is set to zero and the others are refitted, as long as the residual does not grow significantly.";
    let section = Section::new("essential", "Essential parameters", intro);
    if set.left_out.is_empty() {
        return section.with(parts::info(format!(
            "All base parameters are essential. {}",
            set.ended
        )));
    }
    section.with(Block::Table(Table {
        caption: format!("{} essential parameters", set.parameters.len()),
        columns: vec![
            Column::text("Parameter"),
            Column::text("Unit"),
            Column::number("Value", ""),
            Column::number("Std", "%"),
        ],
        rows: set
            .parameters
            .iter()
            .map(|p| {
                vec![
                    p.expression.clone(),
                    parts::unit(&p.unit),
                    format_significant(p.value, 4),
                    format_significant(p.relative_std_percent, 2),
                ]
            })
            .collect(),
        note: format!(
            "Left out, least certain first: {}. The residual's RMS grew by {} %. {}",
            set.left_out.join(", "),
            format_significant(set.residual_increase_percent, 2),
            set.ended
        ),
    }))
}

fn standard(robot: &Robot, found: &Identification, set: &StandardSet) -> Section {
    let worst = set
        .residual_increase_percent
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    let rows = set
        .parameters
        .iter()
        .map(|p| {
            vec![
                p.name.clone(),
                parts::unit(&p.unit),
                format_significant(p.value, 4),
                if p.determined {
                    "data"
                } else {
                    "data and prior"
                }
                .to_owned(),
            ]
        })
        .collect();
    let increases: Vec<String> = if set.residual_increase_percent.len() == robot.joints.len() {
        set.residual_increase_percent
            .iter()
            .zip(&robot.joints)
            .map(|(p, joint)| format!("{} {} %", joint.name, format_significant(*p, 2)))
            .collect()
    } else {
        vec![format!("{} %", format_significant(worst, 2))]
    };
    let mut section = Section::new(
        "standard",
        "Full physically consistent parameters",
        "Many parameter sets give the identified combinations. This one is physically consistent and gives them, or lies nearest to them: every link has positive mass and a positive definite pseudo-inertia; friction and drive inertia are not negative. The written description holds this set.",
    )
    .with(parts::info(format!(
        "Change of the residual's RMS on the training data from the weighted fit, which has no such constraints: {}.",
        increases.join(", ")
    )));
    for sentence in &set.prior {
        section = section.with(Block::Text(sentence.clone()));
    }
    let least: Vec<String> = set
        .least_eigenvalue
        .iter()
        .map(|e| format_significant(*e, 2))
        .collect();
    section.with(Block::Details {
        summary: format!("All {} parameters", set.parameters.len()),
        blocks: vec![Block::Table(Table {
            caption: format!("Standard parameters of {}", found.robot),
            columns: vec![
                Column::text("Parameter"),
                Column::text("Unit"),
                Column::number("Value", ""),
                Column::text("Decided by"),
            ],
            rows,
            note: format!(
                "Smallest eigenvalue of each link's pseudo-inertia, mass and radius of gyration scaled to one: {}.",
                least.join(", ")
            ),
        })],
    })
}
