//! Tests of chains with equations of motion in closed form.
#![allow(clippy::unwrap_used)]

use core::f64::consts::FRAC_PI_2;

use super::*;

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];
const G: f64 = 9.81;

fn joint(kind: JointKind, alpha: f64, a: f64) -> JointGeometry {
    JointGeometry {
        kind,
        alpha,
        a,
        theta: 0.0,
        d: 0.0,
    }
}

fn near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-13 * expected.abs().max(1.0),
        "{found} is not {expected}"
    );
}

/// τ = J·q̈ + gc·cos q + gs·sin q + fv·q̇ + fc·sgn q̇ + off with J = Izz + Ia, gc = mx·g, gs = −my·g.
#[test]
fn one_link_is_the_model_of_the_rig() {
    let chain = Chain::new(&[joint(JointKind::Revolute, FRAC_PI_2, 0.0)], DOWN).unwrap();
    let (m, mx, my, izz, ia) = (1.0, 0.3, -0.07, 0.12, 0.05);
    let (fv, fc, off) = (0.3, 0.4, -0.02);
    // Values in columns that cannot matter must not matter.
    let row = [
        m, mx, my, 0.21, 0.4, 0.02, 0.03, 0.5, 0.01, izz, ia, fv, fc, off,
    ];
    for (q, qd, qdd) in [
        (0.0, 0.0, 0.0),
        (FRAC_PI_2, 0.0, 0.0),
        (0.7, 1.3, -4.0),
        (-2.6, -0.2, 9.0),
    ] {
        let mut tau = [f64::NAN];
        inverse_dynamics(&chain, &[row], &[q], &[qd], &[qdd], &mut tau).unwrap();
        let sign = if qd == 0.0 { 0.0 } else { f64::signum(qd) };
        let expected =
            (izz + ia) * qdd + mx * G * q.cos() - my * G * q.sin() + fv * qd + fc * sign + off;
        near(tau[0], expected);
        // The columns of m, mz and the other inertias are exactly zero, not merely small.
        let mut y = [f64::NAN; COLUMNS];
        differential_regressor(&chain, &[q], &[qd], &[qdd], &mut y).unwrap();
        for k in [0, 3, 4, 5, 6, 7, 8] {
            assert_eq!(y[k], 0.0, "column {}", COLUMN_NAMES[k]);
        }
    }
}

/// A slide along the horizontal: only m·q̈, without gravity and inertia.
#[test]
fn horizontal_slide_shows_its_mass_only() {
    let chain = Chain::new(&[joint(JointKind::Prismatic, FRAC_PI_2, 0.0)], DOWN).unwrap();
    let (q, qd, qdd) = (0.31, -0.8, 2.5);
    let mut y = [f64::NAN; COLUMNS];
    differential_regressor(&chain, &[q], &[qd], &[qdd], &mut y).unwrap();
    let mut expected = [0.0; COLUMNS];
    expected[column::MASS] = qdd;
    expected[column::DRIVE_INERTIA] = qdd;
    expected[column::VISCOUS] = qd;
    expected[column::COULOMB] = -1.0;
    expected[column::OFFSET] = 1.0;
    assert_eq!(y, expected);
}

/// The same slide upright carries its weight.
#[test]
fn vertical_slide_carries_its_weight() {
    let chain = Chain::new(&[joint(JointKind::Prismatic, 0.0, 0.0)], DOWN).unwrap();
    let mut y = [f64::NAN; COLUMNS];
    differential_regressor(&chain, &[0.2], &[0.0], &[2.5], &mut y).unwrap();
    near(y[column::MASS], 2.5 + G);
    let mut row = [0.0; COLUMNS];
    row[column::MASS] = 2.0;
    near(
        potential_energy(&chain, &[row], &[0.2]).unwrap(),
        2.0 * G * 0.2,
    );
}

/// Planar elbow arm in the vertical plane (Spong, Hutchinson & Vidyasagar 2006, ch. 7, the elbow
/// manipulator): A, the Christoffel form of C, and g.
#[test]
fn planar_arm_of_two_links() {
    let (l1, lc1, lc2) = (0.6, 0.25, 0.2);
    let (m1, m2, i1, i2) = (3.0, 2.0, 0.08, 0.05);
    let chain = Chain::new(
        &[
            joint(JointKind::Revolute, FRAC_PI_2, 0.0),
            joint(JointKind::Revolute, 0.0, l1),
        ],
        DOWN,
    )
    .unwrap();
    let link = |m: f64, c: f64, i: f64| {
        let mut row = [0.0; COLUMNS];
        row[column::MASS] = m;
        row[column::FIRST_MOMENT] = m * c;
        row[column::INERTIA + 5] = i + m * c * c;
        row[column::INERTIA + 3] = m * c * c;
        row
    };
    let parameters = [link(m1, lc1, i1), link(m2, lc2, i2)];
    let (q, qd): ([f64; 2], [f64; 2]) = ([0.4, -1.1], [1.7, -2.3]);

    let d22 = m2 * lc2 * lc2 + i2;
    let d12 = m2 * (lc2 * lc2 + l1 * lc2 * q[1].cos()) + i2;
    let d11 = m1 * lc1 * lc1 + m2 * (l1 * l1 + lc2 * lc2 + 2.0 * l1 * lc2 * q[1].cos()) + i1 + i2;
    let mut a = [f64::NAN; 4];
    inertia_matrix(&chain, &parameters, &q, &mut a).unwrap();
    for (found, expected) in a.into_iter().zip([d11, d12, d12, d22]) {
        near(found, expected);
    }

    let h = -m2 * l1 * lc2 * q[1].sin();
    let mut c = [f64::NAN; 4];
    coriolis_matrix(&chain, &parameters, &q, &qd, &mut c).unwrap();
    let expected = [h * qd[1], h * (qd[0] + qd[1]), -h * qd[0], 0.0];
    for (found, expected) in c.into_iter().zip(expected) {
        near(found, expected);
    }

    let second = m2 * lc2 * G * (q[0] + q[1]).cos();
    let first = (m1 * lc1 + m2 * l1) * G * q[0].cos() + second;
    let mut g = [f64::NAN; 2];
    gravity_vector(&chain, &parameters, &q, &mut g).unwrap();
    near(g[0], first);
    near(g[1], second);
}

/// A mass that slides out on a turning arm: τ = (I + m·r²)·θ̈ + 2·m·r·ṙ·θ̇, f = m·(r̈ − r·θ̇²). A revolute joint before
/// a prismatic one shows the Coriolis force.
#[test]
fn mass_sliding_on_a_turning_arm() {
    // z of frame 2 lies along the turned x of frame 1: z₁ up, slide horizontal.
    let chain = Chain::new(
        &[
            joint(JointKind::Revolute, 0.0, 0.0),
            joint(JointKind::Prismatic, FRAC_PI_2, 0.0),
        ],
        DOWN,
    )
    .unwrap();
    let (i, m) = (0.3, 1.5);
    let mut parameters = [[0.0; COLUMNS]; 2];
    parameters[0][column::INERTIA + 5] = i;
    parameters[1][column::MASS] = m;
    let (q, qd, qdd) = ([0.9, 0.7], [2.0, -0.6], [3.0, 1.1]);
    let mut tau = [f64::NAN; 2];
    inverse_dynamics(&chain, &parameters, &q, &qd, &qdd, &mut tau).unwrap();
    let r = q[1];
    near(
        tau[0],
        (i + m * r * r) * qdd[0] + 2.0 * m * r * qd[1] * qd[0],
    );
    near(tau[1], m * (qdd[1] - r * qd[0] * qd[0]));
}
