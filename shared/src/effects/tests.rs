#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::HashSet;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::scalar::Real;

/// Returns an effect in the middle of its searched range, with positive gains.
fn example(kind: Kind) -> Effect<f64> {
    let about = kind.about();
    let middle = |p: &Parameter| match p.scale {
        Scale::Linear => 0.5 * (p.range[0] + p.range[1]),
        Scale::Logarithmic => (p.range[0] * p.range[1]).sqrt(),
        Scale::Whole => (0.5 * (p.range[0] + p.range[1])).round(),
    };
    let of = |list: &[Parameter]| list.iter().map(middle).collect::<Vec<f64>>();
    Effect::new(kind, &of(about.gains), &of(about.shapes))
}

/// Returns instants along positions at a constant period, with constant velocity between two positions.
fn along(q: &[f64], period: f64) -> Vec<Instant<f64>> {
    q.windows(2)
        .enumerate()
        .map(|(k, pair)| {
            let velocity = (pair[1] - pair[0]) / period;
            Instant {
                position: 0.5 * (pair[0] + pair[1]),
                velocity,
                direction: velocity.sgn(),
                motor_angle: 25.0 * (pair[0] + pair[1]),
                drive_torque: 2.0,
                load: -3.0,
                friction: 0.5 * velocity.sgn(),
                time: k as f64 * period,
                temperature_rise: 5.0,
                period,
                travel: pair[1] - pair[0],
                ..Instant::default()
            }
        })
        .collect()
}

/// Returns the work against `effect` along `q`, J. `coulomb` is additional friction of the joint.
fn work(effect: &Effect<f64>, coulomb: f64, q: &[f64], period: f64) -> f64 {
    let mut memory = Memory::default();
    along(q, period)
        .iter()
        .map(|at| {
            let torque = effect.torque(&mut memory, at) + coulomb * at.direction;
            torque * at.velocity * period
        })
        .sum()
}

/// Returns a closed path of three sines.
fn loop_of(a: [f64; 3], turns: usize) -> Vec<f64> {
    let n = 4000;
    (0..=turns * n)
        .map(|k| {
            let phase = core::f64::consts::TAU * (k % n) as f64 / n as f64;
            a[0] * phase.sin() + a[1] * (2.0 * phase).sin() + a[2] * (3.0 * phase).sin()
        })
        .collect()
}

#[test]
fn every_kind_says_all_there_is_to_say() {
    let mut seen = HashSet::new();
    for &kind in Kind::ALL {
        let about = kind.about();
        assert!(seen.insert((about.name, about.law)), "{kind:?} twice");
        let laws = Kind::ALL
            .iter()
            .filter(|k| k.about().name == about.name)
            .count();
        // One of several laws may be selected by the name alone.
        assert!(laws > 1 || about.law.is_none(), "{kind:?}");
        assert_eq!(Kind::from_name(about.name, about.law), Some(kind));
        for text in [
            about.title,
            about.equation,
            about.source,
            about.signature,
            about.leaves_out,
        ] {
            assert!(text.len() > 3 && !text.ends_with('.'), "{kind:?}: {text}");
        }
        assert!(about.gains.len() <= GAINS && about.shapes.len() <= SHAPES);
        assert!(
            !about.confused.is_empty() && !about.needs.is_empty(),
            "{kind:?}"
        );
        let mut names = HashSet::from(["kind", "joint", "law", "other"]);
        for p in about.gains.iter().chain(about.shapes) {
            assert!(names.insert(p.name), "{kind:?}: {}", p.name);
            assert!(p.unit.is_ascii() && !p.meaning.is_empty());
            assert!(
                p.bounds[0] <= p.range[0] && p.range[0] < p.range[1] && p.range[1] <= p.bounds[1]
            );
            let searchable = match p.scale {
                Scale::Linear => true,
                Scale::Logarithmic => p.range[0] > 0.0,
                Scale::Whole => p.range.iter().all(|end| end.fract() == 0.0),
            };
            assert!(searchable, "{kind:?}: {}", p.name);
        }
        // Only effects between motor and link have no torque of their own.
        assert_eq!(
            about.gains.is_empty(),
            about.channel == Channel::Transmission
        );
        assert_eq!(
            kind.transmission(&[1.0; SHAPES]).is_some(),
            about.channel == Channel::Transmission
        );
        for c in about.confused {
            assert!(
                Kind::from_name(c.with, None).is_some() && c.with != about.name,
                "{kind:?}"
            );
            assert!(!c.separated_by.is_empty());
            let back = Kind::ALL.iter().any(|k| {
                let other = k.about();
                other.name == c.with
                    && other
                        .confused
                        .iter()
                        .any(|d| d.with == about.name && d.exact)
            });
            assert_eq!(c.exact, back, "{} and {}", about.name, c.with);
        }
    }
}

