//! Torque error from reading the positions. A position has an error of up to half an encoder step, or noise. In the
//! second derivative this error exceeds any noise of the current. Errors from steps repeat with the motion, so two runs
//! of it do not show them.
//!
//! Leaves out: uneven steps; noise that is not white or that a recorder filtered, which cannot be separated from the
//! motion; the controller's response to both, which moves the joint.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::DiagnoseError;
use crate::columns::effect_columns::Source;
use crate::rows::nominal_torque::predict;
use crate::rows::regression::Rows;
use rig_data::prepare::{LowPass, central_difference, second_difference};
use rig_data::runs::{Run, resolution};
use rig_numerics::statistics;

/// Seed of the noise that is added to a position.
const SEED: u64 = 1;

/// Ratio of position noise variances from fifth- and fourth-order differences in which the noise counts as white. White
/// noise gives 1. Filtered readings give less, noise that rises with the frequency more.
const WHITE: std::ops::Range<f64> = 0.96..1.04;

/// Error of a position reading.
#[derive(Clone, Copy)]
enum Reading {
    /// Counts of this size, rad or m.
    Steps(f64),
    /// White noise of this standard deviation, rad or m.
    Noise(f64),
}

impl Reading {
    /// Returns a joint's reading error; `None` without steps and white noise. White noise above the steps' includes it.
    fn of(run: &Run, joint: usize) -> Option<Self> {
        let step = resolution(std::slice::from_ref(run), joint);
        match white(&run.joints[joint].q_raw) {
            Some(noise) if noise > step / 12.0_f64.sqrt() => Some(Self::Noise(noise)),
            _ => (step > 0.0).then_some(Self::Steps(step)),
        }
    }
}

/// Returns the standard deviation of white position noise; `None` if it is not white. A motion contributes less to
/// fourth- and fifth-order differences than to lower ones.
fn white(position: &[f64]) -> Option<f64> {
    let differences = |x: &[f64]| -> Vec<f64> { x.windows(2).map(|w| w[1] - w[0]).collect() };
    let fourth = (0..4).fold(position.to_vec(), |x, _| differences(&x));
    // Squares of the binomial coefficients of either order.
    let variances = [
        statistics::mean_square(&fourth) / 70.0,
        statistics::mean_square(&differences(&fourth)) / 252.0,
    ];
    WHITE
        .contains(&(variances[1] / variances[0]))
        .then(|| variances[1].sqrt())
}

/// RMS torque error of each joint from position readings, N·m or N.
pub(crate) struct PositionReading {
    /// From encoder steps; it repeats with the motion.
    pub(crate) steps: Vec<f64>,
    /// From white noise; it does not repeat.
    pub(crate) noise: Vec<f64>,
}

impl PositionReading {
    /// Returns the error of white noise alone.
    pub(crate) fn of_noise(noise: Vec<f64>) -> Self {
        Self {
            steps: vec![0.0; noise.len()],
            noise,
        }
    }

    /// Computes both on the rows of the first run. The filtered motion is read again with steps, half a step away, or
    /// with noise, and filtered again. The effect on the direction of friction is included.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        source: &Source,
        rows: &Rows,
        filter: &LowPass,
    ) -> Result<Self, DiagnoseError> {
        let joints = rows.joints();
        let Some(run) = source.runs.first() else {
            return Ok(Self::of_noise(vec![0.0; joints]));
        };
        let all: Vec<Option<Reading>> = (0..joints).map(|j| Reading::of(run, j)).collect();
        let part = |noisy: bool| -> Vec<Option<Reading>> {
            let own = |reading: &Reading| matches!(reading, Reading::Noise(_)) == noisy;
            all.iter().map(|reading| reading.filter(own)).collect()
        };
        let [steps, noise] = [false, true].map(|noisy| left(source, rows, filter, &part(noisy)));
        Ok(Self {
            steps: steps?,
            noise: noise?,
        })
    }

    /// Returns both combined, for one joint.
    pub(crate) fn whole(&self, joint: usize) -> f64 {
        self.steps[joint].hypot(self.noise[joint])
    }
}

/// Returns the torque error of such readings, joint by joint.
fn left(
    source: &Source,
    rows: &Rows,
    filter: &LowPass,
    readings: &[Option<Reading>],
) -> Result<Vec<f64>, DiagnoseError> {
    let (Some(run), true) = (source.runs.first(), readings.iter().any(Option::is_some)) else {
        return Ok(vec![0.0; readings.len()]);
    };
    // Both motions pass the filter twice, so its loss does not count as a reading error.
    let filtered = |read: &mut dyn FnMut(f64, Reading) -> f64| {
        let mut again = run.clone();
        for (own, reading) in again.joints.iter_mut().zip(readings) {
            let Some(reading) = *reading else { continue };
            let positions: Vec<f64> = own.q.iter().map(|q| read(*q, reading)).collect();
            own.q = filter.zero_phase(&positions);
            own.qd = central_difference(&own.q, 1.0 / run.rate);
            own.qdd = second_difference(&own.q, 1.0 / run.rate);
        }
        again
    };
    let smooth = filtered(&mut |q, _| q);
    let mut random = rand_pcg::Pcg64::seed_from_u64(SEED);
    let read = filtered(&mut |q, reading| match reading {
        Reading::Steps(step) => step * ((q / step).floor() + 0.5),
        Reading::Noise(std) => {
            let unit: f64 = StandardNormal.sample(&mut random);
            q + std * unit
        }
    });
    // The source's own prediction may include effects.
    let [before, after] =
        [&smooth, &read].map(|run| predict(source.nominal, source.robot, &source.values, run));
    let (before, after) = (before?, after?);
    let keep = &rows.keep;
    let joints = keep.iter().zip(&rows.left_out[0]);
    Ok((after.torque.iter().zip(&before.torque).zip(joints))
        .map(|((after, before), (keep, left_out))| {
            let apart: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
            let mut thin = Vec::new();
            source.thinning.push(&apart, left_out, &mut thin);
            statistics::rms_of_kept(&thin, keep)
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds noise of 10 µrad beside a motion; filtered noise is not white.
    #[test]
    fn noise_of_a_position_is_told_from_its_motion() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(3);
        let mut noise: Vec<f64> = (0..20_000)
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        noise.iter_mut().for_each(|x| *x *= 1e-5);
        for rate in [250.0, 1000.0] {
            let motion = |k: usize| 1.2 * (5.0 * k as f64 / rate).sin();
            let read: Vec<f64> = noise
                .iter()
                .enumerate()
                .map(|(k, x)| motion(k) + x)
                .collect();
            let found = white(&read).unwrap_or(f64::NAN);
            assert!((found / 1e-5 - 1.0).abs() < 0.03, "{rate} Hz: {found:e}");
            let filtered: Vec<f64> = read.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
            assert_eq!(white(&filtered), None);
        }
    }
}
