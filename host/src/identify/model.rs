//! Rows of the two models, streamed from a recording.

use rig_shared::multibody::{COLUMNS, Chain, column, differential_regressor, energy_regressor};

use super::cache::RowCache;
use super::{IdentifyError, ModelKind};
use crate::prepare::{Masked, Motion, PrepareError, Recording, Treatment, each_motion};

/// How rows are formed.
pub struct Plan<'a> {
    /// Geometry.
    pub chain: &'a Chain<f64>,
    /// Columns of the standard regressor that are wanted (the base parameters').
    pub columns: &'a [usize],
    /// What is done to the recordings.
    pub treatment: &'a Treatment,
    /// Length of a window of the integral model, rows at the full rate.
    pub window: usize,
    /// Distance between the starts of neighbouring windows, rows at the full rate.
    pub stride: usize,
    /// Per joint, how loud its torque is taken to be in the energy balance (its RMS), N·m or N.
    pub loudness: Vec<f64>,
    /// Rows made so far.
    pub cache: RowCache,
}

/// One equation at many instants: x·β = y.
#[derive(Clone, Debug, Default)]
pub struct Equation {
    /// Row-major, rows × columns.
    pub x: Vec<f64>,
    /// Torque, or the energy of a window scaled to a torque.
    pub y: Vec<f64>,
    /// Whether the row is used.
    pub keep: Vec<bool>,
}

/// Rows of one piece.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// s (start of the window for the integral model)
    pub t: Vec<f64>,
    /// One a joint for the differential model, one for the integral model.
    pub equations: Vec<Equation>,
    /// Per joint, position at each row.
    pub q: Vec<Vec<f64>>,
    /// Per joint, velocity at each row.
    pub qd: Vec<Vec<f64>>,
}

/// Rows left out so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rows used, over all equations.
    pub used: u64,
    /// Per joint (or window), too slow.
    pub slow: Vec<u64>,
    /// Per joint (or window), saturated.
    pub saturated: Vec<u64>,
    /// Rows, before decimation, of stretches between gaps that are shorter than the filters need.
    pub short: u64,
}

impl Tally {
    fn count(list: &mut Vec<u64>, k: usize) {
        if list.len() <= k {
            list.resize(k + 1, 0);
        }
        list[k] += 1;
    }

    /// As entries for a report.
    pub fn masked(&self, model: ModelKind) -> Vec<Masked> {
        let joint = |k: usize| match model {
            ModelKind::Differential => k + 1,
            ModelKind::Integral => 0,
        };
        let entries = |list: &[u64], why: &str| {
            list.iter()
                .enumerate()
                .filter(|(_, rows)| **rows > 0)
                .map(|(k, rows)| Masked {
                    joint: joint(k),
                    rows: *rows,
                    why: why.to_owned(),
                })
                .collect::<Vec<_>>()
        };
        let mut all = entries(
            &self.slow,
            "speed below the threshold: friction there is not Coulomb and viscous, or its sign is not known",
        );
        all.extend(entries(&self.saturated, "torque at its limit"));
        if self.short > 0 {
            all.push(Masked {
                joint: 0,
                rows: self.short,
                why: "rows of stretches between gaps in time that are too short for the filters"
                    .into(),
            });
        }
        all
    }
}

/// Streams the rows of `recording` into `take`.
///
/// # Errors
/// What reading or `take` gives.
pub fn each_rows(
    recording: &dyn Recording,
    plan: &Plan,
    model: ModelKind,
    take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
) -> Result<Tally, IdentifyError> {
    if let Some(tally) = plan.cache.replay(recording, model, take)? {
        return Ok(tally);
    }
    plan.cache.keep(
        recording,
        model,
        |keep| make_rows(recording, plan, model, keep),
        take,
    )
}

fn make_rows(
    recording: &dyn Recording,
    plan: &Plan,
    model: ModelKind,
    take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
) -> Result<Tally, IdentifyError> {
    let mut tally = Tally::default();
    let reach = match model {
        ModelKind::Differential => 0,
        ModelKind::Integral => plan.window,
    };
    each_motion(recording, plan.treatment, reach, &mut |motion| {
        if motion.usable.0 >= motion.usable.1 {
            tally.short += motion.t.len() as u64;
        }
        take(&rows_of(motion, plan, model, &mut tally)?)
    })?;
    Ok(tally)
}

