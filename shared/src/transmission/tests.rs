//! Tests of the transmission by finite differences, powers and energies, on the drives of the IRp-6 and on random ones.
#![allow(clippy::unwrap_used)]

use std::vec;
use std::vec::Vec;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::dual::Dual;
use crate::lanes::Lanes;
use crate::multibody::{
    COLUMNS, Chain, JointGeometry, JointKind, bias_torque, inertia_matrix, inverse_dynamics,
};
use crate::scalar::Real;

/// Owned numbers of a drive.
#[derive(Clone, Debug)]
struct Numbers {
    ratios: Vec<f64>,
    screw: Option<([f64; 5], Vec<f64>)>,
    zero: f64,
}

fn build<T: Real>(numbers: &[Numbers]) -> Transmission<T> {
    let maps: Vec<DriveMap<'_>> = numbers
        .iter()
        .map(|d| DriveMap {
            ratios: &d.ratios,
            screw: d
                .screw
                .as_ref()
                .map(
                    |([lead, constant, cosine, sine, offset], weights)| ScrewMap {
                        lead: *lead,
                        constant: *constant,
                        cosine: *cosine,
                        sine: *sine,
                        weights,
                        offset: *offset,
                    },
                ),
            zero: d.zero,
            joint_inertia: false,
        })
        .collect();
    Transmission::new(&maps).unwrap()
}

/// The five drives of the IRp-6 (irp6_robot controller sources, RCPRG, Warsaw), lengths in m.
fn irp6() -> Vec<Numbers> {
    let ratios = |own: &[(usize, f64)]| {
        let mut row = vec![0.0; 5];
        for (j, r) in own {
            row[*j] = *r;
        }
        row
    };
    let right = core::f64::consts::FRAC_PI_2;
    let plain = |own: &[(usize, f64)], zero| Numbers {
        ratios: ratios(own),
        screw: None,
        zero,
    };
    let screw = |cosine, sine, weights: &[(usize, f64)], offset| Numbers {
        ratios: ratios(&[]),
        screw: Some(([0.005, 0.077_895_25, cosine, sine, offset], ratios(weights))),
        zero: 3.0,
    };
    let all = 128.0;
    vec![
        plain(&[(0, -158.0)], 1.0),
        screw(0.060_902_55, -0.029_346_68, &[(1, 1.0)], 0.0),
        screw(-0.0441, -0.05124, &[(1, 1.0), (2, 1.0)], right),
        plain(&[(1, -all), (2, -all), (3, -all)], -all * right),
        plain(&[(1, -all), (2, -all), (3, -all), (4, -76.8)], -7.0),
    ]
}

/// A position within the range of the IRp-6.
fn irp6_position(rng: &mut Pcg64) -> Vec<f64> {
    let mut u = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let right = core::f64::consts::FRAC_PI_2;
    let (p2, p3, p4) = (u(-2.26, -0.88), u(-0.43, 0.69), u(-1.5, 1.5));
    vec![u(-2.9, 2.9), p2, p3 - p2 - right, p4 - p3, u(-1.0, 1.0)]
}

/// Returns random drives of n joints. No screw's slope changes its sign for |q| ≤ 0.5.
fn random(n: usize, rng: &mut Pcg64) -> Vec<Numbers> {
    let mut u = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    (0..n)
        .map(|k| {
            let mut ratios: Vec<f64> = (0..n)
                .map(|_| if u(0.0, 1.0) < 0.4 { u(-0.2, 0.2) } else { 0.0 })
                .collect();
            let screw = (u(0.0, 1.0) < 0.4).then(|| {
                let mut weights = vec![0.0; n];
                weights[k] = 1.0;
                weights[u(0.0, n as f64) as usize] += 0.2;
                let (crank, arm) = (u(0.1, 0.2), u(0.3, 0.5));
                let swing = 2.0 * crank * arm;
                let constant = crank * crank + arm * arm;
                (
                    [u(0.3, 0.6), constant, swing, 0.1 * swing, u(1.2, 1.6)],
                    weights,
                )
            });
            if screw.is_none() {
                ratios[k] = if u(0.0, 1.0) < 0.5 {
                    u(1.0, 3.0)
                } else {
                    u(-3.0, -1.0)
                };
            }
            Numbers {
                ratios,
                screw,
                zero: u(-3.0, 3.0),
            }
        })
        .collect()
}

