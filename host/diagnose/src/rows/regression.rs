//! Regression rows of runs: torque and nominal regressor, low-passed, decimated, masked.

use std::ops::Range;

use nalgebra::Vector3;
use rig_shared::lanes::Lanes;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use crate::columns::transmission::ABREAST;
use rig_data::prepare::{LowPass, Treatment, central_difference, second_difference};
use rig_data::runs::Run;
use rig_identify::{Base, ModelKind, chain_of, transmission_of};
use rig_model::batch::{BLOCK, ChainBatch, RegressorBlock};
use rig_model::robot::{JointKind, Robot};

/// Share of slow or saturated samples around a row above which the row is not used. It is the low-passed indicator of
/// such samples. Before a reversal, stiction may lie anywhere between the Coulomb friction of both directions. So a
/// kept row may have an error of twice this share of the dry friction.
const SPOILT: f64 = 0.03;
/// The same share above which a row near standstill is not usable either.
pub(crate) const ILLEGIBLE: f64 = 0.1;

/// Fewest rows near standstill that allow a comparison of their residual.
const FEWEST_ABOUT_RESTS: usize = 20;

/// Periods of the position filter's cut-off frequency by which the filter may shift a reversal. It rounds the corner
/// where friction changes sign, or stops the joint for a moment.
const SMEAR: f64 = 0.2;

/// Largest share of standstill or reversal around a clear row. Twice this share of dry friction is below most noise.
const CLEAR: f64 = 0.005;

/// Power loss by the position filter at the upper edge of the low-pass above which the filter matters.
const HEARD: f64 = 1e-4;

/// Highest cut-off as a share of half the sample rate, as for the position filter.
const WIDEST: f64 = 0.8;

/// Sine of the angle below which two directions are parallel.
const PARALLEL: f64 = 1e-6;

/// A signal on the kept rows, joint by joint; None if it is zero throughout.
pub(crate) type Column = Vec<Option<Vec<f64>>>;

/// Σ factor·column over the `joints` of the columns.
pub(crate) fn combined<'a>(
    joints: usize,
    terms: impl IntoIterator<Item = (&'a Column, f64)>,
) -> Column {
    let mut sum: Column = vec![None; joints];
    for (column, factor) in terms {
        for (to, from) in sum.iter_mut().zip(column) {
            let Some(from) = from else { continue };
            let to = to.get_or_insert_with(|| vec![0.0; from.len()]);
            for (t, x) in to.iter_mut().zip(from) {
                *t += factor * x;
            }
        }
    }
    sum
}

/// Low-pass and decimation of the torque and of every regressor column.
///
/// The motion has already passed the position filter. The torque has not, and neither has a nonlinear function of the
/// motion, such as the sign of the velocity. These signals pass that filter here. Otherwise both sides of the equation
/// would differ by its loss where its cut-off is near the band of the rows.
///
/// Inertia, gravity and velocity products are not linear in the motion either: M(q)·q̈ of the filtered motion is not
/// the filtered M(q)·q̈. If the filter matters in the band, their columns use a motion behind a [`wide`] filter without
/// loss in the band. Like the torque, they then pass the position filter here.
#[derive(Clone, Debug)]
pub(crate) struct Thinning {
    low_pass: LowPass,
    /// The position filter, and whether it removes anything that the low-pass passes.
    position: LowPass,
    accepted_by_observer: bool,
    /// The filter of the motion for link columns, if the position filter matters.
    wide: Option<(f64, LowPass)>,
    step: usize,
    /// Samples with transients of the position filter at either end. They are cut before the low-pass.
    spoilt: usize,
    smear: f64,
}