/// Rows of one piece of motion.
pub(super) fn rows_of(
    motion: &Motion,
    plan: &Plan,
    model: ModelKind,
    tally: &mut Tally,
) -> Result<Rows, PrepareError> {
    match model {
        ModelKind::Differential => differential_rows(motion, plan, tally),
        ModelKind::Integral => integral_rows(motion, plan, tally),
    }
}

fn failed(e: impl std::fmt::Display) -> PrepareError {
    PrepareError::Stopped(e.to_string())
}

/// Torque and regressor at the full rate, all passed through the parallel low-pass, one row in so many kept.
fn differential_rows(
    motion: &Motion,
    plan: &Plan,
    tally: &mut Tally,
) -> Result<Rows, PrepareError> {
    let n = motion.joints.len();
    let (rows, p) = (motion.t.len(), plan.columns.len());
    let width = n * COLUMNS;
    let low_pass = plan
        .treatment
        .parallel_low_pass()
        .ok_or_else(|| failed("The parallel low-pass cannot be built."))?;
    // Column-major so that each column is filtered in place: [equation][column][row].
    let mut columns = vec![vec![vec![0.0; rows]; p]; n];
    let (mut q, mut qd, mut qdd) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut out = vec![0.0; n * width];
    for k in 0..rows {
        for (j, joint) in motion.joints.iter().enumerate() {
            (q[j], qd[j], qdd[j]) = (joint.q[k], joint.qd[k], joint.qdd[k]);
        }
        differential_regressor(plan.chain, &q, &qd, &qdd, &mut out).map_err(failed)?;
        for (j, equation) in columns.iter_mut().enumerate() {
            for (c, column) in equation.iter_mut().enumerate() {
                column[k] = out[j * width + plan.columns[c]];
            }
        }
    }
    let step = plan.treatment.decimation;
    let picked: Vec<usize> = (motion.usable.0..motion.usable.1)
        .filter(|k| (motion.offset + *k as u64).is_multiple_of(step as u64))
        .collect();
    let mut result = Rows {
        t: picked.iter().map(|&k| motion.t[k]).collect(),
        q: motion
            .joints
            .iter()
            .map(|j| picked.iter().map(|&k| j.q[k]).collect())
            .collect(),
        qd: motion
            .joints
            .iter()
            .map(|j| picked.iter().map(|&k| j.qd[k]).collect())
            .collect(),
        ..Default::default()
    };
    for (j, joint) in motion.joints.iter().enumerate() {
        let mut equation = Equation {
            x: vec![0.0; picked.len() * p],
            ..Default::default()
        };
        for (c, column) in columns[j].iter().enumerate() {
            if column.iter().any(|v| *v != 0.0) {
                let filtered = low_pass.zero_phase(column);
                for (row, &k) in picked.iter().enumerate() {
                    equation.x[row * p + c] = filtered[k];
                }
            }
        }
        let torque = low_pass.zero_phase(&joint.tau);
        for &k in &picked {
            equation.y.push(torque[k]);
            // A passing reversal is the model's business; where the joint is slow for longer than the
            // low-pass remembers, its neighbours carry the torque of standing still too.
            let around = |reach: usize| k.saturating_sub(reach)..(k + reach + 1).min(rows);
            let dwells = around(step).all(|i| joint.slow[i])
                || around(2 * step).filter(|i| joint.slow[*i]).count() > 3 * step.max(2);
            let slow = joint.slow[k] || dwells;
            let saturated = around(step).any(|i| joint.saturated[i]);
            if saturated {
                Tally::count(&mut tally.saturated, j);
            } else if slow {
                Tally::count(&mut tally.slow, j);
            } else {
                tally.used += 1;
            }
            equation.keep.push(!saturated && !slow);
        }
        result.equations.push(equation);
    }
    Ok(result)
}