/// Returns every case with a position in its range.
fn cases() -> Vec<(Vec<Numbers>, Vec<f64>)> {
    let mut rng = Pcg64::seed_from_u64(11);
    let mut all = Vec::new();
    for _ in 0..20 {
        all.push((irp6(), irp6_position(&mut rng)));
    }
    for n in 1..=12 {
        for _ in 0..6 {
            let numbers = random(n, &mut rng);
            let q = (0..n).map(|_| rng.random_range(-0.25..0.25)).collect();
            all.push((numbers, q));
        }
    }
    all
}

fn signals(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    let scale = a.iter().chain(b).fold(1.0, |m: f64, x| m.max(x.abs()));
    assert_eq!(a.len(), b.len());
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= tolerance * scale, "{a:?} and {b:?}");
    }
}

fn position(t: &Transmission<f64>, q: &[f64]) -> Vec<f64> {
    let mut psi = vec![f64::NAN; q.len()];
    t.motor_position(q, &mut psi).unwrap();
    psi
}

#[test]
fn jacobian_is_the_derivative_of_the_position_to_rounding() {
    for (numbers, q) in cases() {
        let n = q.len();
        let mut jacobian = vec![f64::NAN; n * n];
        build::<f64>(&numbers).jacobian(&q, &mut jacobian).unwrap();
        let exact = build::<Dual<f64, 12>>(&numbers);
        let variables: Vec<_> = (0..n).map(|j| Dual::variable(q[j], j)).collect();
        let mut psi = vec![Dual::constant(0.0); n];
        exact.motor_position(&variables, &mut psi).unwrap();
        let by_dual: Vec<f64> = psi
            .iter()
            .flat_map(|p| p.derivative[..n].to_vec())
            .collect();
        close(&jacobian, &by_dual, 1e-13);
    }
}

#[test]
fn velocity_and_acceleration_are_differences_of_the_position() {
    for (numbers, q) in cases() {
        let n = q.len();
        let t = build::<f64>(&numbers);
        let (qd, qdd) = (signals(n, 1), signals(n, 2));
        // Along q(h) = q + q̇·h + q̈·h²/2; central differences of second order.
        let along = |h: f64| -> Vec<f64> {
            let at: Vec<f64> = (0..n)
                .map(|j| q[j] + qd[j] * h + 0.5 * qdd[j] * h * h)
                .collect();
            position(&t, &at)
        };
        let h = 1e-4;
        let (before, now, after) = (along(-h), along(0.0), along(h));
        let speed: Vec<f64> = (0..n).map(|k| (after[k] - before[k]) / (2.0 * h)).collect();
        let acceleration: Vec<f64> = (0..n)
            .map(|k| (after[k] - 2.0 * now[k] + before[k]) / (h * h))
            .collect();
        let (mut psid, mut psidd) = (vec![f64::NAN; n], vec![f64::NAN; n]);
        t.motor_velocity(&q, &qd, &mut psid).unwrap();
        t.motor_acceleration(&q, &qd, &qdd, &mut psidd).unwrap();
        close(&psid, &speed, 1e-6);
        // Rounding error of positions of some hundred radians, divided by h².
        close(&psidd, &acceleration, 1e-4);

        let (mut rate, mut ahead, mut behind) =
            (vec![f64::NAN; n * n], vec![0.0; n * n], vec![0.0; n * n]);
        t.jacobian_rate(&q, &qd, &mut rate).unwrap();
        let shifted = |h: f64| (0..n).map(|j| q[j] + h * qd[j]).collect::<Vec<_>>();
        t.jacobian(&shifted(1e-5), &mut ahead).unwrap();
        t.jacobian(&shifted(-1e-5), &mut behind).unwrap();
        let difference: Vec<f64> = ahead
            .iter()
            .zip(&behind)
            .map(|(a, b)| (a - b) / 2e-5)
            .collect();
        close(&rate, &difference, 1e-7);
    }
}