impl Thinning {
    /// Creates the filters of a treatment.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if a filter cannot be built.
    pub(crate) fn of(treatment: &Treatment) -> Result<Self, DiagnoseError> {
        let low_pass = treatment
            .parallel_low_pass()
            .ok_or_else(|| DiagnoseError::Model("its low-pass cannot be built.".into()))?;
        let position = treatment.position_filter().ok_or_else(|| {
            DiagnoseError::Model("the filter of its position cannot be built.".into())
        })?;
        // Power loss: the filter runs forward and backward.
        let taken = 1.0
            - position
                .gain(treatment.parallel_edge, treatment.sample_rate)
                .powi(2);
        let accepted_by_observer = taken > HEARD;
        Ok(Self {
            low_pass,
            position,
            accepted_by_observer,
            wide: accepted_by_observer.then(|| wide(treatment)).flatten(),
            step: treatment.decimation.max(1),
            spoilt: treatment.trimmed,
            smear: SMEAR / treatment.cutoff,
        })
    }

    /// Returns the time between rows of a run with this sample rate, s.
    pub(crate) fn period(&self, rate: f64) -> f64 {
        self.step as f64 / rate
    }

    /// Returns the cut-off of the position for link columns, Hz, if it differs from that of the position filter.
    pub(crate) fn links_cutoff(&self) -> Option<f64> {
        self.wide.as_ref().map(|(cutoff, _)| *cutoff)
    }

    /// Returns the motion for link columns, if it differs from the filtered motion.
    fn wide_motion(&self, run: &Run) -> Option<[Vec<Vec<f64>>; 3]> {
        let (_, filter) = self.wide.as_ref()?;
        let step = 1.0 / run.rate;
        let mut motion = [(); 3].map(|()| Vec::with_capacity(run.joints.len()));
        for joint in &run.joints {
            let q = filter.zero_phase(&joint.q_raw);
            motion[1].push(central_difference(&q, step));
            motion[2].push(second_difference(&q, step));
            motion[0].push(q);
        }
        Some(motion)
    }

    /// Returns the time by which the position filter may shift a reversal, s.
    pub(crate) fn smear(&self) -> f64 {
        self.smear
    }

    /// Returns the samples without transients of the position filter, for a run of `samples`.
    fn sound(&self, samples: usize) -> Range<usize> {
        self.spoilt..samples.saturating_sub(self.spoilt).max(self.spoilt)
    }

    /// Returns the time from the start of a run to its first row, s.
    pub(crate) fn trimmed(&self, run: &Run) -> f64 {
        self.spoilt as f64 / run.rate
    }

    /// Returns the kept samples of a run of `samples`.
    fn kept(&self, samples: usize) -> impl Iterator<Item = usize> {
        self.sound(samples).step_by(self.step)
    }

    /// Appends the rows of a full-rate signal to `out`. The signal must be linear in the filtered motion.
    pub(crate) fn push(&self, signal: &[f64], out: &mut Vec<f64>) {
        let sound = signal.get(self.sound(signal.len())).unwrap_or_default();
        let smooth = self.low_pass.zero_phase_even(sound);
        out.extend(smooth.into_iter().step_by(self.step));
    }

    /// Appends the rows of a signal that has not passed the position filter.
    pub(crate) fn push_raw(&self, signal: &[f64], out: &mut Vec<f64>) {
        match self.accepted_by_observer {
            true => self.push(&self.position.zero_phase_even(signal), out),
            false => self.push(signal, out),
        }
    }

    /// Applies the position filter, without decimation.
    pub(crate) fn calm(&self, signal: &[f64]) -> Vec<f64> {
        self.position.zero_phase(signal)
    }

    /// Applies the low-pass, without decimation.
    pub(crate) fn smooth(&self, signal: &[f64]) -> Vec<f64> {
        self.low_pass.zero_phase(signal)
    }

    /// Returns the rows of signals of equal length that are linear in the filtered motion.
    pub(crate) fn thinned(&self, signals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.thinned_behind(None, signals)
    }

    /// Returns the rows of signals that have not passed the position filter.
    pub(crate) fn thinned_raw(&self, signals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.thinned_behind(self.accepted_by_observer.then_some(&self.position), signals)
    }

