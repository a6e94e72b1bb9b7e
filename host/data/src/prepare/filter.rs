//! Zero-phase low-pass filters: Butterworth and Chebyshev type I as second-order sections.

use std::f64::consts::PI;

use nalgebra::Complex;
use rig_shared::scalar::Real;

/// One second-order section in transposed direct form II, a₀ = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Section {
    /// Returns the steady state of the section for a constant input of one.
    fn settled(&self) -> [f64; 2] {
        let gain = (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1]);
        let second = self.b[2] - self.a[1] * gain;
        [self.b[1] - self.a[0] * gain + second, second]
    }
}

/// A digital low-pass of unit gain at zero frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct LowPass {
    sections: Vec<Section>,
    /// Poles in z: real poles, and the pole in the upper half plane of each conjugate pair.
    poles: Vec<Complex<f64>>,
    settle: usize,
}

impl LowPass {
    /// Returns a Butterworth filter of `order` ≥ 1 with gain 1/√2 at `cutoff_hz`. Uses the bilinear transform with a
    /// prewarped cut-off (Oppenheim & Schafer, Discrete-Time Signal Processing, §7.1). The cut-off must lie between 0
    /// and half of `sample_rate`; otherwise returns `None`.
    pub fn butterworth(order: usize, cutoff_hz: f64, sample_rate: f64) -> Option<Self> {
        let poles = (0..order).map(|k| {
            let angle = PI * (2 * k + order + 1) as f64 / (2 * order) as f64;
            (angle.cos(), angle.sin())
        });
        Self::from_poles(poles.collect(), cutoff_hz, sample_rate)
    }

    /// Returns a Chebyshev type I filter of `order` with `ripple_db` in the pass band, which ends at `edge_hz`. Unlike
    /// the textbook form, the gain at zero frequency is one for even orders too. The filter acts on both sides of the
    /// model, so a constant factor changes no parameter; a gain of one keeps the size of the torques.
    pub fn chebyshev(order: usize, ripple_db: f64, edge_hz: f64, sample_rate: f64) -> Option<Self> {
        let epsilon = (10f64.powf(ripple_db / 10.0) - 1.0).sqrt();
        let mu = (1.0 / epsilon).asinh() / order as f64;
        let poles = (0..order).map(|k| {
            let angle = PI * (2 * k + order + 1) as f64 / (2 * order) as f64;
            (mu.sinh() * angle.cos(), mu.cosh() * angle.sin())
        });
        Self::from_poles(poles.collect(), edge_hz, sample_rate)
    }

    /// Returns the usual anti-alias filter of `decimate`: Chebyshev I, order 8, 0.05 dB, up to 80 % of the new Nyquist
    /// frequency.
    pub fn decimator(factor: usize, sample_rate: f64) -> Option<Self> {
        Self::chebyshev(8, 0.05, decimator_edge(factor, sample_rate), sample_rate)
    }

    fn from_poles(poles: Vec<(f64, f64)>, edge_hz: f64, sample_rate: f64) -> Option<Self> {
        if poles.is_empty() || !(edge_hz > 0.0 && edge_hz < 0.5 * sample_rate) {
            return None;
        }
        let warped = (PI * edge_hz / sample_rate).tan();
        let mut sections = Vec::new();
        let mut digital = Vec::new();
        let mut radius: f64 = 0.0;
        for (re, im) in poles {
            // One section for each conjugate pair, from the pole in the upper half plane.
            let (re, im) = (re * warped, im * warped);
            let denominator = (1.0 - re).powi(2) + im * im;
            let (zr, zi) = (
                (1.0 - re * re - im * im) / denominator,
                2.0 * im / denominator,
            );
            if im.abs() < 1e-12 * warped {
                radius = radius.max(zr.abs());
                digital.push(Complex::new(zr, 0.0));
                let gain = (1.0 - zr) / 2.0;
                sections.push(Section {
                    b: [gain, gain, 0.0],
                    a: [-zr, 0.0],
                });
            } else if im > 0.0 {
                let squared = zr * zr + zi * zi;
                radius = radius.max(squared.sqrt());
                digital.push(Complex::new(zr, zi));
                let gain = (1.0 - 2.0 * zr + squared) / 4.0;
                sections.push(Section {
                    b: [gain, 2.0 * gain, gain],
                    a: [-2.0 * zr, squared],
                });
            }
        }
        if radius >= 1.0 || radius.is_nan() {
            return None;
        }
        // 1e-13 and a quarter more: the error of a wrong initial state is then below rounding. The margin covers the
        // polynomial factors of nearly equal poles (checked in the tests by streaming).
        let settle =
            (1.25 * 1e-13f64.ln() / radius.max(1e-6).ln()).ceil() as usize + 2 * sections.len() + 1;
        Some(Self {
            sections,
            poles: digital,
            settle,
        })
    }

    /// Poles in z: real poles, and the pole in the upper half plane of each conjugate pair. All zeros lie at −1.
    pub(super) fn poles(&self) -> &[Complex<f64>] {
        &self.poles
    }

