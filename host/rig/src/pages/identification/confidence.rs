//! Correlation of the estimated parameters.

use std::f64::consts::TAU;

use crate::pages::parts;
use rig_identify::{Ellipse, Identification};
use rig_report::{Axis, Block, Column, Plot, Role, Section, Series, Style, Table};

/// Largest number of confidence ellipses.
const ELLIPSES: usize = 4;
/// Correlation below which no ellipse is drawn: it would be nearly upright and add nothing to the table.
const CORRELATED: f64 = 0.3;
/// Largest number of parameters whose correlations are a matrix. A wider one is hard to read, so only the strongest
/// pairs are listed.
const WIDEST: usize = 12;

/// Composes the section of the correlations.
pub(super) fn section(found: &Identification) -> Section {
    let e = &found.details.estimate;
    let n = found.base_parameters.len();
    let pairs = pairs(found);
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
        if let Some(ellipse) = e.ellipse(a, b) {
            section = section.with(Block::Plot(region(found, [a, b], &ellipse)));
        }
    }
    if n > WIDEST {
        section = section.with(Block::Table(strongest(found, &pairs)));
    } else if n > 1 {
        section = section.with(Block::Table(matrix(found)));
    }
    section
}

/// All pairs of parameters, the most strongly correlated first.
fn pairs(found: &Identification) -> Vec<(usize, usize)> {
    let e = &found.details.estimate;
    let n = found.base_parameters.len();
    let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
    pairs.sort_by(|x, y| {
        e.correlation[y.0][y.1]
            .abs()
            .total_cmp(&e.correlation[x.0][x.1].abs())
    });
    pairs
}

/// Draws the common 95 % region of two parameters.
fn region(found: &Identification, [a, b]: [usize; 2], ellipse: &Ellipse) -> Plot {
    let e = &found.details.estimate;
    let name = |k: usize| &found.base_parameters[k].expression;
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
            name(a),
            name(b),
            signed(e.correlation[a][b])
        ),
        Axis::new(name(a), &unit(a)),
        Axis::new(name(b), &unit(b)),
    )
    .with(Series::line("95 % region of both", Role::Model, x, y))
    .with(Series::new(
        "estimate, 95 % interval of one",
        Role::Measured,
        Style::ErrorBars {
            half_width: vec![parts::half(e.interval[b])],
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
    plot
}

/// The strongest correlations.
fn strongest(found: &Identification, pairs: &[(usize, usize)]) -> Table {
    let e = &found.details.estimate;
    let name = |k: usize| found.base_parameters[k].expression.clone();
    Table {
        caption: "The twenty strongest correlations".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::text("Parameter"),
            Column::number("Correlation", ""),
        ],
        rows: pairs
            .iter()
            .take(20)
            .map(|&(a, b)| vec![name(a), name(b), signed(e.correlation[a][b])])
            .collect(),
        note: String::new(),
    }
}

/// All correlations.
fn matrix(found: &Identification) -> Table {
    let e = &found.details.estimate;
    let names: Vec<String> = found
        .base_parameters
        .iter()
        .map(|b| b.expression.clone())
        .collect();
    let n = names.len();
    Table {
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
    }
}

/// Formats a correlation with its sign.
fn signed(rho: f64) -> String {
    format!("{rho:+.2}").replace('-', "−")
}
