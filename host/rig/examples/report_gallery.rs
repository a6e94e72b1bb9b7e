//! A page with every block and every style of plot, to look at while changing the report, and a diagnosis of every verdict:
//! `cargo run -p rig --example report_gallery -- gallery.html gallery.svg FOLDER`.

#[path = "made_up/diagnosis.rs"]
mod diagnosis;

use std::path::Path;

use rig::pages;
use rig_diagnose::outcome;
use rig_output::{format_p_value, format_value};
use rig_report::{
    Axis, Block, Column, Document, Fact, Marker, NoteKind, Plot, ReportError, Role, Section,
    Series, Style, Table, Tone, write, write_svg,
};

/// A repeatable sequence without structure, within ±1.
fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

fn torque() -> Plot {
    let n = 20_000;
    let t: Vec<f64> = (0..n).map(|i| i as f64 * 1e-3).collect();
    let model: Vec<f64> = t
        .iter()
        .map(|t| 3.0 * (0.9 * t).sin() + 0.8 * (2.3 * t).cos() + 0.5 * (0.9 * t).cos().signum())
        .collect();
    let mut measured: Vec<f64> = model
        .iter()
        .zip(noise(n, 1))
        .map(|(m, e)| m + 0.3 * e)
        .collect();
    for value in &mut measured[9_000..9_400] {
        *value = f64::NAN;
    }
    Plot::new(
        "Joint link: torque, hold-out",
        Axis::new("time", "s"),
        Axis::new("torque", "N·m"),
    )
    .with(Series::line(
        "measured",
        Role::Measured,
        t.clone(),
        measured,
    ))
    .with(Series::line("predicted", Role::Model, t, model))
    .mark(Marker::vertical(9.2, "recording interrupted"))
    .note("20 000 rows, residual RMS 0.173 N·m, torque RMS 2.26 N·m: the residual is 7.7 % of it.")
}

fn friction() -> Plot {
    let v: Vec<f64> = (0..240).map(|i| -3.0 + i as f64 * 0.025).collect();
    let curve = |v: f64| v.signum() * (0.4 + 0.31 * (-(v / 0.08).powi(2)).exp()) + 0.3 * v;
    let middle: Vec<f64> = v.iter().map(|v| curve(*v)).collect();
    let low = middle.iter().map(|m| m - 0.12).collect();
    let high = middle.iter().map(|m| m + 0.12).collect();
    let sampled: Vec<f64> = v.iter().copied().step_by(12).collect();
    let means: Vec<f64> = sampled
        .iter()
        .zip(noise(sampled.len(), 5))
        .map(|(v, e)| curve(*v) + 0.08 * e)
        .collect();
    let half_width = sampled.iter().map(|v| 0.06 + 0.03 * v.abs()).collect();
    Plot::new(
        "Joint link: friction torque over velocity",
        Axis::new("velocity", "rad/s"),
        Axis::new("friction torque", "N·m"),
    )
    .with(Series::band(
        "95 % of the law",
        Role::Model,
        v.clone(),
        low,
        high,
    ))
    .with(
        Series::line(
            "Coulomb and viscous",
            Role::Before,
            v.clone(),
            v.iter().map(|v| 0.4 * v.signum() + 0.3 * v).collect(),
        )
        .dashed(),
    )
    .with(Series::line("with Stribeck term", Role::Model, v, middle))
    .with(Series::new(
        "mean over a stretch ± 1.96 standard deviations",
        Role::Measured,
        Style::ErrorBars { half_width },
        sampled,
        means,
    ))
    .mark(Marker::horizontal(0.4, "Coulomb 0.40 N·m"))
    .mark(Marker::horizontal(0.71, "breakaway 0.71 N·m"))
    .note("n = 20 stretches of constant speed.")
}

