//! Smooth interpolation of positions that were sampled at an even step.
//!
//! Between two samples runs the quintic with their positions, velocities and accelerations (Hermite). So position, velocity
//! and acceleration are continuous, and each is the derivative of the one before. Derivatives that were not recorded are
//! central differences of fourth order: for a sine of n samples a period the position is wrong by about (2π/n)⁶/200 of its
//! amplitude, the velocity by about (2π/n)⁴/30 of its own. The motion counts as at rest before its first sample, and goes on with
//! its last second difference.
//!
//! Leaves out: noise. Differences of noisy positions are noisy accelerations, as they are at every sample rate.

use rig_numerics::statistics;
use rig_shared::trajectory::Reference;

/// One joint's samples.
pub(super) struct Samples<'a> {
    /// Time between two samples, s.
    pub period: f64,
    /// Positions, rad or m.
    pub position: &'a [f64],
    /// Velocities and accelerations, if they were recorded.
    pub rates: Option<[&'a [f64]; 2]>,
}

impl Samples<'_> {
    /// Returns the position of sample `k`, which may lie before the first or behind the last.
    fn position(&self, k: isize) -> f64 {
        let list = self.position;
        let last = list.len().saturating_sub(1);
        match usize::try_from(k) {
            Err(_) => list.first().copied().unwrap_or(0.0),
            Ok(k) if k <= last => list[k],
            Ok(k) => {
                let at = |back: usize| list[last.saturating_sub(back)];
                let beyond = (k - last) as f64;
                let step = at(0) - at(1);
                let bend = step - (at(1) - at(2));
                at(0) + beyond * step + 0.5 * beyond * (beyond + 1.0) * bend
            }
        }
    }

    /// Returns position, velocity times the period, and acceleration times its square, at sample `k`.
    fn node(&self, k: usize) -> [f64; 3] {
        let h = self.period;
        let place = k as isize;
        let recorded = self.rates.and_then(|[velocity, acceleration]| {
            Some([*velocity.get(k)? * h, *acceleration.get(k)? * h * h])
        });
        let [velocity, acceleration] = recorded.unwrap_or_else(|| {
            let [a, b, c, d, e] = [-2, -1, 0, 1, 2].map(|by| self.position(place + by));
            [
                (a - 8.0 * b + 8.0 * d - e) / 12.0,
                (16.0 * (b + d) - 30.0 * c - a - e) / 12.0,
            ]
        });
        [self.position(place), velocity, acceleration]
    }

    /// Returns the motion at the time of `at` samples from the first, at most the last.
    pub(super) fn at(&self, at: f64) -> Reference<f64> {
        let last = self.position.len().saturating_sub(1);
        let k = (at.max(0.0) as usize).min(last.saturating_sub(1));
        let u = (at - k as f64).clamp(0.0, 1.0);
        let [[p, v, a], [p1, v1, a1]] = [self.node(k), self.node(k + 1)];
        // What the parabola of the first sample lacks at the second.
        let (q, w, b) = (p1 - p - v - 0.5 * a, v1 - v - a, a1 - a);
        let [c3, c4, c5] = [
            10.0 * q - 4.0 * w + 0.5 * b,
            -15.0 * q + 7.0 * w - b,
            6.0 * q - 3.0 * w + 0.5 * b,
        ];
        let position = p + u * (v + u * (0.5 * a + u * (c3 + u * (c4 + u * c5))));
        let velocity = v + u * (a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)));
        let acceleration = a + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5));
        Reference {
            position,
            velocity: velocity / self.period,
            acceleration: acceleration / self.period.powi(2),
        }
    }

    /// Returns the share of the motion that every second sample misses of the others: RMS of their distance from the
    /// interpolation over the RMS of the motion about its mean. The distance counts from `noise` on. For a sine, all
    /// samples together miss a sixty-fourth of it.
    pub(super) fn missed(&self, noise: f64) -> f64 {
        let thinned = |list: &[f64]| -> Vec<f64> { list.iter().step_by(2).copied().collect() };
        let position = thinned(self.position);
        let rates = self.rates.map(|rates| rates.map(thinned));
        let half = Samples {
            period: 2.0 * self.period,
            position: &position,
            rates: rates
                .as_ref()
                .map(|rates| rates.each_ref().map(Vec::as_slice)),
        };
        let off: Vec<f64> = (self.position.iter().enumerate().skip(1).step_by(2))
            .filter(|(k, _)| k + 1 < self.position.len())
            .map(|(k, own)| (own - half.at(0.5 * k as f64).position).powi(2))
            .collect();
        if off.is_empty() {
            return 0.0;
        }
        let mean = statistics::mean(self.position);
        let about = |q: &f64| (q - mean).powi(2);
        let moved: Vec<f64> = self.position.iter().map(about).collect();
        let [off, moved] = [off, moved].map(|list| statistics::mean(&list).sqrt());
        if off > noise { off / moved } else { 0.0 }
    }
}
