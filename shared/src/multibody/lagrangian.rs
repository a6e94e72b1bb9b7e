//! Tests of the recursions against Lagrange's equations, derived independently: energies from 4×4 homogeneous
//! transforms and pseudo-inertia matrices (Uicker 1965), with exact derivatives by numbers with two infinitesimal
//! parts. Of the tested module only the order of the parameters is used.
#![allow(clippy::unwrap_used)]

use core::ops::{Add, Mul, Neg, Sub};
use std::vec;
use std::vec::Vec;

use super::samples::{Sample, relative_difference};
use super::{JointKind, column, inverse_dynamics};

/// x + a·ε₁ + b·ε₂ + c·ε₁ε₂ with ε₁² = ε₂² = 0: c is an exact mixed second derivative.
#[derive(Clone, Copy, Debug)]
struct HyperDual {
    x: f64,
    a: f64,
    b: f64,
    c: f64,
}

const fn real(x: f64) -> HyperDual {
    HyperDual {
        x,
        a: 0.0,
        b: 0.0,
        c: 0.0,
    }
}

impl HyperDual {
    /// Returns a function of the number, from the function's value and first two derivatives.
    fn chain(self, f: f64, df: f64, ddf: f64) -> Self {
        Self {
            x: f,
            a: df * self.a,
            b: df * self.b,
            c: df * self.c + ddf * self.a * self.b,
        }
    }
    fn sin(self) -> Self {
        let (s, c) = (self.x.sin(), self.x.cos());
        self.chain(s, c, -s)
    }
    fn cos(self) -> Self {
        let (s, c) = (self.x.sin(), self.x.cos());
        self.chain(c, -s, -c)
    }
}

impl Add for HyperDual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            x: self.x + o.x,
            a: self.a + o.a,
            b: self.b + o.b,
            c: self.c + o.c,
        }
    }
}
impl Neg for HyperDual {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            x: -self.x,
            a: -self.a,
            b: -self.b,
            c: -self.c,
        }
    }
}
impl Sub for HyperDual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}
impl Mul for HyperDual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            x: self.x * o.x,
            a: self.x * o.a + self.a * o.x,
            b: self.x * o.b + self.b * o.x,
            c: self.x * o.c + self.a * o.b + self.b * o.a + self.c * o.x,
        }
    }
}

type Matrix = [[HyperDual; 4]; 4];

const NOTHING: Matrix = [[real(0.0); 4]; 4];

fn identity() -> Matrix {
    let mut m = NOTHING;
    for k in 0..4 {
        m[k][k] = real(1.0);
    }
    m
}

fn product(p: &Matrix, q: &Matrix) -> Matrix {
    let mut m = NOTHING;
    for i in 0..4 {
        for j in 0..4 {
            for k in 0..4 {
                m[i][j] = m[i][j] + p[i][k] * q[k][j];
            }
        }
    }
    m
}

fn sum(p: &Matrix, q: &Matrix) -> Matrix {
    let mut m = *p;
    for i in 0..4 {
        for j in 0..4 {
            m[i][j] = m[i][j] + q[i][j];
        }
    }
    m
}

fn turn(axis: usize, angle: HyperDual) -> Matrix {
    let mut m = identity();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    m[u][u] = angle.cos();
    m[v][v] = angle.cos();
    m[v][u] = angle.sin();
    m[u][v] = -angle.sin();
    m
}

fn shift(axis: usize, by: HyperDual) -> Matrix {
    let mut m = identity();
    m[axis][3] = by;
    m
}

/// Returns kinetic and potential energy of links and drives.
fn energies(sample: &Sample, q: &[HyperDual], qd: &[HyperDual]) -> (HyperDual, HyperDual) {
    let (mut kinetic, mut potential) = (real(0.0), real(0.0));
    let (mut place, mut rate) = (identity(), NOTHING);
    for (i, g) in sample.geometry.iter().enumerate() {
        let before = product(&turn(0, real(g.alpha)), &shift(0, real(g.a)));
        // Derivative of the moving factor: the generator times the factor itself.
        let mut generator = NOTHING;
        let moving = match g.kind {
            JointKind::Revolute => {
                generator[0][1] = -qd[i];
                generator[1][0] = qd[i];
                product(&turn(2, real(g.theta) + q[i]), &shift(2, real(g.d)))
            }
            JointKind::Prismatic => {
                generator[2][3] = qd[i];
                product(&turn(2, real(g.theta)), &shift(2, real(g.d) + q[i]))
            }
        };
        let step = product(&before, &moving);
        let step_rate = product(&before, &product(&generator, &moving));
        rate = sum(&product(&rate, &step), &product(&place, &step_rate));
        place = product(&place, &step);

        // ∫ r·rᵀ dm with r = (x, y, z, 1), from the inertia about the frame's origin.
        let [m, mx, my, mz, xx, xy, xz, yy, yz, zz, ..] = sample.parameters[i];
        let pseudo = [
            [(yy + zz - xx) / 2.0, -xy, -xz, mx],
            [-xy, (xx + zz - yy) / 2.0, -yz, my],
            [-xz, -yz, (xx + yy - zz) / 2.0, mz],
            [mx, my, mz, m],
        ];
        for row in 0..3 {
            for j in 0..4 {
                for k in 0..4 {
                    kinetic = kinetic + rate[row][j] * rate[row][k] * real(pseudo[j][k] / 2.0);
                }
                potential = potential - place[row][j] * real(pseudo[j][3] * sample.gravity[row]);
            }
        }
        let drive = sample.parameters[i][column::DRIVE_INERTIA];
        kinetic = kinetic + qd[i] * qd[i] * real(drive / 2.0);
    }
    (kinetic, potential)
}