    fn thinned_behind(&self, before: Option<&LowPass>, signals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut thin = Vec::with_capacity(signals.len());
        for four in signals.chunks(ABREAST) {
            let samples = four[0].len();
            let lane = |k: usize, s: usize| four.get(s).map_or(0.0, |signal| signal[k]);
            let abreast = |range: Range<usize>| -> Vec<Lanes<ABREAST>> {
                range
                    .map(|k| Lanes(std::array::from_fn(|s| lane(k, s))))
                    .collect()
            };
            let sound = self.sound(samples);
            let sound = match before {
                Some(filter) => {
                    let mut all = filter.zero_phase_even(&abreast(0..samples));
                    all.truncate(sound.end);
                    all.drain(..sound.start.min(all.len()));
                    all
                }
                None => abreast(sound),
            };
            let smooth = self.low_pass.zero_phase_even(&sound);
            thin.extend((0..four.len()).map(|s| {
                let kept = smooth.iter().step_by(self.step);
                kept.map(|row| row.0[s]).collect::<Vec<f64>>()
            }));
        }
        thin
    }

    /// Appends the kept samples without the low-pass.
    pub(crate) fn pick(&self, signal: &[f64], out: &mut Vec<f64>) {
        out.extend(self.kept(signal.len()).map(|k| signal[k]));
    }
}

/// Returns a position filter with a power loss of at most [`HEARD`] at the upper band edge, as far as the sampling
/// allows. A Butterworth filter of order n, forward and backward, loses the power share 2·(f/cut-off)²ⁿ.
fn wide(treatment: &Treatment) -> Option<(f64, LowPass)> {
    let rate = treatment.sample_rate;
    let order = treatment.order;
    let share = (0.5 * HEARD).powf(0.5 / order as f64);
    let cutoff = (treatment.parallel_edge / share).min(WIDEST * 0.5 * rate);
    (cutoff > treatment.cutoff)
        .then(|| LowPass::butterworth(order, cutoff, rate))
        .flatten()
        .map(|filter| (cutoff, filter))
}

/// The regression: rows over all runs, one set per joint.
pub(crate) struct Rows {
    /// Filter and decimation of the columns.
    pub(crate) thinning: Thinning,
    /// Rows per joint.
    pub(crate) count: usize,
    /// First row of each run, and the total count at the end.
    pub(crate) starts: Vec<usize>,
    /// Time between rows, s.
    pub(crate) period: f64,
    /// Torque, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
    /// True if the row is used, joint by joint.
    pub(crate) keep: Vec<Vec<bool>>,
    /// True if the row is used or usable: its torque has information, except for the error near standstill. Joint by
    /// joint; empty if no row is near standstill.
    pub(crate) legible: Vec<Vec<bool>>,
    /// True if no standstill or reversal leaks into the row through the filters, joint by joint; empty if none is near.
    pub(crate) clear: Vec<Vec<bool>>,
    /// Nominal columns, one per base parameter.
    pub(crate) nominal: Vec<Column>,
}

/// Base parameters with their geometry.
pub(crate) struct Nominal {
    /// Base parameters.
    pub(crate) base: Base,
    robot: Robot,
    batch: ChainBatch,
    transmission: rig_shared::transmission::Transmission<f64>,
}

