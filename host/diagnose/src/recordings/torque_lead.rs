//! The torque lead: time by which a torque was recorded earlier than it acts, if it is less than a sample.
//!
//! A controller holds its torque until its next sample. So the torque recorded with a position acts, on average, half a
//! period later (Franklin, Powell and Workman 1998, section 4.3). Fast motion shows this as a residual along the torque
//! rate, larger than many effects. It belongs to the recording, not to the rig, and is removed before the search. A
//! torque later than the mean over one sample is an effect: `measurement_delay`.
//!
//! Limit: holds longer than the recording's period (a slower controller, recorded faster).

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::fit::least_squares::Fit;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::sampling::sampling_jitter;
use rig_data::runs::{JointRun, Run};

/// Standard deviations above which a lead is significant.
const SEEN: f64 = 4.0;
/// Share of a sample below which a lead is neglected.
const LEAST: f64 = 0.05;
/// Change of a lead, as a share of a sample, that requires another search.
const WORTH_A_SEARCH: f64 = 0.2;

/// Returns the torque lead of each joint (negative: late), s: the `present` lead plus the one that `fit` still shows. 0
/// if it exceeds what sampling explains: then it is another effect.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn leads(
    source: &Source,
    fit: &Fit,
    present: &[f64],
) -> Result<Vec<f64>, DiagnoseError> {
    let Some(rate) = source.runs.first().map(|run| run.rate) else {
        return Ok(present.to_vec());
    };
    let late = sampling_jitter(source.runs);
    (present.iter().enumerate())
        .map(|(joint, &present)| {
            let candidate = Candidate::on(Kind::MeasurementDelay, joint);
            let columns = source.columns(&candidate, &Default::default())?;
            let evidence = fit
                .distinct(&columns)
                .and_then(|own| fit.evidence(&own, &[[f64::NEG_INFINITY, f64::INFINITY]]));
            let lead = match evidence {
                Some(e) if e.gains[0].abs() > SEEN * e.stds[0] => present - e.gains[0],
                _ => present,
            };
            let counts = lead.abs() * rate >= LEAST && (-late..=1.0 / rate).contains(&lead);
            Ok(if counts { lead } else { 0.0 })
        })
        .collect()
}

/// Returns true if two sets of leads differ enough for another search.
pub(crate) fn differ(a: &[f64], b: &[f64], runs: &[Run]) -> bool {
    let rate = runs.first().map_or(0.0, |run| run.rate);
    a.iter()
        .zip(b)
        .any(|(a, b)| (a - b).abs() * rate >= WORTH_A_SEARCH)
}

/// Returns the recordings with each joint's torque shifted to the time when it acts.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn moved(
    context: &DiagnosisContext,
    prepared: PreparedData,
    by: &[f64],
) -> Result<PreparedData, DiagnoseError> {
    if by.iter().all(|lead| *lead == 0.0) {
        return Ok(prepared);
    }
    let mut runs = prepared.runs;
    // The lateness is a share of a sample, so it scales with the sample rate of other recordings.
    let rate = context.rate();
    for run in &mut runs {
        for (joint, lead) in run.joints.iter_mut().zip(by) {
            put_later(joint, lead * rate);
        }
    }
    context.rows(runs, &prepared.treatment)
}

/// Delays a joint's torque by `samples`. The noise of the original reading is stored first, because this smooths it.
fn put_later(joint: &mut JointRun, samples: f64) {
    joint.differences = Some(joint.differences());
    joint.tau = later(&joint.tau, samples);
    joint.taken_off = joint.taken_off.take().map(|held| later(&held, samples));
}

/// Delays a signal by `samples` (at most one, either sign), by the cubic through the four nearest samples.
fn later(signal: &[f64], samples: f64) -> Vec<f64> {
    if samples == 0.0 {
        return signal.to_vec();
    }
    let last = signal.len().saturating_sub(1) as isize;
    let at = |k: isize| signal[k.clamp(0, last) as usize];
    let whole = samples.floor();
    // Position between the samples before and after the wanted time, from the former.
    let x = 1.0 - (samples - whole);
    let before = |k: usize| k as isize - whole as isize - 1;
    let weights = [
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
        -(x + 1.0) * x * (x - 2.0) / 2.0,
        (x + 1.0) * x * (x - 1.0) / 6.0,
    ];
    (0..signal.len())
        .map(|k| {
            (weights.iter().zip(-1..=2))
                .map(|(w, place)| w * at(before(k) + place))
                .sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::recordings::noise_floor::sensor_noise;

    #[test]
    fn a_torque_that_was_moved_tells_its_readings_noise_as_before() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(9);
        let joint = JointRun {
            tau: (0..5000).map(|_| rng.random::<f64>()).collect(),
            ..JointRun::default()
        };
        let mut run = Run {
            rate: 1000.0,
            joints: vec![joint],
            ..Run::default()
        };
        let before = sensor_noise(std::slice::from_ref(&run), 0, 0.01);
        put_later(&mut run.joints[0], 0.4);
        // Shifted again: a lead is found in two passes.
        put_later(&mut run.joints[0], 0.1);
        assert!(before.is_some());
        assert_eq!(sensor_noise(&[run], 0, 0.01), before);
    }

    #[test]
    fn a_moved_wave_is_the_wave_later() {
        let wave = |t: f64| (0.2 * t).sin() + 0.3 * (0.05 * t).cos();
        let signal: Vec<f64> = (0..400).map(|k| wave(f64::from(k))).collect();
        for samples in [0.5, 1.0, 0.1, -0.4, -1.0] {
            let moved = later(&signal, samples);
            for k in 5..395 {
                let wanted = wave(f64::from(k as u32) - samples);
                // The cubic's error: 3/128 of the fourth derivative, 0.2⁴.
                assert!((moved[k] - wanted).abs() < 5e-5, "{samples} {k}");
            }
        }
    }
}
