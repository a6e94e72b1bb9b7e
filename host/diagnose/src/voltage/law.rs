//! The controller behind a voltage, from the recording.
//!
//! A servo whose voltage follows its reference is simulated in the closed loop, with the same reference. The controller
//! holds what drifts under the recorded voltage alone.
//!
//! Off its limit, the share of the supply is linear in the gains of a PID controller with feed-forward (least squares).
//! Rows left out of the fit decide on the controller's terms (Stone 1974).
//!
//! Leaves out: filters and delays of the controller, cascades with an integral of the velocity, back-calculation of the
//! integral.

use nalgebra::{DMatrix, DVector};

use crate::voltage::log::Log;
use crate::voltage::significance::{LEAST_GAIN, LEVEL, signed_rank};
use rig_model::robot::{AntiWindup, VoltageController};

/// Least share of the voltage's power that a law explains.
const EXPLAINED: f64 = 0.995;
/// Fewest rows for a law.
const FEWEST: usize = 100;
/// Share of the largest supply share above which the bridge may be at its limit.
const LIMIT: f64 = 0.995;
/// Fewest rows at a limit.
const AT_LIMIT: usize = 10;
/// Pieces of a recording for the choice of terms.
const PIECES: usize = 16;
/// Folds of the pieces that are left out in turn.
const FOLDS: usize = 8;
/// Largest time between columns of a row, in sample periods: each is read within one, and the controller has its own.
const APART: f64 = 2.0;

/// Columns: error, damping, reference velocity and acceleration, constant, error integral with and without clamping.
const COLUMNS: usize = 7;
/// Columns of each term beside the proportional one.
const TERMS: [&[usize]; 6] = [&[1], &[2], &[3], &[4], &[4, 5], &[4, 6]];
/// Index of the integral that stops at the limit.
const CLAMPED: usize = 6;

/// A controller by a recording.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Law {
    /// The controller.
    pub controller: VoltageController,
    /// Integral of the position error at each row, rad·s or m·s; empty without an integral.
    pub integral: Vec<f64>,
}

/// Normal equations of some rows.
#[derive(Clone)]
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    power: f64,
}

impl Normal {
    fn new() -> Self {
        Self {
            matrix: DMatrix::zeros(COLUMNS, COLUMNS),
            right: DVector::zeros(COLUMNS),
            power: 0.0,
        }
    }

    fn push(&mut self, row: &[f64; COLUMNS], share: f64) {
        for i in 0..COLUMNS {
            self.right[i] += row[i] * share;
            for j in 0..COLUMNS {
                self.matrix[(i, j)] += row[i] * row[j];
            }
        }
        self.power += share * share;
    }

    fn sum<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        parts.fold(Self::new(), |mut sum, part| {
            sum.matrix += &part.matrix;
            sum.right += &part.right;
            sum.power += part.power;
            sum
        })
    }

    /// Returns the gains of the columns `used`, 0 for the others; `None` if they are collinear.
    fn solve(&self, used: &[usize]) -> Option<DVector<f64>> {
        let scale: Vec<f64> = used.iter().map(|c| self.matrix[(*c, *c)].sqrt()).collect();
        if scale.iter().any(|s| !(*s > 0.0)) {
            return None;
        }
        let n = used.len();
        let matrix = DMatrix::from_fn(n, n, |a, b| {
            self.matrix[(used[a], used[b])] / (scale[a] * scale[b])
        });
        let right = DVector::from_fn(n, |a, _| self.right[used[a]] / scale[a]);
        let x = matrix.cholesky()?.solve(&right);
        let mut gains = DVector::zeros(COLUMNS);
        for (a, column) in used.iter().enumerate() {
            gains[*column] = x[a] / scale[a];
        }
        Some(gains)
    }

    /// Returns the squared residual with these gains.
    fn left(&self, gains: &DVector<f64>) -> f64 {
        (self.power - 2.0 * gains.dot(&self.right) + gains.dot(&(&self.matrix * gains))).max(0.0)
    }
}

/// Resolution of a recording.
struct Resolution {
    /// Time between rows, s.
    period: f64,
    /// Duration of the recording, s.
    duration: f64,
    /// Smallest step of the share of the supply.
    step: f64,
}