impl Nominal {
    /// Creates the base parameters of a robot.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(robot: &Robot) -> Result<Self, DiagnoseError> {
        let model = |e: rig_identify::IdentifyError| DiagnoseError::Model(e.to_string());
        Ok(Self {
            base: Base::structural(robot, ModelKind::Differential, 1).map_err(model)?,
            robot: robot.clone(),
            batch: ChainBatch::new(&chain_of(robot).map_err(model)?),
            transmission: transmission_of(robot).map_err(model)?,
        })
    }

    /// Returns the described values of the base parameters.
    pub(crate) fn stated(&self, robot: &Robot) -> Vec<f64> {
        let mut standard = robot.standard_parameters().concat();
        standard.extend(robot.motor_parameters().as_flattened());
        standard.resize(self.base.combination.ncols(), 0.0);
        (self.base.combination.row_iter())
            .map(|row| row.iter().zip(&standard).map(|(k, p)| k * p).sum())
            .collect()
    }

    /// Returns the axes of the base frame about which a tilt matters. If all joints turn about one direction that is
    /// not vertical, only that direction matters: about another one the change is of second order.
    pub(crate) fn tilt_axes(&self) -> Vec<[f64; 3]> {
        let g = Vector3::from(self.robot.gravity);
        if g.norm() == 0.0 {
            return Vec::new();
        }
        let (first, others) = match self.robot.joints.split_first() {
            Some(joints) => joints,
            None => return Vec::new(),
        };
        // z of frame 1 in the base frame: RotX(alpha) alone turns it.
        let (s, c) = first.alpha.sin_cos();
        let upright = Vector3::new(0.0, -s, c).cross(&g).norm() < PARALLEL * g.norm();
        let planar = (self.robot.joints.iter()).all(|j| j.kind == JointKind::Revolute)
            && others.iter().all(|j| j.alpha.sin().abs() < PARALLEL);
        if others.is_empty() || planar && !upright {
            return vec![[0.0, -s, c]];
        }
        let one = if g.normalize().x.abs() < 0.9 {
            Vector3::x()
        } else {
            Vector3::y()
        };
        let first = g.cross(&one).normalize();
        let second = g.cross(&first).normalize();
        vec![first.into(), second.into()]
    }

    /// Returns gravity across the first joint's axis, m/s²: the largest torque per kg·m of first moment.
    pub(crate) fn pull(&self) -> f64 {
        let alpha = self.robot.joints.first().map_or(0.0, |joint| joint.alpha);
        let axis = Vector3::new(0.0, -alpha.sin(), alpha.cos());
        axis.cross(&Vector3::from(self.robot.gravity)).norm()
    }

    /// Returns true if a base parameter is Coulomb friction.
    pub(crate) fn is_coulomb(&self, k: usize) -> bool {
        self.place(k).is_ok_and(|c| c == column::COULOMB)
            || self.place(k).is_err_and(|c| c == motor_column::COULOMB)
    }

    /// Returns true if a base parameter belongs to the drive: friction, offset or its own inertia.
    pub(crate) fn is_drive(&self, k: usize) -> bool {
        self.place(k).map_or(true, |c| c >= column::DRIVE_INERTIA)
    }

    /// Returns true if the drive inertia of a joint is a base parameter of its own.
    pub(crate) fn has_own_drive_inertia(&self, joint: usize) -> bool {
        self.base
            .columns
            .contains(&(joint * COLUMNS + column::DRIVE_INERTIA))
    }

    /// Returns the index of a base parameter's column in its joint, or (as the error) in its motor.
    fn place(&self, k: usize) -> Result<usize, usize> {
        let c = self.base.columns[k];
        match c.checked_sub(self.joints() * COLUMNS) {
            None => Ok(c % COLUMNS),
            Some(motor) => Err(motor % MOTOR_COLUMNS),
        }
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.batch.joint_count()
    }

    /// Visits the regressor of a motion at the full rate: `visit(base parameter, joint, values)` for each column that
    /// is not structurally zero.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if lengths differ.
    pub(crate) fn columns(
        &self,
        motion: [&[Vec<f64>]; 3],
        visit: &mut dyn FnMut(usize, usize, &[f64]),
    ) -> Result<(), DiagnoseError> {
        let failed = |e: &dyn std::fmt::Display| DiagnoseError::Model(e.to_string());
        let n = self.joints();
        let samples = motion[0].first().map_or(0, Vec::len);
        let standard = n * COLUMNS;
        let wanted: Vec<(usize, usize, usize)> = (self.base.columns.iter().enumerate())
            .filter(|(_, c)| **c < standard)
            .flat_map(|(k, &c)| (0..n).map(move |j| (k, j, c)))
            .filter(|&(_, j, c)| !RegressorBlock::is_zero(j, c))
            .collect();
        let mut values = vec![Vec::with_capacity(samples); wanted.len()];
        let mut block = self.batch.block(BLOCK);
        self.batch
            .each_differential_block(motion[0], motion[1], motion[2], &mut block, |part| {
                for (to, &(_, j, c)) in values.iter_mut().zip(&wanted) {
                    to.extend_from_slice(part.column(j, c));
                }
                Ok::<(), rig_model::batch::BatchError>(())
            })
            .map_err(|e| failed(&e))?;
        for (values, &(k, j, _)) in values.iter().zip(&wanted) {
            visit(k, j, values);
        }
        self.motor_columns(motion, visit)
    }

    /// Returns, joint by joint, the samples where a motor with friction on this joint is slow, even if the joint is
    /// fast. Empty if each drive moves only its own joint. As in an identification, the threshold of a motor is the
    /// root sum of squares of its joints' thresholds.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    fn slow_motors(&self, run: &Run, thresholds: &[f64]) -> Result<Vec<Vec<bool>>, DiagnoseError> {
        if self.transmission.is_simple() {
            return Ok(Vec::new());
        }
        let n = self.joints();
        let mut slow = vec![vec![false; run.len()]; n];
        let (mut q, mut directions) = (vec![0.0; n], vec![0.0; n * n]);
        for row in 0..run.len() {
            for (q, joint) in q.iter_mut().zip(&run.joints) {
                *q = joint.q[row];
            }
            self.transmission
                .motor_directions(&q, &mut directions)
                .map_err(|e| DiagnoseError::Model(e.to_string()))?;
            for direction in directions.chunks_exact(n) {
                let speed: f64 = (direction.iter().zip(&run.joints))
                    .map(|(along, joint)| along * joint.qd[row])
                    .sum();
                let least: f64 = (direction.iter().zip(thresholds))
                    .map(|(along, threshold)| (along * threshold).powi(2))
                    .sum();
                if speed.abs() < least.sqrt() {
                    let moved =
                        (slow.iter_mut().zip(direction)).filter(|(_, along)| **along != 0.0);
                    moved.for_each(|(slow, _)| slow[row] = true);
                }
            }
        }
        Ok(slow)
    }

    fn motor_columns(
        &self,
        motion: [&[Vec<f64>]; 3],
        visit: &mut dyn FnMut(usize, usize, &[f64]),
    ) -> Result<(), DiagnoseError> {
        let n = self.joints();
        let motors: Vec<(usize, usize)> = (self.base.columns.iter().enumerate())
            .filter_map(|(k, &c)| Some((k, c.checked_sub(n * COLUMNS)?)))
            .collect();
        if motors.is_empty() {
            return Ok(());
        }
        let samples = motion[0].first().map_or(0, Vec::len);
        let width = n * MOTOR_COLUMNS;
        let mut columns = vec![0.0; n * width];
        let mut values = vec![vec![0.0; samples]; motors.len() * n];
        let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for row in 0..samples {
            for (now, lists) in state.iter_mut().zip(motion) {
                for (to, list) in now.iter_mut().zip(lists) {
                    *to = list[row];
                }
            }
            self.transmission
                .motor_columns(&state[0], &state[1], &state[2], &mut columns)
                .map_err(|e| DiagnoseError::Model(e.to_string()))?;
            for (m, &(_, c)) in motors.iter().enumerate() {
                for j in 0..n {
                    values[m * n + j][row] = columns[j * width + c];
                }
            }
        }
        for (m, &(k, _)) in motors.iter().enumerate() {
            for j in 0..n {
                visit(k, j, &values[m * n + j]);
            }
        }
        Ok(())
    }
}

