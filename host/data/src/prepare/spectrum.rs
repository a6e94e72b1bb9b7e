//! Power spectral density of the position (Welch), and the cut-off frequencies that follow from it.

use std::f64::consts::PI;

use realfft::RealFftPlanner;
use rig_numerics::statistics;
use serde::Serialize;

/// Welch's estimate, accumulated sample by sample (Welch 1967; Hann window, half overlapping).
///
/// The second difference of the position is transformed, and its transfer |2·sin(ω/2)|⁴ is then divided out. Without
/// this, the side lobes of the window would hide the noise floor: the position falls by many decades with frequency.
pub struct Welch {
    segment: usize,
    window: Vec<f64>,
    buffer: Vec<f64>,
    last: [f64; 2],
    seen: usize,
    sum: Vec<f64>,
    count: usize,
    fft: std::sync::Arc<dyn realfft::RealToComplex<f64>>,
}

impl Welch {
    /// Uses segments of `segment` samples (a power of two is fastest).
    pub fn new(segment: usize) -> Self {
        let segment = segment.max(16);
        Self {
            segment,
            window: (0..segment)
                .map(|k| 0.5 - 0.5 * (2.0 * PI * k as f64 / segment as f64).cos())
                .collect(),
            buffer: Vec::with_capacity(segment),
            last: [0.0; 2],
            seen: 0,
            sum: vec![0.0; segment / 2 + 1],
            count: 0,
            fft: RealFftPlanner::new().plan_fft_forward(segment),
        }
    }

    /// Clears the last samples: the next sample does not follow them.
    pub fn interrupt(&mut self) {
        self.buffer.clear();
        self.seen = 0;
    }

    /// Takes one sample.
    pub fn push(&mut self, x: f64) {
        if self.seen >= 2 {
            self.buffer.push(x - 2.0 * self.last[0] + self.last[1]);
        }
        self.last = [x, self.last[0]];
        self.seen += 1;
        if self.buffer.len() == self.segment {
            let mut input: Vec<f64> = self
                .buffer
                .iter()
                .zip(&self.window)
                .map(|(x, w)| x * w)
                .collect();
            let mut output = self.fft.make_output_vec();
            // The lengths are those of the plan; a wrong length is the only error of this call.
            if self.fft.process(&mut input, &mut output).is_ok() {
                for (s, z) in self.sum.iter_mut().zip(&output) {
                    *s += z.norm_sqr();
                }
                self.count += 1;
            }
            self.buffer.drain(..self.segment / 2);
        }
    }

    /// Returns frequencies in Hz and the one-sided density of the POSITION in unit²/Hz, without zero frequency.
    pub fn density(&self, sample_rate: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        if self.count == 0 {
            return None;
        }
        let power = statistics::sum_of_squares(&self.window);
        let scale = 2.0 / (sample_rate * power * self.count as f64);
        let pairs = (1..self.sum.len()).map(|k| {
            let w = 2.0 * PI * k as f64 / self.segment as f64;
            let transfer = (2.0 * (w / 2.0).sin()).powi(4);
            (
                k as f64 * sample_rate / self.segment as f64,
                self.sum[k] * scale / transfer,
            )
        });
        Some(pairs.unzip())
    }
}

/// Spectrum of one joint's position and the frequencies derived from it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PositionSpectrum {
    /// Hz
    pub frequency: Vec<f64>,
    /// One-sided density, rad²/Hz or m²/Hz.
    pub density: Vec<f64>,
    /// Level of the white noise floor, same unit.
    pub floor: f64,
    /// Frequency at which the signal falls to the noise floor, Hz.
    pub crossing: f64,
    /// Frequency below which 99 % of the power of the velocity lies, Hz.
    pub motion: f64,
    /// Highest cut-off at which the noise in the acceleration stays below [`NOISE_SHARE`] of its power, Hz.
    pub clean: f64,
}

/// Share of noise in the power of the filtered acceleration that the automatic cut-off allows. Least squares with a
/// noisy regressor column underestimates its parameter by about this share (attenuation; Fuller 1987, §1.1). A
/// thousandth is well below the repeatability of a test bench.
pub const NOISE_SHARE: f64 = 1e-3;

