//! Nominal parameters of a voltage-driven joint without a simulation: the start of a fit.
//!
//! The equation of motion is linear in them. It is multiplied by a bump that vanishes with its slope at both ends of a
//! short piece, and integrated by parts (weak form; Shinbrot 1954, Preisig and Rippin 1993). This needs no derivative
//! of the measured position, so encoder steps do not bias the inertia and no simulation can diverge.

use nalgebra::{DMatrix, DVector};
use rig_numerics::svd::Svd;

use crate::voltage::log::Log;
use crate::voltage::plant::{NOMINAL, Plant};
use rig_numerics::optimise::non_negative::nnls;
use rig_numerics::statistics::sum_of_squares;

/// Length of a piece, s: a few steps of a coarse encoder, short beside an oscillation.
const PIECE: f64 = 0.3;
/// Fewest rows of a piece.
const FEWEST: usize = 12;
/// Share of the RMS velocity below which dry friction may hold the joint.
const SLOW: f64 = 0.1;
/// Share of slow rows above which a piece does not show Coulomb friction.
const MOSTLY_SLOW: f64 = 0.25;
/// Most rounds of the least squares, many times the need of five bounded unknowns.
const ROUNDS: usize = 100;

/// Columns of a joint under gravity: inertia, back-EMF, dry friction, a constant, and gravity's two.
const OF_GRAVITY: usize = 6;
/// Singular values below this are rounding.
const TINY: f64 = 1e-12;

/// Non-negative: drive inertia, torque per volt, its product with the back-EMF, Coulomb and viscous friction.
const NOT_NEGATIVE: usize = 5;
/// Place of the torque per volt.
const GAIN: usize = 1;
/// Place of its product with the back-EMF.
const BACK_EMF: usize = 2;
/// Standard deviations above zero from which the back-EMF is known.
const KNOWN: f64 = 3.0;

/// Normal equations of the nominal parameters over all pieces.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Sum of the squares of the known side.
    squares: f64,
    /// Number of pieces.
    pieces: usize,
}

/// Sets up the equations; see [`start`].
fn normal(plant: &Plant, logs: &[Log], viscous: bool) -> Normal {
    let velocities: Vec<Vec<f64>> = (logs.iter())
        .map(|log| (0..log.t.len()).map(|k| log.slope(k)[0]).collect())
        .collect();
    let rows = velocities.iter().map(Vec::len).sum::<usize>().max(1);
    let squares: f64 = velocities.iter().flatten().map(|v| v * v).sum();
    let slow = SLOW * (squares / rows as f64).sqrt();
    let mut normal = DMatrix::<f64>::zeros(NOMINAL, NOMINAL);
    let mut right = DVector::<f64>::zeros(NOMINAL);
    let (mut known_squares, mut count) = (0.0, 0);
    for (log, velocity) in logs.iter().zip(&velocities) {
        for [from, to] in pieces(log) {
            let still = velocity[from..to].iter().filter(|v| v.abs() < slow).count();
            let switched = log.on[from..to].windows(2).any(|pair| pair[0] != pair[1]);
            if switched || still as f64 > MOSTLY_SLOW * (to - from) as f64 {
                continue;
            }
            let (row, known) = equation(plant, log, velocity, [from, to], viscous);
            known_squares += known * known;
            count += 1;
            for i in 0..NOMINAL {
                right[i] += row[i] * known;
                for j in 0..NOMINAL {
                    normal[(i, j)] += row[i] * row[j];
                }
            }
        }
    }
    for i in 0..NOMINAL {
        normal[(i, i)] += 1.0e-15 + 1.0e-9 * normal[(i, i)];
    }
    Normal {
        matrix: normal,
        right,
        squares: known_squares,
        pieces: count,
    }
}

impl Normal {
    /// Returns the non-negative solution.
    fn solution(&self) -> Option<DVector<f64>> {
        let bounded: Vec<bool> = (0..NOMINAL).map(|k| k < NOT_NEGATIVE).collect();
        nnls(
            &self.matrix,
            &self.right,
            &bounded,
            &mut [true; NOMINAL],
            ROUNDS,
        )
    }
}

/// Returns the back-EMF, V·s/rad, where the recordings show it; `None` if it is zero or not known to a third. Pieces
/// overlap by half, so half of them are independent.
pub(crate) fn back_emf(plant: &Plant, logs: &[Log]) -> Option<f64> {
    let normal = normal(plant, logs, false);
    let x = normal.solution()?;
    let own = |k: usize| x[k] > 0.0 || k >= NOT_NEGATIVE;
    let free: Vec<usize> = (0..NOMINAL).filter(|k| own(*k)).collect();
    let place = free.iter().position(|k| *k == BACK_EMF)?;
    let reduced = normal.matrix.select_rows(&free).select_columns(&free);
    let left = normal.squares - 2.0 * normal.right.dot(&x) + x.dot(&(&normal.matrix * &x));
    let independent = (0.5 * normal.pieces as f64 - free.len() as f64).max(1.0);
    let inverse = reduced.try_inverse()?;
    let variance = left.max(0.0) / independent * inverse[(place, place)];
    let known = variance.is_finite() && x[BACK_EMF] > KNOWN * variance.sqrt();
    (known && x[GAIN] > 0.0).then(|| x[BACK_EMF] / x[GAIN])
}