#[test]
fn an_effect_takes_its_values_in_their_order_and_zero_beyond() {
    let effect = Effect::new(Kind::Cogging, &[0.3, -0.2], &[14.0]);
    assert_eq!(effect.kind, Kind::Cogging);
    assert_eq!(effect.gains, [0.3, -0.2, 0.0, 0.0]);
    assert_eq!(effect.shapes, [14.0, 0.0, 0.0, 0.0]);
    // A gear that is described by shapes alone has no gain.
    let gear = Effect::new(Kind::JointElasticity, &[], &[2.0e3, 4.0, 0.5]);
    assert_eq!(gear.gains, [0.0; GAINS]);
    assert_eq!(gear.shapes, [2.0e3, 4.0, 0.5, 0.0]);
}

#[test]
fn terms_beyond_the_gains_are_zero_and_no_gain_is_without_a_term() {
    let at = Instant {
        position: 0.7,
        velocity: -0.4,
        acceleration: 2.0,
        direction: -1.0,
        motor_angle: 35.2,
        drive_torque: 3.0,
        drive_rate: 7.0,
        load: 2.5,
        friction: -0.4,
        gravity: 6.0,
        time: 40.0,
        temperature_rise: 8.0,
        other: [0.3, 0.6, -1.5],
        extra_friction_ratio: 0.2,
        period: 1e-3,
        travel: -0.4e-3,
    };
    for &kind in Kind::ALL {
        let effect = example(kind);
        let terms = kind.terms(&effect.shapes, &mut [0.0; MEMORY], &at);
        for (k, term) in terms.iter().enumerate() {
            assert!(term.is_finite(), "{kind:?}");
            assert_eq!(*term != 0.0, k < kind.gains(), "{kind:?} {k}: {term}");
        }
    }
}

#[test]
fn dry_friction_turns_with_the_direction_and_the_rest_does_not_know_it() {
    let moving = along(&[0.30, 0.31], 1e-2)[0];
    for &kind in Kind::ALL {
        let effect = example(kind);
        let torque = |direction| {
            let at = Instant {
                direction,
                ..moving
            };
            effect.torque(&mut Memory::default(), &at)
        };
        let dry = kind.about().direction == Direction::Dry;
        if dry && kind != Kind::AsymmetricCoulomb {
            // The hidden state does not depend on the direction; the rest is odd in it.
            let even = torque(1.0) + torque(-1.0) - 2.0 * torque(0.0);
            assert!(even.abs() < 1e-12, "{kind:?}");
        }
        assert_eq!(
            torque(1.0) != torque(-1.0),
            dry && kind != Kind::AsymmetricCoulomb,
            "{kind:?}"
        );
    }
    let asymmetric = example(Kind::AsymmetricCoulomb);
    let at = Instant {
        direction: 0.0,
        ..moving
    };
    assert_eq!(asymmetric.torque(&mut Memory::default(), &at), 0.0);
}

