//! Models of any robot with this geometry: links of positive mass, drives of positive inertia, dissipative friction.
//!
//! A link is its description times a number plus point masses about its frame, none of them negative. Every such sum is
//! a possible body, and every possible body is near one. Friction may be viscous, dry, fall with speed (Stribeck), rise
//! with its root or its square, depend on the load, and differ between directions. Further terms are a constant, a
//! spring, and one wave over the motor's turn ([`crate::faults::wave`]), as from cogging, ripple and eccentric gears.
//! Non-negative least squares fits all of them to the whole robot at once.
//!
//! Leaves out: elastic joints, backlash, further waves, and bodies wider than the box of their points.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use crate::faults::fit::Fit;
use crate::faults::rows::{Form, Rows};
use crate::faults::wave;
use rig_model::robot;
use rig_model::robot::{Inertial, Robot};
use rig_numerics::optimise::non_negative::nnls;
use rig_numerics::statistics;

/// Number of stretches that are left out in turn.
pub(crate) const BLOCKS: usize = 8;
/// Effective number of independent rows in a recording.
pub(crate) const INDEPENDENT: f64 = 50.0;
/// Share of the torque that no rigid-body model explains: the uncertainty of its rows.
const UNCERTAIN: f64 = 0.1;
/// Relative standard deviation of a described link or rotor, if the description is believed.
const DESCRIBED: f64 = 0.3;
/// Least link mass and rotor inertia, as shares of the described: stand-in values are right to one decade.
const LIGHTEST: f64 = 0.1;
/// Precision of a coefficient without prior knowledge: its torque is at most of the measured size.
const RIDGE: f64 = UNCERTAIN * UNCERTAIN / INDEPENDENT;
/// Prior RMS torque of either-sign columns and of friction, as shares of the described bodies' strongest torque.
const BESIDE: [f64; 2] = [0.3, 1.0];
/// Rounds of the fit to all stretches, and to all but one, which starts from the former.
const ROUNDS: [usize; 2] = [60, 5];
/// Half the side of a payload's box as a share of the arm's reach, and its least value, m.
const LOAD_BOX: (f64, f64) = (0.4, 0.1);
/// Decay speeds of Stribeck friction, as shares of the RMS speed.
const STRIBECK: [f64; 2] = [0.1, 0.4];
/// Columns of one joint's drive; those of either sign come first.
const OWN: usize = 13;
/// Number of columns of either sign.
const EITHER: usize = 5;
/// Index of the wave's two columns.
const WAVE: usize = 3;
/// Index of the drive's inertia.
const INERTIA: usize = 5;

/// Prior knowledge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Belief {
    /// The description.
    Described,
    /// The description and a payload on the last link.
    PreparedData,
    /// The geometry, and masses and rotors within the uncertainty of a description (`robot::worth`).
    Free,
}

/// A body on the last link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Load {
    /// kg
    pub(crate) mass: f64,
    /// m, in the last frame
    pub(crate) place: [f64; 3],
}

/// Prediction of left-out stretches.
#[derive(Clone, Debug)]
pub(crate) struct Score {
    /// Residual share of each joint's variance by stretch and joint; 0 for joints without torque.
    pub(crate) errors: Vec<Vec<f64>>,
    /// Negative log-likelihood of data and prior under the model of all rows, without terms that all models share.
    pub(crate) cost: f64,
    /// The model's payload on the last link.
    pub(crate) load: Load,
}

impl Score {
    /// Returns the residual share of the variance of joint `j`'s torque, mean over the stretches.
    pub(crate) fn left(&self, j: usize) -> f64 {
        let all = self.errors.iter().map(|stretch| stretch[j]);
        all.sum::<f64>() / self.errors.len().max(1) as f64
    }
}

/// Columns and rows of a recording, as recorded or with a fault undone.
pub(crate) struct Physical {
    /// Joint by joint: the shared columns (bodies, points, motors), then the joint's own.
    matrices: Vec<DMatrix<f64>>,
    tau: Vec<Vec<f64>>,
    /// True for joints whose torque has an unknown sign.
    magnitude: Vec<bool>,
    /// RMS of the torque about its mean.
    size: Vec<f64>,
    /// Number of columns that joints share.
    shared: usize,
    points: Points,
    /// Described mass and rotor inertia, by shared column or joint; 0 if there is none.
    masses: Vec<f64>,
    rotors: Vec<f64>,
    motors: Vec<f64>,
    described: bool,
    edge: usize,
}