    /// Factor of (1 + z⁻¹)^order in the numerator.
    pub(super) fn leading(&self) -> f64 {
        self.sections.iter().map(|s| s.b[0]).product()
    }

    /// Samples until the effect of a wrong initial state has decayed below 1e-13 of its size.
    pub fn settle_samples(&self) -> usize {
        self.settle
    }

    /// Returns |H(f)| of ONE pass.
    pub fn gain(&self, frequency_hz: f64, sample_rate: f64) -> f64 {
        let w = 2.0 * PI * frequency_hz / sample_rate;
        self.sections
            .iter()
            .map(|s| {
                let at = |c0: f64, c1: f64, c2: f64| {
                    (c0 + c1 * w.cos() + c2 * (2.0 * w).cos())
                        .hypot(c1 * w.sin() + c2 * (2.0 * w).sin())
                };
                at(s.b[0], s.b[1], s.b[2]) / at(1.0, s.a[0], s.a[1])
            })
            .product()
    }

    /// Runs four sections at a time: each depends only on its own last output, so the processor computes them in
    /// parallel.
    fn run<T: Real>(&self, signal: &mut [T]) {
        let (fours, rest) = self.sections.as_chunks::<4>();
        for four in fours {
            together(four, signal);
        }
        for one in rest {
            together(std::array::from_ref(one), signal);
        }
    }

    /// Filters `signal` forward and backward: no phase shift, gain |H|². The ends are extended by the odd reflection
    /// 2·x₀ − x₋ₖ, and each pass starts in the steady state of its first sample (Gustafsson 1996).
    ///
    /// `T` may hold several signals side by side; they take hardly longer than one.
    pub fn zero_phase<T: Real>(&self, signal: &[T]) -> Vec<T> {
        self.both_ways(signal, |end, inside| end + end - inside)
    }

    /// Filters with the even reflection x₋ₖ = xₖ at the ends. The result does not follow a slope there, but noise of
    /// the end sample has hardly more weight than that of others. For signals that are only compared with each other.
    pub fn zero_phase_even<T: Real>(&self, signal: &[T]) -> Vec<T> {
        self.both_ways(signal, |_, inside| inside)
    }

    fn both_ways<T: Real>(&self, signal: &[T], beyond: impl Fn(T, T) -> T) -> Vec<T> {
        let n = signal.len();
        if n < 2 {
            return signal.to_vec();
        }
        let pad = self.settle.min(n - 1);
        let mut work = Vec::with_capacity(n + 2 * pad);
        work.extend((1..=pad).rev().map(|k| beyond(signal[0], signal[k])));
        work.extend_from_slice(signal);
        work.extend((1..=pad).map(|k| beyond(signal[n - 1], signal[n - 1 - k])));
        self.run(&mut work);
        work.reverse();
        self.run(&mut work);
        work.reverse();
        work.truncate(pad + n);
        work.drain(..pad);
        work
    }
}

/// Runs one pass through sections in series, from the steady state of the first sample.
fn together<T: Real, const N: usize>(sections: &[Section; N], signal: &mut [T]) {
    let Some(&first) = signal.first() else { return };
    let number = |list: [f64; 2]| list.map(T::from_f64);
    let taps = sections.map(|s| (T::from_f64(s.b[0]), number([s.b[1], s.b[2]]), number(s.a)));
    // Unit gain: the settled output of one section is the input of the next.
    let mut settled = first;
    let mut states = sections.map(|section| {
        let state = number(section.settled()).map(|z| z * settled);
        settled = T::from_f64(section.b[0]) * settled + state[0];
        state
    });
    for x in signal.iter_mut() {
        let mut y = *x;
        for ((b0, [b1, b2], [a1, a2]), [s1, s2]) in taps.iter().zip(&mut states) {
            let out = *b0 * y + *s1;
            *s1 = *b1 * y - *a1 * out + *s2;
            *s2 = *b2 * y - *a2 * out;
            y = out;
        }
        *x = y;
    }
}

/// Returns the end of the pass band of [`LowPass::decimator`], Hz.
pub fn decimator_edge(factor: usize, sample_rate: f64) -> f64 {
    0.8 * sample_rate / (2.0 * factor as f64)
}

/// First derivative by five points, (x₋₂ − 8x₋₁ + 8x₊₁ − x₊₂)/12Δ (Abramowitz and Stegun 1964, table 25.2); by fewer
/// points at the ends.
///
/// The error falls with Δ⁴: at 20 samples per period it is 0.03 %, with three points 1.6 %.
pub fn central_difference(x: &[f64], dt: f64) -> Vec<f64> {
    let n = x.len();
    (0..n)
        .map(|k| {
            if k >= 2 && k + 2 < n {
                return (x[k - 2] - x[k + 2] + 8.0 * (x[k + 1] - x[k - 1])) / (12.0 * dt);
            }
            let (low, high) = (k.saturating_sub(1), (k + 1).min(n - 1));
            if high > low {
                (x[high] - x[low]) / ((high - low) as f64 * dt)
            } else {
                0.0
            }
        })
        .collect()
}