#[test]
fn power_is_the_same_on_both_sides() {
    for (numbers, q) in cases() {
        let n = q.len();
        let t = build::<f64>(&numbers);
        let (qd, tau_motor) = (signals(n, 3), signals(n, 4));
        let (mut tau, mut psid, mut back) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        t.joint_torque(&q, &tau_motor, &mut tau).unwrap();
        t.motor_velocity(&q, &qd, &mut psid).unwrap();
        let power = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let (joint, motor) = (power(&tau, &qd), power(&tau_motor, &psid));
        assert!((joint - motor).abs() <= 1e-12 * joint.abs().max(1000.0));
        t.motor_torque(&q, &tau, &mut back).unwrap();
        close(&back, &tau_motor, 1e-11);
        t.joint_velocity(&q, &psid, &mut back).unwrap();
        close(&back, &qd, 1e-11);
        let qdd = signals(n, 5);
        let mut psidd = vec![0.0; n];
        t.motor_acceleration(&q, &qd, &qdd, &mut psidd).unwrap();
        t.joint_acceleration(&q, &qd, &psidd, &mut back).unwrap();
        close(&back, &qdd, 1e-10);
    }
}

#[test]
fn joints_are_found_again_from_the_motors_from_a_start_nearby_and_from_far() {
    for (case, (numbers, q)) in cases().into_iter().enumerate() {
        let t = build::<f64>(&numbers);
        let psi = position(&t, &q);
        let far = if case < 20 {
            // The middle of the IRp-6's range.
            vec![0.0, -1.57, 0.13, -0.13, 0.0]
        } else {
            vec![0.0; q.len()]
        };
        let near: Vec<f64> = q.iter().map(|x| x + 0.01).collect();
        for start in [near, far, q.clone()] {
            let mut found = start;
            t.joint_position(&psi, &mut found).unwrap();
            close(&found, &q, 1e-12);
        }
    }
}

#[test]
fn the_inverse_carries_derivatives_and_runs_in_lanes() {
    let mut rng = Pcg64::seed_from_u64(5);
    let numbers = irp6();
    let t = build::<f64>(&numbers);
    let positions: Vec<Vec<f64>> = (0..4).map(|_| irp6_position(&mut rng)).collect();
    let exact = build::<Dual<f64, 5>>(&numbers);
    for q in &positions {
        // ∂q/∂Ψ = J⁻¹, also if the start is the solution.
        for start in [q.clone(), vec![0.0, -1.57, 0.13, -0.13, 0.0]] {
            let psi: Vec<_> = position(&t, q)
                .iter()
                .enumerate()
                .map(|(k, p)| Dual::<f64, 5>::variable(*p, k))
                .collect();
            let mut found: Vec<_> = start.iter().map(|x| Dual::constant(*x)).collect();
            exact.joint_position(&psi, &mut found).unwrap();
            for k in 0..5 {
                let mut unit = vec![0.0; 5];
                unit[k] = 1.0;
                let mut column = vec![0.0; 5];
                t.joint_velocity(q, &unit, &mut column).unwrap();
                let by_dual: Vec<f64> = found.iter().map(|f| f.derivative[k]).collect();
                close(&by_dual, &column, 1e-12);
            }
        }
    }
    let wide = build::<Lanes<4>>(&numbers);
    let lane = |of: &dyn Fn(usize) -> Vec<f64>| -> Vec<Lanes<4>> {
        let each: Vec<Vec<f64>> = (0..4).map(of).collect();
        (0..5)
            .map(|k| Lanes(core::array::from_fn(|l| each[l][k])))
            .collect()
    };
    let psi = lane(&|l| position(&t, &positions[l]));
    let mut q = lane(&|_| vec![0.0, -1.57, 0.13, -0.13, 0.0]);
    wide.joint_position(&psi, &mut q).unwrap();
    for (l, expected) in positions.iter().enumerate() {
        let found: Vec<f64> = q.iter().map(|x| x.0[l]).collect();
        close(&found, expected, 1e-12);
    }
    let (qd, qdd) = (
        lane(&|l| signals(5, l as u64)),
        lane(&|l| signals(5, 9 + l as u64)),
    );
    let mut columns = vec![Lanes([0.0; 4]); 75];
    wide.motor_columns(&q, &qd, &qdd, &mut columns).unwrap();
    for (l, expected) in positions.iter().enumerate() {
        let mut narrow = vec![0.0; 75];
        t.motor_columns(
            expected,
            &signals(5, l as u64),
            &signals(5, 9 + l as u64),
            &mut narrow,
        )
        .unwrap();
        let found: Vec<f64> = columns.iter().map(|x| x.0[l]).collect();
        close(&found, &narrow, 1e-11);
    }
}

