//! The page of the demonstration: the emulated rig, identified by firmware and host.

mod missing;

use super::{friction, parts, residuals};
use rig_diagnose::Diagnosis;
use rig_identify::{FrictionMap, ResidualReport};
use rig_model::robot::{JointKind, Robot};
use rig_output::{format_significant, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, Marker, NoteKind, Plot, Role, Section, Series, Style,
    Table, Tone,
};

/// An estimate with its 95 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// Estimate.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    fn covers(&self, truth: f64) -> bool {
        (self.low..=self.high).contains(&truth)
    }
}

/// One parameter, its true value and the three estimates of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DemoParameter {
    /// Short name: `J`.
    pub name: String,
    /// In words: `inertia`.
    pub meaning: String,
    /// Unit, ASCII (`kg*m^2`) or as printed.
    pub unit: String,
    /// Value in the emulated rig.
    pub truth: f64,
    /// Off-line estimate by the differential model (torque).
    pub differential: Interval,
    /// Off-line estimate by the integral model (energy).
    pub integral: Interval,
    /// The firmware's estimate at the end of the motion.
    pub online: Interval,
}

/// Estimates of the firmware during the motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OnlineEstimates {
    /// s
    pub t: Vec<f64>,
    /// One series for each parameter, in the order of [`DemoFigures::parameters`].
    pub values: Vec<Vec<f64>>,
    /// Standard deviations of `values`.
    pub std: Vec<Vec<f64>>,
}

/// Tracking error of one motion without and with precompensation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tracking {
    /// In words: `slow reversals`.
    pub motion: String,
    /// Unit of position and errors.
    pub unit: String,
    /// s
    pub t: Vec<f64>,
    /// Reference position.
    pub reference: Vec<f64>,
    /// Reference less position with feedback alone; NaN where there is no sample.
    pub error_without: Vec<f64>,
    /// Reference less position with friction and dynamics precompensated.
    pub error_with: Vec<f64>,
    /// RMS over all samples of the run.
    pub rms_without: f64,
    /// RMS over all samples of the run.
    pub rms_with: f64,
    /// A remark about the runs.
    pub note: String,
}

/// Samples on the wire.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wire {
    /// Samples received.
    pub received: u64,
    /// Samples lost.
    pub lost: u64,
    /// A sentence.
    pub text: String,
}

/// Everything the page shows.
#[derive(Clone, Debug, PartialEq)]
pub struct DemoFigures {
    /// The description that was identified.
    pub robot: Robot,
    /// The command line that repeats the demonstration.
    pub command: String,
    /// Length of all recordings together, s.
    pub seconds: f64,
    /// The six parameters of one link.
    pub parameters: Vec<DemoParameter>,
    /// On-line estimates over time.
    pub online: OnlineEstimates,
    /// Motions with and without precompensation.
    pub tracking: Vec<Tracking>,
    /// Friction map.
    pub friction: Option<FrictionMap>,
    /// The reason if there is no map.
    pub friction_text: String,
    /// The wire.
    pub wire: Wire,
    /// Residuals on the hold-out, one for each joint.
    pub holdout: Vec<ResidualReport>,
    /// Diagnosis of the identified model.
    pub diagnosis: Option<Diagnosis>,
    /// Effects of the emulated rig that the model does not have.
    pub beyond_model: Vec<String>,
    /// Sentences for the top of the page.
    pub warnings: Vec<String>,
    /// Files in the folder of the page, with the content of each.
    pub files: Vec<(String, String)>,
}

/// Composes the page of the demonstration.
pub fn demo(figures: &DemoFigures) -> Document {
    let mut sections: Vec<Section> = Vec::new();
    sections.extend(parts::warnings(&[&figures.warnings]));
    sections.push(parameters(figures));
    sections.push(tracking(figures));
    sections.push(online(figures));
    sections.push(holdout(figures));
    sections.push(friction(figures));
    sections.push(wire(figures));
    sections.extend(figures.diagnosis.as_ref().map(missing::section));
    sections.push(beyond(figures));
    let mut repeat =
        Section::new("repeat", "How to repeat this", "").with(Block::Code(figures.command.clone()));
    if !figures.files.is_empty() {
        repeat = repeat.with(Block::Table(Table {
            caption: "Files beside this page".into(),
            columns: vec![Column::text("File"), Column::text("Holds")],
            rows: figures
                .files
                .iter()
                .map(|(name, what)| vec![name.clone(), what.clone()])
                .collect(),
            note: String::new(),
        }));
    }
    sections.push(repeat);
    Document {
        title: "One geared link, identified and precompensated".into(),
        subtitle: format!(
            "No hardware was used. The logic of the firmware drove an emulated rig, {}. Its telemetry, {} s in all, passed through the real wire protocol, and from it this program estimated the dynamics of the link. The rig has effects that the model lacks, so the estimates are tested against a more complex truth.",
            figures.robot.name,
            format_significant(figures.seconds, 3)
        ),
        summary: summary(figures),
        sections,
        footer: format!("rig {} · {}", env!("CARGO_PKG_VERSION"), figures.command),
    }
}