/// Returns position, velocity and acceleration of all joints over a run.
pub(crate) fn motion_of(run: &Run) -> [Vec<Vec<f64>>; 3] {
    let of = |pick: fn(&rig_data::runs::JointRun) -> &Vec<f64>| -> Vec<Vec<f64>> {
        run.joints.iter().map(|j| pick(j).clone()).collect()
    };
    [of(|j| &j.q), of(|j| &j.qd), of(|j| &j.qdd)]
}

/// Returns the motion of the links, where link encoders were recorded, else of the joints.
pub(crate) fn links_of(run: &Run) -> [Vec<Vec<f64>>; 3] {
    let mut motion = motion_of(run);
    for (j, joint) in run.joints.iter().enumerate() {
        if let Some(link) = &joint.link {
            for (to, from) in motion.iter_mut().zip(link) {
                to[j].clone_from(from);
            }
        }
    }
    motion
}

impl Rows {
    /// Computes torque, masks and nominal columns of all runs.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        runs: &[Run],
        nominal: &Nominal,
        treatment: &Treatment,
    ) -> Result<Self, DiagnoseError> {
        let thinning = Thinning::of(treatment)?;
        let n = nominal.joints();
        let mut starts = vec![0];
        let mut torque = vec![Vec::new(); n];
        let [mut keep, mut legible, mut clear] = [(); 3].map(|()| vec![Vec::new(); n]);
        let mut columns: Vec<Column> = vec![vec![None; n]; nominal.base.len()];
        for run in runs {
            let motors = nominal.slow_motors(run, &treatment.speed_threshold)?;
            let before = starts.last().copied().unwrap_or(0);
            let rows = thinning.kept(run.len()).count();
            for (j, joint) in run.joints.iter().enumerate() {
                thinning.push_raw(&joint.tau, &mut torque[j]);
                let threshold = treatment.speed_threshold.get(j).copied().unwrap_or(0.0);
                let [low, high] = treatment.saturation.get(j).copied().unwrap_or_default();
                let mut spoilt: Vec<f64> = (joint.qd.iter().zip(joint.recorded().iter()))
                    .map(|(v, tau)| {
                        let limited =
                            low.is_some_and(|l| *tau <= l) || high.is_some_and(|h| *tau >= h);
                        f64::from(u8::from(v.abs() < threshold || limited))
                    })
                    .collect();
                for (spoilt, slow) in spoilt.iter_mut().zip(motors.get(j).into_iter().flatten()) {
                    if *slow {
                        *spoilt = 1.0;
                    }
                }
                for part in &run.left_out {
                    spoilt[part.clone()].fill(1.0);
                }
                let mut share = Vec::new();
                thinning.push_raw(&spoilt, &mut share);
                // The low-pass rings, so a share below 0 counts like one above.
                keep[j].extend(share.iter().map(|s| s.abs() < SPOILT));
                legible[j].extend(share.iter().map(|s| *s < ILLEGIBLE));
                for (spoilt, (v, a)) in spoilt.iter_mut().zip(joint.qd.iter().zip(&joint.qdd)) {
                    if v.abs() < a.abs() * thinning.smear {
                        *spoilt = 1.0;
                    }
                }
                share.clear();
                thinning.push_raw(&spoilt, &mut share);
                clear[j].extend(share.iter().map(|s| s.abs() < CLEAR));
            }
            let wide = thinning.wide_motion(run);
            let motion = motion_of(run);
            nominal.columns([&motion[0], &motion[1], &motion[2]], &mut |k, j, values| {
                if wide.is_some() && !nominal.is_drive(k) {
                    return;
                }
                let list = columns[k][j].get_or_insert_with(|| vec![0.0; before]);
                if nominal.is_coulomb(k) {
                    thinning.push_raw(values, list);
                } else {
                    thinning.push(values, list);
                }
            })?;
            if let Some([q, qd, qdd]) = &wide {
                nominal.columns([q, qd, qdd], &mut |k, j, values| {
                    if !nominal.is_drive(k) {
                        let list = columns[k][j].get_or_insert_with(|| vec![0.0; before]);
                        thinning.push_raw(values, list);
                    }
                })?;
            }
            starts.push(before + rows);
        }
        Ok(Self {
            thinning,
            count: starts.last().copied().unwrap_or(0),
            starts,
            period: treatment.decimation.max(1) as f64 / treatment.sample_rate,
            torque,
            keep,
            legible,
            clear,
            nominal: columns,
        })
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.torque.len()
    }

    /// Returns, for each sample, true if the nearest row is usable by the observer of a link behind a gear. False
    /// outside the rows.
    pub(crate) fn torque_valid(&self, run: usize, joint: usize, samples: usize) -> Vec<bool> {
        let all = self.legible.get(joint).map_or(&[][..], Vec::as_slice);
        let legible = all
            .get(self.starts[run]..self.starts[run + 1])
            .unwrap_or_default();
        let Thinning { step, spoilt, .. } = self.thinning;
        (0..samples)
            .map(|k| {
                let row = (k + step / 2).checked_sub(spoilt).map(|past| past / step);
                row.is_some_and(|row| legible.get(row).copied().unwrap_or(false))
            })
            .collect()
    }

    /// Returns the mean squared residual of a joint: on usable rows near standstill, and on the used rows. `residual`
    /// covers all rows. None if too few rows are near standstill.
    pub(crate) fn about_rests(&self, joint: usize, residual: &[f64]) -> Option<[f64; 2]> {
        let keep = &self.keep[joint];
        let legible = self.legible.get(joint)?;
        let mean = |near: bool| {
            let own = |(keep, legible): (&bool, &bool)| *legible && (*keep != near);
            let rows = || residual.iter().zip(keep.iter().zip(legible));
            let own = || rows().filter(|(_, about)| own(*about)).map(|(r, _)| r * r);
            let count = own().count();
            (count >= FEWEST_ABOUT_RESTS).then(|| own().sum::<f64>() / count as f64)
        };
        Some([mean(true)?, mean(false)?])
    }

    /// Also uses the rows near a joint's standstill.
    pub(crate) fn use_rests(&mut self, joint: usize) {
        if let Some(legible) = self.legible.get(joint) {
            self.keep[joint].clone_from(legible);
        }
    }

    /// Returns true for the rows of a joint that are used and clear of standstill and reversals.
    pub(crate) fn away(&self, joint: usize) -> Vec<bool> {
        let clear = self.clear.get(joint);
        let clear = |row: usize| clear.is_none_or(|clear| clear[row]);
        (self.keep[joint].iter().enumerate())
            .map(|(row, keep)| *keep && clear(row))
            .collect()
    }

    /// Returns the number of used rows of a joint.
    pub(crate) fn used(&self, joint: usize) -> usize {
        self.keep[joint].iter().filter(|k| **k).count()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
impl Rows {
    /// Creates the rows of one joint in one run with these nominal columns.
    pub(crate) fn of_columns(nominal: Vec<Column>, count: usize) -> Self {
        Self {
            thinning: Thinning {
                low_pass: LowPass::butterworth(2, 0.1, 1.0).unwrap(),
                position: LowPass::butterworth(2, 0.1, 1.0).unwrap(),
                accepted_by_observer: false,
                wide: None,
                step: 1,
                spoilt: 0,
                smear: 0.0,
            },
            count,
            starts: vec![0, count],
            period: 1.0,
            torque: vec![vec![0.0; count]],
            keep: vec![vec![true; count]],
            legible: vec![vec![true; count]],
            clear: vec![vec![true; count]],
            nominal,
        }
    }
}
