//! Treatment of the data before a fit.

use super::parts;
use rig_data::prepare::{PositionSpectrum, PreprocessingPlan};
use rig_model::robot::Joint;
use rig_output::format_significant;
use rig_report::{Axis, Block, Marker, Plot, Role, Series};

/// Draws the torque residual over the cut-offs that were tried.
fn over_cutoff(joints: &[Joint], treatment: &PreprocessingPlan) -> Plot {
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

/// Sentences about the treatment of the data of a fit to torques.
pub(super) fn sentences(treatment: &PreprocessingPlan) -> Vec<String> {
    let mut items = sentences_of_motion(treatment);
    items.push(format!("Speed thresholds: {}", treatment.speed_reason));
    if treatment.torque_lead != 0.0 {
        items.push(format!(
            "Torque lead: a recorded torque is assumed to act {} ms later.",
            format_significant(1e3 * treatment.torque_lead, 3)
        ));
    }
    items
}

/// Sentences about the treatment of the data of a fit in which no torque and no friction takes part.
pub(super) fn sentences_of_motion(treatment: &PreprocessingPlan) -> Vec<String> {
    let rate = treatment.sample_rate;
    vec![
        format!(
            "Position filter: Butterworth, order {}, forward and backward (no phase shift), cut-off {}",
            treatment.order, treatment.cutoff_reason
        ),
        format!("Derivatives: {}", treatment.derivatives),
        format!("Parallel filter: {}.", treatment.parallel_filter),
        format!("Decimation: {}", treatment.decimation_reason),
        format!(
            "Trimmed: {} rows ({} s) at both ends of every stretch, because the filters have not settled there.",
            parts::count(treatment.trimmed as u64),
            format_significant(treatment.trimmed as f64 / rate, 3)
        ),
    ]
}

/// Treatment of the data: sentences, and the spectra behind them.
pub(super) fn treatment(joints: &[Joint], treatment: &PreprocessingPlan) -> Vec<Block> {
    let mut blocks = vec![Block::List(sentences(treatment))];
    if !treatment.trials.is_empty() {
        blocks.push(Block::Plot(over_cutoff(joints, treatment)));
    }
    for (joint, spectrum) in joints.iter().zip(&treatment.spectra) {
        let plot = Block::Plot(over_frequency(joint, spectrum, treatment));
        blocks.extend(parts::of_joint(
            &joint.name,
            joints.len(),
            "spectrum of the position",
            vec![plot],
        ));
    }
    blocks
}

/// Draws the spectrum of a joint's position, with noise floor and cut-off.
fn over_frequency(joint: &Joint, s: &PositionSpectrum, treatment: &PreprocessingPlan) -> Plot {
    let rate = treatment.sample_rate;
    let position = parts::units(joint.kind)[0];
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
    plot
}