/// Second derivative by five points, (−x₋₂ + 16x₋₁ − 30x + 16x₊₁ − x₊₂)/12Δ² (Abramowitz and Stegun 1964, table 25.2);
/// by three points next to the ends. The ends repeat their neighbours.
pub fn second_difference(x: &[f64], dt: f64) -> Vec<f64> {
    let n = x.len();
    if n < 3 {
        return vec![0.0; n];
    }
    (0..n)
        .map(|k| {
            let c = k.clamp(1, n - 2);
            let near = x[c + 1] - 2.0 * x[c] + x[c - 1];
            if c < 2 || c + 2 >= n {
                return near / (dt * dt);
            }
            let far = x[c + 2] - 2.0 * x[c] + x[c - 2];
            (16.0 * near - far) / (12.0 * dt * dt)
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic)]
mod tests {
    use super::*;

    #[test]
    fn butterworth_has_its_textbook_magnitude() {
        for order in 1..=8 {
            let filter = LowPass::butterworth(order, 100.0, 1000.0).unwrap();
            for f in [0.0, 3.0, 50.0, 100.0, 200.0, 400.0] {
                // The bilinear transform maps the analogue magnitude exactly, at warped frequencies.
                let ratio = (PI * f / 1000.0).tan() / (PI * 0.1f64).tan();
                let expected = 1.0 / (1.0 + ratio.powi(2 * order as i32)).sqrt();
                assert!(
                    (filter.gain(f, 1000.0) - expected).abs() < 1e-11,
                    "order {order}, {f} Hz"
                );
            }
        }
        assert!(LowPass::butterworth(4, 500.0, 1000.0).is_none());
        assert!(LowPass::butterworth(4, f64::NAN, 1000.0).is_none());
    }

    #[test]
    fn chebyshev_ripples_within_its_band_and_no_more() {
        let filter = LowPass::chebyshev(8, 0.05, 40.0, 1000.0).unwrap();
        for k in 0..=400 {
            let decibel = 20.0 * filter.gain(k as f64 * 0.1, 1000.0).log10();
            assert!((-1e-9..0.0501).contains(&decibel), "{k}: {decibel}");
        }
        assert!(20.0 * filter.gain(80.0, 1000.0).log10() < -60.0);
    }

    #[test]
    fn zero_phase_keeps_a_slow_sine_in_place_and_lines_whole() {
        let filter = LowPass::butterworth(4, 50.0, 1000.0).unwrap();
        let sine: Vec<f64> = (0..4000)
            .map(|k| (2.0 * PI * 2.0 * k as f64 * 1e-3).sin())
            .collect();
        let gain = filter.gain(2.0, 1000.0).powi(2);
        for (k, (a, b)) in sine
            .iter()
            .zip(filter.zero_phase(&sine))
            .enumerate()
            .take(3600)
            .skip(400)
        {
            assert!((gain * a - b).abs() < 1e-10, "{k}");
        }
        let line: Vec<f64> = (0..500).map(|k| 5.0 + 0.3 * k as f64).collect();
        for (a, b) in line.iter().zip(filter.zero_phase(&line)) {
            assert!((a - b).abs() < 1e-6);
        }
    }

    #[test]
    fn signals_side_by_side_are_filtered_as_if_alone() {
        use rig_shared::lanes::Lanes;
        for order in [1, 4, 8, 11] {
            let filter = LowPass::butterworth(order, 50.0, 1000.0).unwrap();
            let wave = |k: usize, f: f64| 3.0 + (0.01 * f * k as f64).sin() + (k % 7) as f64;
            let pair: Vec<Lanes<2>> = (0..500)
                .map(|k| Lanes([wave(k, 1.0), wave(k, 2.3)]))
                .collect();
            let both = filter.zero_phase(&pair);
            for lane in 0..2 {
                let alone: Vec<f64> = pair.iter().map(|x| x.0[lane]).collect();
                let of_pair: Vec<f64> = both.iter().map(|x| x.0[lane]).collect();
                assert_eq!(filter.zero_phase(&alone), of_pair, "order {order}");
            }
        }
    }

    #[test]
    fn differences_are_exact_on_a_quartic_and_near_the_ends_on_a_parabola() {
        let dt = 1e-2;
        let of =
            |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..50).map(|k| f(k as f64 * dt)).collect() };
        let (parabola, quartic) = (of(&|t| 3.0 * t * t), of(&|t| t.powi(4) - t.powi(3)));
        for k in [1, 20, 48] {
            let t = k as f64 * dt;
            assert!((central_difference(&parabola, dt)[k] - 6.0 * t).abs() < 1e-9);
            assert!((second_difference(&parabola, dt)[k] - 6.0).abs() < 1e-9);
        }
        for k in [2, 20, 47] {
            let t = k as f64 * dt;
            let (first, second) = (4.0 * t.powi(3) - 3.0 * t * t, 12.0 * t * t - 6.0 * t);
            assert!((central_difference(&quartic, dt)[k] - first).abs() < 1e-10);
            assert!((second_difference(&quartic, dt)[k] - second).abs() < 1e-8);
        }
    }
}
