//! What the rows of a set show, from one pass over its recordings.

use nalgebra::DMatrix;
use rig_identify::{Base, Identification, IdentifyError, ModelKind, Rows, TriangularFactor};
use rig_model::robot::Robot;

use crate::friction_drift::{Drift, Stretches};
use crate::motion_groups::MotionGroups;
use crate::period::Repeating;
use crate::rows::each_row;
use crate::set::RecordingSet;

/// RMS torque, speed and acceleration of each joint.
#[derive(Clone)]
pub(crate) struct MotionSizes {
    /// N·m or N
    pub torque: Vec<f64>,
    /// rad/s or m/s
    pub speed: Vec<f64>,
    /// rad/s² or m/s²
    pub acceleration: Vec<f64>,
}

/// What the rows of a set show.
#[derive(Clone)]
pub(crate) struct SetRows {
    /// By joint, the rows over the base parameters, torque against motion.
    pub factors: Vec<TriangularFactor>,
    /// Sizes of its motion.
    pub sizes: MotionSizes,
    /// By joint, the change of its friction, if the recordings are long enough to show one.
    pub drifts: Vec<Drift>,
    /// If the motion repeats: the rows by place in the motion, and the same rows by time alone.
    pub groups: Option<[MotionGroups; 2]>,
}

/// Sums of squares of a joint's motion.
#[derive(Clone, Copy, Default)]
struct Motion {
    rows: f64,
    speed: f64,
    acceleration: f64,
}

/// What is collected while the rows pass.
struct Collected<'a> {
    /// Base parameters of the set.
    values: &'a [f64],
    /// By joint, one over its residual; 0 if it has none.
    weights: Vec<f64>,
    /// By recording of a motion that repeats, its beginning, see [`Repeating`].
    begins: Vec<f64>,
    /// Recording and its first time.
    start: Option<(usize, f64)>,
    factors: Vec<TriangularFactor>,
    motion: Vec<Motion>,
    stretches: Vec<Stretches>,
    groups: Option<[MotionGroups; 2]>,
}

impl Collected<'_> {
    fn take(&mut self, recording: usize, rows: &Rows) {
        let Some(first) = rows.t.first() else {
            return;
        };
        let start = match self.start {
            Some((of, start)) if of == recording => start,
            _ => *first,
        };
        self.start = Some((recording, start));
        let begin = self.begins.get(recording).copied().unwrap_or(0.0);
        let p = self.values.len();
        for (j, equation) in rows.equations.iter().enumerate() {
            for k in 0..rows.t.len() {
                let time = rows.t[k] - start;
                if equation.keep[k] {
                    let x = &equation.x[k * p..(k + 1) * p];
                    self.factors[j].push(x, equation.y[k], 1.0);
                    self.stretches[j].push((equation, k), self.values, time);
                    if let Some(groups) = &mut self.groups {
                        let fitted: f64 = x.iter().zip(self.values).map(|(x, v)| x * v).sum();
                        for own in groups {
                            own.push(begin + time, x, equation.y[k] - fitted, self.weights[j]);
                        }
                    }
                }
                let motion = &mut self.motion[j];
                motion.rows += 1.0;
                motion.speed += rows.qd[j][k].powi(2);
                if k > 0 {
                    let slope = (rows.qd[j][k] - rows.qd[j][k - 1]) / (rows.t[k] - rows.t[k - 1]);
                    motion.acceleration += slope * slope;
                }
            }
        }
    }

    fn finished(self) -> SetRows {
        let rms = |of: fn(&Motion) -> f64| -> Vec<f64> {
            let one = |m: &Motion| (of(m) / m.rows.max(1.0)).sqrt();
            self.motion.iter().map(one).collect()
        };
        let torque =
            |f: &TriangularFactor| (f.right_side_squares() / f.rows().max(1) as f64).sqrt();
        let sizes = MotionSizes {
            torque: self.factors.iter().map(torque).collect(),
            speed: rms(|m| m.speed),
            acceleration: rms(|m| m.acceleration),
        };
        SetRows {
            sizes,
            drifts: (self.stretches.iter().enumerate())
                .filter_map(|(j, own)| own.drift(j))
                .collect(),
            factors: self.factors,
            groups: self.groups,
        }
    }
}

impl SetRows {
    /// Streams the rows of a set. `values`: its base parameters. `repeating`: how its motion repeats.
    ///
    /// # Errors
    /// Recordings that cannot be read.
    pub(crate) fn of(
        robot: &Robot,
        base: &Base,
        set: &RecordingSet,
        found: &Identification,
        values: &[f64],
        repeating: Option<&Repeating>,
    ) -> Result<Self, IdentifyError> {
        let joints = robot.joints.len();
        let treatment = &found.details.treatment;
        let row = treatment.decimation as f64 * treatment.dt();
        let memory = found.details.estimate.memory_rows * row;
        let groups = |length: f64| MotionGroups::new(base.len(), length, memory);
        let weight = |rms: f64| if rms > 0.0 { 1.0 / rms } else { 0.0 };
        let mut all = Collected {
            values,
            weights: (found.joints.iter())
                .map(|joint| weight(joint.train_residual_rms))
                .collect(),
            begins: repeating.map_or_else(Vec::new, |own| own.begins.clone()),
            start: None,
            factors: vec![TriangularFactor::new(base.len()); joints],
            motion: vec![Motion::default(); joints],
            stretches: (0..joints).map(|j| Stretches::new(base, j)).collect(),
            groups: repeating.map(|own| [own.period, own.length].map(groups)),
        };
        let mut take = |recording: usize, rows: &Rows| all.take(recording, rows);
        let differential = ModelKind::Differential;
        each_row(robot, base, &set.recordings, found, differential, &mut take)?;
        Ok(all.finished())
    }

    /// Returns XᵀX of the base parameters over all joints, each in units of its residual.
    pub(crate) fn information(&self, found: &Identification) -> DMatrix<f64> {
        let p = self.factors.first().map_or(0, TriangularFactor::columns);
        let mut sum = DMatrix::zeros(p, p);
        for (factor, joint) in self.factors.iter().zip(&found.joints) {
            let noise = joint.train_residual_rms;
            if noise > 0.0 && noise.is_finite() {
                let (r, _) = factor.system();
                sum += r.transpose() * &r / (noise * noise);
            }
        }
        sum
    }
}
