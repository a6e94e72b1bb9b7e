//! Parts that several pages share.

pub(super) use rig_output::format_unit as unit;

use super::context::Context;
use rig_data::prepare::Treatment;
use rig_identify::{Dependence, FrictionFit, FrictionMap, ResidualReport, Series as Curves};
use rig_model::robot::{Joint, JointKind};
use rig_output::{format_significant, format_value};
use rig_report::{
    Axis, Block, Column, Marker, NoteKind, Plot, Role, Section, Series, Style, Table,
};

/// Returns "torque" or "force".
pub(super) fn effort(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "torque",
        JointKind::Prismatic => "force",
    }
}

/// Units of position, velocity and torque.
pub(super) fn units(kind: JointKind) -> [&'static str; 3] {
    match kind {
        JointKind::Revolute => ["rad", "rad/s", "N·m"],
        JointKind::Prismatic => ["m", "m/s", "N"],
    }
}

/// Formats a whole number with thin spaces between thousands.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(c);
    }
    text
}

/// Formats a share in per cent, with two digits below 10 % and three above.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    format_significant(value, if value.abs() < 10.0 { 2 } else { 3 })
}

/// Formats a small length or angle with a suitable unit prefix.
pub(super) fn length(value: f64, unit: &str) -> String {
    let (scale, prefix) = if value < 1e-6 {
        (1e9, "n")
    } else if value < 1e-3 {
        (1e6, "µ")
    } else if value < 1.0 {
        (1e3, "m")
    } else {
        (1.0, "")
    };
    format!("{} {prefix}{unit}", format_significant(scale * value, 3))
}

pub(super) fn warning(text: impl Into<String>) -> Block {
    Block::Note {
        kind: NoteKind::Warning,
        text: text.into(),
    }
}

pub(super) fn info(text: impl Into<String>) -> Block {
    Block::Note {
        kind: NoteKind::Info,
        text: text.into(),
    }
}

/// Returns the section of all warnings; none if there are no warnings.
pub(super) fn warnings(groups: &[&[String]]) -> Option<Section> {
    let blocks: Vec<Block> = groups.iter().copied().flatten().map(warning).collect();
    (!blocks.is_empty()).then(|| Section {
        id: "warnings".into(),
        title: "Read this first".into(),
        lead: String::new(),
        blocks,
    })
}

/// The command that repeats the result, and the description that was written.
pub(super) fn repeat(context: &Context) -> Section {
    let mut section =
        Section::new("repeat", "How to repeat this", "").with(Block::Code(context.command.clone()));
    if let Some((name, text)) = &context.identified {
        if !context.remarks.is_empty() {
            section = section.with(Block::List(context.remarks.clone()));
        }
        section = section.with(Block::Details {
            summary: format!("The identified description, {name}"),
            blocks: vec![Block::Code(text.clone())],
        });
    }
    section
}

/// Inserts a gap at each jump of time, so that no line joins two recordings.
fn with_gaps(curves: &Curves) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let steps: Vec<f64> = curves.t.windows(2).map(|w| w[1] - w[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
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
    let (what, torque) = (effort(joint.kind), units(joint.kind)[2]);
    let (t, measured, predicted) = with_gaps(&report.series);
    let residual: Vec<f64> = measured
        .iter()
        .zip(&predicted)
        .map(|(a, b)| a - b)
        .collect();
    let note = format!(
        "{} rows, residual RMS {} {torque}, {what} RMS {} {torque}: the residual is {} % of it.",
        count(report.rows),
        format_significant(report.rms, 3),
        format_significant(report.torque_rms, 3),
        percent(report.relative_error)
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
        count(report.rows),
        format_significant(report.rms, 3)
    ));
    second.height = 220;
    vec![Block::Plot(first), Block::Plot(second)]
}

/// Tests of the residual of one joint: sentences first, then figures.
pub(super) fn residual_tests(joint: &Joint, report: &ResidualReport, period: f64) -> Vec<Block> {
    let [_, _, torque] = units(joint.kind);
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
        count(report.rows),
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
    let [position, velocity, torque] = units(joint.kind);
    let (label, unit) = match d.coordinate.as_str() {
        "position" => ("position", position),
        "velocity" => ("velocity", velocity),
        _ => (effort(joint.kind), torque),
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
        count(report.rows),
        format_significant(report.rms, 3)
    ));
    plot.height = 220;
    plot
}

