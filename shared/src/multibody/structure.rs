//! Tests of general properties of the equations of motion: symmetry, definiteness, passivity, energy balance, and
//! agreement of the functions with one another and between precisions.
#![allow(clippy::unwrap_used)]

use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use super::samples::{Sample, relative_difference};
use super::*;
use crate::dual::Dual;

fn torque(sample: &Sample, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let mut tau = vec![f64::NAN; sample.n()];
    inverse_dynamics(&sample.chain(), &sample.parameters, q, qd, qdd, &mut tau).unwrap();
    tau
}

fn matrix(sample: &Sample, q: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; sample.n() * sample.n()];
    inertia_matrix(&sample.chain(), &sample.parameters, q, &mut out).unwrap();
    out
}

fn coriolis(sample: &Sample, qd: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; sample.n() * sample.n()];
    coriolis_matrix(&sample.chain(), &sample.parameters, &sample.q, qd, &mut out).unwrap();
    out
}

fn times(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    matrix
        .chunks_exact(x.len())
        .map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum())
        .collect()
}

/// Returns the derivative of a vector function at 0 by central differences of sixth order. Truncation and rounding are
/// both near 1e-11 of the function at this step for signals of a few rad/s.
fn derivative(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let h = 2e-3;
    let mut total = vec![0.0; f(0.0).len()];
    for (steps, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
        let (ahead, behind) = (f(steps * h), f(-steps * h));
        for ((t, a), b) in total.iter_mut().zip(ahead).zip(behind) {
            *t += weight * (a - b) / (60.0 * h);
        }
    }
    total
}

/// Returns a chain of dual numbers with its parameters.
fn dual(s: &Sample) -> (Chain<Dual<f64, 1>>, Vec<[Dual<f64, 1>; COLUMNS]>) {
    let parameters = s.parameters.iter().map(|row| row.map(Dual::constant));
    (
        Chain::new(&s.geometry, s.gravity).unwrap(),
        parameters.collect(),
    )
}

/// Returns values with their derivatives in one direction.
fn with_slope(values: &[f64], slope: &[f64]) -> Vec<Dual<f64, 1>> {
    let pairs = values.iter().zip(slope);
    pairs
        .map(|(&value, &s)| Dual {
            value,
            derivative: [s],
        })
        .collect()
}

/// Returns exact derivatives of the inertia matrix: by every joint's position, and by time.
fn slopes(s: &Sample) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (chain, parameters) = dual(s);
    let n = s.n();
    let along = |direction: &[f64]| -> Vec<f64> {
        let mut out = vec![Dual::constant(f64::NAN); n * n];
        inertia_matrix(&chain, &parameters, &with_slope(&s.q, direction), &mut out).unwrap();
        out.iter().map(|x| x.derivative[0]).collect()
    };
    let by_joint = (0..n)
        .map(|k| {
            let mut unit = vec![0.0; n];
            unit[k] = 1.0;
            along(&unit)
        })
        .collect();
    (by_joint, along(&s.qd))
}

/// Returns the exact rate of a function of q and q̇ along the motion.
fn along_motion(
    s: &Sample,
    f: impl Fn(&Chain<Dual<f64, 1>>, &[Dual<f64, 1>], &[Dual<f64, 1>], &mut [Dual<f64, 1>]),
    length: usize,
) -> Vec<f64> {
    let mut out = vec![Dual::constant(f64::NAN); length];
    let (q, qd) = (with_slope(&s.q, &s.qd), with_slope(&s.qd, &s.qdd));
    f(&dual(s).0, &q, &qd, &mut out);
    out.iter().map(|x| x.derivative[0]).collect()
}

fn moved(q: &[f64], direction: &[f64], by: f64) -> Vec<f64> {
    q.iter().zip(direction).map(|(q, d)| q + by * d).collect()
}