fn ellipses() -> Plot {
    let ring = |a: f64, b: f64, turn: f64| -> (Vec<f64>, Vec<f64>) {
        (0..=120)
            .map(|k| (f64::from(k) * std::f64::consts::TAU / 120.0).sin_cos())
            .map(|(s, c)| {
                (
                    0.12 + a * c * turn.cos() - b * s * turn.sin(),
                    0.30 + a * c * turn.sin() + b * s * turn.cos(),
                )
            })
            .unzip()
    };
    let ((x1, y1), (x2, y2)) = (ring(0.02, 0.006, 0.5), ring(0.009, 0.004, 0.4));
    let cloud = noise(600, 9);
    let (cx, cy) = cloud
        .chunks(2)
        .map(|e| {
            (
                0.12 + 0.012 * e[0] - 0.002 * e[1],
                0.30 + 0.006 * e[0] + 0.004 * e[1],
            )
        })
        .unzip();
    let mut plot = Plot::new(
        "J and gc: correlation +0.93",
        Axis::new("J", "kg·m²"),
        Axis::new("gc", "N·m"),
    )
    .with(Series::points("runs", Role::Noise, cx, cy))
    .with(Series::line(
        "95 % region, first motion",
        Role::Before,
        x1,
        y1,
    ))
    .with(Series::line(
        "95 % region, optimal motion",
        Role::After,
        x2,
        y2,
    ))
    .mark(Marker::vertical(0.12, "truth"))
    .mark(Marker::vertical(0.121, "description"));
    plot.equal_aspect = true;
    plot.height = 380;
    plot
}

fn spectrum() -> Plot {
    let f: Vec<f64> = (0..500)
        .map(|i| 10f64.powf(-1.0 + i as f64 * 0.008))
        .collect();
    let line = |corner: f64| {
        f.iter()
            .map(|f| 1.0 / (1.0 + (f / corner).powi(4)))
            .collect::<Vec<_>>()
    };
    let rough: Vec<f64> = line(20.0)
        .iter()
        .zip(noise(500, 3))
        .map(|(p, e)| p * (1.5 * e).exp() + 1e-7)
        .collect();
    Plot::new(
        "Spectrum of the residual",
        Axis::log("frequency", "Hz"),
        Axis::log("power density", "N²·m²/Hz"),
    )
    .with(Series::line("residual", Role::Residual, f.clone(), rough))
    .with(Series::line("noise floor", Role::Noise, f.clone(), vec![1e-7; 500]).dashed())
    .mark(Marker::vertical(50.0, "mains, 50 Hz"))
    .mark(Marker::vertical(62.0, "cogging at 1 rad/s"))
}

fn bars() -> Plot {
    let places: Vec<f64> = (0..6).map(f64::from).collect();
    let names = (1..=6).map(|k| format!("joint {k}")).collect();
    Plot::new(
        "Residuals by joint",
        Axis::categories("", names),
        Axis::new("residual RMS", "N·m"),
    )
    .with(Series::new(
        "without the effects",
        Role::Before,
        Style::Bars,
        places.clone(),
        vec![3.1, 4.2, 2.6, 0.91, 0.85, 0.66],
    ))
    .with(Series::new(
        "with the effects",
        Role::After,
        Style::Bars,
        places,
        vec![1.1, 1.4, 0.9, 0.41, 0.35, 0.36],
    ))
    .mark(Marker::horizontal(0.35, "noise floor"))
}

fn steps() -> Plot {
    let k: Vec<f64> = (0..60).map(|k| f64::from(k) * 1e-3).collect();
    let y = (0..60)
        .map(|k| f64::from((k / 7) % 5) * 2.4e-5 - 3e-5)
        .collect();
    let mut plot = Plot::new(
        "Encoder position, one count a step",
        Axis::new("time", "s"),
        Axis::new("position", "rad"),
    )
    .with(Series::new("encoder", Role::Measured, Style::Steps, k, y));
    plot.height = 220;
    plot
}