/// Draws the torque residual over the cut-offs that were tried.
fn over_cutoff(joints: &[Joint], treatment: &Treatment) -> Plot {
    let mut plot = Plot::new(
        "Torque residual over the cut-off".to_owned(),
        Axis::log("cut-off of the position filter", "Hz"),
        Axis::log("torque residual", "% of the torque"),
    );
    for (j, joint) in joints.iter().enumerate() {
        let judged = treatment
            .trials
            .iter()
            .filter(|t| t.relative_error[j] > 0.0);
        let (x, y): (Vec<f64>, Vec<f64>) = judged
            .map(|t| (t.cutoff, 100.0 * t.relative_error[j]))
            .unzip();
        let role = Role::ALL[j % Role::ALL.len()];
        plot = plot.with(Series::line(format!("joint {}", joint.name), role, x, y));
    }
    let mark = |hz: f64, what: &str| {
        Marker::vertical(hz, format!("{what} {} Hz", format_significant(hz, 3)))
    };
    plot = plot.mark(mark(treatment.cutoff, "cut-off"));
    if let Some(hz) = treatment.spectral_cutoff {
        plot = plot.mark(mark(hz, "by the spectrum"));
    }
    plot.height = 280;
    plot.note(
        "One fit for each cut-off, to the same torque in the same band. A cut-off that is too low distorts the motion; one that is too high lets noise through.",
    )
}

/// Treatment of the data: sentences, and the spectra behind them.
pub(super) fn treatment(joints: &[Joint], treatment: &Treatment) -> Vec<Block> {
    let rate = treatment.sample_rate;
    let mut items = vec![
        format!(
            "Position filter: Butterworth, order {}, forward and backward (no phase shift), cut-off {}",
            treatment.order, treatment.cutoff_reason
        ),
        format!("Derivatives: {}", treatment.derivatives),
        format!("Parallel filter: {}.", treatment.parallel_filter),
        format!("Decimation: {}", treatment.decimation_reason),
        format!("Speed thresholds: {}", treatment.speed_reason),
        format!(
            "Trimmed: {} rows ({} s) at both ends of every stretch, because the filters have not settled there.",
            count(treatment.trimmed as u64),
            format_significant(treatment.trimmed as f64 / rate, 3)
        ),
    ];
    if treatment.torque_lead != 0.0 {
        items.push(format!(
            "Torque lead: a recorded torque is assumed to act {} ms later.",
            format_significant(1e3 * treatment.torque_lead, 3)
        ));
    }
    let mut blocks = vec![Block::List(items)];
    if !treatment.trials.is_empty() {
        blocks.push(Block::Plot(over_cutoff(joints, treatment)));
    }
    for (joint, s) in joints.iter().zip(&treatment.spectra) {
        let position = units(joint.kind)[0];
        let ends: Vec<f64> = [s.frequency.first(), s.frequency.last()]
            .into_iter()
            .flatten()
            .copied()
            .collect();
        let mut plot = Plot::new(
            format!("Joint {}: spectrum of the position", joint.name),
            Axis::log("frequency", "Hz"),
            Axis::log("power density", &format!("{position}²/Hz")),
        )
        .with(Series::line(
            "position",
            Role::Measured,
            s.frequency.clone(),
            s.density.clone(),
        ))
        .with(
            Series::line(
                "noise floor",
                Role::Noise,
                ends.clone(),
                vec![s.floor; ends.len()],
            )
            .dashed(),
        )
        .mark(Marker::vertical(
            treatment.cutoff,
            format!("cut-off {} Hz", format_significant(treatment.cutoff, 3)),
        ))
        .mark(Marker::vertical(
            treatment.motion_frequency,
            format!(
                "motion up to {} Hz",
                format_significant(treatment.motion_frequency, 3)
            ),
        ))
        .note(format!(
            "Sampled at {} Hz. RMS of the noise over the whole band {} {position}.",
            format_significant(rate, 4),
            format_significant((s.floor * rate / 2.0).sqrt(), 2)
        ));
        plot.height = 280;
        blocks.push(Block::Plot(plot));
    }
    blocks
}

fn law(fit: &FrictionFit, v: f64) -> f64 {
    let dip = fit
        .stribeck_velocity
        .map_or(0.0, |vs| fit.breakaway_excess * (-(v / vs).powi(2)).exp());
    v.signum() * (fit.coulomb + dip) + fit.viscous * v + fit.offset
}