fn sample() -> impl Strategy<Value = Sample> {
    (1..=8_usize, any::<u64>()).prop_map(|(n, seed)| Sample::random(n, seed))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_algorithm: prop::test_runner::RngAlgorithm::ChaCha,
        rng_seed: prop::test_runner::RngSeed::Fixed(20), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn torque_is_linear_in_the_parameters(s in sample()) {
        let n = s.n();
        let mut y = vec![f64::NAN; n * n * COLUMNS];
        differential_regressor(&s.chain(), &s.q, &s.qd, &s.qdd, &mut y).unwrap();
        // Any numbers serve here, even those of no real body.
        let mut odd = s.clone();
        for (k, row) in odd.parameters.iter_mut().enumerate() {
            for (c, value) in row.iter_mut().enumerate() {
                *value = ((k * COLUMNS + c) as f64 * 1.7).sin() - 0.3 * *value;
            }
        }
        let by_row = y
            .chunks_exact(n * COLUMNS)
            .map(|row| row.iter().zip(odd.parameters.as_flattened()).map(|(y, p)| y * p).sum())
            .collect::<Vec<f64>>();
        prop_assert!(relative_difference(&by_row, &torque(&odd, &s.q, &s.qd, &s.qdd)) < 1e-13);
    }

    #[test]
    fn inertia_matrix_is_the_torque_of_unit_accelerations(s in sample()) {
        let n = s.n();
        let a = matrix(&s, &s.q);
        let still = vec![0.0; n];
        let rest = torque(&s, &s.q, &still, &still);
        for k in 0..n {
            let mut unit = still.clone();
            unit[k] = 1.0;
            let column = torque(&s, &s.q, &still, &unit);
            let column: Vec<f64> = column.iter().zip(&rest).map(|(t, r)| t - r).collect();
            let found: Vec<f64> = (0..n).map(|j| a[j * n + k]).collect();
            prop_assert!(relative_difference(&found, &column) < 1e-12);
        }
    }

    #[test]
    fn inertia_matrix_is_symmetric_and_positive_definite(s in sample()) {
        let (n, a) = (s.n(), matrix(&s, &s.q));
        for j in 0..n {
            for k in 0..n {
                prop_assert_eq!(a[j * n + k], a[k * n + j]);
            }
        }
        // xᵀ·A·x is twice the kinetic energy, which another recursion computes; positive for x ≠ 0.
        let quadratic: f64 = times(&a, &s.qd).iter().zip(&s.qd).map(|(p, x)| p * x).sum();
        let energy = kinetic_energy(&s.chain(), &s.parameters, &s.q, &s.qd).unwrap();
        prop_assert!(energy > 0.0);
        prop_assert!((quadratic - 2.0 * energy).abs() < 1e-12 * energy.max(1.0));
    }

    #[test]
    fn coriolis_matrix_is_that_of_the_christoffel_symbols(s in sample()) {
        // c_jk = Σ ½(∂A_jk/∂q_i + ∂A_ji/∂q_k − ∂A_ki/∂q_j)·q̇_i, with the derivatives by differences.
        let n = s.n();
        let partial: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let mut unit = vec![0.0; n];
                unit[i] = 1.0;
                derivative(|t| matrix(&s, &moved(&s.q, &unit, t)))
            })
            .collect();
        let mut expected = vec![0.0; n * n];
        for j in 0..n {
            for k in 0..n {
                for i in 0..n {
                    expected[j * n + k] += 0.5 * s.qd[i]
                        * (partial[i][j * n + k] + partial[k][j * n + i] - partial[j][k * n + i]);
                }
            }
        }
        let difference = relative_difference(&coriolis(&s, &s.qd), &expected);
        prop_assert!(difference < 1e-8, "{difference:e}");
    }

    #[test]
    fn rate_of_inertia_less_twice_coriolis_is_skew(s in sample()) {
        let n = s.n();
        let rate = derivative(|t| matrix(&s, &moved(&s.q, &s.qd, t)));
        let c = coriolis(&s, &s.qd);
        let scale = rate.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        for j in 0..n {
            for k in 0..n {
                let skew = rate[j * n + k] - 2.0 * c[j * n + k];
                let mirror = rate[k * n + j] - 2.0 * c[k * n + j];
                prop_assert!((skew + mirror).abs() < 1e-8 * scale, "{:e}", (skew + mirror) / scale);
            }
        }
    }

    #[test]
    fn the_parts_add_up_to_the_torque(s in sample()) {
        let chain = s.chain();
        let mut gravity = vec![f64::NAN; s.n()];
        gravity_vector(&chain, &s.parameters, &s.q, &mut gravity).unwrap();
        let mut bias = vec![f64::NAN; s.n()];
        bias_torque(&chain, &s.parameters, &s.q, &s.qd, &mut bias).unwrap();
        let velocity = times(&coriolis(&s, &s.qd), &s.qd);
        let inertial = times(&matrix(&s, &s.q), &s.qdd);
        let parts: Vec<f64> = (0..s.n())
            .map(|j| {
                let row = s.parameters[j];
                gravity[j] + velocity[j] + row[column::VISCOUS] * s.qd[j]
                    + row[column::COULOMB] * s.qd[j].signum() + row[column::OFFSET]
            })
            .collect();
        prop_assert!(relative_difference(&parts, &bias) < 1e-12);
        let total: Vec<f64> = parts.iter().zip(&inertial).map(|(p, i)| p + i).collect();
        prop_assert!(relative_difference(&total, &torque(&s, &s.q, &s.qd, &s.qdd)) < 1e-12);
    }

    #[test]
    fn gravity_torque_is_the_slope_of_the_potential(s in sample()) {
        let chain = s.chain();
        let mut gravity = vec![f64::NAN; s.n()];
        gravity_vector(&chain, &s.parameters, &s.q, &mut gravity).unwrap();
        let slope: Vec<f64> = (0..s.n())
            .map(|k| {
                let mut unit = vec![0.0; s.n()];
                unit[k] = 1.0;
                derivative(|t| {
                    let q = moved(&s.q, &unit, t);
                    vec![potential_energy(&chain, &s.parameters, &q).unwrap()]
                })[0]
            })
            .collect();
        prop_assert!(relative_difference(&slope, &gravity) < 1e-9);
    }

    #[test]
    fn forward_dynamics_undoes_inverse_dynamics(s in sample()) {
        let tau = torque(&s, &s.q, &s.qd, &s.qdd);
        let mut found = vec![f64::NAN; s.n()];
        forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &tau, &mut found).unwrap();
        // The accelerations carry the rounding of τ times the condition of A, so τ itself is compared.
        let again = torque(&s, &s.q, &s.qd, &found);
        prop_assert!(relative_difference(&again, &tau) < 1e-11);
        prop_assert!(relative_difference(&found, &s.qdd) < 1e-7);
    }

    #[test]
    fn articulated_bodies_give_the_accelerations_of_composite_bodies(s in sample()) {
        let tau = torque(&s, &s.q, &s.qd, &s.qdd);
        let mut found = vec![f64::NAN; s.n()];
        articulated_forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &tau, &mut found).unwrap();
        prop_assert!(relative_difference(&torque(&s, &s.q, &s.qd, &found), &tau) < 1e-10);
        let mut composite = vec![f64::NAN; s.n()];
        forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &tau, &mut composite).unwrap();
        prop_assert!(relative_difference(&found, &composite) < 1e-7);
        prop_assert!(relative_difference(&found, &s.qdd) < 1e-7);
    }

    #[test]
    fn velocity_coefficients_are_the_derivatives_of_the_inertia_matrix(s in sample()) {
        // The formulas of the entries, with exact derivatives of A by dual numbers, one direction per joint.
        let n = s.n();
        let (slope, _) = slopes(&s);
        let pairs = n * (n - 1) / 2;
        let (mut b, mut c) = (vec![f64::NAN; n * pairs], vec![f64::NAN; n * n]);
        velocity_coefficients(&s.chain(), &s.parameters, &s.q, &mut b, &mut c).unwrap();
        let a = |i: usize, j: usize, by: usize| slope[by][i * n + j];
        let (mut expected_b, mut expected_c) = (Vec::new(), Vec::new());
        for i in 0..n {
            for j in 0..n {
                expected_c.push(a(i, j, j) - 0.5 * a(j, j, i));
                for k in j + 1..n {
                    prop_assert_eq!(pair_column(n, j, k), expected_b.len() - i * pairs);
                    expected_b.push(a(i, j, k) + a(i, k, j) - a(j, k, i));
                }
            }
        }
        prop_assert!(relative_difference(&b, &expected_b) < 1e-12);
        prop_assert!(relative_difference(&c, &expected_c) < 1e-12);
        // The coefficients give the torque of the Coriolis matrix.
        let products: Vec<f64> = (0..n)
            .flat_map(|j| (j + 1..n).map(move |k| (j, k)))
            .map(|(j, k)| s.qd[j] * s.qd[k])
            .collect();
        let squares: Vec<f64> = s.qd.iter().map(|w| w * w).collect();
        let found: Vec<f64> = (0..n)
            .map(|i| {
                let dot = |m: &[f64], x: &[f64]| m.iter().zip(x).map(|(m, x)| m * x).sum::<f64>();
                dot(&b[i * pairs..(i + 1) * pairs], &products) + dot(&c[i * n..(i + 1) * n], &squares)
            })
            .collect();
        prop_assert!(relative_difference(&found, &times(&coriolis(&s, &s.qd), &s.qd)) < 1e-12);
    }

    #[test]
    fn rate_of_inertia_less_twice_coriolis_is_skew_to_rounding(s in sample()) {
        let n = s.n();
        let (_, rate) = slopes(&s);
        let c = coriolis(&s, &s.qd);
        let scale = rate.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        for j in 0..n {
            for k in 0..n {
                let skew = rate[j * n + k] - 2.0 * c[j * n + k];
                let mirror = rate[k * n + j] - 2.0 * c[k * n + j];
                prop_assert!((skew + mirror).abs() < 1e-12 * scale, "{:e}", (skew + mirror) / scale);
            }
        }
    }

    #[test]
    fn power_regressor_is_the_power_of_the_torques(s in sample()) {
        let chain = s.chain();
        let width = chain.parameter_count();
        let mut row = vec![f64::NAN; width];
        power_regressor(&chain, &s.q, &s.qd, &s.qdd, &mut row).unwrap();
        let mut y = vec![f64::NAN; s.n() * width];
        differential_regressor(&chain, &s.q, &s.qd, &s.qdd, &mut y).unwrap();
        let expected: Vec<f64> = (0..width)
            .map(|c| (0..s.n()).map(|j| s.qd[j] * y[j * width + c]).sum())
            .collect();
        prop_assert!(relative_difference(&row, &expected) < 1e-13);
        // The exact rate of the energy's row, by dual numbers, plus the friction's row.
        let rate = along_motion(&s, |chain, q, qd, out| energy_regressor(chain, q, qd, out).unwrap(), width);
        let mut friction = vec![f64::NAN; width];
        friction_power_regressor(&chain, &s.qd, &mut friction).unwrap();
        let total: Vec<f64> = rate.iter().zip(&friction).map(|(r, f)| r + f).collect();
        prop_assert!(relative_difference(&row, &total) < 1e-12);
    }

    #[test]
    fn rate_of_momentum_and_losses_make_the_differential_regressor(s in sample()) {
        let (chain, n) = (s.chain(), s.n());
        let length = n * chain.parameter_count();
        let rate = along_motion(&s, |chain, q, qd, out| momentum_regressor(chain, q, qd, out).unwrap(), length);
        let mut rest = vec![f64::NAN; length];
        momentum_loss_regressor(&chain, &s.q, &s.qd, &mut rest).unwrap();
        let mut y = vec![f64::NAN; length];
        differential_regressor(&chain, &s.q, &s.qd, &s.qdd, &mut y).unwrap();
        let total: Vec<f64> = rate.iter().zip(&rest).map(|(r, l)| r + l).collect();
        prop_assert!(relative_difference(&total, &y) < 1e-12);
        // The momentum equals that of the inertia matrix.
        let mut p = vec![f64::NAN; length];
        momentum_regressor(&chain, &s.q, &s.qd, &mut p).unwrap();
        let momentum = times(&p, s.parameters.as_flattened());
        prop_assert!(relative_difference(&momentum, &times(&matrix(&s, &s.q), &s.qd)) < 1e-12);
    }

    #[test]
    fn a_tilted_base_is_a_turned_gravity(s in sample()) {
        // Two equal cases: a motionless first joint that turns the whole arm by β about x, and the arm itself under
        // gravity turned by −β.
        let beta = 0.7;
        let mut long = s.clone();
        long.geometry.insert(0, JointGeometry { kind: JointKind::Prismatic, alpha: beta, a: 0.3, theta: 0.0, d: -0.2 });
        long.parameters.insert(0, [0.0; COLUMNS]);
        for signal in [&mut long.q, &mut long.qd, &mut long.qdd] {
            signal.insert(0, 0.0);
        }
        let expected = torque(&long, &long.q, &long.qd, &long.qdd);
        let [x, y, z] = s.gravity;
        let (sin, cos) = beta.sin_cos();
        let turned = [x, cos * y + sin * z, cos * z - sin * y];
        let mut found = vec![f64::NAN; s.n()];
        inverse_dynamics(&s.chain().with_gravity(turned), &s.parameters, &s.q, &s.qd, &s.qdd, &mut found).unwrap();
        prop_assert!(relative_difference(&found, &expected[1..]) < 1e-12);
    }

    #[test]
    fn power_of_the_torques_feeds_energy_and_friction(s in sample()) {
        // dH/dt = q̇ᵀτ − friction power along q(t) = q + q̇·t + ½·q̈·t², by the rows of the integral model.
        let chain = s.chain();
        let pi = s.parameters.as_flattened();
        let against = |row: &[f64]| row.iter().zip(pi).map(|(h, p)| h * p).sum::<f64>();
        let rate = derivative(|t| {
            let q = moved(&moved(&s.q, &s.qd, t), &s.qdd, 0.5 * t * t);
            let qd = moved(&s.qd, &s.qdd, t);
            let mut row = vec![f64::NAN; pi.len()];
            energy_regressor(&chain, &q, &qd, &mut row).unwrap();
            vec![against(&row)]
        })[0];
        let mut row = vec![f64::NAN; pi.len()];
        friction_power_regressor(&chain, &s.qd, &mut row).unwrap();
        let lost = against(&row);
        let tau = torque(&s, &s.q, &s.qd, &s.qdd);
        let power: f64 = tau.iter().zip(&s.qd).map(|(t, w)| t * w).sum();
        let scale = tau.iter().zip(&s.qd).map(|(t, w)| (t * w).abs()).fold(1.0, f64::max);
        prop_assert!((power - rate - lost).abs() < 1e-8 * scale, "{power} against {rate} + {lost}");
    }

    #[test]
    fn single_precision_follows_double(s in sample()) {
        let chain = Chain::<f32>::new(&s.geometry, s.gravity).unwrap();
        let narrow = |v: &[f64]| v.iter().map(|&x| x as f32).collect::<Vec<_>>();
        let wide = |v: &[f32]| v.iter().map(|&x| f64::from(x)).collect::<Vec<_>>();
        // The double side gets the rounded inputs, so that only the arithmetic differs.
        let (q, qd, qdd) = (narrow(&s.q), narrow(&s.qd), narrow(&s.qdd));
        let mut found = vec![f32::NAN; s.n() * s.n() * COLUMNS];
        differential_regressor(&chain, &q, &qd, &qdd, &mut found).unwrap();
        let mut expected = vec![f64::NAN; found.len()];
        differential_regressor(&s.chain(), &wide(&q), &wide(&qd), &wide(&qdd), &mut expected).unwrap();
        let difference = relative_difference(&wide(&found), &expected);
        prop_assert!(difference < 2e-5, "{difference:e}");
    }
}