/// Minimum factor by which the density of a position falls from one octave to the next if it is motion. 4 lies between
/// the 16 of a jump in speed and the 1 of white noise. (After an impact the density of the position falls with f⁻⁴, for
/// bounded torque with f⁻⁶.)
const FLAT: f64 = 4.0;

/// Multiple of the noise floor below which the signal counts as ended. At 2 the signal-to-noise ratio is one, and the
/// best linear filter (Wiener) passes half.
const SUNK: f64 = 2.0;

impl PositionSpectrum {
    /// Derives the spectrum's frequencies from a density estimate.
    pub fn judge(frequency: Vec<f64>, density: Vec<f64>) -> Self {
        let n = density.len();
        // Noise floor: median over the upper quarter of the band, where a mechanism no longer moves.
        let mut top: Vec<f64> = density[n - n / 4 - 1..].to_vec();
        top.sort_by(f64::total_cmp);
        let floor = top[top.len() / 2];
        // Smoothing over a tenth of a decade, so that one low bin does not end the signal.
        let smooth: Vec<f64> = (0..n)
            .map(|k| {
                let reach = (k as f64 * 0.12) as usize;
                let part = &density[k.saturating_sub(reach)..(k + reach + 1).min(n)];
                statistics::mean(part)
            })
            .collect();
        let sunk = (0..n).find(|&k| {
            // The density must stay low over the next half octave too.
            let end = ((k as f64 + 1.0) * 1.4) as usize;
            smooth[k..end.clamp(k + 1, n)]
                .iter()
                .all(|d| *d < SUNK * floor)
        });
        let crossing = sunk.map_or(frequency[n - 1], |k| frequency[k]);
        Self::with(frequency, density, floor, crossing)
    }

    /// Computes the other values from the noise floor and the end of the signal.
    fn with(frequency: Vec<f64>, density: Vec<f64>, floor: f64, crossing: f64) -> Self {
        let signal = |d: f64| (d - floor).max(0.0);
        let bins = || frequency.iter().zip(&density);
        let velocity = bins().map(|(f, d)| {
            if *f <= crossing {
                signal(*d) * f * f
            } else {
                0.0
            }
        });
        let motion = quantile(&frequency, &velocity.collect::<Vec<f64>>(), 0.99);
        let (mut noise, mut power, mut clean) = (0.0, 0.0, frequency[0]);
        for (f, d) in bins() {
            noise += floor * f.powi(4);
            power += signal(*d) * f.powi(4);
            if noise <= NOISE_SHARE * power {
                clean = *f;
            }
        }
        Self {
            frequency,
            density,
            floor,
            crossing,
            motion,
            clean,
        }
    }

    /// Returns the same spectrum for a signal that ends at `end` Hz at the latest. The density at `end` becomes the
    /// noise floor if it is above the old one. Noise that is not white lies above the floor at the top of the band, and
    /// the spectrum alone takes it for motion. Examples are a filter in the drive, a coarse encoder and time jitter.
    pub fn ending_at(&self, end: f64) -> Self {
        if self.crossing <= end {
            return self.clone();
        }
        let near = |f: &f64| (end / 1.12..=end * 1.12).contains(f);
        let bins = || self.frequency.iter().zip(&self.density);
        let level: Vec<f64> = bins().filter(|(f, _)| near(f)).map(|(_, d)| *d).collect();
        let level = statistics::mean_or_zero(&level);
        let (frequency, density) = (self.frequency.clone(), self.density.clone());
        Self::with(frequency, density, self.floor.max(level), end)
    }

    /// Returns true if the density falls by less than a factor of four from one octave to the next somewhere between
    /// `from` and `to` Hz. Noise does this, motion does not.
    pub fn flattens(&self, from: f64, to: f64) -> bool {
        let mean = |low: f64, high: f64| {
            let bins = self.frequency.iter().zip(&self.density);
            let own: Vec<f64> = bins
                .filter(|(f, _)| (low..high).contains(*f))
                .map(|(_, d)| *d)
                .collect();
            statistics::mean(&own)
        };
        let mut low = from;
        while 4.0 * low <= to {
            if mean(2.0 * low, 4.0 * low) * FLAT > mean(low, 2.0 * low) {
                return true;
            }
            low *= 1.19;
        }
        false
    }

