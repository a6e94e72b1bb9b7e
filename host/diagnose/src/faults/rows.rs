//! A recording as a few thousand rows: means over short stretches, for regressor and torque alike.

use core::ops::Range;

use nalgebra::DMatrix;
use rig_shared::multibody::COLUMNS;
use rig_shared::transmission::{MOTOR_COLUMNS, Transmission};

use crate::DiagnoseError;
use rig_data::runs::Run;
use rig_data::{PILE_UP, Stretch, plateaus};
use rig_identify::{chain_of, transmission_of};
use rig_model::batch::ChainBatch;
use rig_model::robot::Robot;
use rig_numerics::statistics;

/// Rows per second: slow against the noise, fast against the motion of drives.
const RATE: f64 = 50.0;
/// Most rows; a column's fault is the same in all of them.
const MOST: usize = 6000;

/// Returns an error of the model.
pub(crate) fn model_error(error: impl ToString) -> DiagnoseError {
    DiagnoseError::Model(error.to_string())
}

/// Structure of the regressors: links, and drives that move more than their own joint.
pub(crate) struct Form {
    chain: ChainBatch,
    drives: Option<Transmission<f64>>,
}

impl Form {
    /// Returns the form of a description.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if geometry or drives are not valid.
    pub(crate) fn of(robot: &Robot) -> Result<Self, DiagnoseError> {
        let drives = transmission_of(robot).map_err(model_error)?;
        Ok(Self {
            chain: ChainBatch::new(&chain_of(robot).map_err(model_error)?),
            drives: (!drives.is_simple()).then_some(drives),
        })
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.chain.joint_count()
    }

    /// Returns the number of columns: the joints' own, then the motors'.
    pub(crate) fn width(&self) -> usize {
        let motors = self.drives.as_ref().map_or(0, |_| MOTOR_COLUMNS);
        self.chain.joint_count() * (COLUMNS + motors)
    }
}

/// Means over stretches of equal length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// s between rows
    pub(crate) period: f64,
    /// Middle of each row, s on the clock of the recording.
    pub(crate) t: Vec<f64>,
    /// True where the drive was off, or an event left out, for a part of the row.
    pub(crate) off: Vec<bool>,
    /// Position, velocity, acceleration and torque, joint by joint.
    pub(crate) q: Vec<Vec<f64>>,
    pub(crate) qd: Vec<Vec<f64>>,
    pub(crate) qdd: Vec<Vec<f64>>,
    pub(crate) tau: Vec<Vec<f64>>,
    /// Share of the samples of each row at the highest or lowest torque of the recording, if they pile up there, in one
    /// value or as noise about a level.
    pub(crate) cut: Vec<Vec<f64>>,
}

/// Returns the highest torque if more samples are `near` it than a smooth torque in steps has in its top level;
/// infinity if not.
fn pile(values: &[f64], near: f64) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let below = values.iter().copied().filter(|v| *v < top - near);
    let next = below.fold(f64::NEG_INFINITY, f64::max);
    let at = |level: f64| {
        let own = values.iter().filter(|v| (**v - level).abs() <= near);
        own.count() as f64
    };
    match at(top) > PILE_UP * at(next) {
        true => top,
        false => f64::INFINITY,
    }
}

/// Returns the torques of a joint beyond which rows are cut, at the lowest and at the highest ones: those within `near` of
/// a value where they pile up, or a band of noise about a level; infinite if there is none.
fn cut_beyond(runs: &[&Run], joint: usize, all: &[f64], near: f64) -> [f64; 2] {
    let high = pile(all, near) - near;
    let low = near - pile(&all.iter().map(|v| -v).collect::<Vec<_>>(), near);
    let own = runs.iter().filter_map(|run| run.joints.get(joint));
    let stretches: Vec<Stretch<'_>> = own
        .map(|own| [own.tau.as_slice(), own.qd.as_slice()])
        .collect();
    let [noisy_low, noisy_high] = plateaus(&stretches);
    [
        match (low.is_finite(), noisy_low) {
            (false, Some(noisy)) => noisy.edge,
            _ => low,
        },
        match (high.is_finite(), noisy_high) {
            (false, Some(noisy)) => noisy.edge,
            _ => high,
        },
    ]
}

impl Rows {
    /// Returns the first rows of one recording with torque.
    pub(crate) fn of(runs: &[&Run], joints: usize) -> Self {
        Self::first(runs, joints, MOST)
    }

    /// Returns rows over all of one recording with torque: every n-th where there are too many.
    pub(crate) fn over_all(runs: &[&Run], joints: usize) -> Self {
        Self::first(runs, joints, usize::MAX).thinned(MOST)
    }

