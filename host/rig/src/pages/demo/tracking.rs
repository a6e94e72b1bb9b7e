//! Tracking error without and with precompensation.

use super::figures::{DemoFigures, Tracking};
use crate::pages::parts;
use rig_output::format_significant;
use rig_report::{Axis, Block, Marker, Plot, Role, Section, Series};

/// Factor by which precompensation reduces the tracking error.
pub(super) fn gain(t: &Tracking) -> Option<f64> {
    (t.rms_with > 0.0 && t.rms_without.is_finite()).then(|| t.rms_without / t.rms_with)
}

/// Describes a reduction or an increase of the error in words.
pub(super) fn times(factor: f64) -> String {
    if factor >= 1.0 {
        format!("{} times smaller", format_significant(factor, 2))
    } else {
        format!("{} times larger", format_significant(1.0 / factor, 2))
    }
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

/// Composes the section of the tracking errors.
pub(super) fn section(figures: &DemoFigures) -> Section {
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