/// Places of point masses in each frame.
struct Points {
    places: Vec<Vec<[f64; 3]>>,
}

impl Points {
    fn of(robot: &Robot) -> Self {
        let n = robot.joints.len();
        let centre = |j: usize| {
            let inertial = robot.joints[j].inertial.as_ref();
            inertial.filter(|i| i.mass > 0.0).map_or(0.0, |i| {
                let moments = i.first_moment.iter().map(|m| m * m).sum::<f64>();
                moments.sqrt() / i.mass
            })
        };
        let step = |j: usize| {
            let next = robot.joints.get(j);
            next.map_or(0.0, |joint| joint.a.hypot(joint.d))
        };
        let reach: f64 = (1..n).map(step).sum::<f64>() + centre(n - 1);
        let (share, least) = LOAD_BOX;
        let load = f64::max(share * reach, least);
        let places = (0..n)
            .map(|j| {
                let half = f64::max(step(j + 1), 1.5 * centre(j)).max(0.1 * reach);
                let half = if j + 1 == n { half.max(load) } else { half };
                grid(half, j + 1 == n)
            })
            .collect();
        Self { places }
    }

    fn count(&self) -> usize {
        self.places.iter().map(Vec::len).sum()
    }
}

/// Returns centre and corners of a box, with `full` also the centres of its faces.
fn grid(half: f64, full: bool) -> Vec<[f64; 3]> {
    let ends = [-half, 0.0, half];
    let mut all = Vec::new();
    for x in ends {
        for y in ends {
            for z in ends {
                let off = [x, y, z].iter().filter(|v| **v != 0.0).count();
                if off == 0 || off == 3 || (full && off == 1) {
                    all.push([x, y, z]);
                }
            }
        }
    }
    all
}

