//! Whether the encoder and the winding tell of the same speed.
//!
//! The voltage over the motor's terminals is u = R·i + L·di/dt + Kₑ·ω (Krishnan 2001, "Electric Motor Drives", ch. 2). What
//! current and encoder leave unexplained of the applied one, low-passed, is nothing but noise while the encoder counts what
//! the motor turns. Where it has lost the motor it is the back-EMF of a speed that nobody counts; of a motor that is blocked
//! all is explained by R·i, so that one is not taken for the other.
//!
//! The margin that is allowed is a constant and a share of either explained part, as nameplates and parts are not exact.
//! A speed whose back-EMF stays below the margin is not missed, and neither is a motor at rest.
//!
//! Left out: L·di/dt, which the low-pass turns into L/T·i (0.025 Ω of it, with the template's 0.5 mH and 20 ms); dead time
//! and drop of the bridge, temperature of winding and magnets, which the margin is for. A motor's wire that is off shows
//! here too: voltage without current and speed.

use crate::drive::Drive;

/// The model, and what it may be wrong by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltageModel {
    /// Winding, leads and bridge, Ω.
    pub resistance: f32,
    /// Back-EMF of one encoder count a tick, V.
    pub back_emf_per_step: f32,
    /// Control periods in the low-pass's time constant, inverted.
    pub forget: f32,
    /// What is allowed at rest without current, V.
    pub floor: f32,
    /// What is allowed beside of the resistance's part and the back-EMF's part, each as a share of it.
    pub shares: [f32; 2],
}

/// Time constant of the low-pass, s: long against the winding's and the velocity's delays, short against the way that a
/// link makes on its own.
const TIME: f32 = 0.02;
/// The bridge's dead time and drops with what the supply's divider is wrong by, V (0.3 µs at 20 kHz and 24 V are 0.14 V, 1 %
/// of 24 V is 0.24 V).
const FLOOR: f32 = 1.0;
/// Copper has 39 % more resistance 100 K warmer (0.393 %/K, IEC 60028).
const RESISTANCE_SHARE: f32 = 0.4;
/// Torque constants are given to 10 %, and magnets lose up to 0.2 %/K.
const BACK_EMF_SHARE: f32 = 0.2;

impl VoltageModel {
    /// The model of a drive whose encoder has so many counts per motor turn, looked at every `period` seconds.
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

/// What is remembered from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VoltageState {
    /// Voltage that is not explained, low-passed, V.
    pub unexplained: f32,
    /// What is allowed beside the floor, low-passed, V.
    allowed: f32,
}

/// One tick: whether more is unexplained than the model may be wrong by. `voltage` in V is what the bridge applies, `current`
/// in A, `step` in counts. A value that is no number counts as unexplained.
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

    /// Ticks until it is told, of voltage, current and motor speed (rad/s) that stand.
    fn told(voltage: f32, current: f32, speed: f32) -> Option<u32> {
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
        assert_eq!(told(1.92, 3.2, 0.0), None);
        assert_eq!(told(1.92 * 1.39, 3.2, 0.0), None);
        // 50 rad/s of the motor are 1 rad/s of the joint, and 2.5 V.
        assert_eq!(told(0.6 + 2.5, 1.0, 50.0), None);
        let after = told(0.6 + 2.5, 1.0, 0.0);
        assert!(after.is_some_and(|ticks| ticks < 300), "{after:?}");
        // Counted with the wrong sign.
        assert!(told(0.6 + 2.5, 1.0, -50.0).is_some());
    }

    #[test]
    fn parts_as_wrong_as_they_may_be_are_allowed_and_no_number_is_not() {
        for speed in [0.0, 30.0, 300.0_f32] {
            for current in [-3.2, 0.5, 3.2_f32] {
                let voltage = 1.39 * 0.6 * current + 0.85 * 0.05 * speed;
                assert_eq!(told(voltage, current, speed), None, "{speed} {current}");
            }
        }
        assert_eq!(told(f32::NAN, 0.0, 0.0), Some(0));
    }
}