#[test]
fn what_a_screw_cannot_reach_and_dead_centres_are_refused_by_name() {
    let t = build::<f64>(&irp6());
    let middle = vec![0.0, -1.57, 0.13, -0.13, 0.0];
    let mut psi = position(&t, &middle);
    // Longest screw of motor 2: √(s + √(m² + n²)) = 0.3812 m, 479 rad.
    psi[1] = 500.0;
    let mut q = middle.clone();
    assert_eq!(
        t.joint_position(&psi, &mut q),
        Err(TransmissionError::OutOfReach { motor: 1 })
    );
    assert_eq!(q, middle);
    // m·sin φ + n·cos φ = 0.
    let dead = 0.029_346_68_f64.atan2(0.060_902_55);
    for angle in [dead, dead - core::f64::consts::PI] {
        let mut at = middle.clone();
        at[1] = angle;
        let mut qd = vec![0.0; 5];
        assert_eq!(
            t.joint_velocity(&at, &[1.0; 5], &mut qd),
            Err(TransmissionError::Singular { motor: 1 })
        );
    }
    let twice = |zero| DriveMap {
        ratios: &[1.0, 1.0],
        screw: None,
        zero,
        joint_inertia: false,
    };
    let flat = Transmission::<f64>::new(&[twice(0.0), twice(1.0)]).unwrap();
    assert_eq!(
        flat.joint_position(&[0.0, 0.0], &mut [0.0, 0.0]),
        Err(TransmissionError::Singular { motor: 1 })
    );
    let idle = DriveMap {
        ratios: &[0.0, 2.0],
        screw: None,
        zero: 0.0,
        joint_inertia: false,
    };
    assert_eq!(
        Transmission::<f64>::new(&[idle, twice(0.0)]).unwrap_err(),
        TransmissionError::OwnRatioZero { motor: 0 }
    );
    assert!(matches!(
        Transmission::<f64>::new(&[]).unwrap_err(),
        TransmissionError::Count { found: 0 }
    ));
}

/// Returns motor inertia, viscous and Coulomb friction at the motors, and the parameters that follow.
fn split(
    t: &Transmission<f64>,
    q: &[f64],
    own: &[[f64; 3]],
) -> (Vec<[f64; COLUMNS]>, Vec<[f64; 3]>) {
    let n = own.len();
    let mut jacobian = vec![0.0; n * n];
    t.jacobian(q, &mut jacobian).unwrap();
    let mut joints = vec![[0.0; COLUMNS]; n];
    let mut motors = vec![[0.0; 3]; n];
    for (k, [inertia, viscous, coulomb]) in own.iter().copied().enumerate() {
        let ratio = jacobian[k * n + k];
        match t.kind(k).unwrap() {
            DriveKind::Simple => {
                joints[k][10] += ratio * ratio * inertia;
                joints[k][11] += ratio * ratio * viscous;
                joints[k][12] += ratio.abs() * coulomb;
            }
            DriveKind::Coupled => {
                motors[k] = [
                    ratio * ratio * inertia,
                    ratio * ratio * viscous,
                    ratio.abs() * coulomb,
                ];
                for i in 0..n {
                    let share = jacobian[k * n + i].powi(2);
                    joints[i][10] += if i == k { 0.0 } else { share * inertia };
                    joints[i][11] += share * viscous;
                }
            }
            DriveKind::Varying => motors[k] = [inertia, viscous, coulomb],
        }
    }
    (joints, motors)
}