impl Physical {
    /// Builds the rows of a robot. `magnitude` marks joints whose torques have lost their sign; `edge` rows at either
    /// end are invalid.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn of(
        robot: &Robot,
        form: &Form,
        rows: &Rows,
        magnitude: Vec<bool>,
        edge: usize,
    ) -> Result<Self, DiagnoseError> {
        let n = robot.joints.len();
        let parameters = robot.standard_parameters();
        let motors = robot.motor_parameters();
        let points = Points::of(robot);
        let regressors = rows.regressors(form)?;
        let map = bodies(&parameters, &points);
        let coupled = form.width() - n * COLUMNS;
        let shared = map.ncols() + coupled;
        let order: Vec<usize> = (0..shared + OWN).collect();
        let matrices = (0..n)
            .map(|j| {
                let regressor = &regressors[j];
                let links = regressor.columns(0, n * COLUMNS) * &map;
                let weight = links.columns(0, n).column_sum();
                let own = own(&rows.q[j], &rows.qd[j], &rows.qdd[j], weight.as_slice());
                let mut matrix = DMatrix::zeros(rows.len(), shared + OWN);
                matrix.columns_mut(0, links.ncols()).copy_from(&links);
                let of_motors = regressor.columns(n * COLUMNS, coupled);
                matrix
                    .columns_mut(map.ncols(), coupled)
                    .copy_from(&of_motors);
                matrix.columns_mut(shared, OWN).copy_from(&own);
                // A screw beyond its reach has no valid column.
                for mut column in matrix.column_iter_mut() {
                    if column.iter().any(|x| !x.is_finite()) {
                        column.fill(0.0);
                    }
                }
                let turn: Vec<f64> = rows.q[j]
                    .iter()
                    .map(|q| q * robot.joints[j].gear_ratio())
                    .collect();
                let fit = Fit::of(&matrix, &rows.tau[j], &order);
                let found = fit.and_then(|fit| wave::loudest(&turn, fit.residual.as_slice()));
                if let Some(order) = found {
                    for (row, angle) in turn.iter().enumerate() {
                        let (sine, cosine) = (order * angle).sin_cos();
                        matrix[(row, shared + WAVE)] = cosine;
                        matrix[(row, shared + WAVE + 1)] = sine;
                    }
                }
                matrix
            })
            .collect();
        let count = rows.len().max(1) as f64;
        let size = |tau: &Vec<f64>| (statistics::squares_about_mean(tau) / count).sqrt();
        Ok(Self {
            matrices,
            size: rows.tau.iter().map(size).collect(),
            tau: rows.tau.clone(),
            magnitude,
            shared,
            masses: parameters.iter().map(|p| p[column::MASS]).collect(),
            rotors: parameters
                .iter()
                .map(|p| p[column::DRIVE_INERTIA])
                .collect(),
            motors: (motors.iter().flatten().copied()).take(coupled).collect(),
            described: parameters.iter().all(|p| p[column::MASS] > 0.0),
            points,
            edge,
        })
    }

    /// Scores a belief by its prediction of left-out stretches; `None` without enough rows or a description.
    pub(crate) fn score(&self, belief: Belief) -> Option<Score> {
        if belief != Belief::Free && !self.described {
            return None;
        }
        let n = self.matrices.len();
        let size = self.shared + n * OWN;
        let live: Vec<usize> = (0..n).filter(|j| self.size[*j] > 0.0).collect();
        let blocks = self.blocks()?;
        let grams: Vec<(DMatrix<f64>, DVector<f64>)> =
            blocks.iter().map(|b| self.gram(&live, b, size)).collect();
        let mut whole = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (h, g) in &grams {
            whole.0 += h;
            whole.1 += g;
        }
        let problem = Problem::of(self, belief, &whole.0);
        let mut free = vec![false; problem.kept.len()];
        let all = problem.solved(&whole.0, &whole.1, &mut free, ROUNDS[0])?;
        let mut errors = Vec::new();
        for (block, (h, g)) in blocks.iter().zip(&grams) {
            let mut free = free.clone();
            let x = problem.solved(&(&whole.0 - h), &(&whole.1 - g), &mut free, ROUNDS[1])?;
            let of = |j: usize| (self.size[j] > 0.0).then(|| self.error(j, block, &x));
            errors.push((0..n).map(|j| of(j).unwrap_or(0.0)).collect());
        }
        let squares: f64 = live.iter().map(|j| self.squares(*j)).sum();
        let misfit = 0.5 * (squares + all.dot(&(&whole.0 * &all))) - all.dot(&whole.1);
        Some(Score {
            errors,
            cost: misfit + problem.cost(&all),
            load: self.load(&all),
        })
    }

    /// Returns the stretches of rows; `None` if there are too few rows.
    fn blocks(&self) -> Option<Vec<std::ops::Range<usize>>> {
        let rows = self.tau.first()?.len().checked_sub(2 * self.edge)?;
        (rows >= 5 * BLOCKS).then(|| {
            let at = |b: usize| self.edge + rows * b / BLOCKS;
            (0..BLOCKS).map(|b| at(b)..at(b + 1)).collect()
        })
    }

    /// Returns the weight of a joint's squared torque.
    fn weight(&self, j: usize) -> f64 {
        INDEPENDENT / (self.tau[j].len() as f64 * (UNCERTAIN * self.size[j]).powi(2))
    }

    /// Returns the weighted squares of a joint's torque.
    fn squares(&self, j: usize) -> f64 {
        let inner = self.edge..self.tau[j].len().saturating_sub(self.edge);
        self.weight(j) * statistics::sum_of_squares(&self.tau[j][inner])
    }

    /// Returns the normal equations of a stretch.
    fn gram(
        &self,
        live: &[usize],
        block: &std::ops::Range<usize>,
        size: usize,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let mut h = DMatrix::zeros(size, size);
        let mut g = DVector::zeros(size);
        for &j in live {
            let weight = self.weight(j);
            let x = self.matrices[j].rows(block.start, block.len());
            let y = DVector::from_column_slice(&self.tau[j][block.clone()]);
            let (own, right) = (x.tr_mul(&x) * weight, x.tr_mul(&y) * weight);
            let place = |c: usize| match c.checked_sub(self.shared) {
                None => c,
                Some(k) => self.shared + j * OWN + k,
            };
            for c in 0..own.ncols() {
                g[place(c)] += right[c];
                for r in 0..own.nrows() {
                    h[(place(r), place(c))] += own[(r, c)];
                }
            }
        }
        (h, g)
    }

    /// Returns the residual share of a joint's torque variance in a stretch.
    fn error(&self, j: usize, block: &std::ops::Range<usize>, x: &DVector<f64>) -> f64 {
        let own = x.rows(self.shared + j * OWN, OWN);
        let shared = x.rows(0, self.shared);
        let matrix = self.matrices[j].rows(block.start, block.len());
        let predicted =
            matrix.columns(0, self.shared) * shared + matrix.columns(self.shared, OWN) * own;
        let squares: f64 = (predicted.iter().zip(&self.tau[j][block.clone()]))
            .map(|(p, y)| match self.magnitude[j] {
                true => (p.abs() - y.abs()).powi(2),
                false => (p - y).powi(2),
            })
            .sum();
        squares / (block.len() as f64 * self.size[j].powi(2))
    }

    /// Returns the RMS of one of a joint's own columns.
    fn rms(&self, joint: usize, own: usize) -> f64 {
        let column = self.matrices[joint].column(self.shared + own);
        (column.norm_squared() / column.len().max(1) as f64).sqrt()
    }

    /// Returns the RMS torque of the described bodies at the joint that carries most.
    fn strongest(&self) -> f64 {
        let n = self.matrices.len();
        let of = |j: usize| {
            let matrix = &self.matrices[j];
            let rotor = matrix.column(self.shared + INERTIA) * self.rotors[j];
            let all = matrix.columns(0, n).column_sum() + rotor;
            (all.norm_squared() / all.len().max(1) as f64).sqrt()
        };
        (0..n).map(of).fold(0.0, f64::max)
    }

    fn load(&self, x: &DVector<f64>) -> Load {
        let n = self.matrices.len();
        let last = &self.points.places[n - 1];
        let from = n + self.points.count() - last.len();
        let (mut mass, mut moment) = (0.0, [0.0; 3]);
        for (k, place) in last.iter().enumerate() {
            mass += x[from + k];
            for (sum, p) in moment.iter_mut().zip(place) {
                *sum += x[from + k] * p;
            }
        }
        Load {
            mass,
            place: moment.map(|m| m / f64::max(mass, f64::MIN_POSITIVE)),
        }
    }
}