/// Friction points with error bars, the fitted laws, the profile over the Stribeck velocity and the decision.
pub(super) fn friction(kind: JointKind, map: &FrictionMap) -> Vec<Block> {
    let [_, velocity, torque] = units(kind);
    let what = effort(kind);
    let fastest = map.points.iter().fold(0.0f64, |m, p| m.max(p.speed.abs()));
    let slowest = map
        .points
        .iter()
        .fold(fastest, |m, p| m.min(p.speed.abs()))
        .max(fastest * 1e-4);
    // Two branches with a gap at rest, where the laws jump. Samples are denser at low speed, where the curves bend.
    let curve = |fit: &FrictionFit| -> (Vec<f64>, Vec<f64>) {
        let branch: Vec<f64> = (0..=120)
            .map(|k| 0.2 * slowest * (5.0 * fastest / slowest).powf(f64::from(k) / 120.0))
            .collect();
        let x: Vec<f64> = branch
            .iter()
            .rev()
            .map(|v| -v)
            .chain([f64::NAN])
            .chain(branch.iter().copied())
            .collect();
        let y = x.iter().map(|v| law(fit, *v)).collect();
        (x, y)
    };
    let mut plot = Plot::new(
        format!("Joint {}: friction {what} over velocity", map.joint),
        Axis::new("velocity", velocity),
        Axis::new(format!("friction {what}"), torque),
    );
    let (x, y) = curve(&map.simple);
    plot = plot.with(Series::line("Coulomb and viscous", Role::Model, x, y));
    if let Some(fit) = &map.stribeck {
        let (x, y) = curve(fit);
        plot = plot.with(Series::line("with Stribeck term", Role::After, x, y).dashed());
    }
    plot = plot
        .with(Series::new(
            "mean over a stretch ± 1.96 standard deviations",
            Role::Measured,
            Style::ErrorBars {
                half_width: map.points.iter().map(|p| 1.96 * p.std).collect(),
            },
            map.points.iter().map(|p| p.speed).collect(),
            map.points.iter().map(|p| p.friction).collect(),
        ))
        .note(format!(
            "n = {} stretches of constant speed, {}. Leave-one-out RMS error: {} {torque} without a Stribeck term{}.",
            map.points.len(),
            if map.from_reference { "found in the reference" } else { "found in the position" },
            format_significant(map.simple.leave_one_out_rms, 2),
            map.stribeck_left_out_rms
                .map_or(String::new(), |rms| format!(", {} {torque} with it", format_significant(rms, 2))),
        ));
    let kind_of_note = if map.warranted {
        NoteKind::Good
    } else {
        NoteKind::Info
    };
    let mut rows = vec![fit_row("Coulomb and viscous", &map.simple)];
    rows.extend(
        map.stribeck
            .iter()
            .map(|f| fit_row("with Stribeck term", f)),
    );
    let mut blocks = vec![
        Block::Note {
            kind: kind_of_note,
            text: map.text.clone(),
        },
        Block::Plot(plot),
        Block::Table(Table {
            caption: if map.stribeck.is_some() {
                "Both laws, ± half the 95 % interval"
            } else {
                "The law, ± half the 95 % interval"
            }
            .into(),
            columns: vec![
                Column::text("Law"),
                Column::number("Coulomb", torque),
                Column::number(
                    "Viscous",
                    if kind == JointKind::Revolute {
                        "N·m·s/rad"
                    } else {
                        "N·s/m"
                    },
                ),
                Column::number("Breakaway above Coulomb", torque),
                Column::number("Stribeck velocity", velocity),
            ],
            rows,
            note: format!(
                "fc·sgn v + fv·v + constant{}. Constant torque in addition to the identified one: {} {torque}. Standard deviation between passes in addition to the noise within a pass: {} {torque}.",
                if map.stribeck.is_some() {
                    ", and the same with Δ·exp(−(v/vs)²)·sgn v"
                } else {
                    ""
                },
                format_significant(map.stribeck.as_ref().unwrap_or(&map.simple).offset, 2),
                format_significant(map.scatter, 2)
            ),
        }),
    ];
    if map.stribeck.is_some() && map.profile.len() > 1 {
        let mut profile = Plot::new(
            "Sum of squares over the Stribeck velocity",
            Axis::log("Stribeck velocity", velocity),
            Axis::new("weighted sum of squares", ""),
        )
        .with(Series::line(
            "with Stribeck term",
            Role::After,
            map.profile.iter().map(|p| p[0]).collect(),
            map.profile.iter().map(|p| p[1]).collect(),
        ))
        .mark(Marker::horizontal(map.simple.squares, "without"))
        .note(format!(
            "n = {}; residuals in standard deviations of the points.",
            map.points.len()
        ));
        profile.height = 220;
        blocks.push(Block::Details {
            summary: "How the Stribeck velocity was chosen".into(),
            blocks: vec![Block::Plot(profile)],
        });
    }
    blocks
}

fn fit_row(name: &str, fit: &FrictionFit) -> Vec<String> {
    let value = |v: f64, k: usize| {
        fit.half_interval
            .get(k)
            .map_or("–".into(), |h| format_value(v, *h))
    };
    vec![
        name.into(),
        value(fit.coulomb, 0),
        value(fit.viscous, 1),
        value(fit.breakaway_excess, 2),
        fit.stribeck_velocity
            .map_or("–".into(), |v| format_significant(v, 2)),
    ]
}