proptest! {
    /// Friction never returns energy over a closed path.
    #[test]
    fn friction_only_takes(
        a in proptest::array::uniform3(-1.0..1.0_f64),
        scale in 1e-3..1.0_f64,
        period in 1e-4..1e-2_f64,
    ) {
        let q = loop_of(a.map(|x| x * scale), 2);
        for kind in [
            Kind::Stribeck, Kind::StribeckExponential, Kind::QuadraticDrag, Kind::LoadFriction, Kind::PreslidingDahl,
            Kind::PreslidingMaxwell, Kind::PositionFriction, Kind::AsymmetricCoulomb,
        ] {
            let effect = example(kind);
            // Minimum friction of the joint itself, with which the sum is still friction.
            let coulomb: f64 = match kind {
                Kind::PreslidingMaxwell | Kind::PreslidingDahl => effect.gains.iter().sum(),
                Kind::PositionFriction => effect.gains[0].hypot(effect.gains[1]),
                Kind::AsymmetricCoulomb => effect.gains[0],
                _ => 0.0,
            };
            let lost = work(&effect, coulomb, &q, period);
            let size: f64 = q.windows(2).map(|p| (p[1] - p[0]).abs()).sum();
            prop_assert!(lost >= -1e-9 * size, "{kind:?} gives {}", -lost);
        }
    }

    /// A torque with a potential does no work over a closed path.
    #[test]
    fn conservative_torques_return_what_they_take(a in proptest::array::uniform3(-1.0..1.0_f64)) {
        let q = loop_of(a, 1);
        let way: f64 = q.windows(2).map(|p| (p[1] - p[0]).abs()).sum();
        for kind in [
            Kind::Spring, Kind::GravityTilt, Kind::Cogging, Kind::GearEccentricity, Kind::TorqueOffset,
        ] {
            let effect = example(kind);
            let lost = work(&effect, 0.0, &q, 1e-3);
            // The midpoint rule is not exact for periodic effects: 2000 motor radians in 4000 steps.
            let slack = match kind { Kind::Cogging | Kind::GearEccentricity => 1e-1, _ => 1e-6 };
            prop_assert!(lost.abs() < slack * way, "{kind:?}: {lost}");
        }
    }

    /// Presliding depends on distance, not on time, and its loops close.
    #[test]
    fn presliding_does_not_know_how_fast(a in proptest::array::uniform3(-0.05..0.05_f64)) {
        let q = loop_of(a, 1);
        for kind in [Kind::PreslidingDahl, Kind::PreslidingMaxwell] {
            let effect = example(kind);
            let state = |period| {
                let mut memory = Memory::default();
                for at in along(&q, period) {
                    effect.torque(&mut memory, &at);
                }
                memory
            };
            let (slow, fast) = (state(1e-2), state(1e-4));
            for (s, f) in slow.0.iter().zip(fast.0) {
                prop_assert!((s - f).abs() < 1e-9, "{kind:?}");
                prop_assert!(s.abs() <= 1.0);
            }
        }
    }

    /// Single precision on the controller agrees with double precision.
    #[test]
    fn single_precision_is_enough(
        position in -3.0..3.0_f64, velocity in -4.0..4.0_f64, torque in -20.0..20.0_f64,
    ) {
        let at = Instant {
            position, velocity, acceleration: 3.0 * velocity, direction: velocity.sgn(), motor_angle: 50.0 * position,
            drive_torque: torque, drive_rate: 30.0 * velocity, load: 0.8 * torque, friction: 0.3 * velocity.sgn(), gravity: 9.0, time: 60.0,
            temperature_rise: 4.0, other: [0.1, velocity, -velocity], extra_friction_ratio: 0.2, period: 1e-3, travel: 1e-3 * velocity,
        };
        let near = Instant {
            position: at.position as f32, velocity: at.velocity as f32, acceleration: at.acceleration as f32,
            direction: at.direction as f32, motor_angle: at.motor_angle as f32,
            drive_torque: at.drive_torque as f32, drive_rate: at.drive_rate as f32, load: at.load as f32, friction: at.friction as f32,
            gravity: at.gravity as f32, time: at.time as f32, temperature_rise: at.temperature_rise as f32,
            other: at.other.map(|x| x as f32), extra_friction_ratio: 0.2, period: at.period as f32, travel: at.travel as f32,
        };
        for &kind in Kind::ALL {
            let shapes = example(kind).shapes;
            let wide = kind.terms(&shapes, &mut [0.0; MEMORY], &at);
            let narrow = kind.terms(&shapes.map(|x| x as f32), &mut [0.0; MEMORY], &near);
            for (w, n) in wide.iter().zip(narrow) {
                // 150 motor radians times order 44, with a relative rounding of 2⁻²⁴.
                let slack = 1e-6 * w.abs() + 150.0 * 44.0 * 1.2e-7 * torque.abs().max(1.0);
                prop_assert!((w - f64::from(n)).abs() < slack, "{kind:?}: {w} {n}");
            }
        }
    }

    /// Continuous everywhere, except where teeth separate.
    #[test]
    fn what_a_gear_transmits_is_continuous_and_never_pulls(
        gap in 0.0..0.02_f64, twist in -0.03..0.03_f64, rate in -2.0..2.0_f64,
    ) {
        let (stiffness, damping) = (3000.0, 4.0);
        let torque = transmission_torque(gap, stiffness, damping, twist, rate);
        let bend = twist - twist.clamp(-0.5 * gap, 0.5 * gap);
        if gap > 0.0 {
            prop_assert!(torque * bend >= 0.0);
            prop_assert!(bend != 0.0 || torque == 0.0);
        }
        let quasi = transmission_torque(gap, stiffness, 0.0, twist, rate);
        let moved = transmission_torque(gap, stiffness, 0.0, twist + 1e-9, rate);
        prop_assert!((quasi - moved).abs() <= stiffness * 1.1e-9);
        // Damping dissipates: torque minus elastic part has the sign of the rate, or the teeth are apart.
        prop_assert!(torque == 0.0 || (torque - quasi) * rate >= 0.0);
    }
}