impl Resolution {
    fn of(log: &Log, share: &[f64]) -> Self {
        let steps = share.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let largest = share.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        Self {
            period: log.duration() / log.t.len() as f64,
            duration: log.duration(),
            // Smaller steps are rounding of a quotient.
            step: (steps.filter(|step| *step > 1.0e-6 * largest)).fold(f64::INFINITY, f64::min),
        }
    }

    /// Returns the least identifiable gain of each column beside a proportional controller. Columns read at different
    /// instants look like gains on velocities and accelerations. Rounding looks like a constant, a drift like an
    /// integral with a time longer than the recording.
    fn least(&self, proportional: f64) -> [f64; COLUMNS] {
        let apart = APART * self.period * proportional;
        let slow = proportional / self.duration;
        let bent = 0.5 * APART * self.period * apart;
        [0.0, apart, apart, bent, self.step, slow, slow]
    }

    /// Returns true if these are gains of a controller: all identifiable, none with the wrong sign. Gains on the
    /// velocities of joint and reference may be small with either sign: they come from different instants.
    fn allows(&self, gains: &DVector<f64>) -> bool {
        let least = self.least(gains[0]);
        let has_integral = gains[5] + gains[CLAMPED] > 0.0;
        let allowed = |column: usize| {
            let gain = gains[column];
            match column {
                _ if gain == 0.0 => true,
                0 | 3 | 5 | CLAMPED => gain > least[column],
                1 | 2 => gain > -least[column],
                // Beside an integral, the constant is its initial value.
                _ => gain.abs() > least[column] || has_integral,
            }
        };
        gains[0] > 0.0 && (0..COLUMNS).all(allowed)
    }
}

/// Columns of a controller, and the squared residual of each piece when it is left out of the fit.
struct Terms {
    used: Vec<usize>,
    unseen: Vec<f64>,
}

impl Terms {
    fn of(pieces: &[Normal], used: Vec<usize>) -> Option<Self> {
        let mut unseen = vec![0.0; pieces.len()];
        for fold in 0..FOLDS {
            let out = |k: usize| k % FOLDS == fold;
            let rest = (pieces.iter().enumerate()).filter(|(k, _)| !out(*k));
            let gains = Normal::sum(rest.map(|(_, piece)| piece)).solve(&used)?;
            for k in (0..pieces.len()).filter(|k| out(*k)) {
                unseen[k] = pieces[k].left(&gains);
            }
        }
        Some(Self { used, unseen })
    }

    fn error(&self) -> f64 {
        self.unseen.iter().sum()
    }

    /// Returns true if left-out rows are explained better than by `other`, and significantly.
    fn beats(&self, other: &Self) -> bool {
        let gains: Vec<f64> = (other.unseen.iter().zip(&self.unseen))
            .map(|(before, after)| (before / after).ln())
            .filter(|gain| gain.is_finite())
            .collect();
        self.error() <= (1.0 - LEAST_GAIN).powi(2) * other.error() && signed_rank(&gains) <= LEVEL
    }
}

/// Returns the fewest columns that no larger set beats; `None` if even the proportional term explains nothing.
fn chosen(pieces: &[Normal], resolution: &Resolution) -> Option<Vec<usize>> {
    let whole = Normal::sum(pieces.iter());
    let mut all: Vec<Terms> = (0..1_usize << TERMS.len())
        .filter_map(|set| {
            let picked = (0..TERMS.len()).filter(|term| set >> term & 1 == 1);
            let mut used: Vec<usize> = picked.flat_map(|term| TERMS[term]).copied().collect();
            used.push(0);
            used.sort_unstable();
            used.dedup();
            // The two integrals exclude each other.
            let one = !(used.contains(&5) && used.contains(&CLAMPED));
            let sound = one && resolution.allows(&whole.solve(&used)?);
            sound.then(|| Terms::of(pieces, used))?
        })
        .collect();
    all.sort_by(|a, b| {
        let size = a.used.len().cmp(&b.used.len());
        size.then_with(|| a.error().total_cmp(&b.error()))
    });
    let mut best = 0;
    while let Some(next) = (best + 1..all.len())
        .find(|k| all[*k].used.len() > all[best].used.len() && all[*k].beats(&all[best]))
    {
        best = next;
    }
    all.into_iter().nth(best).map(|terms| terms.used)
}