/// Estimates by all methods, with their names.
fn estimates(p: &DemoParameter) -> [(&'static str, Role, Interval); 3] {
    [
        ("differential", Role::Measured, p.differential),
        ("integral", Role::After, p.integral),
        ("on-line", Role::Model, p.online),
    ]
}

fn summary(figures: &DemoFigures) -> Vec<Fact> {
    let total = figures.parameters.len();
    let covered = figures
        .parameters
        .iter()
        .filter(|p| p.differential.covers(p.truth))
        .count();
    let mut facts = vec![
        Fact::new(
            "True values within their 95 % intervals",
            format!("{covered} of {total}"),
        )
        .note("off-line, differential model")
        // One interval of twenty is expected to miss. More than one miss of six is unlikely to be chance.
        .tone(if covered + 1 >= total {
            Tone::Good
        } else {
            Tone::Warning
        }),
    ];
    for t in &figures.tracking {
        if let Some(factor) = gain(t) {
            facts.push(
                Fact::new(format!("Tracking error, {}", t.motion), times(factor))
                    .note(format!(
                        "RMS {} → {} {} with precompensation",
                        format_significant(t.rms_without, 2),
                        format_significant(t.rms_with, 2),
                        parts::unit(&t.unit)
                    ))
                    .tone(if factor > 1.0 {
                        Tone::Good
                    } else {
                        Tone::Warning
                    }),
            );
        }
    }
    for report in &figures.holdout {
        facts.push(
            Fact::new(
                "Torque residual on the hold-out",
                parts::percent(report.relative_error),
            )
            .unit("%")
            .note("residual RMS over torque RMS"),
        );
    }
    facts.push(
        Fact::new("Samples lost on the wire", parts::count(figures.wire.lost))
            .note(format!(
                "of {}",
                parts::count(figures.wire.received + figures.wire.lost)
            ))
            .tone(if figures.wire.lost == 0 {
                Tone::Good
            } else {
                Tone::Warning
            }),
    );
    facts
}

/// Factor by which precompensation reduces the tracking error.
fn gain(t: &Tracking) -> Option<f64> {
    (t.rms_with > 0.0 && t.rms_without.is_finite()).then(|| t.rms_without / t.rms_with)
}

/// Describes a reduction or an increase of the error in words.
fn times(factor: f64) -> String {
    if factor >= 1.0 {
        format!("{} times smaller", format_significant(factor, 2))
    } else {
        format!("{} times larger", format_significant(1.0 / factor, 2))
    }
}

fn parameters(figures: &DemoFigures) -> Section {
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

/// Scale and unit for printing a tracking error.
fn shown(t: &Tracking) -> (f64, String) {
    let unit = parts::unit(&t.unit);
    if t.rms_without.abs() < 0.1 {
        (1e3, format!("m{unit}"))
    } else {
        (1.0, unit)
    }
}

/// Draws the tracking error with and without precompensation.
pub fn tracking_plot(t: &Tracking) -> Plot {
    let (scale, shown) = shown(t);
    let scaled = |v: &[f64]| v.iter().map(|e| scale * e).collect::<Vec<_>>();
    let note = format!(
        "{} points drawn; over the whole run RMS {} {shown} without and {} {shown} with{}. {}",
        t.t.len(),
        format_significant(scale * t.rms_without, 3),
        format_significant(scale * t.rms_with, 3),
        gain(t).map_or(String::new(), |g| format!(": {}", times(g))),
        t.note
    );
    let mut error = Plot::new(
        format!("Tracking error: {}", t.motion),
        Axis::new("time", "s"),
        Axis::new("reference less position", &shown),
    )
    .with(Series::line(
        "feedback alone",
        Role::Before,
        t.t.clone(),
        scaled(&t.error_without),
    ))
    .with(Series::line(
        "with precompensation",
        Role::After,
        t.t.clone(),
        scaled(&t.error_with),
    ))
    .mark(Marker::horizontal(0.0, ""))
    .note(note.trim_end());
    error.height = 280;
    error
}

fn tracking(figures: &DemoFigures) -> Section {
    let mut section = Section::new(
        "tracking",
        "Tracking with the identified model",
        "The same motion twice: with feedback alone, and with the torque predicted by the identified model added as feed-forward (precompensation).",
    );
    for t in &figures.tracking {
        let mut reference = Plot::new(
            format!("Reference: {}", t.motion),
            Axis::new("time", "s"),
            Axis::new("position", &parts::unit(&t.unit)),
        )
        .with(Series::line(
            "reference",
            Role::Reference,
            t.t.clone(),
            t.reference.clone(),
        ))
        .note(format!("n = {}.", t.t.len()));
        reference.height = 160;
        section = section
            .with(Block::Plot(tracking_plot(t)))
            .with(Block::Plot(reference));
    }
    if figures.tracking.is_empty() {
        section = section.with(parts::warning(
            "No motion was run with and without precompensation.",
        ));
    }
    section
}

fn online(figures: &DemoFigures) -> Section {
    let mut section = Section::new(
        "online",
        "On-line estimation",
        "Recursive estimate of the firmware, sample by sample. The band is ±1.96 of its standard deviations.",
    );
    let o = &figures.online;
    for (k, p) in figures.parameters.iter().enumerate() {
        let (Some(values), Some(std)) = (o.values.get(k), o.std.get(k)) else {
            section = section.with(parts::warning(format!(
                "There is no on-line estimate of {}.",
                p.name
            )));
            continue;
        };
        let unit = parts::unit(&p.unit);
        let shifted = |f: f64| {
            values
                .iter()
                .zip(std)
                .map(|(v, s)| v + f * s)
                .collect::<Vec<_>>()
        };
        // At the start the band is very wide and would flatten the rest of the figure, so it is cut off.
        let wide = 5.0
            * std
                .last()
                .copied()
                .unwrap_or(0.0)
                .max(0.1 * p.truth.abs())
                .max(p.online.std);
        let first = std.iter().position(|s| *s <= wide).unwrap_or(0);
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
        section = section.with(Block::Plot(plot));
    }
    section
}

fn holdout(figures: &DemoFigures) -> Section {
    let mut section = Section::new(
        "holdout",
        "Prediction of the hold-out",
        "Torque of a motion not used in the fit, predicted with the identified parameters.",
    );
    for (joint, report) in figures.robot.joints.iter().zip(&figures.holdout) {
        section
            .blocks
            .extend(residuals::torque_plots(joint, report, "hold-out"));
    }
    if figures.holdout.is_empty() {
        section = section.with(parts::warning("There is no hold-out."));
    }
    section
}

fn friction(figures: &DemoFigures) -> Section {
    let section = Section::new(
        "friction",
        "Friction over velocity",
        "Friction on stretches of constant speed; gravity and inertia are subtracted.",
    );
    match &figures.friction {
        Some(map) => {
            let kind = figures
                .robot
                .joints
                .first()
                .map_or(JointKind::Revolute, |j| j.kind);
            Section {
                blocks: friction::friction(kind, map),
                ..section
            }
        }
        None => section.with(parts::warning(figures.friction_text.clone())),
    }
}

fn wire(figures: &DemoFigures) -> Section {
    let kind = if figures.wire.lost == 0 {
        NoteKind::Good
    } else {
        NoteKind::Warning
    };
    Section::new("wire", "Communication between firmware and host", "").with(Block::Note {
        kind,
        text: figures.wire.text.clone(),
    })
}

fn beyond(figures: &DemoFigures) -> Section {
    let section = Section::new(
        "beyond",
        "Effects of the emulated rig that the model lacks",
        "These effects make the test realistic: the rig shares no equation with the fitted model.",
    );
    if figures.beyond_model.is_empty() {
        return section.with(parts::info(
            "No effect beyond the model was switched on in this run.",
        ));
    }
    section.with(Block::List(figures.beyond_model.clone()))
}