#[test]
fn inner_loops_of_the_slipping_elements_close_where_dahl_forgets() {
    // Out, an inner loop of a tenth of the stroke, and back to its start.
    let stroke = (5.0e-4_f64 * 0.2).sqrt();
    let ramp =
        |from: f64, to: f64| (1..=1000).map(move |k| from + (to - from) * f64::from(k) * 1e-3);
    let out: Vec<f64> = core::iter::once(0.0)
        .chain(ramp(0.0, 0.6 * stroke))
        .collect();
    let (top, low) = (0.6 * stroke, 0.5 * stroke);
    let inner: Vec<f64> = out
        .iter()
        .copied()
        .chain(ramp(top, low))
        .chain(ramp(low, top))
        .collect();
    let end = |kind: Kind, q: &[f64]| {
        let effect = example(kind);
        let mut memory = Memory::default();
        let states: Vec<f64> = along(q, 1e-3)
            .iter()
            .map(|at| effect.torque(&mut memory, at))
            .collect();
        *states.last().unwrap()
    };
    let closed = end(Kind::PreslidingMaxwell, &out) - end(Kind::PreslidingMaxwell, &inner);
    assert!(closed.abs() < 1e-9, "{closed}");
    let mut dahl = example(Kind::PreslidingDahl);
    dahl.shapes[0] = stroke;
    let run = |q: &[f64]| {
        let mut memory = Memory::default();
        along(q, 1e-3)
            .iter()
            .map(|at| dahl.torque(&mut memory, at))
            .last()
            .unwrap()
    };
    assert!((run(&out) - run(&inner)).abs() > 1e-3 * dahl.gains[0]);
}

#[test]
fn sliding_on_leaves_only_coulomb_and_breakaway() {
    // Far beyond the stroke the state equals the direction, so presliding adds nothing to Coulomb friction.
    let q: Vec<f64> = (0..=5000).map(|k| 1e-3 * f64::from(k)).collect();
    for kind in [
        Kind::PreslidingDahl,
        Kind::PreslidingMaxwell,
        Kind::PreslidingLugre,
    ] {
        let effect = example(kind);
        let mut memory = Memory::default();
        let last = along(&q, 1e-3)
            .iter()
            .map(|at| effect.torque(&mut memory, at))
            .last()
            .unwrap();
        let expected = match kind {
            Kind::PreslidingLugre => {
                effect.gains[0] * effect.shapes[1] * (-(1.0 / effect.shapes[2]).powi(2)).exp()
            }
            _ => 0.0,
        };
        assert!((last - expected).abs() < 1e-9, "{kind:?}: {last}");
    }
}

#[test]
fn a_saturated_motor_is_the_textbook_torque_constant() {
    // The joint gets Kt(1 − b·i²)·i·ratio; the effect is the missing part.
    let (constant, ratio, current, b) = (0.05, 50.0, 6.0, 2.0e-3);
    let mut effect = example(Kind::TorqueSaturation);
    effect.gains[0] = b / (constant * ratio * constant * ratio);
    let at = Instant {
        drive_torque: constant * ratio * current,
        ..Instant::default()
    };
    let lacking = effect.torque(&mut Memory::default(), &at);
    let got = constant * (1.0 - b * current * current) * current * ratio;
    assert!((at.drive_torque - lacking - got).abs() < 1e-12);
}

