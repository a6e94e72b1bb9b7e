//! The integral (energy) model: work on the link over a window equals the change of its energy.
//!
//! ∫τ·q̇ dt = J·½Δ(q̇²) + gc·Δ(sin q) − gs·Δ(cos q) + fv·∫q̇² dt + fc·∫|q̇| dt + off·∫q̇ dt.
//!
//! No acceleration is needed. Sources: Gautier & Khalil (1988), "On the identification of the inertial
//! parameters of robots"; Kozłowski (1998), "Modelling and Identification in Robotics", ch. 3;
//! the power form is Gautier (1997), "Dynamic identification of robots with power model".
//!
//! Every integral, the work too, uses the trapezoid rule. Friction and offset columns are then consistent with the work
//! sample by sample, also where q̇ passes zero and the torque jumps. What remains is the rule's error on the smooth
//! conservative power p := J·q̈·q̇ + (gc·cos q + gs·sin q)·q̇, which is dt²/12·(ṗ(t₂) − ṗ(t₁)) + O(dt⁴)
//! (Euler–Maclaurin). A jump of q̈ inside a step adds up to ½·J·|Δq̈|·|q̇|·dt once.
//!
//! Leaves out: the same as the one-link model. Sums are plain, so in `f32` a window should stay below some 10⁴ samples.

use super::Row;
use crate::scalar::Real;

/// Sums over the window so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accumulator<T> {
    first: Option<Edge<T>>,
    last: Option<Edge<T>>,
    work: T,
    squared_velocity: T,
    absolute_velocity: T,
    displacement: T,
    intervals: u32,
}

/// Values of the previous sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Edge<T> {
    sin: T,
    cos: T,
    qd: T,
    tau: T,
}

impl<T: Real> Accumulator<T> {
    /// Returns an empty window.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a sample: position (rad, may be wrapped to a turn), velocity (rad/s), torque (N·m) and the time since the
    /// previous sample (s; ignored for the first).
    #[inline]
    pub fn push(&mut self, q: T, qd: T, tau: T, dt: T) {
        let (sin, cos) = q.sin_cos();
        let now = Edge { sin, cos, qd, tau };
        match self.last {
            None => self.first = Some(now),
            Some(old) => {
                let half = T::from_f64(0.5) * dt;
                self.work += half * (old.tau * old.qd + tau * qd);
                self.squared_velocity += half * (old.qd.squared() + qd.squared());
                self.absolute_velocity += half * (old.qd.abs() + qd.abs());
                self.displacement += half * (old.qd + qd);
                self.intervals = self.intervals.saturating_add(1);
            }
        }
        self.last = Some(now);
    }

