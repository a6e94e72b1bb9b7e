//! Motor and gear: a DC motor, or a brushless one seen through its field-oriented controller as a DC motor.
//!
//! u = R·i + L·di/dt + k·ωm, τm = k·i, with the same k for both in SI units (N·m/A = V·s/rad), joint torque N·k·i and
//! motor speed N·q̇ for N motor turns per joint turn; N is negative if the gear reverses the direction.
//!
//! Leaves out: gear losses (they are joint friction, see [`friction`](crate::friction)), iron loss, cogging and
//! torque ripple, saturation of the torque constant, the change of R and k with temperature, brush voltage,
//! bridge dead time, and for brushless motors the reluctance torque and the d axis. For these k is the torque
//! per quadrature current, R and L those of the q axis.

use crate::scalar::Real;

/// Parameters of motor and gear, motor-side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive<T> {
    /// Motor turns per joint turn N; negative if the gear reverses the direction.
    pub gear_ratio: T,
    /// Inertia of the rotor and the parts that turn with it, kg·m².
    pub rotor_inertia: T,
    /// Torque constant k, N·m/A, which is also the back-EMF constant, V·s/rad.
    pub torque_constant: T,
    /// Winding resistance R, Ω.
    pub resistance: T,
    /// Winding inductance L, H.
    pub inductance: T,
}

impl<T: Real> Drive<T> {
    /// Returns the joint torque of a motor current in A, N·m: N·k·i.
    #[inline(always)]
    pub fn joint_torque(&self, current: T) -> T {
        self.gear_ratio * self.torque_constant * current
    }

    /// Returns the motor current for a joint torque in N·m, A. Gear ratio and torque constant must not be zero.
    #[inline(always)]
    pub fn current(&self, joint_torque: T) -> T {
        joint_torque / (self.gear_ratio * self.torque_constant)
    }

    /// Returns the motor speed at a joint speed in rad/s, rad/s.
    #[inline(always)]
    pub fn motor_velocity(&self, joint_velocity: T) -> T {
        self.gear_ratio * joint_velocity
    }

    /// Returns the back-EMF at a joint speed in rad/s, V.
    #[inline(always)]
    pub fn back_emf(&self, joint_velocity: T) -> T {
        self.torque_constant * self.motor_velocity(joint_velocity)
    }

    /// Returns the terminal voltage for a current (A), its rate (A/s) and a joint speed (rad/s), V.
    #[inline(always)]
    pub fn voltage(&self, current: T, current_rate: T, joint_velocity: T) -> T {
        self.resistance * current + self.inductance * current_rate + self.back_emf(joint_velocity)
    }

    /// Returns the rate of the current, A/s, under a terminal voltage (V). The inductance must not be zero.
    #[inline(always)]
    pub fn current_rate(&self, voltage: T, current: T, joint_velocity: T) -> T {
        (voltage - self.resistance * current - self.back_emf(joint_velocity)) / self.inductance
    }

    /// Returns the electrical time constant L/R, s.
    #[inline(always)]
    pub fn electrical_time_constant(&self) -> T {
        self.inductance / self.resistance
    }

    /// Returns the rotor's inertia at the joint, N²·Jm, kg·m².
    #[inline(always)]
    pub fn reflected_inertia(&self) -> T {
        self.gear_ratio.squared() * self.rotor_inertia
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn drive(gear_ratio: f64) -> Drive<f64> {
        Drive {
            gear_ratio,
            rotor_inertia: 2.0e-5,
            torque_constant: 0.05,
            resistance: 0.6,
            inductance: 0.5e-3,
        }
    }

    proptest! {
        #[test]
        fn power_is_conserved_between_terminals_winding_and_joint(
            ratio in prop_oneof![20.0..160.0_f64, -160.0..-20.0_f64],
            current in -8.0..8.0_f64,
            rate in -1e4..1e4_f64,
            velocity in -6.0..6.0_f64,
        ) {
            let drive = drive(ratio);
            let electrical = drive.voltage(current, rate, velocity) * current;
            let heat = drive.resistance * current * current;
            let magnetic = drive.inductance * current * rate;
            let mechanical = drive.joint_torque(current) * velocity;
            prop_assert!((electrical - heat - magnetic - mechanical).abs() < 1e-9);
            prop_assert!((drive.current(drive.joint_torque(current)) - current).abs() < 1e-12);
            let voltage = drive.voltage(current, rate, velocity);
            prop_assert!((drive.current_rate(voltage, current, velocity) - rate).abs() < 1e-7);
        }
    }

    #[test]
    fn rotor_energy_is_the_same_on_both_sides_of_a_reversing_gear() {
        let drive = drive(-50.0);
        let motor = 0.5 * drive.rotor_inertia * drive.motor_velocity(2.0).squared();
        let joint = 0.5 * drive.reflected_inertia() * 4.0;
        assert!((motor - joint).abs() < 1e-12 && drive.joint_torque(1.0) < 0.0);
    }

    #[test]
    fn a_locked_rotor_reaches_63_percent_after_one_time_constant() {
        let drive = drive(50.0);
        let steps = 10_000;
        let h = drive.electrical_time_constant() / f64::from(steps);
        let mut current = 0.0;
        for _ in 0..steps {
            let middle = current + h / 2.0 * drive.current_rate(3.0, current, 0.0);
            current += h * drive.current_rate(3.0, middle, 0.0);
        }
        let expected = 3.0 / drive.resistance * (1.0 - libm::exp(-1.0));
        assert!((current / expected - 1.0).abs() < 1e-8);
    }
}
