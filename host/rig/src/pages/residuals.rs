//! Torque and its residual: curves over time, and tests of the residual.

use super::parts;
use rig_identify::{Dependence, ResidualReport, Series as Curves};
use rig_model::robot::Joint;
use rig_numerics::statistics::median;
use rig_output::format_significant;
use rig_report::{Axis, Block, Marker, Plot, Role, Series, Style};

/// Curves over time with a gap at each jump of time, so that no line joins two recordings.
#[derive(Default)]
struct Gapped {
    t: Vec<f64>,
    measured: Vec<f64>,
    predicted: Vec<f64>,
    used: Vec<bool>,
}

fn with_gaps(curves: &Curves) -> Gapped {
    let steps: Vec<f64> = curves.t.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = median(steps.clone()).unwrap_or(0.0);
    let mut found = Gapped::default();
    let mut push = |t, measured, predicted, used| {
        found.t.push(t);
        found.measured.push(measured);
        found.predicted.push(predicted);
        found.used.push(used);
    };
    for (i, time) in curves.t.iter().enumerate() {
        let step = i.checked_sub(1).and_then(|k| steps.get(k));
        if step.is_some_and(|s| *s < 0.0 || *s > 5.0 * usual) {
            push(*time, f64::NAN, f64::NAN, true);
        }
        let used = curves.used.get(i).is_none_or(|used| *used);
        push(*time, curves.measured[i], curves.predicted[i], used);
    }
    found
}

/// Returns the residual of the rows that count, and of the masked ones with the rows beside them, so that the lines meet.
fn used_and_masked(curves: &Gapped) -> [Vec<f64>; 2] {
    let n = curves.t.len();
    let masked = |k: usize| curves.used.get(k).is_some_and(|used| !used);
    let residual = |k: usize| curves.measured[k] - curves.predicted[k];
    let shown = |show: &dyn Fn(usize) -> bool| -> Vec<f64> {
        let value = |k| if show(k) { residual(k) } else { f64::NAN };
        (0..n).map(value).collect()
    };
    let beside = |k: usize| masked(k) || masked(k + 1) || (k > 0 && masked(k - 1));
    [shown(&|k| !masked(k)), shown(&beside)]
}

/// Draws measured and predicted torque and the residual over time.
pub(super) fn torque_plots(joint: &Joint, report: &ResidualReport, of: &str) -> Vec<Block> {
    let (what, torque) = (parts::effort(joint.kind), parts::units(joint.kind)[2]);
    let curves = with_gaps(&report.series);
    let [counted, masked] = used_and_masked(&curves);
    let Gapped {
        t,
        measured,
        predicted,
        ..
    } = curves;
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
    .with(Series::line("masked, not counted", Role::Noise, t.clone(), masked))
    .with(Series::line("residual", Role::Residual, t, counted))
    .mark(Marker::horizontal(0.0, ""))
    .note(format!(
        "{} rows, RMS {} {torque}. Grey rows are masked and not counted; \"Treatment of the data\" says why.",
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