/// Shares of the supply, and which may be limited.
struct Shares {
    share: Vec<f64>,
    /// Rows with the drive on.
    on: Vec<usize>,
    largest: f64,
}

impl Shares {
    fn of(log: &Log) -> Self {
        let share: Vec<f64> = (log.u.iter().zip(&log.supply))
            .map(|(u, supply)| u / supply)
            .collect();
        let on: Vec<usize> = (0..log.t.len())
            .filter(|k| log.on[*k] && share[*k].is_finite())
            .collect();
        let largest = on.iter().fold(0.0_f64, |m, k| m.max(share[*k].abs()));
        Self { share, on, largest }
    }

    fn limited(&self, k: usize) -> bool {
        self.share[k].abs() >= LIMIT * self.largest
    }

    /// Returns the integral of the error at each row; with `clamped` it stops while the share is at its limit.
    fn integral(&self, log: &Log, clamped: bool) -> Vec<f64> {
        let error = |k: usize| log.reference[k] - log.q[k];
        let mut sum = 0.0;
        (0..log.t.len())
            .map(|k| {
                let stands = clamped && self.limited(k) && self.share[k] * error(k) > 0.0;
                if k > 0 && !stands {
                    sum += 0.5 * (error(k) + error(k - 1)) * (log.t[k] - log.t[k - 1]);
                }
                sum
            })
            .collect()
    }
}

/// A recording with all inputs of a controller.
struct Rows<'a> {
    log: &'a Log,
    shares: Shares,
    /// Integral of the position error at each row without and with clamping.
    integrals: [Vec<f64>; 2],
}

impl<'a> Rows<'a> {
    fn of(log: &'a Log) -> Self {
        let shares = Shares::of(log);
        let integrals = [false, true].map(|clamped| shares.integral(log, clamped));
        Self {
            log,
            shares,
            integrals,
        }
    }

    /// Returns the columns at row `k`.
    fn columns(&self, k: usize) -> [f64; COLUMNS] {
        let log = self.log;
        let (error, velocity) = (log.reference[k] - log.q[k], log.slope(k)[0]);
        let [free, clamped] = [self.integrals[0][k], self.integrals[1][k]];
        let [speed, acceleration] = [log.reference_velocity[k], log.reference_acceleration[k]];
        [error, -velocity, speed, acceleration, 1.0, free, clamped]
    }

    /// Returns the largest share if it is a limit: the gains demand more there, by more than their `scatter` elsewhere.
    /// Else returns the whole supply if that is known, because a bridge gives no more, or `None`.
    fn limit(&self, gains: &DVector<f64>, scatter: f64) -> Option<f64> {
        let Shares { share, on, largest } = &self.shares;
        let limited: Vec<usize> = (on.iter().copied())
            .filter(|k| self.shares.limited(*k))
            .collect();
        let beyond = |k: &usize| {
            let wish: f64 = (self.columns(*k).iter().zip(gains.iter()))
                .map(|(x, gain)| x * gain)
                .sum();
            wish * share[*k].signum() - largest
        };
        let mean = limited.iter().map(beyond).sum::<f64>() / limited.len().max(1) as f64;
        let supplied = self.log.supply.iter().any(|supply| *supply != 1.0);
        match (limited.len() >= AT_LIMIT && mean > scatter, supplied) {
            (true, _) => Some(*largest),
            (false, true) => Some(largest.max(1.0)),
            (false, false) => None,
        }
    }
}