    /// Returns the frequency below which 99.9 % of the power of the POSITION lies, Hz. The motion is far larger than
    /// the encoder error, so errors of the encoder or of the time stamps do not change this frequency.
    pub fn swing(&self) -> f64 {
        quantile(&self.frequency, &self.density, 0.999)
    }

    /// Returns the spectrum of a position that never changes: zero density and no limit on the cut-off.
    pub fn still(frequency: Vec<f64>) -> Self {
        let [first, last] =
            [frequency.first(), frequency.last()].map(|f| f.copied().unwrap_or(0.0));
        Self {
            density: vec![0.0; frequency.len()],
            floor: 0.0,
            crossing: last,
            motion: first,
            clean: last,
            frequency,
        }
    }

    /// Returns the RMS of the velocity up to the crossing, without the noise beyond it, rad/s or m/s.
    pub fn velocity_rms(&self) -> f64 {
        self.velocity_rms_below(self.crossing)
    }

    /// Returns the RMS of the velocity up to `most` Hz, rad/s or m/s.
    pub fn velocity_rms_below(&self, most: f64) -> f64 {
        let step = self.frequency[0];
        let sum: f64 = self
            .frequency
            .iter()
            .zip(&self.density)
            .take_while(|(f, _)| **f <= most)
            .map(|(f, d)| (2.0 * PI * f).powi(2) * (d - self.floor).max(0.0) * step)
            .sum();
        sum.sqrt()
    }

    /// Returns the standard deviation of the velocity noise that passes the cut-off, rad/s or m/s.
    pub fn velocity_noise(&self, cutoff: f64) -> f64 {
        // ∫₀^fc N·(2πf)² df
        (self.floor * (2.0 * PI).powi(2) * cutoff.powi(3) / 3.0).sqrt()
    }
}

/// Returns the first frequency at which the sum of `power` reaches `share` of its total.
fn quantile(frequency: &[f64], power: &[f64], share: f64) -> f64 {
    let total: f64 = power.iter().sum();
    let mut sum = 0.0;
    let mut reached = frequency[0];
    for (f, p) in frequency.iter().zip(power) {
        sum += p;
        reached = *f;
        if sum >= share * total {
            break;
        }
    }
    reached
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Compares a density of f⁻⁴, as after an impact, with noise that ends at 100 Hz.
    #[test]
    fn noise_flattens_and_a_motion_with_impacts_does_not() {
        let frequency: Vec<f64> = (1..2000).map(|k| 0.25 * f64::from(k)).collect();
        let impacts = |f: &f64| f.powi(-4);
        let filtered = |f: &f64| f.powi(-4) + 1e-5 / (1.0 + (f / 100.0).powi(8));
        for (density, flattens) in [
            (frequency.iter().map(impacts).collect::<Vec<f64>>(), false),
            (frequency.iter().map(filtered).collect(), true),
        ] {
            let spectrum = PositionSpectrum::judge(frequency.clone(), density);
            assert_eq!(spectrum.flattens(5.0, 400.0), flattens);
        }
    }

    #[test]
    fn welch_finds_the_level_of_white_noise_and_the_end_of_a_signal() {
        let rate = 1000.0;
        let mut generator = rand_pcg::Pcg64::seed_from_u64(1);
        let mut welch = Welch::new(1024);
        let sigma = 1e-4;
        // A signal that ends at 20 Hz for sure: a sum of sines below it.
        for k in 0..60_000 {
            let t = k as f64 / rate;
            let signal: f64 = (1..=40)
                .map(|m| (2.0 * PI * 0.5 * m as f64 * t + (m * m) as f64).sin() / m as f64)
                .sum();
            let noise: f64 = (0..12).map(|_| generator.random::<f64>()).sum::<f64>() - 6.0;
            welch.push(0.1 * signal + sigma * noise);
        }
        let (f, d) = welch.density(rate).unwrap();
        let spectrum = PositionSpectrum::judge(f, d);
        // White noise of variance σ² spread over 0 … fs/2.
        assert!(
            (spectrum.floor / (sigma * sigma / 500.0) - 1.0).abs() < 0.1,
            "{}",
            spectrum.floor
        );
        assert!(
            (19.0..28.0).contains(&spectrum.crossing),
            "{}",
            spectrum.crossing
        );
        assert!(
            (15.0..=21.0).contains(&spectrum.motion),
            "{}",
            spectrum.motion
        );
    }
}