/// Returns d/dt ∂L/∂q̇ₖ − ∂L/∂qₖ plus friction and offset for every joint.
fn torques(sample: &Sample) -> Vec<f64> {
    let n = sample.n();
    (0..n)
        .map(|k| {
            // ε₁ along q̇ₖ, ε₂ along time: their mixed derivative is d/dt ∂L/∂q̇ₖ.
            let flow = |values: &[f64], rates: &[f64], seeded: bool| -> Vec<HyperDual> {
                (0..n)
                    .map(|j| HyperDual {
                        x: values[j],
                        a: if seeded && j == k { 1.0 } else { 0.0 },
                        b: rates[j],
                        c: 0.0,
                    })
                    .collect()
            };
            let (kinetic, potential) = energies(
                sample,
                &flow(&sample.q, &sample.qd, false),
                &flow(&sample.qd, &sample.qdd, true),
            );
            let momentum_rate = (kinetic - potential).c;
            let still = vec![0.0; n];
            let (kinetic, potential) = energies(
                sample,
                &flow(&sample.q, &still, true),
                &flow(&sample.qd, &still, false),
            );
            let row = sample.parameters[k];
            let speed = sample.qd[k];
            momentum_rate - (kinetic - potential).a
                + row[column::VISCOUS] * speed
                + row[column::COULOMB] * speed.signum()
                + row[column::OFFSET]
        })
        .collect()
}

#[test]
fn newton_euler_gives_the_torques_of_lagrange() {
    for sample in Sample::many(40) {
        let mut tau = vec![0.0; sample.n()];
        inverse_dynamics(
            &sample.chain(),
            &sample.parameters,
            &sample.q,
            &sample.qd,
            &sample.qdd,
            &mut tau,
        )
        .unwrap();
        let difference = relative_difference(&tau, &torques(&sample));
        assert!(difference < 1e-12, "{difference:e} for {sample:?}");
    }
}

#[test]
fn regressor_times_parameters_gives_the_torques_of_lagrange() {
    for sample in Sample::many(40) {
        let n = sample.n();
        let width = n * super::COLUMNS;
        let mut matrix = vec![f64::NAN; n * width];
        super::differential_regressor(
            &sample.chain(),
            &sample.q,
            &sample.qd,
            &sample.qdd,
            &mut matrix,
        )
        .unwrap();
        let tau: Vec<f64> = matrix
            .chunks_exact(width)
            .map(|row| {
                let pi = sample.parameters.as_flattened();
                row.iter().zip(pi).map(|(y, p)| y * p).sum()
            })
            .collect();
        let difference = relative_difference(&tau, &torques(&sample));
        assert!(difference < 1e-12, "{difference:e} for {sample:?}");
    }
}

#[test]
fn energies_are_those_of_the_homogeneous_transforms() {
    for sample in Sample::many(40) {
        let n = sample.n();
        let plain = |values: &[f64]| values.iter().map(|&x| real(x)).collect::<Vec<_>>();
        let (kinetic, potential) = energies(&sample, &plain(&sample.q), &plain(&sample.qd));
        let chain = sample.chain();
        let pi = sample.parameters.as_flattened();
        let mut row = vec![f64::NAN; n * super::COLUMNS];
        let value = |row: &[f64]| row.iter().zip(pi).map(|(h, p)| h * p).sum::<f64>();

        super::kinetic_energy_regressor(&chain, &sample.q, &sample.qd, &mut row).unwrap();
        let by_row = value(&row);
        super::potential_energy_regressor(&chain, &sample.q, &mut row).unwrap();
        let below = value(&row);
        super::energy_regressor(&chain, &sample.q, &sample.qd, &mut row).unwrap();
        let total = value(&row);
        let direct = [
            super::kinetic_energy(&chain, &sample.parameters, &sample.q, &sample.qd).unwrap(),
            super::potential_energy(&chain, &sample.parameters, &sample.q).unwrap(),
        ];
        let expected = [
            kinetic.x,
            potential.x,
            kinetic.x + potential.x,
            kinetic.x,
            potential.x,
        ];
        let found = [by_row, below, total, direct[0], direct[1]];
        let difference = relative_difference(&found, &expected);
        assert!(difference < 1e-12, "{difference:e} for {sample:?}");
    }
}