/// Returns non-negative nominal parameters by least squares; `None` if the voltage does not drive the joint. `viscous`
/// separates viscous friction from the back-EMF, by rows with the drive off.
pub(crate) fn start(plant: &Plant, logs: &[Log], viscous: bool) -> Option<Vec<f64>> {
    let x = normal(plant, logs, viscous).solution()?;
    let weight = plant.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let gain = if x[1] > 0.0 { x[1] } else { return None };
    Some(vec![
        x[0].max(0.05 * plant.inertia),
        gain,
        (x[2] / gain).max(1.0e-3),
        x[3].max(0.01 * weight),
        if viscous {
            x[4].max(1.0e-3 * weight)
        } else {
            0.0
        },
        x[5],
    ])
}

/// Returns the residual share of the voltage's squares for a joint under gravity whose position is `factor` times the
/// recorded. The factor with gravity's right period gives the least. Inertia, friction, back-EMF and gravity are fitted
/// without the description.
pub(crate) fn left_of_voltage(logs: &[Log], factor: f64) -> Option<f64> {
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for log in logs {
        for [from, to] in pieces(log) {
            let length = log.t[to - 1] - log.t[from];
            let (mut row, mut volts) = ([0.0; OF_GRAVITY], 0.0);
            for k in from..to {
                let [before, after] = [k.max(from + 1) - 1, (k + 1).min(to - 1)];
                let width = 0.5 * (log.t[after] - log.t[before]);
                let [bump, slope, bend] = bump((log.t[k] - log.t[from]) / length, length);
                let q = log.q[k] - log.q[from];
                let (sin, cos) = (factor * log.q[k]).sin_cos();
                let own = [
                    bend * q,
                    -slope * q,
                    bump * log.slope(k)[0].signum(),
                    bump,
                    bump * cos,
                    bump * sin,
                ];
                for (to, x) in row.iter_mut().zip(own) {
                    *to += width * x;
                }
                volts += width * bump * f64::from(u8::from(log.on[k])) * log.u[k];
            }
            rows.extend(row);
            right.push(volts);
        }
    }
    let squares = sum_of_squares(&right);
    let x = DMatrix::from_row_slice(right.len(), OF_GRAVITY, &rows);
    let y = DVector::from_vec(right);
    let fit = Svd::of(x.clone()).solve(&y, TINY);
    (squares > 0.0).then(|| (y - x * fit).norm_squared() / squares)
}

/// Returns x³(1 − x)³ at a share of a piece of `length`, s, and its time derivatives.
fn bump(x: f64, length: f64) -> [f64; 3] {
    let rest = 1.0 - x;
    [
        (x * rest).powi(3),
        3.0 * (x * rest).powi(2) * (rest - x) / length,
        6.0 * x * rest * (1.0 - 5.0 * x * rest) / (length * length),
    ]
}

/// Returns the rows of overlapping pieces; the last index is one past the end.
fn pieces(log: &Log) -> Vec<[usize; 2]> {
    let mut list = Vec::new();
    let mut from = 0;
    while let Some(to) = (from..log.t.len()).find(|k| log.t[*k] > log.t[from] + PIECE) {
        if to - from >= FEWEST {
            list.push([from, to]);
        }
        from += ((to - from) / 2).max(1);
    }
    list
}

/// Returns the coefficients of the nominal parameters in one piece, and its described part.
fn equation(
    plant: &Plant,
    log: &Log,
    velocity: &[f64],
    [from, to]: [usize; 2],
    viscous: bool,
) -> ([f64; NOMINAL], f64) {
    let length = log.t[to - 1] - log.t[from];
    let mut row = [0.0; NOMINAL];
    let mut known = 0.0;
    for k in from..to {
        let [before, after] = [k.max(from + 1) - 1, (k + 1).min(to - 1)];
        let width = 0.5 * (log.t[after] - log.t[before]);
        let [bump, slope, bend] = bump((log.t[k] - log.t[from]) / length, length);
        let q = log.q[k] - log.q[from];
        let on = f64::from(u8::from(log.on[k]));
        let [acceleration, speed] = [bend * q, -slope * q];
        row[0] -= width * acceleration;
        row[1] += width * bump * on * log.u[k];
        row[2] -= width * on * speed;
        row[3] -= width * bump * velocity[k].signum();
        row[4] -= if viscous { width * speed } else { 0.0 };
        row[5] -= width * bump;
        known += width * (plant.inertia * acceleration + bump * plant.weight(log.q[k]));
    }
    (row, known)
}