    /// Closes the window. Returns the row and the work y (J) with y = row·θ; `None` below two samples. The next window
    /// starts at the last sample, so that windows join without a gap.
    #[inline]
    pub fn finish(&mut self) -> Option<(Row<T>, T)> {
        let (first, last) = (self.first?, self.last?);
        if self.intervals == 0 {
            return None;
        }
        let row = [
            T::from_f64(0.5) * (last.qd - first.qd) * (last.qd + first.qd),
            last.sin - first.sin,
            first.cos - last.cos,
            self.squared_velocity,
            self.absolute_velocity,
            self.displacement,
        ];
        let work = self.work;
        *self = Self {
            first: Some(last),
            last: Some(last),
            ..Self::default()
        };
        Some((row, work))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(super) mod tests {
    use super::*;
    use std::vec::Vec;

    /// The true parameters of all model tests, in the order of the parameter names.
    pub(crate) const TRUTH: [f64; 6] = [0.12, 2.9, -0.7, 0.3, 0.4, 0.15];

    /// Simulates forward dynamics by RK4 with 16 sub-steps per sample. The torque is held over the sample, as a power
    /// stage does, plus compensation of Coulomb friction away from zero so that the link keeps moving. Returns (q, q̇,
    /// τ at the start of the step, τ at its end) per sample.
    pub(crate) fn simulate(dt: f64, samples: usize, torque: impl Fn(f64) -> f64) -> Vec<[f64; 3]> {
        let [j, gc, gs, fv, fc, off] = TRUTH;
        let acceleration = |t: f64, q: f64, qd: f64| {
            let free = torque(t) - gc * q.cos() - gs * q.sin() - fv * qd - off;
            (free - fc * if qd > 0.0 { 1.0 } else { -1.0 }) / j
        };
        let (mut q, mut qd) = (0.2, 0.5);
        let mut out = Vec::new();
        for k in 0..samples {
            let t0 = dt * k as f64;
            out.push([q, qd, torque(t0)]);
            let h = dt / 16.0;
            for s in 0..16 {
                let t = t0 + h * f64::from(s);
                let a1 = acceleration(t, q, qd);
                let (q2, v2) = (q + 0.5 * h * qd, qd + 0.5 * h * a1);
                let a2 = acceleration(t + 0.5 * h, q2, v2);
                let (q3, v3) = (q + 0.5 * h * v2, qd + 0.5 * h * a2);
                let a3 = acceleration(t + 0.5 * h, q3, v3);
                let (q4, v4) = (q + h * v3, qd + h * a3);
                let a4 = acceleration(t + h, q4, v4);
                q += h / 6.0 * (qd + 2.0 * v2 + 2.0 * v3 + v4);
                qd += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            }
        }
        out
    }

    /// Returns a smooth torque that swings the link through reversals.
    pub(crate) fn drive(t: f64) -> f64 {
        3.0 * (2.0 * t).sin() + 1.5 * (5.1 * t).cos() + 1.0
    }

    fn worst_energy_error(dt: f64, reversals: bool) -> (f64, usize) {
        let samples = (6.0 / dt) as usize;
        let data = simulate(dt, samples, drive);
        let window = (0.2 / dt).round() as usize;
        let mut worst = 0.0_f64;
        let mut count = 0;
        for part in data.chunks_exact(window) {
            let turns = part.windows(2).any(|w| w[0][1] * w[1][1] <= 0.0);
            if turns != reversals {
                continue;
            }
            let mut sum = Accumulator::new();
            for &[q, qd, tau] in part {
                sum.push(q, qd, tau, dt);
            }
            let (row, y) = sum.finish().unwrap();
            let model: f64 = row.iter().zip(TRUTH).map(|(a, b)| a * b).sum();
            worst = worst.max((model - y).abs());
            count += 1;
        }
        (worst, count)
    }

    #[test]
    fn energy_balances_to_second_order_between_reversals() {
        let (coarse, n) = worst_energy_error(2e-3, false);
        let (fine, _) = worst_energy_error(1e-3, false);
        assert!(n > 5, "{n}");
        assert!(coarse < 2e-4, "{coarse}");
        let order = (coarse / fine).log2();
        assert!(order > 1.6, "order {order}: {coarse} {fine}");
    }

    #[test]
    fn energy_balances_through_reversals_too() {
        let (coarse, n) = worst_energy_error(1e-3, true);
        assert!(n > 3, "{n}");
        // ½·J·|Δq̈|·|q̇|·dt with |Δq̈| = 2·fc/J and |q̇| of one step: below 1e-4 J.
        assert!(coarse < 1e-4, "{coarse}");
    }

    #[test]
    fn windows_join_and_wrapped_position_is_the_same() {
        let data = simulate(1e-3, 2000, drive);
        let mut whole = Accumulator::new();
        let mut parts = Accumulator::new();
        let mut sum = [0.0; 6];
        let mut work = 0.0;
        for (k, &[q, qd, tau]) in data.iter().enumerate() {
            whole.push(q, qd, tau, 1e-3);
            parts.push(q + 12.0 * core::f64::consts::PI, qd, tau, 1e-3);
            if k % 100 == 99 {
                let (row, y) = parts.finish().unwrap();
                (0..6).for_each(|i| sum[i] += row[i]);
                work += y;
            }
        }
        let (row, y) = whole.finish().unwrap();
        assert!((y - work).abs() < 1e-10);
        for i in 0..6 {
            assert!((row[i] - sum[i]).abs() < 1e-9, "{i}");
        }
    }

    #[test]
    fn empty_window_has_no_row() {
        let mut sum = Accumulator::<f32>::new();
        assert!(sum.finish().is_none());
        sum.push(0.0, 1.0, 1.0, 1e-3);
        assert!(sum.finish().is_none());
    }
}