/// Work done over windows against the change of energy and the work of friction:
/// ∫ τᵀq̇ dt = H(end) − H(start) + Σ (fv·∫q̇² + fc·∫|q̇| + off·∫q̇).
///
/// The torque passes the position's filter, and so does the sign of the velocity: what the filter takes from
/// one side it takes from the other. Each window is divided by √(W·∫Σ(loudness·q̇)²), which makes the residuals of
/// all windows equally uncertain (noise of the torque enters the work multiplied by the velocity) and gives
/// them the unit of a torque.
fn integral_rows(motion: &Motion, plan: &Plan, tally: &mut Tally) -> Result<Rows, PrepareError> {
    let n = motion.joints.len();
    let (rows, p) = (motion.t.len(), plan.columns.len());
    let width = n * COLUMNS;
    let dt = plan.treatment.dt();
    let low_pass = plan
        .treatment
        .position_filter()
        .ok_or_else(|| failed("The position filter cannot be built."))?;
    let cumulative = |power: &dyn Fn(usize) -> f64| {
        let mut sum = 0.0;
        let mut last = power(0);
        let mut all = Vec::with_capacity(rows);
        all.push(0.0);
        for k in 1..rows {
            let next = power(k);
            sum += 0.5 * dt * (last + next);
            last = next;
            all.push(sum);
        }
        all
    };
    if rows == 0 {
        return Ok(Rows::default());
    }
    let loudest = plan.loudness.iter().fold(0.0f64, |m, x| m.max(*x));
    let loudness: Vec<f64> = plan.loudness.iter().map(|l| l / loudest).collect();
    let mut work = vec![0.0; rows];
    let mut activity = vec![0.0; rows];
    let mut least_activity = 0.0;
    // Per joint: ∫q̇², ∫sgn(q̇)·q̇, ∫q̇.
    let mut friction = Vec::with_capacity(n);
    for (j, joint) in motion.joints.iter().enumerate() {
        let qd = &joint.qd;
        let torque = low_pass.zero_phase(&joint.tau);
        let sign: Vec<f64> = qd
            .iter()
            .map(|v| rig_shared::scalar::Real::sgn(*v))
            .collect();
        let sign = low_pass.zero_phase(&sign);
        let squares = cumulative(&|k| qd[k] * qd[k]);
        for (sum, part) in work.iter_mut().zip(cumulative(&|k| torque[k] * qd[k])) {
            *sum += part;
        }
        let share = loudness[j].powi(2);
        for (sum, part) in activity.iter_mut().zip(&squares) {
            *sum += share * part;
        }
        least_activity +=
            share * plan.treatment.speed_threshold[j].powi(2) * plan.window as f64 * dt;
        friction.push([
            squares,
            cumulative(&|k| sign[k] * qd[k]),
            cumulative(&|k| qd[k]),
        ]);
    }
    let duration = plan.window as f64 * dt;
    let mut result = Rows {
        equations: vec![Equation::default()],
        q: vec![Vec::new(); n],
        qd: vec![Vec::new(); n],
        ..Default::default()
    };
    let (mut before, mut after) = (vec![0.0; width], vec![0.0; width]);
    for start in motion.usable.0..motion.usable.1 {
        let end = start + plan.window;
        if !(motion.offset + start as u64).is_multiple_of(plan.stride as u64)
            || end >= motion.sound_end
        {
            continue;
        }
        for (k, out) in [(start, &mut before), (end, &mut after)] {
            let q: Vec<f64> = motion.joints.iter().map(|j| j.q[k]).collect();
            let qd: Vec<f64> = motion.joints.iter().map(|j| j.qd[k]).collect();
            energy_regressor(plan.chain, &q, &qd, out).map_err(failed)?;
        }
        let moved = activity[end] - activity[start];
        let scale = 1.0
            / (duration * (moved + least_activity))
                .sqrt()
                .max(f64::MIN_POSITIVE);
        let equation = &mut result.equations[0];
        for &c in plan.columns.iter().take(p) {
            let joint = &friction[c / COLUMNS];
            let over = |f: &[f64]| f[end] - f[start];
            equation.x.push(
                scale
                    * match c % COLUMNS {
                        column::VISCOUS => over(&joint[0]),
                        column::COULOMB => over(&joint[1]),
                        column::OFFSET => over(&joint[2]),
                        _ => after[c] - before[c],
                    },
            );
        }
        equation.y.push(scale * (work[end] - work[start]));
        let still = moved <= least_activity;
        let saturated = motion
            .joints
            .iter()
            .any(|j| j.saturated[start..=end].iter().any(|s| *s));
        if saturated {
            Tally::count(&mut tally.saturated, 0);
        } else if still {
            Tally::count(&mut tally.slow, 0);
        } else {
            tally.used += 1;
        }
        equation.keep.push(!still && !saturated);
        result.t.push(motion.t[start]);
        for (j, joint) in motion.joints.iter().enumerate() {
            result.q[j].push(joint.q[start]);
            result.qd[j].push(joint.qd[start]);
        }
    }
    Ok(result)
}