/// Returns standard parameters of all links from described bodies, then points: links × COLUMNS × columns.
fn bodies(parameters: &[[f64; COLUMNS]], points: &Points) -> DMatrix<f64> {
    let n = parameters.len();
    let mut map = DMatrix::zeros(n * COLUMNS, n + points.count());
    let mut at = n;
    for (link, (own, places)) in parameters.iter().zip(&points.places).enumerate() {
        for (k, value) in own[..column::DRIVE_INERTIA].iter().enumerate() {
            map[(link * COLUMNS + k, link)] = *value;
        }
        for place in places {
            for (k, value) in Inertial::point(*place).parameters().iter().enumerate() {
                map[(link * COLUMNS + k, at)] = *value;
            }
            at += 1;
        }
    }
    map
}

/// Returns the columns of one joint's drive: constant, difference between directions, spring, space for a wave;
/// inertia, viscous, dry, then other friction of the library, each with a dissipative sign.
fn own(q: &[f64], qd: &[f64], qdd: &[f64], weight: &[f64]) -> DMatrix<f64> {
    let rms = statistics::rms(qd);
    DMatrix::from_fn(qd.len(), OWN, |k, c| {
        let (v, sense) = (qd[k], if qd[k] == 0.0 { 0.0 } else { qd[k].signum() });
        let fallen = |share: f64| sense * (-v.abs() / (share * rms).max(f64::MIN_POSITIVE)).exp();
        match c {
            0 => 1.0,
            1 => v.abs(),
            2 => q[k],
            WAVE..INERTIA => 0.0,
            INERTIA => qdd[k],
            6 => v,
            7 => sense,
            8 => fallen(STRIBECK[0]),
            9 => fallen(STRIBECK[1]),
            10 => sense * v.abs().sqrt(),
            11 => v * v.abs(),
            _ => sense * weight[k].abs(),
        }
    })
}

/// Normal equations with a belief's prior, columns scaled to one size.
struct Problem {
    kept: Vec<usize>,
    scale: DVector<f64>,
    precision: DVector<f64>,
    pull: DVector<f64>,
    /// Half the squared prior means, in their standard deviations.
    offset: f64,
    bounded: Vec<bool>,
    /// Lower bounds of the bounded columns.
    least: DVector<f64>,
    size: usize,
}