#[test]
fn the_longest_chain_works() {
    let s = Sample::random(MAX_JOINTS, 3);
    let tau = torque(&s, &s.q, &s.qd, &s.qdd);
    let mut found = vec![f64::NAN; s.n()];
    forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &tau, &mut found).unwrap();
    assert!(relative_difference(&torque(&s, &s.q, &s.qd, &found), &tau) < 1e-10);
    articulated_forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &tau, &mut found).unwrap();
    assert!(relative_difference(&torque(&s, &s.q, &s.qd, &found), &tau) < 1e-10);
    let mut y = vec![f64::NAN; s.n() * s.n() * COLUMNS];
    differential_regressor(&s.chain(), &s.q, &s.qd, &s.qdd, &mut y).unwrap();
    let again: Vec<f64> = times(&y, s.parameters.as_flattened());
    assert!(relative_difference(&again, &tau) < 1e-13);
}

#[test]
fn a_body_that_cannot_exist_is_named() {
    let mut s = Sample::random(3, 1).links_only();
    s.parameters[2] = [0.0; COLUMNS];
    s.parameters[2][column::MASS] = -5.0;
    s.parameters[2][column::DRIVE_INERTIA] = -5.0;
    let mut qdd = [7.0; 3];
    let result = forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &[0.0; 3], &mut qdd);
    assert!(
        matches!(result, Err(MultibodyError::NotPositiveDefinite { .. })),
        "{result:?}"
    );
    assert_eq!(qdd, [7.0; 3]);
    s.parameters[2][column::MASS] = f64::NAN;
    let result = forward_dynamics(&s.chain(), &s.parameters, &s.q, &s.qd, &[0.0; 3], &mut qdd);
    assert!(
        matches!(result, Err(MultibodyError::NotPositiveDefinite { .. })),
        "{result:?}"
    );
}

