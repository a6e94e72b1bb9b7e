//! Noise of the sensor in the band of the fit, inferred from its readings above the band.
//!
//! The noise of the sensor's own messages is taken as white. Rows between two messages hold an interpolated reading, whose
//! noise is weaker and not white: the ratio of the noise within the band to that above it follows from white noise that is
//! interpolated to the same rows and passes the same low-pass.

use rig_data::prepare::{LowPass, PreprocessingPlan};

/// Least power above the band of noise of power 1 from which the noise in the band is inferred.
pub(crate) const LEAST_ABOVE: f64 = 0.05;
/// Drawn sequences of noise, whose powers are averaged. Each of a recording of 30 s at 100 Hz with a band of 5 Hz has 300
/// independent values within the band, so that six of them give its power to 3 %.
const SEQUENCES: u64 = 6;

/// Sums over the rows of a recording.
pub(crate) struct NoiseFloor<'a> {
    low_pass: &'a LowPass,
    /// Share of white noise within the band, and above it.
    white: [f64; 2],
    /// Squares of forces and of moments above the band.
    above: [f64; 2],
    /// Power that noise of power 1 of the messages has within the band, and above it, summed over the rows.
    unit: [f64; 2],
    rows: usize,
}

impl<'a> NoiseFloor<'a> {
    pub(crate) fn new(low_pass: &'a LowPass, plan: &PreprocessingPlan) -> Self {
        Self {
            low_pass,
            white: shares(low_pass, plan),
            above: [0.0; 2],
            unit: [0.0; 2],
            rows: 0,
        }
    }

    /// Adds rows: their readings, the same behind the low-pass, and the numbers of the messages that they come from, if the
    /// readings were interpolated.
    pub(crate) fn add(
        &mut self,
        readings: [&[f64]; 6],
        smooth: &[Vec<f64>],
        messages: Option<&[f64]>,
    ) {
        for (channel, (smooth, all)) in smooth.iter().zip(readings).enumerate() {
            self.above[channel / 3] += squares_of_difference(all, smooth);
        }
        let rows = readings[0].len();
        self.rows += rows;
        let Some(messages) = messages else {
            for (sum, share) in self.unit.iter_mut().zip(self.white) {
                *sum += rows as f64 * share;
            }
            return;
        };
        for sequence in 0..SEQUENCES {
            let noise: Vec<f64> = (messages.iter())
                .map(|message| {
                    let place = message - 0.5;
                    let (before, share) = (place.floor(), place - place.floor());
                    let [a, b] = [before, before + 1.0].map(|number| drawn(number, sequence));
                    a + share * (b - a)
                })
                .collect();
            let smooth = self.low_pass.zero_phase(&noise);
            let within: f64 = smooth.iter().map(|value| value * value).sum();
            self.unit[0] += within / SEQUENCES as f64;
            self.unit[1] += squares_of_difference(&noise, &smooth) / SEQUENCES as f64;
        }
    }

    /// Returns the noise of forces (N) and moments (N·m) in the band; `None` if the sensor shows too little above the band.
    pub(crate) fn noise(&self) -> Option<[f64; 2]> {
        let rows = self.rows as f64;
        let [within, beyond] = self.unit;
        // Three channels of a kind.
        let noise = self
            .above
            .map(|sum| (sum / 3.0 * within / beyond).sqrt() / rows.sqrt());
        (self.rows > 0 && beyond > LEAST_ABOVE * rows).then_some(noise)
    }
}

pub(crate) fn squares_of_difference(all: &[f64], smooth: &[f64]) -> f64 {
    let rest = all.iter().zip(smooth);
    rest.map(|(y, smooth)| (y - smooth).powi(2)).sum()
}

/// Returns the noise of a message: 1 or −1, by the bits of its number (Steele, Lea & Flood 2014, SplitMix64).
fn drawn(number: f64, sequence: u64) -> f64 {
    let mut bits = (number as i64 as u64)
        .wrapping_mul(SEQUENCES)
        .wrapping_add(sequence)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    match (bits ^ (bits >> 31)) & 1 {
        0 => 1.0,
        _ => -1.0,
    }
}

/// Returns the shares of white noise that the zero-phase low-pass leaves, and that the rest of the signal has.
pub(crate) fn shares(low_pass: &LowPass, plan: &PreprocessingPlan) -> [f64; 2] {
    let reach = (10.0 * plan.sample_rate / plan.cutoff).ceil();
    let reach = (reach as usize).clamp(32, 1 << 16);
    let mut impulse = vec![0.0; 2 * reach + 1];
    impulse[reach] = 1.0;
    let response = low_pass.zero_phase(&impulse);
    let within: f64 = response.iter().map(|h| h * h).sum();
    [within, 1.0 - 2.0 * response[reach] + within]
}