#[test]
fn columns_give_the_torque_of_spinning_motors() {
    for (numbers, q) in cases() {
        let n = q.len();
        let t = build::<f64>(&numbers);
        let (qd, qdd) = (signals(n, 6), signals(n, 7));
        let own: Vec<[f64; 3]> = (0..n)
            .map(|k| [1e-4 * (k + 1) as f64, 2e-4 / (k + 1) as f64, 3e-3])
            .collect();
        let (joints, motors) = split(&t, &q, &own);
        let mut columns = vec![f64::NAN; n * 3 * n];
        t.motor_columns(&q, &qd, &qdd, &mut columns).unwrap();
        let mut tau: Vec<f64> = (0..n)
            .map(|i| {
                let [ia, fv, fc] = [joints[i][10], joints[i][11], joints[i][12]];
                let motor: f64 = columns[i * 3 * n..(i + 1) * 3 * n]
                    .iter()
                    .zip(motors.as_flattened())
                    .map(|(y, p)| y * p)
                    .sum();
                // A column that is left out must be zero.
                assert!(t.has_joint_inertia(i) || ia == 0.0);
                ia * qdd[i] + fv * qd[i] + fc * qd[i].signum() + motor
            })
            .collect();
        // Newton's law for each rotor, transformed to the joints.
        let (mut psid, mut psidd) = (vec![0.0; n], vec![0.0; n]);
        t.motor_velocity(&q, &qd, &mut psid).unwrap();
        t.motor_acceleration(&q, &qd, &qdd, &mut psidd).unwrap();
        let at_motor: Vec<f64> = (0..n)
            .map(|k| own[k][0] * psidd[k] + own[k][1] * psid[k] + own[k][2] * psid[k].signum())
            .collect();
        let mut expected = vec![0.0; n];
        t.joint_torque(&q, &at_motor, &mut expected).unwrap();
        close(&tau, &expected, 1e-12);

        // Split into what each motor takes itself and the parts that stand in the joints' parameters.
        let (mut taken, mut parts) = (vec![f64::NAN; n], vec![[f64::NAN; 2]; n]);
        t.own_motor_torque(&motors, &q, &qd, &qdd, &mut taken)
            .unwrap();
        t.joint_parts(&motors, &mut parts).unwrap();
        for k in 0..n {
            let simple = t.kind(k) == Some(DriveKind::Simple);
            let turns = if simple {
                t.own_turns(k).unwrap().powi(2)
            } else {
                0.0
            };
            let expected = if simple { 0.0 } else { at_motor[k] };
            close(&[taken[k]], &[expected], 1e-12);
            let simple_parts = [turns * own[k][0], turns * own[k][1]];
            close(
                &parts[k],
                &[
                    joints[k][10] - simple_parts[0],
                    joints[k][11] - simple_parts[1],
                ],
                1e-12,
            );
        }

        // The same through the matrices.
        let (mut mass, mut damping) = (vec![0.0; n * n], vec![0.0; n * n]);
        for i in 0..n {
            mass[i * n + i] = joints[i][10];
            damping[i * n + i] = joints[i][11];
        }
        t.add_motor_inertia(&motors, &q, &mut mass).unwrap();
        t.add_motor_viscosity(&motors, &q, &mut damping).unwrap();
        let (mut directions, mut speeds) = (vec![0.0; n * n], vec![0.0; n]);
        t.motor_directions(&q, &mut directions).unwrap();
        t.motor_speeds(&q, &qd, &mut speeds).unwrap();
        let mut rate = vec![0.0; n * n];
        t.jacobian_rate(&q, &qd, &mut rate).unwrap();
        for (i, value) in tau.iter_mut().enumerate() {
            *value = joints[i][12] * qd[i].signum();
            for j in 0..n {
                *value += mass[i * n + j] * qdd[j] + damping[i * n + j] * qd[j];
                *value += motors[j][2] * directions[j * n + i] * speeds[j].signum();
            }
            for k in 0..n {
                let spin: f64 = (0..n).map(|j| rate[k * n + j] * qd[j]).sum();
                if t.kind(k) == Some(DriveKind::Varying) {
                    *value += motors[k][0] * directions[k * n + i] * spin;
                }
            }
        }
        close(&tau, &expected, 1e-12);
    }
}

