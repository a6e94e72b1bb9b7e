//! Tests of effects as torques and corrections: against the friction law where both describe the same effect, and
//! over the whole registry for common properties.
#![allow(clippy::unwrap_used, clippy::panic)]

use super::*;
use crate::effects::{Effect, Kind, Parameter};
use crate::friction::Friction;
use crate::precompensation;
use crate::trajectory::Reference;
use proptest::prelude::*;

const SETTINGS: PrecompensationSettings<f64> = PrecompensationSettings {
    enabled: true,
    gain: 0.95,
    gain_at_rest: 0.7,
    velocity_threshold: 0.05,
};

fn only(effect: Effect<f64>) -> Effects<f64> {
    let mut effects = Effects::default();
    effects[0] = Some(effect);
    effects
}

fn stribeck(breakaway: f64, velocity: f64) -> Effect<f64> {
    Effect {
        kind: Kind::Stribeck,
        gains: [breakaway, 0.0, 0.0, 0.0],
        shapes: [velocity, 0.0, 0.0, 0.0],
    }
}

fn cogging(cosine: f64, sine: f64, order: f64) -> Effect<f64> {
    Effect {
        kind: Kind::Cogging,
        gains: [cosine, sine, 0.0, 0.0],
        shapes: [order, 0.0, 0.0, 0.0],
    }
}

/// Returns an effect of this kind with typical parameters.
fn typical(kind: Kind) -> Effect<f64> {
    let about = kind.about();
    let middle = |parameters: &[Parameter], k: usize| {
        parameters.get(k).map_or(0.0, |p| {
            (0.5 * (p.range[0] + p.range[1])).round().max(p.range[0])
        })
    };
    Effect {
        kind,
        gains: core::array::from_fn(|k| middle(about.gains, k)),
        shapes: core::array::from_fn(|k| middle(about.shapes, k)),
    }
}

fn at(reference: f64, measured: f64) -> Inputs<f64> {
    Inputs {
        reference: Reference {
            velocity: reference,
            ..Reference::default()
        },
        velocity: measured,
        position_known: true,
        rotates_waves: true,
        period: 1e-4,
        ..Inputs::default()
    }
}

/// Returns the output after every effect has had its turn.
fn settled<T: Scalar>(
    effects: &Effects<T>,
    settings: &PrecompensationSettings<T>,
    inputs: &Inputs<T>,
) -> Output<T> {
    let compensation = Compensation::new(effects).unwrap();
    let mut state = State::default();
    let mut output = Output::default();
    // With a period of 0, presliding travels no distance.
    let inputs = Inputs {
        period: T::ZERO,
        ..*inputs
    };
    for _ in 0..2 * EFFECTS {
        compensation.turn(&mut state, &inputs);
        output = compensation.torque(settings, &mut state, &inputs);
    }
    output
}

fn torque(effects: &Effects<f64>, inputs: &Inputs<f64>) -> Output<f64> {
    settled(effects, &SETTINGS, inputs)
}

#[test]
fn stribeck_as_an_effect_is_stribeck_in_the_friction_law() {
    let effects = only(stribeck(0.25, 0.1));
    let law = Friction {
        breakaway_excess: 0.25,
        stribeck_velocity: 0.1,
        ..Friction::default()
    };
    for reference in [-0.4, -0.05, -1e-4, 0.0, 1e-4, 0.02, 0.3] {
        for k in -100..=100 {
            let measured = f64::from(k) * 5e-3;
            let by_law = precompensation::torque(&SETTINGS, &law, reference, measured, 0.0);
            let by_effect = torque(&effects, &at(reference, measured)).feedforward;
            assert!(
                (by_law - by_effect).abs() < 1e-12,
                "{reference} {measured}: {by_law} {by_effect}"
            );
        }
    }
}

