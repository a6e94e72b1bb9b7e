//! The differential model: one row per sample from position, velocity and acceleration.

use super::Row;
use crate::scalar::Real;

/// Returns the row of τ = row·θ at position `q` (rad), velocity `qd` (rad/s) and acceleration `qdd` (rad/s²).
///
/// The units of the entries are torque over the parameter's unit. Source: Khalil & Dombre (2002), eq. 12.2, for one
/// joint with Coulomb, viscous friction and offset.
#[inline]
pub fn row<T: Real>(q: T, qd: T, qdd: T) -> Row<T> {
    let (sin, cos) = q.sin_cos();
    [qdd, cos, sin, qd, qd.sgn(), T::ONE]
}

#[cfg(test)]
mod tests {
    use super::row;

    /// Power of the conservative columns is the rate of energy, by finite differences of the energy.
    #[test]
    fn power_is_rate_of_energy() {
        let (inertia, gc, gs) = (0.31, 1.7, -0.6);
        let q = |t: f64| 1.3 * (1.9 * t).sin() + 0.4 * t;
        let qd = |t: f64| 1.3 * 1.9 * (1.9 * t).cos() + 0.4;
        let qdd = |t: f64| -1.3 * 1.9 * 1.9 * (1.9 * t).sin();
        let energy = |t: f64| 0.5 * inertia * qd(t) * qd(t) + gc * q(t).sin() - gs * q(t).cos();
        for k in 0..100 {
            let t = 0.05 * f64::from(k);
            let r = row(q(t), qd(t), qdd(t));
            let power = (inertia * r[0] + gc * r[1] + gs * r[2]) * qd(t);
            let h = 1e-5;
            let rate = (energy(t + h) - energy(t - h)) / (2.0 * h);
            assert!((power - rate).abs() < 1e-8, "{t}: {power} {rate}");
        }
    }

    #[test]
    fn friction_dissipates_at_any_velocity() {
        for qd in [-3.0, -1e-9, 0.0, 1e-9, 2.0_f64] {
            let r = row(0.3, qd, 0.0);
            assert!(r[3] * qd >= 0.0 && r[4] * qd >= 0.0);
        }
    }
}