impl Problem {
    fn of(physical: &Physical, belief: Belief, h: &DMatrix<f64>) -> Self {
        let size = h.nrows();
        let (n, shared) = (physical.matrices.len(), physical.shared);
        let points = physical.points.count();
        let most = h.diagonal().max();
        let kept: Vec<usize> = (0..size)
            .filter(|k| h[(*k, *k)] > f64::EPSILON * f64::EPSILON * most)
            .collect();
        // Link of each point.
        let links: Vec<usize> = (physical.points.places.iter().enumerate())
            .flat_map(|(link, places)| std::iter::repeat_n(link, places.len()))
            .collect();
        let strongest = physical.strongest();
        let share = match belief {
            Belief::Described | Belief::PreparedData => DESCRIBED,
            Belief::Free => robot::DESCRIBED,
        };
        // Prior mean, standard deviation and lower bound of a coefficient.
        let known = |k: usize| -> Option<(f64, f64, f64)> {
            let stated =
                |value: f64| (value > 0.0).then_some((value, share * value, LIGHTEST * value));
            if k < n + points && !physical.described {
                None
            } else if k < n {
                Some((1.0, share, LIGHTEST))
            } else if k < n + points {
                let link = links[k - n];
                let prepared = belief == Belief::PreparedData && link + 1 == n;
                (!prepared).then_some((0.0, share * physical.masses[link], 0.0))
            } else if k < shared {
                let motor = k - n - points;
                let inertia = motor % MOTOR_COLUMNS == motor_column::INERTIA;
                inertia.then(|| stated(physical.motors[motor])).flatten()
            } else {
                let (joint, own) = ((k - shared) / OWN, (k - shared) % OWN);
                let beside = BESIDE[usize::from(own >= EITHER)];
                let rms = physical.rms(joint, own);
                let small = belief != Belief::Free && rms > 0.0;
                (own == INERTIA)
                    .then(|| stated(physical.rotors[joint]))
                    .flatten()
                    .or(small.then(|| (0.0, beside * strongest / rms, 0.0)))
            }
        };
        let scale = DVector::from_iterator(kept.len(), kept.iter().map(|k| h[(*k, *k)].sqrt()));
        let mut precision = DVector::zeros(kept.len());
        let mut pull = DVector::zeros(kept.len());
        let mut least = DVector::zeros(kept.len());
        let mut offset = 0.0;
        for (at, k) in kept.iter().enumerate() {
            let (mean, inverse, bound) = known(*k).map_or((0.0, 0.0, 0.0), |(mean, std, bound)| {
                (mean, 1.0 / (std * std), bound)
            });
            precision[at] = inverse / (scale[at] * scale[at]) + RIDGE;
            pull[at] = mean * inverse / scale[at];
            least[at] = bound * scale[at];
            offset += 0.5 * mean * mean * inverse;
        }
        let bounded = (kept.iter())
            .map(|k| k.checked_sub(shared).is_none_or(|own| own % OWN >= EITHER))
            .collect();
        Self {
            kept,
            scale,
            precision,
            pull,
            offset,
            bounded,
            least,
            size,
        }
    }

    /// Returns the distance of coefficients from the prior, half the squares in standard deviations.
    fn cost(&self, x: &DVector<f64>) -> f64 {
        let own = x.select_rows(&self.kept).component_mul(&self.scale);
        let squares = own.component_mul(&own).dot(&self.precision);
        0.5 * squares - own.dot(&self.pull) + self.offset
    }

    fn solved(
        &self,
        h: &DMatrix<f64>,
        g: &DVector<f64>,
        free: &mut [bool],
        rounds: usize,
    ) -> Option<DVector<f64>> {
        let mut own = h.select_rows(&self.kept).select_columns(&self.kept);
        for c in 0..own.ncols() {
            for r in 0..own.nrows() {
                own[(r, c)] /= self.scale[r] * self.scale[c];
            }
            own[(c, c)] += self.precision[c];
        }
        let right = g.select_rows(&self.kept).component_div(&self.scale) + &self.pull;
        let beyond = nnls(
            &own,
            &(right - &own * &self.least),
            &self.bounded,
            free,
            rounds,
        )?;
        let x = beyond + &self.least;
        let mut all = DVector::zeros(self.size);
        for (at, k) in self.kept.iter().enumerate() {
            all[*k] = x[at] / self.scale[at];
        }
        Some(all)
    }
}
