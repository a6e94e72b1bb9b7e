//! Highest frequency at which torque and acceleration of a joint are coherent.
//!
//! The spectrum of a position shows its noise limit only for white noise. After differentiation, noise from jittered
//! time stamps and from filtered positions rises with the frequency and looks like motion. Acceleration needs torque,
//! noise does not. Where their coherence (Welch; Bendat and Piersol, Random Data, 2010, chapter 6) is below a half,
//! less than half of the acceleration is real. The best linear filter (Wiener) then passes at most half.
//!
//! Leaves out: torque noise, friction and coupling, which also lower the coherence: motion may reach further. So the
//! test is used only where the spectrum takes noise for motion.

use std::f64::consts::PI;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use rig_data::prepare::{PrepareError, Recording};

/// Coherence above which acceleration and torque belong together.
const TOGETHER: f64 = 0.5;
/// Least number of segments; with 16 independent ones, noise exceeds 0.18 at one of twenty frequencies.
const SEGMENTS: usize = 16;
/// Shortest and longest segment, samples.
const SEGMENT: [usize; 2] = [64, 1024];
/// Ratio of a frequency to the ends of the band over which its coherence is averaged: a third of an octave in all.
const BAND: f64 = 1.12;
/// Rows of a block.
const ROWS: usize = 1 << 16;

/// Sums of power and cross-spectra of a joint's acceleration and torque.
#[derive(Clone)]
struct Spectra {
    acceleration: Vec<f64>,
    torque: Vec<f64>,
    cross: Vec<Complex<f64>>,
    segments: usize,
}

/// Returns the highest frequency at which some joint's torque and acceleration are coherent, Hz. `None` if no joint's
/// are, or if the recordings are too short. `longest` is the number of rows of the longest stretch.
///
/// # Errors
/// [`PrepareError`] of reading.
pub(crate) fn highest(
    recordings: &[&dyn Recording],
    joints: usize,
    rate: f64,
    longest: u64,
) -> Result<Option<f64>, PrepareError> {
    let most = (longest as usize / SEGMENTS).clamp(SEGMENT[0], SEGMENT[1]);
    let length = 1usize << most.ilog2();
    let none = Spectra {
        acceleration: vec![0.0; length / 2 + 1],
        torque: vec![0.0; length / 2 + 1],
        cross: vec![Complex::default(); length / 2 + 1],
        segments: 0,
    };
    let mut all = vec![none; joints];
    for recording in recordings {
        recording.each_block(ROWS, &mut |block| {
            for (own, joint) in all.iter_mut().zip(&block.joints) {
                own.take(&joint.q, &joint.tau, length);
            }
            Ok(())
        })?;
    }
    let step = rate / length as f64;
    let ends = all.iter().filter_map(Spectra::end).map(|k| k as f64 * step);
    Ok(ends.reduce(f64::max))
}

impl Spectra {
    /// Adds a stretch, in half-overlapping segments with a Hann window.
    fn take(&mut self, q: &[f64], torque: &[f64], length: usize) {
        let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
        let window = |k: usize| 0.5 - 0.5 * (2.0 * PI * k as f64 / length as f64).cos();
        let samples = q.len().min(torque.len());
        let mut from = 1;
        while from + length < samples {
            let transform = |value: &dyn Fn(usize) -> f64| {
                let mean = (from..from + length).map(value).sum::<f64>() / length as f64;
                let own = |k: usize| window(k) * (value(from + k) - mean);
                let mut input: Vec<f64> = (0..length).map(own).collect();
                let mut output = fft.make_output_vec();
                // The lengths are those of the plan; this call fails only for another length.
                let done = fft.process(&mut input, &mut output).is_ok();
                done.then_some(output)
            };
            let both =
                transform(&|k| q[k + 1] - 2.0 * q[k] + q[k - 1]).zip(transform(&|k| torque[k]));
            if let Some((a, b)) = both {
                for (k, (a, b)) in a.iter().zip(&b).enumerate() {
                    self.acceleration[k] += a.norm_sqr();
                    self.torque[k] += b.norm_sqr();
                    self.cross[k] += a.conj() * b;
                }
                self.segments += 1;
            }
            from += length / 2;
        }
    }

    /// Returns the last frequency index with a mean coherence of at least [`TOGETHER`] around it. The mean rejects a
    /// single line in both sensors, such as mains hum.
    fn end(&self) -> Option<usize> {
        let coherence = |k: usize| {
            let both = self.acceleration[k] * self.torque[k];
            self.cross[k].norm_sqr() / both.max(f64::MIN_POSITIVE)
        };
        let about = |k: usize| {
            let (from, to) = (k as f64 / BAND, k as f64 * BAND);
            let to = (to.floor() as usize).min(self.cross.len() - 1);
            let band = from.ceil() as usize..=to;
            let count = band.clone().count();
            band.map(coherence).sum::<f64>() / count as f64
        };
        (self.segments >= SEGMENTS)
            .then(|| (1..self.cross.len()).rfind(|k| about(*k) >= TOGETHER))
            .flatten()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::highest;
    use rig_data::prepare::InMemory;
    use rig_data::{Block, JointColumns};

    /// A mass of 2 kg under a force with equal power up to 60 Hz. Its position noise becomes acceleration noise that
    /// rises with the square of the frequency.
    #[test]
    fn noise_of_the_position_takes_no_torque() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut q, mut v, mut force) = (0.0, 0.0, [0.0; 4]);
        let mut joint = JointColumns::default();
        let mut t = Vec::new();
        for k in 0..30_000 {
            let share = 1.0 - (-2.0 * std::f64::consts::PI * 60.0 / 1000.0_f64).exp();
            let mut wanted = white();
            for stage in &mut force {
                *stage += share * (wanted - *stage);
                wanted = *stage;
            }
            t.push(k as f64 * 1e-3);
            joint.q.push(q + 2e-7 * white());
            joint.tau.push(wanted);
            v += 1e-3 * (wanted / 2.0 - 0.5 * v);
            q += 1e-3 * v;
        }
        let block = Block {
            t,
            joints: vec![joint],
            ..Block::default()
        };
        let made = InMemory {
            label: "made".into(),
            blocks: vec![block],
        };
        let end = highest(&[&made], 1, 1000.0, 30_000).unwrap().unwrap();
        // The four filter stages determine where force and noise are equally strong in the acceleration.
        println!("{end} Hz");
        assert!((40.0..160.0).contains(&end), "{end} Hz");
        let mut other = made.clone();
        for x in &mut other.blocks[0].joints[0].tau {
            *x = white();
        }
        assert_eq!(highest(&[&other], 1, 1000.0, 30_000).unwrap(), None);
    }
}
