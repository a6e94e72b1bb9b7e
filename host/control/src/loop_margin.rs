//! The bandwidth at which a sampled position loop keeps its gain margin.
//!
//! The tracking laws have gains in proportion to a diagonal inertia D: D·ω² and 2ζ·D·ω. On a robot with the inertia matrix A
//! the error then moves along the eigenvectors of A⁻¹·D, each as a single mass whose gains are λ times those designed, λ its
//! eigenvalue. The stiffest of them, λ of the least effective inertia, is the first to become unstable. Its loop is linear:
//! a mass, the torque held over a tick and perhaps one tick late, and the velocity observer of the encoder at many edges.
//! Stability is that of this sampled system, by the powers of its matrix.
//!
//! Leaves out: friction (which damps), Coriolis torques, the quantisation of the encoder, and the adaptation's own dynamics.

use nalgebra::{SMatrix, SVector};

use super::sensing::OBSERVER_SHARE;
use super::settings::{LawKind, Settings};
use rig_shared::encoder::Config;

/// Gain margin of the loop: the factor of all gains up to which it is stable. By judgement: the law's own model is known, so
/// the margin covers what the linear loop leaves out, and a model whose inertia is a fifth too large. Friction helps in
/// practice: the IRp-6 has 1.4 at the default settings, and parameters that are wrong by 30 % fail in no motion.
pub(crate) const MARGIN: f64 = 1.25;
/// Lowest share of the wanted bandwidth that is tried.
const LOWEST: f64 = 1e-3;
/// Halvings of the interval of bandwidths, in logarithms.
const HALVINGS: usize = 30;
/// Squarings of the matrix: after 2²⁰ ticks a stable loop has decayed.
const SQUARINGS: usize = 20;
/// Norm from which on a power counts as growing without bound.
const GROWN: f64 = 1e60;

type Loop = SMatrix<f64, 7, 7>;

/// Gains at unit inertia: position, velocity, integral.
fn gains(law: LawKind, lambda: f64, settings: &Settings) -> [f64; 3] {
    let (omega, zeta) = (settings.omega(), settings.damping);
    let (kp, kd) = (omega * omega, 2.0 * zeta * omega);
    match law {
        LawKind::Pid => [lambda * kp, lambda * kd, 0.1 * lambda * kp * omega],
        // q̈_r − Λ·ė through the model, with Λ = ω/2ζ, and K_D·(ė + Λ·e).
        LawKind::Adaptive => [lambda * kp, lambda * kd + omega / (2.0 * zeta), 0.0],
        _ => [kp, kd, 0.0],
    }
}

/// State after one tick: position, velocity, held torque, observed position, velocity and acceleration a tick, integral.
fn tick(state: SVector<f64, 7>, [kp, kd, ki]: [f64; 3], settings: &Settings) -> SVector<f64, 7> {
    let h = settings.period();
    let [
        mut x,
        mut v,
        mut held,
        mut seen,
        mut rate,
        mut bend,
        mut sum,
    ]: [f64; 7] = state.into();
    // The observer of rig_shared::encoder with an edge in every sample.
    let theta = Config::new(OBSERVER_SHARE * settings.rate, settings.rate).decay();
    let left = 1.0 - theta;
    seen += rate + 0.5 * bend;
    rate += bend;
    let error = x - seen;
    seen += (1.0 - theta.powi(3)) * error;
    rate += 1.5 * left * left * (1.0 + theta) * error;
    bend += left.powi(3) * error;
    let velocity = match settings.resolution > 0.0 {
        true => rate / h,
        false => v,
    };
    // A law without integral has no such state.
    sum = if ki > 0.0 { sum + ki * h * x } else { 0.0 };
    let next = -kp * x - kd * velocity - sum;
    if !settings.delay {
        held = next;
    }
    x += h * v + 0.5 * h * h * held;
    v += h * held;
    held = next;
    SVector::from([x, v, held, seen, rate, bend, sum])
}

/// Returns true if the loop with `gain` times the gains decays.
fn decays(law: LawKind, lambda: f64, gain: f64, settings: &Settings) -> bool {
    let gains = gains(law, lambda, settings).map(|own| gain * own);
    let columns: [SVector<f64, 7>; 7] = core::array::from_fn(|k| {
        let mut unit = SVector::zeros();
        unit[k] = 1.0;
        tick(unit, gains, settings)
    });
    let mut power = Loop::from_columns(&columns);
    for _ in 0..SQUARINGS {
        power *= power;
        let size = power.norm();
        if !(size < GROWN) {
            return false;
        }
    }
    power.norm() < 1.0
}

/// Returns the highest bandwidth (Hz), at most that of `settings`, at which a law keeps its gain margin. `lambda` is the
/// inertia that the gains are for over the least effective one, at least 1.
pub(crate) fn fastest(law: LawKind, lambda: f64, settings: &Settings) -> f64 {
    let stable = |share: f64| {
        let slower = Settings {
            bandwidth: share * settings.bandwidth,
            ..*settings
        };
        decays(law, lambda, MARGIN, &slower)
    };
    if stable(1.0) {
        return settings.bandwidth;
    }
    let (mut low, mut high) = (LOWEST.ln(), 0.0_f64);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match stable(middle.exp()) {
            true => low = middle,
            false => high = middle,
        }
    }
    low.exp() * settings.bandwidth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without delay, observer and integral the loop x'' = −kp·x − kd·v, held over ticks, is a quadratic in z: it is
    /// stable for kd·h < 2 and kp·h < 2·kd (Jury). With ζ = 1 and ω·h small the first binds: ω·h < 1 − ….
    #[test]
    fn the_limit_of_a_mass_with_a_held_torque_is_that_of_jury() {
        let settings = Settings {
            rate: 1000.0,
            delay: false,
            resolution: 0.0,
            ..Settings::default()
        };
        let bound = |lambda: f64, bandwidth: f64| {
            let own = Settings {
                bandwidth,
                ..settings
            };
            let [kp, kd, _] = gains(LawKind::ComputedTorque, lambda, &own);
            let h = own.period();
            // z² + (kd·h + kp·h²/2 − 2)·z + 1 − kd·h + kp·h²/2.
            let (b, c) = (
                kd * h + 0.5 * kp * h * h - 2.0,
                1.0 - kd * h + 0.5 * kp * h * h,
            );
            c.abs() < 1.0 && 1.0 + b + c > 0.0 && 1.0 - b + c > 0.0
        };
        for bandwidth in [20.0, 80.0, 120.0, 150.0, 158.0, 160.0, 170.0, 300.0] {
            let own = Settings {
                bandwidth,
                ..settings
            };
            assert_eq!(
                decays(LawKind::ComputedTorque, 1.0, 1.0, &own),
                bound(1.0, bandwidth),
                "{bandwidth} Hz"
            );
        }
    }
}