#[test]
fn energy_and_power_columns_are_those_of_the_torque_columns() {
    for (numbers, q) in cases() {
        let n = q.len();
        let t = build::<f64>(&numbers);
        let (qd, qdd) = (signals(n, 8), signals(n, 9));
        let mut torque = vec![f64::NAN; n * 3 * n];
        t.motor_columns(&q, &qd, &qdd, &mut torque).unwrap();
        let power = |c: usize| (0..n).map(|i| torque[i * 3 * n + c] * qd[i]).sum::<f64>();
        let mut friction = vec![f64::NAN; 3 * n];
        t.motor_power_columns(&q, &qd, &mut friction).unwrap();
        let energy = |h: f64| {
            let at: Vec<f64> = (0..n)
                .map(|j| q[j] + qd[j] * h + 0.5 * qdd[j] * h * h)
                .collect();
            let speed: Vec<f64> = (0..n).map(|j| qd[j] + qdd[j] * h).collect();
            let mut row = vec![f64::NAN; 3 * n];
            t.motor_energy_columns(&at, &speed, &mut row).unwrap();
            row
        };
        let (after, before) = (energy(1e-5), energy(-1e-5));
        for c in 0..3 * n {
            let scale = 1.0 + power(c).abs();
            if c % 3 == motor_column::INERTIA {
                let rate = (after[c] - before[c]) / 2e-5;
                assert!((rate - power(c)).abs() < 1e-6 * scale.max(after[c].abs()));
                assert_eq!(friction[c], 0.0);
            } else {
                assert!((friction[c] - power(c)).abs() < 1e-11 * scale);
                assert_eq!(after[c], 0.0);
            }
        }
    }
}

#[test]
fn the_coupled_wrist_has_the_columns_of_the_published_model() {
    // Stäubli TX40: Ψ5 = 45·q5, Ψ6 = 32·q5 + 32·q6. Iam6 couples q̈5 and q̈6, fvm6 the speeds, and fcm6 has the sign of
    // their sum (Gautier et al.; parameters Iam6, fvm6, fsm6).
    let t = Transmission::<f64>::new(&[
        DriveMap {
            ratios: &[45.0, 0.0],
            screw: None,
            zero: 0.0,
            joint_inertia: false,
        },
        DriveMap {
            ratios: &[32.0, 32.0],
            screw: None,
            zero: 0.0,
            joint_inertia: false,
        },
    ])
    .unwrap();
    let mut out = [f64::NAN; 12];
    t.motor_columns(&[0.0; 2], &[-3.0, 2.0], &[5.0, 7.0], &mut out)
        .unwrap();
    assert_eq!(
        out,
        [
            0.0, 0.0, 0.0, 7.0, 2.0, -1.0, 0.0, 0.0, 0.0, 12.0, -3.0, -1.0
        ]
    );
    assert_eq!(t.kind(0), Some(DriveKind::Simple));
    assert_eq!(t.kind(1), Some(DriveKind::Coupled));
    assert!(t.has_joint_inertia(0) && !t.has_joint_inertia(1));
}

#[test]
fn the_published_screw_functions_give_the_published_lengths() {
    // Synchronisation position of the Warsaw robots: 220.3374 mm and 183.8348 mm. Both lie within the screws' reach. At
    // those lengths the ratios equal the hand-derived ones of F, dL/dφ = −(m·sin φ + n·cos φ)/2L.
    let t = build::<f64>(&irp6());
    let mut q = vec![0.0, -1.57, 0.13, -0.13, 0.0];
    let mut psi = position(&t, &q);
    let turns = core::f64::consts::TAU / 0.005;
    psi[1] = turns * 0.220_337_4 + 3.0;
    psi[2] = turns * 0.183_834_8 + 3.0;
    t.joint_position(&psi, &mut q).unwrap();
    let mut jacobian = vec![0.0; 25];
    t.jacobian(&q, &mut jacobian).unwrap();
    let (p2, p3) = (q[1], q[1] + q[2] + core::f64::consts::FRAC_PI_2);
    let by_hand =
        |m: f64, n: f64, length: f64, p: f64| -turns * (m * p.sin() + n * p.cos()) / (2.0 * length);
    let second = by_hand(0.060_902_55, -0.029_346_68, 0.220_337_4, p2);
    let third = by_hand(-0.0441, -0.05124, 0.183_834_8, p3);
    close(&jacobian[5..10], &[0.0, second, 0.0, 0.0, 0.0], 1e-9);
    close(&jacobian[10..15], &[0.0, third, third, 0.0, 0.0], 1e-9);
}

