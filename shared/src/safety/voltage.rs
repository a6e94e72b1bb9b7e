//! Check that encoder and winding show the same speed.
//!
//! The voltage over the motor's terminals is u = R·i + L·di/dt + Kₑ·ω (Krishnan 2001, "Electric Motor Drives", ch. 2).
//! Current and encoder leave a part of the applied voltage unexplained. Low-passed, this part is only noise while the
//! encoder counts the motor's turns. If the encoder has lost the motor, it is the back-EMF of the uncounted speed. A
//! blocked motor is not mistaken for that: R·i explains its voltage.
//!
//! The allowed margin is a constant and a share of each explained part, because ratings and parts are not exact. A lost
//! encoder is not detected at rest, nor at a speed whose back-EMF is below the margin.
//!
//! Leaves out: L·di/dt, which the low-pass turns into L/T·i (0.025 Ω with the template's 0.5 mH and 20 ms). The margin
//! covers dead time and drop of the bridge and the temperature of winding and magnets. A broken motor wire shows here
//! too: voltage without current and speed.

use crate::drive::Drive;

/// The voltage model with its margins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltageModel {
    /// Resistance of winding, leads and bridge, Ω.
    pub resistance: f32,
    /// Back-EMF of one encoder count a tick, V.
    pub back_emf_per_step: f32,
    /// Control period over the time constant of the low-pass.
    pub forget: f32,
    /// Margin at rest without current, V.
    pub floor: f32,
    /// Additional margin as a share of the resistive voltage and of the back-EMF.
    pub shares: [f32; 2],
}

/// Time constant of the low-pass, s. Long against the delays of winding and velocity, short against the time in which a
/// link moves far on its own.
const TIME: f32 = 0.02;
/// Constant margin, V, for dead time and drops of the bridge and the error of the supply divider (0.3 µs at 20 kHz and
/// 24 V are 0.14 V, 1 % of 24 V is 0.24 V).
const FLOOR: f32 = 1.0;
/// Margin as a share of the resistive voltage. Copper has 39 % more resistance 100 K warmer (0.393 %/K, IEC 60028).
const RESISTANCE_SHARE: f32 = 0.4;
/// Margin as a share of the back-EMF. Torque constants are rated to 10 %, and magnets lose up to 0.2 %/K.
const BACK_EMF_SHARE: f32 = 0.2;

impl VoltageModel {
    /// Returns the model for a drive, its encoder's counts per motor turn, and a step period in seconds.
    pub fn new(drive: &Drive<f32>, counts_per_motor_turn: u32, period: f32) -> Self {
        Self {
            resistance: drive.resistance,
            back_emf_per_step: drive.torque_constant * core::f32::consts::TAU
                / (counts_per_motor_turn.max(1) as f32 * period),
            forget: period / TIME,
            floor: FLOOR,
            shares: [RESISTANCE_SHARE, BACK_EMF_SHARE],
        }
    }
}

/// State between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageState {
    /// Unexplained voltage, low-passed, V.
    pub unexplained: f32,
    /// Margin in addition to the floor, low-passed, V.
    allowed: f32,
}

/// Runs one tick. Returns true if the unexplained voltage exceeds the margin. `voltage` in V is the voltage that the
/// bridge applies, `current` is in A, `step` in counts. NaN counts as unexplained.
pub fn step(
    model: &VoltageModel,
    state: &mut VoltageState,
    voltage: f32,
    current: f32,
    step: i32,
) -> bool {
    let drop = model.resistance * current;
    let back_emf = model.back_emf_per_step * step as f32;
    let allowed = model.shares[0] * drop.abs() + model.shares[1] * back_emf.abs();
    state.unexplained += (voltage - drop - back_emf - state.unexplained) * model.forget;
    state.allowed += (allowed - state.allowed) * model.forget;
    !(state.unexplained.abs() <= model.floor + state.allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive<f32> = Drive {
        gear_ratio: 50.0,
        rotor_inertia: 2e-5,
        torque_constant: 0.05,
        resistance: 0.6,
        inductance: 0.5e-3,
    };

    fn model() -> VoltageModel {
        VoltageModel::new(&DRIVE, 8192, 1e-4)
    }

    /// Returns the ticks until detection at constant voltage, current and motor speed (rad/s).
    fn step_voltages(voltage: f32, current: f32, speed: f32) -> Option<u32> {
        let (model, mut state) = (model(), VoltageState::default());
        let per_tick = speed * 1e-4 * 8192.0 / core::f32::consts::TAU;
        let (mut angle, mut count) = (0.0_f32, 0);
        (0..20_000).find(|_| {
            angle += per_tick;
            let before = count;
            count = angle as i32;
            step(&model, &mut state, voltage, current, count - before)
        })
    }

    #[test]
    fn a_blocked_motor_is_explained_and_a_lost_encoder_is_not() {
        // 0.6 Ω · 3.2 A, at rest; the same in a winding 100 K warmer.
        assert_eq!(step_voltages(1.92, 3.2, 0.0), None);
        assert_eq!(step_voltages(1.92 * 1.39, 3.2, 0.0), None);
        // 50 rad/s of the motor are 1 rad/s of the joint, and 2.5 V.
        assert_eq!(step_voltages(0.6 + 2.5, 1.0, 50.0), None);
        let after = step_voltages(0.6 + 2.5, 1.0, 0.0);
        assert!(after.is_some_and(|ticks| ticks < 300), "{after:?}");
        // Encoder counts with the wrong sign.
        assert!(step_voltages(0.6 + 2.5, 1.0, -50.0).is_some());
    }

    #[test]
    fn parts_as_wrong_as_they_may_be_are_allowed_and_no_number_is_not() {
        for speed in [0.0, 30.0, 300.0_f32] {
            for current in [-3.2, 0.5, 3.2_f32] {
                let voltage = 1.39 * 0.6 * current + 0.85 * 0.05 * speed;
                assert_eq!(
                    step_voltages(voltage, current, speed),
                    None,
                    "{speed} {current}"
                );
            }
        }
        assert_eq!(step_voltages(f32::NAN, 0.0, 0.0), Some(0));
    }
}