#[test]
fn what_is_explained_is_the_whole_law_at_the_measured_motion() {
    let effects = only(stribeck(0.25, 0.1));
    let output = torque(&effects, &at(0.3, -0.06));
    assert!((output.explained + 0.25 * libm::exp(-0.36)).abs() < 1e-12);
    // If switched off, friction is not given but still explained.
    let off = PrecompensationSettings {
        enabled: false,
        ..SETTINGS
    };
    let silent = settled(&effects, &off, &at(0.3, -0.06));
    assert_eq!(
        (silent.feedforward, silent.explained),
        (0.0, output.explained)
    );
}

#[test]
fn cogging_is_given_in_full_at_rest_and_only_where_the_link_stands() {
    let effects = only(cogging(0.2, -0.1, 24.0));
    for angle in [0.0, 0.013, 1.0, 6.0] {
        let mut inputs = Inputs {
            motor_angle: angle,
            angle_in_turn: angle,
            ..at(0.0, 0.0)
        };
        let (s, c) = libm::sincos(24.0 * angle);
        let wanted = 0.2 * c - 0.1 * s;
        let output = torque(&effects, &inputs);
        assert!((output.feedforward - wanted).abs() < 1e-12);
        assert_eq!(output.feedforward, output.explained);
        // If the position is unknown, no angle is valid.
        inputs.position_known = false;
        assert_eq!(torque(&effects, &inputs), Output::default());
    }
}

#[test]
fn a_whole_order_takes_the_angle_within_a_turn_and_a_broken_one_does_not() {
    let inputs = Inputs {
        motor_angle: 100.0 * core::f64::consts::TAU + 0.4,
        angle_in_turn: 0.4,
        ..at(0.0, 0.0)
    };
    let whole = torque(&only(cogging(1.0, 0.0, 24.0)), &inputs).feedforward;
    assert_eq!(whole, libm::cos(24.0 * 0.4));
    let broken = torque(&only(cogging(1.0, 0.0, 24.5)), &inputs).feedforward;
    assert_eq!(broken, libm::cos(24.5 * inputs.motor_angle));
}

#[test]
fn effects_add_up() {
    let (a, b) = (stribeck(0.25, 0.1), cogging(0.2, -0.1, 24.0));
    let inputs = Inputs {
        angle_in_turn: 0.3,
        ..at(0.1, 0.08)
    };
    let mut both = [None; EFFECTS];
    (both[0], both[2]) = (Some(a), Some(b));
    let sum = torque(&only(a), &inputs).feedforward + torque(&only(b), &inputs).feedforward;
    assert!((torque(&both, &inputs).feedforward - sum).abs() < 1e-15);
}

#[test]
fn no_effect_drives_a_link_that_runs_ahead_and_dry_ones_stop_with_the_reference() {
    for kind in Kind::ALL {
        if Role::of(*kind) != Some(Role::DryFriction) {
            continue;
        }
        let effects = only(typical(*kind));
        assert_eq!(
            torque(&effects, &at(0.0, 0.02)).feedforward,
            0.0,
            "{kind:?}"
        );
        for reference in [0.06, 0.3] {
            let mut last = torque(&effects, &at(reference, reference))
                .feedforward
                .abs();
            for k in 1..=400 {
                let measured = reference + f64::from(k) * 5e-3;
                // The same position for any velocity of the link.
                let inputs = Inputs {
                    period: 0.0,
                    ..at(reference, measured)
                };
                let next = torque(&effects, &inputs).feedforward.abs();
                // The share may still rise from a slow to a fast link.
                let share_left = SETTINGS.gain / share(&SETTINGS, reference, reference);
                assert!(next <= share_left * last + 1e-12, "{kind:?} {measured}");
                last = next;
            }
        }
    }
}