    fn first(runs: &[&Run], joints: usize, most: usize) -> Self {
        let rate = runs.first().map_or(RATE, |run| run.rate);
        let stride = (rate / RATE).round().max(1.0) as usize;
        let mut rows = Self {
            period: stride as f64 / rate,
            t: Vec::new(),
            off: Vec::new(),
            q: vec![Vec::new(); joints],
            qd: vec![Vec::new(); joints],
            qdd: vec![Vec::new(); joints],
            tau: vec![Vec::new(); joints],
            cut: vec![Vec::new(); joints],
        };
        for j in 0..joints {
            let own = runs.iter().filter_map(|run| run.joints.get(j));
            let all: Vec<f64> = own.flat_map(|own| own.tau.iter().copied()).collect();
            let near = 1e-6 * all.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let [low, high] = cut_beyond(runs, j, &all, near);
            for run in runs {
                let Some(joint) = run.joints.get(j) else {
                    continue;
                };
                let mean = |x: &[f64], from: usize| statistics::mean(&x[from..from + stride]);
                let columns = [&joint.q, &joint.qd, &joint.qdd, &joint.tau];
                let whole = columns.iter().map(|x| x.len()).min().unwrap_or(0) / stride;
                for k in (0..whole.min(most.saturating_sub(rows.q[j].len()))).map(|k| k * stride) {
                    if j == 0 {
                        let away = |range: &Range<usize>| range.start < k + stride && k < range.end;
                        rows.t.push(mean(&run.t, k));
                        rows.off
                            .push(run.coasting.iter().chain(&run.left_out).any(away));
                    }
                    rows.q[j].push(mean(&joint.q, k));
                    rows.qd[j].push(mean(&joint.qd, k));
                    rows.qdd[j].push(mean(&joint.qdd, k));
                    rows.tau[j].push(mean(&joint.tau, k));
                    let at = joint.tau[k..k + stride]
                        .iter()
                        .filter(|v| **v >= high || **v <= low)
                        .count();
                    rows.cut[j].push(at as f64 / stride as f64);
                }
            }
        }
        rows
    }

    /// Returns the number of rows.
    pub(crate) fn len(&self) -> usize {
        self.q.first().map_or(0, Vec::len)
    }

    /// Returns the rows as if the joint, or all joints for `None`, had moved `factor` times as far.
    pub(crate) fn rescaled(&self, joint: Option<usize>, factor: f64) -> Self {
        let mut rows = self.clone();
        for columns in [&mut rows.q, &mut rows.qd, &mut rows.qdd] {
            for (j, column) in columns.iter_mut().enumerate() {
                if joint.is_none_or(|k| k == j) {
                    column.iter_mut().for_each(|v| *v *= factor);
                }
            }
        }
        rows
    }

    /// Returns every n-th row, at most `most`, so that many trials are cheap.
    pub(crate) fn thinned(&self, most: usize) -> Self {
        let step = self.len().div_ceil(most.max(1)).max(1);
        let thin = |columns: &[Vec<f64>]| {
            columns
                .iter()
                .map(|c| c.iter().copied().step_by(step).collect())
                .collect()
        };
        Self {
            period: self.period * step as f64,
            t: self.t.iter().copied().step_by(step).collect(),
            off: self.off.iter().copied().step_by(step).collect(),
            q: thin(&self.q),
            qd: thin(&self.qd),
            qdd: thin(&self.qdd),
            tau: thin(&self.tau),
            cut: thin(&self.cut),
        }
    }

    /// Returns the regressor of each joint's torque, rows × [`Form::width`]: the joints' standard parameters, then the
    /// motors' own for coupled drives.
    pub(crate) fn regressors(&self, form: &Form) -> Result<Vec<DMatrix<f64>>, DiagnoseError> {
        let (n, rows) = (form.chain.joint_count(), self.len());
        let links = n * COLUMNS;
        let mut block = form.chain.block(rows);
        form.chain
            .differential_regressor(&self.q, &self.qd, &self.qdd, &mut block)
            .map_err(model_error)?;
        let motors = self.of_motors(form)?;
        Ok((0..n)
            .map(|j| {
                let mut matrix = DMatrix::zeros(rows, form.width());
                for c in 0..links {
                    matrix.column_mut(c).copy_from_slice(block.column(j, c));
                }
                if let Some(own) = motors.get(j) {
                    matrix.columns_mut(links, own.ncols()).copy_from(own);
                }
                matrix
            })
            .collect())
    }

    /// Returns the motors' columns in each joint's torque, rows × [`MOTOR_COLUMNS`] n; empty without coupled drives. A
    /// screw beyond its reach has no valid numbers there, and no fit uses such a column.
    pub(crate) fn of_motors(&self, form: &Form) -> Result<Vec<DMatrix<f64>>, DiagnoseError> {
        let Some(drives) = &form.drives else {
            return Ok(Vec::new());
        };
        let n = form.chain.joint_count();
        let width = n * MOTOR_COLUMNS;
        let mut all = vec![DMatrix::zeros(self.len(), width); n];
        let mut columns = vec![0.0; n * width];
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for row in 0..self.len() {
            for (now, lists) in state.iter_mut().zip([&self.q, &self.qd, &self.qdd]) {
                for (to, list) in now.iter_mut().zip(lists) {
                    *to = list[row];
                }
            }
            drives
                .motor_columns(&state[0], &state[1], &state[2], &mut columns)
                .map_err(model_error)?;
            for (matrix, own) in all.iter_mut().zip(columns.chunks_exact(width)) {
                for (c, value) in own.iter().enumerate() {
                    matrix[(row, c)] = *value;
                }
            }
        }
        Ok(all)
    }
}
