//! Torque and its residual: curves over time, and tests of the residual.

use super::parts;
use rig_identify::{Dependence, ResidualReport, Series as Curves};
use rig_model::robot::Joint;
use rig_numerics::statistics::median;
use rig_output::format_significant;
use rig_report::{Axis, Block, Marker, Plot, Role, Series, Style};

/// Inserts a gap at each jump of time, so that no line joins two recordings.
fn with_gaps(curves: &Curves) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let steps: Vec<f64> = curves.t.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = median(steps.clone()).unwrap_or(0.0);
    let (mut t, mut a, mut b) = (Vec::new(), Vec::new(), Vec::new());
    for (i, time) in curves.t.iter().enumerate() {
        let step = i.checked_sub(1).and_then(|k| steps.get(k));
        if step.is_some_and(|s| *s < 0.0 || *s > 5.0 * usual) {
            t.push(*time);
            a.push(f64::NAN);
            b.push(f64::NAN);
        }
        t.push(*time);
        a.push(curves.measured[i]);
        b.push(curves.predicted[i]);
    }
    (t, a, b)
}

/// Draws measured and predicted torque and the residual over time.
pub(super) fn torque_plots(joint: &Joint, report: &ResidualReport, of: &str) -> Vec<Block> {
    let (what, torque) = (parts::effort(joint.kind), parts::units(joint.kind)[2]);
    let (t, measured, predicted) = with_gaps(&report.series);
    let residual: Vec<f64> = measured
        .iter()
        .zip(&predicted)
        .map(|(a, b)| a - b)
        .collect();
    let note = format!(
        "{} rows, residual RMS {} {torque}, {what} RMS {} {torque}: the residual is {} % of it.",
        parts::count(report.rows),
        format_significant(report.rms, 3),
        format_significant(report.torque_rms, 3),
        parts::percent(report.relative_error)
    );
    let mut first = Plot::new(
        format!("Joint {}: {what}, {of}", joint.name),
        Axis::new("time", "s"),
        Axis::new(what, torque),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        t.clone(),
        measured,
    ))
    .with(Series::line("predicted", Role::Model, t.clone(), predicted))
    .note(note);
    first.height = 280;
    let mut second = Plot::new(
        format!(
            "Joint {}: residual (measured less predicted), {of}",
            joint.name
        ),
        Axis::new("time", "s"),
        Axis::new("residual", torque),
    )
    .with(Series::line("residual", Role::Residual, t, residual))
    .mark(Marker::horizontal(0.0, ""))
    .note(format!(
        "{} rows, RMS {} {torque}. Masked rows are drawn but not counted.",
        parts::count(report.rows),
        format_significant(report.rms, 3)
    ));
    second.height = 220;
    vec![Block::Plot(first), Block::Plot(second)]
}

/// Tests of the residual of one joint: sentences first, then figures.
pub(super) fn residual_tests(joint: &Joint, report: &ResidualReport, period: f64) -> Vec<Block> {
    let [_, _, torque] = parts::units(joint.kind);
    let n = report.autocorrelation.len();
    let lags: Vec<f64> = (0..n).map(|k| k as f64 * period).collect();
    let bound = 1.96 / (report.rows.max(1) as f64).sqrt();
    let mut correlation = Plot::new(
        format!("Joint {}: autocorrelation of the residual", joint.name),
        Axis::new("lag", "s"),
        Axis::new("correlation", ""),
    )
    .with(Series::band(
        "95 % of white noise",
        Role::Noise,
        lags.clone(),
        vec![-bound; n],
        vec![bound; n],
    ))
    .with(Series::line(
        "residual",
        Role::Residual,
        lags,
        report.autocorrelation.clone(),
    ))
    .note(format!(
        "n = {}, residual RMS {} {torque}.",
        parts::count(report.rows),
        format_significant(report.rms, 3)
    ));
    correlation.height = 220;
    let mut blocks = vec![
        Block::List(
            [report.whiteness.clone(), report.normality.clone()]
                .into_iter()
                .chain(report.dependence.iter().map(|d| d.text.clone()))
                .collect(),
        ),
        Block::Plot(correlation),
    ];
    for d in &report.dependence {
        if d.coordinate != "direction" && d.middle.len() > 1 {
            blocks.push(Block::Plot(dependence(joint, d, report)));
        }
    }
    blocks
}

fn dependence(joint: &Joint, d: &Dependence, report: &ResidualReport) -> Plot {
    let [position, velocity, torque] = parts::units(joint.kind);
    let (label, unit) = match d.coordinate.as_str() {
        "position" => ("position", position),
        "velocity" => ("velocity", velocity),
        _ => (parts::effort(joint.kind), torque),
    };
    let mut plot = Plot::new(
        format!("Joint {}: mean residual over {}", joint.name, d.coordinate),
        Axis::new(label, unit),
        Axis::new("mean residual", torque),
    )
    .with(Series::new(
        "mean ± 1.96 standard deviations",
        Role::Residual,
        Style::ErrorBars {
            half_width: d.std.iter().map(|s| 1.96 * s).collect(),
        },
        d.middle.clone(),
        d.mean.clone(),
    ))
    .mark(Marker::horizontal(0.0, ""))
    .note(format!(
        "n = {}, residual RMS {} {torque}. Error bars allow for correlation in time.",
        parts::count(report.rows),
        format_significant(report.rms, 3)
    ));
    plot.height = 220;
    plot
}
