//! Torque that is in the reading of the positions alone: a position that is read in steps is off by up to half of one, or has noise, and
//! its second derivative by more than any noise of the current. What the steps make comes back with the motion, so that two runs of it
//! do not tell.
//!
//! Leaves out: steps that are not even; noise that is not white, or that a recorder has filtered, which is not told from the motion;
//! what a controller makes of them, which moves the joint and is in both.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::DiagnoseError;
use super::columns::Source;
use super::floor;
use super::predicted::predict;
use super::rows::Rows;
use rig_data::prepare::{LowPass, central_difference, second_difference};
use rig_data::runs::{Run, resolution};

/// Of the noise that a position is read with once more.
const SEED: u64 = 1;

/// Variance of a position's noise by differences of the fifth order over that by those of the fourth, between which it counts as white:
/// of white noise they are equal. Less has a reading that was filtered, more one whose noise rises with the frequency.
const WHITE: std::ops::Range<f64> = 0.96..1.04;

/// What a position's reading has beside the motion.
#[derive(Clone, Copy)]
enum Reading {
    /// Counts of this size, rad or m.
    Steps(f64),
    /// White noise of this standard deviation, rad or m.
    Noise(f64),
}

impl Reading {
    /// That of a joint; none of one that is neither in steps nor white. White noise above that of the steps holds theirs.
    fn of(run: &Run, joint: usize) -> Option<Self> {
        let step = resolution(std::slice::from_ref(run), joint);
        match white(&run.joints[joint].q_raw) {
            Some(noise) if noise > step / 12.0_f64.sqrt() => Some(Self::Noise(noise)),
            _ => (step > 0.0).then_some(Self::Steps(step)),
        }
    }
}

/// Standard deviation of white noise of a position; none where it is not white. A motion leaves less in differences of the fourth
/// and fifth order than in lower ones.
fn white(position: &[f64]) -> Option<f64> {
    let differences = |x: &[f64]| -> Vec<f64> { x.windows(2).map(|w| w[1] - w[0]).collect() };
    let square = |x: &[f64]| x.iter().map(|d| d * d).sum::<f64>() / x.len().max(1) as f64;
    let fourth = (0..4).fold(position.to_vec(), |x, _| differences(&x));
    // Squares of the binomial coefficients of either order.
    let variances = [
        square(&fourth) / 70.0,
        square(&differences(&fourth)) / 252.0,
    ];
    WHITE
        .contains(&(variances[1] / variances[0]))
        .then(|| variances[1].sqrt())
}

/// RMS that the reading of the positions leaves in each joint's torque, N·m or N.
pub(super) struct PositionReading {
    /// By the steps of encoders, which comes back with the motion.
    pub(super) steps: Vec<f64>,
    /// By white noise, which does not.
    pub(super) noise: Vec<f64>,
}

impl PositionReading {
    /// By white noise alone, or by nothing.
    pub(super) fn of_noise(noise: Vec<f64>) -> Self {
        Self {
            steps: vec![0.0; noise.len()],
            noise,
        }
    }

    /// On the rows of the first run: the filtered motion read once more in the steps, half a step away, or with the noise of the
    /// positions, and filtered as it was. What its velocity then says of the direction of friction is in it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn of(
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

    /// By both, of one joint.
    pub(super) fn whole(&self, joint: usize) -> f64 {
        self.steps[joint].hypot(self.noise[joint])
    }
}

/// What such readings leave in each joint's torque.
fn left(
    source: &Source,
    rows: &Rows,
    filter: &LowPass,
    readings: &[Option<Reading>],
) -> Result<Vec<f64>, DiagnoseError> {
    let (Some(run), true) = (source.runs.first(), readings.iter().any(Option::is_some)) else {
        return Ok(vec![0.0; readings.len()]);
    };
    // The motion passes the filter twice either way: what that takes off it is not of the reading.
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
    // The source's own prediction may hold effects.
    let [before, after] =
        [&smooth, &read].map(|run| predict(source.nominal, source.robot, &source.values, run));
    let (before, after) = (before?, after?);
    let keep = &rows.keep;
    Ok((after.torque.iter().zip(&before.torque).zip(keep))
        .map(|((after, before), keep)| {
            let apart: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
            let mut thin = Vec::new();
            source.thinning.push(&apart, &mut thin);
            floor::rms(&thin, keep)
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of 10 µrad beside motions that second differences tell from nothing; a count in its place, and a filtered noise.
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