fn parameters() -> Table {
    let row = |name: &str, v: f64, s: f64, p: f64| {
        vec![
            name.to_owned(),
            format_value(v, s),
            format!("{:.2}", 100.0 * s / v.abs()),
            format_p_value(p),
        ]
    };
    Table {
        caption: "Base parameters".into(),
        columns: vec![
            Column::text("Parameter"),
            Column::number("Value ± std", "kg·m²"),
            Column::number("Std", "%"),
            Column::number("p", ""),
        ],
        rows: vec![
            row(
                "Izz1 + Ia1 + Iyy2 + 0.4318²·(m3 + m4 + m5 + m6)",
                1.2479,
                0.0123,
                0.0,
            ),
            row("Ia2", 95.1123, 0.1083, 4e-12),
            row("my2", -0.0457, 0.0012, 0.031),
            row(
                "<script>alert('a robot file')</script>",
                1.2345e-6,
                2.2e-8,
                0.4,
            ),
        ],
        note: "Std: standard deviation. It allows for the correlation of the residual in time."
            .into(),
    }
}

fn document() -> Document {
    let empty = Plot::new(
        "Joint link: residual (measured less predicted), hold-out",
        Axis::new("time", "s"),
        Axis::new("residual", "N·m"),
    );
    Document {
        title: "one-link rig: diagnosis of the model".into(),
        subtitle: "Every block and every style of plot on one page; the numbers are made up.".into(),
        summary: vec![
            Fact::new("Verdict", "Explained").note("the effects explain the residual").tone(Tone::Good),
            Fact::new("Gap closed", "97").unit("%").note("of the residual above the noise floor, on the hold-out"),
            Fact::new("Noise floor", format_value(0.0512, 0.0011)).unit("N·m").note("RMS of the part that no model can predict"),
            Fact::new("Not testable", "2 effects").note("these data can neither show nor exclude them").tone(Tone::Warning),
        ],
        sections: vec![
            Section::new("fit", "Residual of the fit", "Measured torque, and torque predicted with the identified parameters, behind the same filters. The hold-out was not used in the fit.")
                .with(Block::Plot(torque()))
                .with(Block::Note { kind: NoteKind::Good, text: "The residual on the hold-out is as small as on the training data.".into() })
                .with(Block::Plot(bars())),
            Section::new("friction", "Friction over velocity", "Friction on stretches of constant speed; the identified gravity, inertia and offset are subtracted.")
                .with(Block::Plot(friction()))
                .with(Block::Text("The band is the 95 % interval of the fitted law.\n\nA second paragraph follows after an empty line.".into()))
                .with(Block::List(vec!["Coulomb friction from both directions".into(), "Breakaway from slow reversals".into()]))
                .with(Block::Note { kind: NoteKind::Warning, text: "Only one stretch is slower than 0.02 rad/s.".into() }),
            Section::new("parameters", "Parameters", "")
                .with(Block::Table(parameters()))
                .with(Block::Plot(ellipses())),
            Section::new("left", "Remaining residual", "")
                .with(Block::Plot(spectrum()))
                .with(Block::Plot(steps()))
                .with(Block::Plot(empty))
                .with(Block::Details { summary: "How the noise floor was found".into(), blocks: vec![
                    Block::Text("From the differences between repeated runs of the same motion.".into()),
                    Block::Plot(steps()),
                    Block::Code("rig diagnose --robot robot.toml --data train.csv --holdout holdout.csv --out result-of-a-long-command-line".into()),
                ] })
                .with(Block::Note { kind: NoteKind::Info, text: "Drag over a plot to zoom; double-click to reset.".into() }),
        ],
        footer: "rig 0.1.0 · rig diagnose --robot robot.toml --data train.csv --out result".into(),
    }
}

fn main() -> Result<(), ReportError> {
    let mut arguments = std::env::args().skip(1);
    let page = arguments.next().unwrap_or_else(|| "gallery.html".into());
    write(Path::new(&page), &document())?;
    if let Some(picture) = arguments.next() {
        write_svg(Path::new(&picture), &friction())?;
    }
    if let Some(folder) = arguments.next() {
        let context = pages::Context {
            command: "rig diagnose --robot one-link.toml --data train.csv --holdout holdout.csv --out found".into(),
            identified: Some(("model.toml".into(), "name = \"one-link rig\"".into())),
            ..pages::Context::default()
        };
        for (name, found) in diagnosis::all() {
            write(
                &Path::new(&folder).join(format!("{name}.html")),
                &pages::diagnosis(&found, &context),
            )?;
        }
    }
    Ok(())
}