#[test]
fn every_kind_is_either_refused_by_name_or_finite_whatever_comes() {
    let mut used = 0;
    for kind in Kind::ALL {
        let effects = only(typical(*kind));
        match (Role::of(*kind), Compensation::new(&effects)) {
            (None, Err(EffectFault::NotCompensable(named))) => assert_eq!(named, *kind),
            (Some(_), Ok(compensation)) => {
                used += 1;
                for value in [f64::NAN, f64::INFINITY, -1e300, 0.0, 1.0] {
                    let inputs = Inputs {
                        position: value,
                        velocity: value,
                        motor_angle: value,
                        angle_in_turn: value,
                        drive_torque: value,
                        load: value,
                        coulomb: value,
                        viscous: value,
                        time: value,
                        temperature_rise: value,
                        reference: Reference {
                            position: value,
                            velocity: value,
                            acceleration: value,
                        },
                        position_known: true,
                        busy: false,
                        rotates_waves: true,
                        gear_ratio: 50.0,
                        period: 1e-4,
                        torque_delay: 3e-4,
                        delay_ticks: 3,
                        delay_fraction: 0.5,
                    };
                    let mut state = State::default();
                    for _ in 0..9 {
                        let reading = compensation.turn(&mut state, &inputs);
                        let output = compensation.torque(&SETTINGS, &mut state, &inputs);
                        assert!(output.feedforward.is_finite(), "{kind:?} {value}");
                        assert!(output.explained.is_finite(), "{kind:?} {value}");
                        assert!(reading.error.is_finite() && reading.slope.is_finite());
                    }
                }
            }
            other => panic!("{kind:?}: {other:?}"),
        }
    }
    assert!(used >= 3);
}

#[test]
fn what_is_wrong_with_an_effect_is_named() {
    let fault = |effect| Compensation::new(&only(effect)).unwrap_err();
    let parameter = |name| EffectFault::Parameter(name);
    assert_eq!(fault(stribeck(f64::NAN, 0.1)), parameter("breakaway"));
    assert_eq!(fault(stribeck(-0.1, 0.1)), parameter("breakaway"));
    assert_eq!(fault(stribeck(0.1, f64::INFINITY)), parameter("velocity"));
    // 0/0 at rest.
    assert_eq!(fault(stribeck(0.1, 0.0)), parameter("velocity"));
    assert_eq!(fault(cogging(0.1, 0.1, 1.0)), parameter("order"));
    let mut surplus = stribeck(0.1, 0.1);
    surplus.gains[3] = 1.0;
    assert_eq!(fault(surplus), EffectFault::Surplus);
    let refused = fault(typical(Kind::Backlash));
    assert_eq!(refused, EffectFault::NotCompensable(Kind::Backlash));
    assert!(std::format!("{refused}").contains(" cannot be compensated: it acts between"));
    assert!(Compensation::new(&only(stribeck(0.0, 0.1))).is_ok());
}

/// Two effects.
fn both<T: Copy>([first, second]: [Effect<T>; 2]) -> Effects<T> {
    let mut effects = [None; EFFECTS];
    (effects[0], effects[1]) = (Some(first), Some(second));
    effects
}

/// Exactly the kinds that cannot be compensated are refused, with a reason.
#[test]
fn each_kind_has_a_role_or_a_reason() {
    let refused: std::vec::Vec<_> = Kind::ALL
        .iter()
        .filter(|kind| Role::refusal(**kind).is_some())
        .map(|kind| kind.about().name)
        .collect();
    let expected = [
        "backlash",
        "joint_elasticity",
        "measurement_delay",
        "payload",
        "inertia_coupling",
    ];
    assert_eq!(refused, expected);
}