#[test]
fn wrong_lengths_are_named_and_nothing_is_written() {
    let s = Sample::random(2, 5);
    let (chain, p) = (s.chain(), s.parameters.as_slice());
    let (two, three) = ([0.5; 2], [0.5; 3]);
    let mut out = [7.0; 56];
    let wrong = |argument, expected, found| {
        Err(MultibodyError::WrongLength {
            argument,
            expected,
            found,
        })
    };
    assert_eq!(
        differential_regressor(&chain, &two, &three, &two, &mut out),
        wrong("qd", 2, 3)
    );
    assert_eq!(
        differential_regressor(&chain, &two, &two, &two, &mut out[..55]),
        wrong("out", 56, 55)
    );
    assert_eq!(
        inverse_dynamics(&chain, &p[..1], &two, &two, &two, &mut out[..2]),
        wrong("parameters", 2, 1)
    );
    assert_eq!(
        inertia_matrix(&chain, p, &two, &mut out[..5]),
        wrong("out", 4, 5)
    );
    assert_eq!(
        coriolis_matrix(&chain, p, &three, &two, &mut out[..4]),
        wrong("q", 2, 3)
    );
    assert_eq!(
        gravity_vector(&chain, p, &two, &mut out[..1]),
        wrong("gravity", 2, 1)
    );
    assert_eq!(
        bias_torque(&chain, p, &two, &two, &mut out[..3]),
        wrong("bias", 2, 3)
    );
    assert_eq!(
        forward_dynamics(&chain, p, &two, &two, &three, &mut out[..2]),
        wrong("tau", 2, 3)
    );
    assert_eq!(
        energy_regressor(&chain, &two, &two, &mut out[..27]),
        wrong("out", 28, 27)
    );
    assert_eq!(
        friction_power_regressor(&chain, &three, &mut out[..28]),
        wrong("qd", 2, 3)
    );
    assert!(kinetic_energy(&chain, p, &two, &three).is_err());
    assert!(potential_energy(&chain, p, &three).is_err());
    assert_eq!(out, [7.0; 56]);
}

#[test]
fn chains_that_cannot_be_built_are_refused() {
    let good = Sample::random(MAX_JOINTS, 9).geometry;
    let down = [0.0, 0.0, -9.81];
    assert_eq!(
        Chain::<f64>::new(&[], down).err(),
        Some(ChainError::NoJoints)
    );
    let mut long = good.clone();
    long.push(good[0]);
    assert_eq!(
        Chain::<f64>::new(&long, down).err(),
        Some(ChainError::TooManyJoints {
            found: MAX_JOINTS + 1
        })
    );
    let mut broken = good.clone();
    broken[4].theta = f64::NAN;
    assert_eq!(
        Chain::<f64>::new(&broken, down).err(),
        Some(ChainError::GeometryNotFinite {
            joint: 4,
            parameter: "theta"
        })
    );
    assert_eq!(
        Chain::<f64>::new(&good, [0.0, f64::INFINITY, 0.0]).err(),
        Some(ChainError::GravityNotFinite)
    );
}