/// The load friction also depends on the link's friction: it adds if the motor drives the load, and subtracts if the
/// load drives the motor.
#[test]
fn a_gear_that_carries_friction_loses_more_driving_than_driven() {
    let (coefficient, share, dry, load) = (0.1, 0.25, 0.8, 3.0);
    let lost = |direction: f64, share: f64| {
        let at = Instant {
            direction,
            load,
            friction: dry * direction,
            ..Instant::default()
        };
        let law = Effect::new(Kind::LoadFriction, &[coefficient], &[share]);
        law.torque(&mut Memory::default(), &at)
    };
    let [up, down] = [1.0, -1.0].map(|direction| lost(direction, share));
    assert!((up - coefficient * (load + share * dry)).abs() < 1e-12);
    assert!((down + coefficient * (load - share * dry)).abs() < 1e-12);
    // With all friction before the gear both directions are alike.
    assert!((lost(1.0, 0.0) + lost(-1.0, 0.0)).abs() < 1e-12);
}

/// The deflection goes from one direction to the other, evenly if all elements are alike, and no farther.
#[test]
fn a_contact_is_bent_from_one_direction_to_the_other() {
    for kind in [
        Kind::PreslidingDahl,
        Kind::PreslidingLugre,
        Kind::PreslidingMaxwell,
    ] {
        assert!(kind.is_presliding() && !kind.acts_through_contact());
        let effect = example(kind);
        let mut memory = Memory::default();
        assert_eq!(effect.contact_deflection(&memory, 0.0), 0.0);
        let mut along = |velocity: f64, count: usize| -> Vec<f64> {
            let at = Instant {
                velocity,
                direction: velocity.sgn(),
                period: 1e-3,
                travel: velocity * 1e-3,
                ..Instant::default()
            };
            let mut step = || {
                effect.torque(&mut memory, &at);
                effect.contact_deflection(&memory, 0.0)
            };
            (0..count).map(|_| step()).collect()
        };
        let forth = along(0.5, 4000);
        let back = along(-0.5, 4000);
        assert!((forth[3999] - 1.0).abs() < 1e-6 && (back[3999] + 1.0).abs() < 1e-6);
        assert!(forth.windows(2).all(|pair| pair[0] <= pair[1]), "{kind:?}");
        assert!(back.windows(2).all(|pair| pair[0] >= pair[1]), "{kind:?}");
    }
}

/// Ten thousand times a second for ten minutes in single precision: the increment of a tick is below the last digit.
#[test]
fn heat_is_stored_on_a_chip_as_it_is_on_a_desktop() {
    let (period, time_constant, velocity, friction) = (1e-4, 600.0, 0.5, 0.8);
    let at = Instant {
        velocity: velocity as f32,
        friction: friction as f32,
        period: period as f32,
        ..Instant::default()
    };
    let law = Effect::new(Kind::ViscousWarmupHeat, &[1.0_f32], &[time_constant as f32]);
    let mut memory = Memory::default();
    let mut torque = 0.0;
    let ticks = (time_constant / period) as usize;
    for _ in 0..ticks {
        torque = law.torque(&mut memory, &at);
    }
    let warm = friction * velocity * (1.0 - (-1.0_f64).exp());
    let expected = -velocity * warm;
    assert!(
        (f64::from(torque) / expected - 1.0).abs() < 1e-3,
        "{torque} {expected}"
    );
}

/// After a pause the heat has decayed as in a joint at rest, and a distance is forgotten.
#[test]
fn heat_outlasts_a_pause_and_nothing_else_does() {
    for &kind in Kind::ALL {
        let law = example(kind);
        let at = |velocity: f64| Instant {
            velocity,
            direction: velocity.sgn(),
            friction: 0.5 * velocity.sgn(),
            time: 30.0,
            period: 1e-3,
            travel: velocity * 1e-3,
            ..Instant::default()
        };
        let mut memory = Memory::default();
        for _ in 0..20_000 {
            law.torque(&mut memory, &at(0.7));
        }
        let paused = law.after_pause(memory, 3.0);
        if kind != Kind::ViscousWarmupHeat {
            assert_eq!(paused, Memory::default(), "{kind:?}");
            continue;
        }
        let warm = memory.0[0];
        for _ in 0..3000 {
            law.torque(&mut memory, &at(0.0));
        }
        assert!(warm > 0.0 && paused.0[0] < warm);
        assert!((paused.0[0] / memory.0[0] - 1.0).abs() < 1e-3);
    }
}