impl Law {
    /// Fits the rows with the drive on and off its limit; `None` if they follow no such law.
    pub(crate) fn of(log: &Log) -> Option<Self> {
        let rows = log.t.len();
        if log.reference.len() != rows || log.u.len() != rows {
            return None;
        }
        let rows = Rows::of(log);
        let used: Vec<usize> = (rows.shares.on.iter().copied())
            .filter(|k| !rows.shares.limited(*k))
            .collect();
        if used.len() < FEWEST {
            return None;
        }
        let mut pieces = vec![Normal::new(); PIECES];
        for (n, &k) in used.iter().enumerate() {
            pieces[n * PIECES / used.len()].push(&rows.columns(k), rows.shares.share[k]);
        }
        let resolution = Resolution::of(log, &rows.shares.share);
        let columns = chosen(&pieces, &resolution)?;
        let whole = Normal::sum(pieces.iter());
        let mut gains = whole.solve(&columns)?;
        let left = whole.left(&gains);
        if !(left <= (1.0 - EXPLAINED) * whole.power) {
            return None;
        }
        let least = resolution.least(gains[0]);
        for column in [1, 2] {
            if gains[column].abs() <= least[column] {
                gains[column] = 0.0;
            }
        }
        let clamped = columns.contains(&CLAMPED);
        let limit = rows.limit(&gains, (left / used.len() as f64).sqrt());
        let [free, stopped] = rows.integrals;
        Some(Self {
            controller: VoltageController {
                proportional: gains[0],
                integral: gains[5] + gains[CLAMPED],
                derivative: gains[1],
                velocity_feedforward: gains[2],
                acceleration_feedforward: gains[3],
                bias: gains[4],
                limit,
                anti_windup: match clamped {
                    true => AntiWindup::Clamping,
                    false => AntiWindup::None,
                },
                // Until all recordings together determine it.
                supply: [1.0, 0.0],
            },
            integral: match (columns.contains(&5), clamped) {
                (true, _) => free,
                (_, true) => stopped,
                _ => Vec::new(),
            },
        })
    }
}

/// A supply by its readings: a line over the demanded share. A switching bridge makes a reading depend on its phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Supply {
    /// Voltage without load, V, and its change per share, V.
    line: [f64; 2],
    /// RMS of the readings about the line, V.
    scatter: f64,
}

impl Supply {
    /// Fits the supply of recordings: one line for all, because small shares alone do not determine it.
    pub(crate) fn of(logs: &[Log]) -> Self {
        let all = || logs.iter().flat_map(readings);
        let (mut sums, mut right) = (nalgebra::Matrix2::zeros(), nalgebra::Vector2::zeros());
        for [share, volts] in all() {
            let row = nalgebra::Vector2::new(1.0, share);
            sums += row * row.transpose();
            right += row * volts;
        }
        let rows = f64::max(sums[(0, 0)], 1.0);
        let solved = sums.lu().solve(&right);
        let line = solved.map_or([right[0] / rows, 0.0], |line| [line[0], line[1]]);
        let off = |[share, volts]: [f64; 2]| volts - line[0] - line[1] * share;
        let squares: f64 = all().map(|at| off(at).powi(2)).sum();
        Self {
            line,
            scatter: (squares / rows).sqrt(),
        }
    }

    /// Returns the supply with a known line; the scatter stays.
    pub(crate) fn with_line(self, line: [f64; 2]) -> Self {
        Self { line, ..self }
    }

    /// Gives this supply to the controllers of `logs`. A recording has its own voltage without load if its readings
    /// differ from the line by more than their scatter in the mean.
    pub(crate) fn give(&self, logs: &mut [Log]) {
        for log in logs {
            let [off, rows] = readings(log)
                .into_iter()
                .fold([0.0; 2], |sum, [share, volts]| {
                    [
                        sum[0] + volts - self.line[0] - self.line[1] * share,
                        sum[1] + 1.0,
                    ]
                });
            let mean = off / f64::max(rows, 1.0);
            let own = if mean.abs() > self.scatter { mean } else { 0.0 };
            if let Some(law) = &mut log.law {
                law.supply = [self.line[0] + own, self.line[1]];
            }
        }
    }
}

/// Returns share and reading of the supply, V, for rows with the drive on.
fn readings(log: &Log) -> Vec<[f64; 2]> {
    let shares = Shares::of(log);
    let reading = |k: &usize| [shares.share[*k].abs(), log.supply[*k]];
    shares.on.iter().map(reading).collect()
}
