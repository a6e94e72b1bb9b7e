//! Parameters of the link: truth and the three estimates.

use super::figures::{DemoFigures, DemoParameter, Interval};
use crate::pages::parts;
use rig_output::{format_significant, format_value};
use rig_report::{Axis, Block, Column, Marker, Plot, Role, Section, Series, Style, Table};

/// Estimates by all methods, with their names.
fn estimates(p: &DemoParameter) -> [(&'static str, Role, Interval); 3] {
    [
        ("differential", Role::Measured, p.differential),
        ("integral", Role::After, p.integral),
        ("on-line", Role::Model, p.online),
    ]
}

/// Composes the section of truth and estimates.
pub(super) fn section(figures: &DemoFigures) -> Section {
    let half = |i: &Interval| 0.5 * (i.high - i.low);
    let rows = figures
        .parameters
        .iter()
        .map(|p| {
            let mut row = vec![
                format!("{} ({})", p.name, p.meaning),
                format_significant(p.truth, 4),
            ];
            for (_, _, i) in estimates(p) {
                let mark = if i.covers(p.truth) { "" } else { " *" };
                row.push(format!("{}{mark}", format_value(i.value, half(&i))));
            }
            row.push(parts::unit(&p.unit));
            row
        })
        .collect();
    let places: Vec<f64> = (0..figures.parameters.len()).map(|k| k as f64).collect();
    let mut plot = Plot::new(
        "Estimate less truth, in standard deviations",
        Axis::categories(
            "",
            figures.parameters.iter().map(|p| p.name.clone()).collect(),
        ),
        Axis::new("(estimate − truth) / standard deviation", ""),
    );
    for m in 0..3 {
        let (mut x, mut y, mut half_width) = (Vec::new(), Vec::new(), Vec::new());
        let (mut name, mut role) = ("", Role::Other);
        for (p, place) in figures.parameters.iter().zip(&places) {
            let (label, its, i) = estimates(p)[m];
            (name, role) = (label, its);
            x.push(place + 0.18 * (m as f64 - 1.0));
            y.push((i.value - p.truth) / i.std);
            half_width.push(half(&i) / i.std);
        }
        plot = plot.with(Series::new(
            name,
            role,
            Style::ErrorBars { half_width },
            x,
            y,
        ));
    }
    plot = plot
        .mark(Marker::horizontal(0.0, "truth"))
        .note("Bars are 95 % intervals; a bar that does not reach the line misses the truth.");
    Section::new(
        "parameters",
        "Truth and estimates",
        "Three estimates from the same motion: off-line from the torque balance, off-line from the energy balance, and by the firmware during the motion. The torque constant of the nameplate is assumed to be exact: an error in it would scale all parameters by the same factor and is not included in the intervals.",
    )
    .with(Block::Table(Table {
        caption: "Parameters of the link, ± half the 95 % interval".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("Truth", ""),
            Column::number("Differential", ""),
            Column::number("Integral", ""),
            Column::number("On-line", ""),
            Column::text("Unit"),
        ],
        rows,
        note: "* the 95 % interval does not hold the true value.".into(),
    }))
    .with(Block::Plot(plot))
}