/// Returns a chain with the joints of the IRp-6's first three axes and two more.
fn chain() -> (Chain<f64>, Vec<[f64; COLUMNS]>) {
    let joint = |alpha: f64, a: f64| JointGeometry {
        kind: JointKind::Revolute,
        alpha,
        a,
        theta: 0.0,
        d: 0.0,
    };
    let right = core::f64::consts::FRAC_PI_2;
    let geometry = [
        joint(0.0, 0.0),
        joint(-right, 0.0),
        joint(0.0, 0.455),
        joint(0.0, 0.67),
        joint(-right, 0.0),
    ];
    let body = |m: f64, x: f64, z: f64| {
        let mut row = [0.0; COLUMNS];
        row[..10].copy_from_slice(&[
            m,
            m * x,
            0.0,
            m * z,
            m * (z * z + 0.02),
            0.0,
            -m * x * z,
            m * (x * x + z * z + 0.03),
            0.0,
            m * (x * x + 0.01),
        ]);
        row
    };
    let parameters = vec![
        body(30.0, 0.0, 0.2),
        body(20.0, 0.2, 0.01),
        body(15.0, 0.3, 0.0),
        body(4.0, 0.02, 0.0),
        body(2.0, 0.0, 0.1),
    ];
    (
        Chain::new(&geometry, [0.0, 0.0, -9.81]).unwrap(),
        parameters,
    )
}

#[test]
fn motor_coordinates_and_joint_coordinates_tell_the_same_mechanics() {
    let (chain, parameters) = chain();
    let t = build::<f64>(&irp6());
    let mut rng = Pcg64::seed_from_u64(3);
    for draw in 0..30 {
        let q = irp6_position(&mut rng);
        let (qd, qdd) = (signals(5, draw), signals(5, 100 + draw));
        let (mut a, mut bias, mut tau) = (vec![0.0; 25], vec![0.0; 5], vec![0.0; 5]);
        inertia_matrix(&chain, &parameters, &q, &mut a).unwrap();
        bias_torque(&chain, &parameters, &q, &qd, &mut bias).unwrap();
        inverse_dynamics(&chain, &parameters, &q, &qd, &qdd, &mut tau).unwrap();
        let (mut psid, mut psidd) = (vec![0.0; 5], vec![0.0; 5]);
        t.motor_velocity(&q, &qd, &mut psid).unwrap();
        t.motor_acceleration(&q, &qd, &qdd, &mut psidd).unwrap();

        let space = MotorSpace::at(&t, &q, &qd).unwrap();
        let (mut a_psi, mut b_psi) = (vec![f64::NAN; 25], vec![f64::NAN; 5]);
        space.inertia_matrix(&a, &mut a_psi).unwrap();
        space.bias_torque(&a, &bias, &mut b_psi).unwrap();
        // Torques at the motors, computed in two ways.
        let by_motor: Vec<f64> = (0..5)
            .map(|k| b_psi[k] + (0..5).map(|l| a_psi[k * 5 + l] * psidd[l]).sum::<f64>())
            .collect();
        let mut expected = vec![0.0; 5];
        t.motor_torque(&q, &tau, &mut expected).unwrap();
        close(&by_motor, &expected, 1e-11);
        // Power and kinetic energy do not depend on the coordinates.
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
        let power = dot(&tau, &qd);
        assert!((dot(&by_motor, &psid) - power).abs() < 1e-10 * power.abs().max(100.0));
        let form = |m: &[f64], v: &[f64]| {
            let rows: Vec<f64> = m.chunks_exact(5).map(|r| dot(r, v)).collect();
            dot(&rows, v)
        };
        let energy = form(&a, &qd);
        assert!((form(&a_psi, &psid) - energy).abs() < 1e-11 * energy);
        for k in 0..5 {
            for l in 0..k {
                let (upper, lower) = (a_psi[l * 5 + k], a_psi[k * 5 + l]);
                assert!(
                    (upper - lower).abs()
                        < 1e-9 * a_psi.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
                );
            }
        }
    }
}