/// Reference: springs of constant stiffness, each of which slips at its share of the total friction. Friction that
/// falls with speed then bends them farther than a contact of its own.
#[test]
fn other_friction_bends_the_contact_farther() {
    let (gains, stroke, dry) = ([0.2, 0.1, 0.15, 0.05], 0.01, 0.5);
    let (falling, speed) = (0.3, 0.2);
    let law = Effect::new(Kind::PreslidingMaxwell, &gains, &[stroke]);
    let stribeck = Effect::new(Kind::Stribeck, &[falling], &[speed]);
    let period = 1e-4;
    let off = |widened: bool| {
        let (mut memory, mut force) = (Memory::default(), [0.0; 4]);
        let (mut squares, mut extra_friction_ratio) = (0.0, 0.0);
        for k in 0..40_000 {
            let t = f64::from(k) * period;
            // Slow loops within a fast one.
            let velocity = 0.5 * (2.0 * t).sin() + 0.3 * (9.0 * t).cos();
            let at = Instant {
                velocity,
                direction: velocity.sgn(),
                period,
                travel: velocity * period,
                extra_friction_ratio: if widened { extra_friction_ratio } else { 0.0 },
                ..Instant::default()
            };
            let presliding = law.torque(&mut memory, &at);
            let whole = stribeck.torque(
                &mut Memory::default(),
                &Instant {
                    direction: 1.0,
                    ..at
                },
            );
            extra_friction_ratio = whole / dry;
            let found = dry * velocity.sgn()
                + presliding
                + whole * law.contact_deflection(&memory, at.extra_friction_ratio);
            let limit = 1.0 + whole / dry;
            for (k, force) in force.iter_mut().enumerate() {
                let yields = stroke * 2.0_f64.powi(k as i32 - 3);
                let held = *force + gains[k] / yields * velocity * period;
                *force = held.clamp(-gains[k] * limit, gains[k] * limit);
            }
            squares += (found - force.iter().sum::<f64>()).powi(2);
        }
        (squares / 40_000.0).sqrt()
    };
    let [widened, plain] = [true, false].map(off);
    assert!(
        widened < 0.003 * dry && widened < 0.05 * plain,
        "{widened} {plain}"
    );
}

/// A contact is bent fast, where friction that falls with speed is small, and released slowly, where it is large. It
/// returns only the energy that it has taken.
#[test]
fn friction_through_a_contact_never_gives_more_than_it_has_taken() {
    let (dry, falling, speed, stroke) = (0.46, 0.9, 0.12, 0.008);
    let laws = [
        Effect::new(Kind::PreslidingDahl, &[dry], &[stroke]),
        Effect::new(Kind::PreslidingMaxwell, &[dry / 4.0; 4], &[stroke]),
        Effect::new(Kind::PreslidingLugre, &[dry, 0.0], &[stroke, 0.0, speed]),
    ];
    let period = 1e-5;
    let cycle = |law: &Effect<f64>, reach: f64, kept: bool| {
        let (mut memory, mut extra_friction_ratio) = (Memory::default(), 0.0);
        let (mut taken, mut turned) = (0.0, 0.0);
        for _ in 0..6 {
            (taken, turned) = (0.0, 0.0);
            for velocity in [0.5, -0.01] {
                let more = falling * (-f64::powi(velocity / speed, 2)).exp() / dry;
                for _ in 0..(reach / f64::abs(velocity) / period) as usize {
                    if !kept {
                        // A contact that keeps its share instead would be stretched without work.
                        memory.0 = memory
                            .0
                            .map(|state| state * (1.0 + more) / (1.0 + extra_friction_ratio));
                    }
                    extra_friction_ratio = more;
                    let at = Instant {
                        velocity,
                        period,
                        travel: velocity * period,
                        extra_friction_ratio,
                        ..Instant::default()
                    };
                    law.torque(&mut memory, &at);
                    let torque =
                        dry * (1.0 + more) * law.contact_deflection(&memory, extra_friction_ratio);
                    taken += torque * velocity * period;
                    turned += f64::abs(torque * velocity) * period;
                }
            }
        }
        taken / turned
    };
    for law in &laws {
        for reach in [2e-4, 1e-3, 4e-3] {
            let share = cycle(law, reach, true);
            assert!(share > -1e-3, "{:?} {reach}: {share}", law.kind);
        }
        assert!(cycle(law, 1e-3, false) < -0.05, "{:?}", law.kind);
    }
}