/// After a reversal the torque builds up over the reference's stroke, and follows the reference alone.
#[test]
fn friction_with_memory_is_given_over_the_way_of_the_reference() {
    let effect = Effect::new(Kind::PreslidingDahl, &[1.0], &[0.01]);
    let compensation = Compensation::new(&only(effect)).unwrap();
    let mut state = State::default();
    let mut go = |reference: f64, measured: f64, ticks: u32| {
        let mut last = 0.0;
        for _ in 0..ticks {
            let inputs = Inputs {
                period: 1e-4,
                ..at(reference, measured)
            };
            last = compensation
                .torque(&SETTINGS, &mut state, &inputs)
                .feedforward;
        }
        last / share(&SETTINGS, reference, measured)
    };
    // After twenty strokes the start is forgotten.
    assert!(go(0.5, 0.0, 4000).abs() < 1e-6);
    // Half a stroke after the reversal: z = −1 + 2·exp(−½), the law gives z + 1.
    let back = go(-0.5, 0.0, 100);
    assert!((back - 2.0 * (-0.5_f64).exp()).abs() < 0.02, "{back}");
    // The motion of the link changes nothing, and a reference at rest gives no torque.
    assert_eq!(go(0.0, 0.3, 10), 0.0);
}

/// The two errors are reset one at a time, and are accurate even at the template's highest speed.
#[test]
fn two_errors_of_the_encoder_are_taken_off_in_turn() {
    let given = [
        Kind::EncoderEccentricityMotor,
        Kind::EncoderEccentricityJoint,
    ];
    let effects = both(given.map(|kind| Effect::new(kind, &[0.001, -0.0005], &[1.0])));
    let compensation = Compensation::new(&effects).unwrap();
    let mut state = State::default();
    let mut worst = 0.0_f64;
    for tick in 0..20_000 {
        let position = 6.0 * 1e-4 * f64::from(tick);
        let inputs = Inputs {
            position,
            motor_angle: 50.0 * position,
            angle_in_turn: (50.0 * position).rem_euclid(core::f64::consts::TAU),
            position_known: true,
            rotates_waves: true,
            gear_ratio: 50.0,
            ..Inputs::default()
        };
        let reading = compensation.turn(&mut state, &inputs);
        let truth: f64 = effects
            .iter()
            .flatten()
            .map(|effect| effect.torque(&mut Memory::default(), &inputs.instant(true)))
            .sum();
        if tick > 2 {
            worst = worst.max((reading.error - truth).abs());
        }
    }
    assert!(worst > 0.0 && worst < 1e-9, "{worst}");
}

#[test]
fn what_the_bridge_loses_is_a_voltage() {
    let lost = Compensation::new(&only(Effect::new(Kind::DriveDeadzone, &[0.4], &[]))).unwrap();
    assert_eq!(lost.lost_voltage(), 0.4);
    assert!(!lost.has_torque() && !lost.has_waves());
}

proptest! {
    #[test]
    fn single_precision_agrees(
        reference in -1.0..1.0_f32,
        measured in -1.0..1.0_f32,
        angle in 0.0..core::f32::consts::TAU,
    ) {
        let single = |effect: Effect<f64>| Effect {
            kind: effect.kind,
            gains: effect.gains.map(|x| x as f32),
            shapes: effect.shapes.map(|x| x as f32),
        };
        let given = [stribeck(0.25, 0.1), cogging(0.2, -0.1, 24.0)];
        let settings = PrecompensationSettings {
            enabled: true,
            gain: 0.95_f32,
            gain_at_rest: 0.7,
            velocity_threshold: 0.05,
        };
        let inputs = Inputs::<f32> {
            reference: Reference { velocity: reference, ..Reference::default() },
            velocity: measured,
            angle_in_turn: angle,
            position_known: true,
            rotates_waves: true,
            ..Inputs::default()
        };
        let effects = both(given.map(single));
        let f32s = settled(&effects, &settings, &inputs);
        let wide = Inputs::<f64> {
            angle_in_turn: angle.into(),
            ..at(reference.into(), measured.into())
        };
        let f64s = torque(&both(given), &wide);
        // The rounding error of the angle is multiplied by the order, 24.
        prop_assert!((f64::from(f32s.feedforward) - f64s.feedforward).abs() < 1e-5);
        prop_assert!((f64::from(f32s.explained) - f64s.explained).abs() < 1e-5);
    }
}
