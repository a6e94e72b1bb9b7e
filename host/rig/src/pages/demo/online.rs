//! Estimates of the firmware during the motion.

use super::figures::{DemoFigures, DemoParameter, OnlineEstimates};
use crate::pages::parts;
use rig_output::{format_significant, format_value};
use rig_report::{Axis, Block, Plot, Role, Section, Series};

/// Draws each estimate with its band over time.
pub(super) fn section(figures: &DemoFigures) -> Section {
    let mut section = Section::new(
        "online",
        "On-line estimation",
        "Recursive estimate of the firmware, sample by sample. The band is ±1.96 of its standard deviations.",
    );
    for (k, parameter) in figures.parameters.iter().enumerate() {
        section = section.with(match drawn(parameter, &figures.online, k) {
            Some(plot) => Block::Plot(plot),
            None => parts::warning(format!(
                "There is no on-line estimate of {}.",
                parameter.name
            )),
        });
    }
    section
}

/// Index of the first estimate that is drawn. At the start the band is very wide and would flatten the rest of the
/// figure, so it is cut off.
fn first_drawn(p: &DemoParameter, std: &[f64]) -> usize {
    let wide = 5.0
        * std
            .last()
            .copied()
            .unwrap_or(0.0)
            .max(0.1 * p.truth.abs())
            .max(p.online.std);
    std.iter().position(|s| *s <= wide).unwrap_or(0)
}

/// Draws the estimates of parameter `k`, with the off-line estimate and the truth. Returns `None` if there are none.
fn drawn(p: &DemoParameter, o: &OnlineEstimates, k: usize) -> Option<Plot> {
    let (values, std) = (o.values.get(k)?, o.std.get(k)?);
    let unit = parts::unit(&p.unit);
    let first = first_drawn(p, std);
    let shifted = |f: f64| {
        values
            .iter()
            .zip(std)
            .map(|(v, s)| v + f * s)
            .collect::<Vec<_>>()
    };
    let ends: Vec<f64> = [o.t.get(first), o.t.last()]
        .into_iter()
        .flatten()
        .copied()
        .collect();
    let level = |v: f64| vec![v; ends.len()];
    let cut = |v: Vec<f64>| v.into_iter().skip(first).collect::<Vec<_>>();
    let t: Vec<f64> = cut(o.t.clone());
    let mut plot = Plot::new(
        format!("{} ({})", p.name, p.meaning),
        Axis::new("time", "s"),
        Axis::new(&p.name, &unit),
    )
    .with(Series::band(
        "on-line, 95 %",
        Role::Model,
        t.clone(),
        cut(shifted(-1.96)),
        cut(shifted(1.96)),
    ))
    .with(Series::line(
        "on-line",
        Role::Model,
        t.clone(),
        cut(values.clone()),
    ))
    .with(
        Series::line(
            "off-line",
            Role::Measured,
            ends.clone(),
            level(p.differential.value),
        )
        .dashed(),
    )
    .with(Series::line(
        "truth",
        Role::Reference,
        ends.clone(),
        level(p.truth),
    ))
    .note(format!(
        "n = {}; at the end {} {unit}.{}",
        values.len(),
        format_value(p.online.value, p.online.std),
        if first > 0 {
            format!(
                " Drawn from {} s on, when the band had become narrow.",
                format_significant(t.first().copied().unwrap_or(0.0), 2)
            )
        } else {
            String::new()
        }
    ));
    plot.height = 220;
    Some(plot)
}
