//! The load from joint torques: with and without the load, or with it against an identified model.
//!
//! With recordings of both, one set of base parameters explains all of them, and the load explains the rest of those
//! with it. Coulomb and viscous friction may differ between the two, because gears rub more under load. Without
//! recordings of the unloaded robot its description gives the torque, and friction, offsets and drive inertia may differ
//! from it. The drive inertia also takes up the noise of the acceleration, which a geared joint multiplies.
//!
//! Leaves out: the uncertainty of the description, if it gives the torque of the unloaded robot.

use nalgebra::{DVector, SMatrix};
use rig_data::Compensated;
use rig_data::prepare::{PrepareOptions, PreprocessingPlan, Recording, as_recordings, surveyed};
use rig_identify::{
    Base, ModelKind, Plan, RowCache, TriangularFactor, chain_of, described, each_rows,
    transmission_of, treatment_for,
};
use rig_model::effects::Effects;
use rig_model::robot::Robot;
use rig_shared::multibody::{COLUMNS, INERTIAL_PARAMETERS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::cut_torque::CutTorque;
use crate::error::LoadError;
use crate::estimate::solved;
use crate::load_friction::{Carried, LoadFriction, growing};
use crate::statistics::SEGMENTS;
use crate::torque_noise::torque_noise;

/// Rounds in which the noise of each joint is estimated from its residuals.
const ROUNDS: usize = 3;
/// Fits in which the torque that a joint carries and its friction are determined in turn. Each leaves an error of about the
/// coefficient times the error before.
const FRICTION_ROUNDS: usize = 3;

/// Recordings of joint torques.
pub(crate) struct Driven<'a> {
    /// The robot without the load.
    pub robot: &'a Robot,
    /// Recordings with the load.
    pub with: &'a [&'a dyn Recording],
    /// Recordings without it; may be empty.
    pub without: &'a [&'a dyn Recording],
    /// From the parameters in the flange frame to those in the frame of the last joint.
    pub to_joint: &'a SMatrix<f64, INERTIAL_PARAMETERS, INERTIAL_PARAMETERS>,
    /// How the recordings are prepared.
    pub prepare: &'a PrepareOptions,
    /// True to go on if most torques of a joint are cut.
    pub even_if_wrong: bool,
}

/// Equations of the joints, in units of their noise.
pub(crate) struct Equations {
    /// One factor a segment, the load's columns first.
    pub segments: Vec<TriangularFactor>,
    /// Per joint, RMS of the residual, N·m or N; `None` if none of its torques was used, as at rest.
    pub noise: Vec<Option<f64>>,
    /// Per joint, RMS that the noise of its torque leaves, N·m or N; `None` if the band leaves nothing above it.
    pub floor: Vec<Option<f64>>,
    /// Torques that are at a limit.
    pub cut: Vec<CutTorque>,
    /// Friction that grows with the load, where the data show it.
    pub friction: Vec<LoadFriction>,
    /// Mass of the load by a fit without such friction, kg.
    pub constant_friction: f64,
    /// Preparation.
    pub plan: PreprocessingPlan,
    /// Torques over time, and what the fit gives for them, of the recordings with the load.
    pub traces: Vec<TorqueTrace>,
}

/// Torque of a joint over time, thinned for a figure, and what the fit gives for it.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueTrace {
    /// Name of the recording.
    pub recording: String,
    /// Index of the joint.
    pub joint: usize,
    /// s
    pub time: Vec<f64>,
    /// N·m or N, in the band of the fit.
    pub read: Vec<f64>,
    /// The same by the fit.
    pub predicted: Vec<f64>,
}

/// Rows of a joint of a recording that are kept for a figure.
const SAMPLED: u64 = 300;

/// A row that is kept for a figure.
struct Sample {
    joint: usize,
    time: f64,
    row: Vec<f64>,
    read: f64,
    /// Torque that is known without the fit.
    known: f64,
}

/// Places of the unknowns beside the load.
struct Columns {
    /// Number of base parameters of the unloaded robot that are estimated: all or none.
    robot: usize,
    /// Columns that may differ with the load.
    changed: Vec<usize>,
}

/// Returns true for a column that may differ with the load: Coulomb and viscous friction. If the description gives the
/// torque of the unloaded robot (`described`), constant torques and drive inertia may differ from it, too.
fn may_differ(c: usize, links: usize, described: bool) -> bool {
    match c.checked_sub(COLUMNS * links) {
        Some(motor) => described || motor % MOTOR_COLUMNS != motor_column::INERTIA,
        None => match c % COLUMNS {
            column::VISCOUS | column::COULOMB => true,
            column::OFFSET | column::DRIVE_INERTIA => described,
            _ => false,
        },
    }
}

/// Collects the equations of all recordings.
///
/// # Errors
/// [`LoadError`]: recordings that cannot be prepared, a robot without a model, joints that all rest.
pub(crate) fn equations(driven: &Driven) -> Result<Equations, LoadError> {
    let robot = driven.robot;
    let (joints, links) = (robot.joints.len(), robot.link_count());
    let all: Vec<&dyn Recording> = driven.with.iter().chain(driven.without).copied().collect();
    let (surveys, usable) = surveyed(&all, joints)?;
    let usable = as_recordings(&usable);
    let (surveys, treatment) = treatment_for(robot, &usable, surveys, driven.prepare)?;
    let (chain, transmission) = (chain_of(robot)?, transmission_of(robot)?);
    let base = Base::structural(robot, ModelKind::Differential, 1)?;
    let estimated = !driven.without.is_empty();
    // Drive inertia may be regrouped with that of the links, and is then no base parameter of its own.
    let mut own = base.columns.clone();
    let all = 0..base.combination.ncols();
    let changed: Vec<usize> = all.filter(|c| may_differ(*c, links, !estimated)).collect();
    own.extend(changed.iter().filter(|c| !base.columns.contains(c)));
    let unknowns = Columns {
        robot: if estimated { base.len() } else { 0 },
        changed,
    };
    // All columns of the rows: those of the robot, then the ten of a body on the last link.
    let last = COLUMNS * robot.last_link();
    let mut columns = own.clone();
    columns.extend(last..last + INERTIAL_PARAMETERS);
    let plan = Plan {
        chain: &chain,
        transmission: &transmission,
        columns: &columns,
        treatment: &treatment,
        window: 1,
        stride: 1,
        loudness: vec![1.0; joints],
        one_way: Vec::new(),
        cache: RowCache::default(),
    };
    let known = match estimated {
        true => Vec::new(),
        false => {
            let all = described(robot, base.combination.ncols());
            (&base.combination * all).as_slice().to_vec()
        }
    };
    let assembly = Assembly {
        driven,
        unknowns: &unknowns,
        robot: &own,
        known: &known,
        width: columns.len(),
    };
    let effects = Effects::of(robot).map_err(|e| LoadError::Model(e.to_string()))?;
    // Without the torque of the described effects.
    let freed = (usable.iter())
        .map(|source| Compensated::new(*source, &effects, &chain, &treatment, true))
        .collect::<Result<Vec<_>, _>>()?;
    let rows = surveys.iter().map(|s| s.rows / treatment.decimation as u64);
    let readings = Readings {
        assembly: &assembly,
        plan: &plan,
        recordings: freed.iter().zip(rows).collect(),
    };
    let constant = readings.collected(None)?;
    if constant.noise.iter().all(Option::is_none) {
        return Err(LoadError::AtRest);
    }
    let constant_friction = constant.solution[0];
    let cut = constant.cut.clone();
    let (collected, friction) = readings.beside_load_friction(constant)?;
    let segments = collected.segments();
    Ok(Equations {
        traces: traces(&segments, &collected.samples, &collected.noise),
        segments,
        noise: collected.noise,
        floor: torque_noise(&usable, &treatment, joints)?,
        cut,
        friction,
        constant_friction,
        plan: treatment,
    })
}

/// The rows of all recordings, reduced to one factor a segment and joint.
struct Collected {
    parts: Vec<Vec<TriangularFactor>>,
    /// Rows for a figure, by recording with the load.
    samples: Vec<(String, Vec<Sample>)>,
    /// Per joint whose friction may grow with the load, RMS of its column with the load.
    sizes: Vec<f64>,
    /// Per joint, RMS of the residual, N·m or N.
    noise: Vec<Option<f64>>,
    /// Values of all unknowns.
    solution: DVector<f64>,
    /// Torques that are at a limit.
    cut: Vec<CutTorque>,
}

impl Collected {
    /// Returns one factor a segment, in units of the noise.
    fn segments(&self) -> Vec<TriangularFactor> {
        let weighted = |joints: &Vec<TriangularFactor>| {
            let mut whole = TriangularFactor::new(joints[0].columns());
            merge_weighted(&mut whole, joints, &self.noise);
            whole
        };
        self.parts.iter().map(weighted).collect()
    }
}

/// Recordings that are ready to be read, with the number of rows that is expected of each.
struct Readings<'a> {
    assembly: &'a Assembly<'a>,
    plan: &'a Plan<'a>,
    recordings: Vec<(&'a Compensated<'a>, u64)>,
}

impl Readings<'_> {
    /// Collects the rows of all recordings. With `carried`, each of its joints has a column of friction that grows with
    /// the load.
    fn collected(&self, carried: Option<&Carried>) -> Result<Collected, LoadError> {
        let with = self.assembly.driven.with;
        let mut parts: Vec<Vec<TriangularFactor>> = Vec::new();
        let (mut samples, mut cut) = (Vec::new(), Vec::new());
        let mut squares = vec![(0.0, 0u64); carried.map_or(0, |own| own.joints.len())];
        for (k, (recording, expected)) in self.recordings.iter().enumerate() {
            let own = Kept {
                loaded: k < with.len(),
                expected: *expected,
                carried,
            };
            let Segmented {
                segments,
                samples: kept,
                rows,
                saturated,
            } = (self.assembly).segments(*recording, self.plan, &own, &mut squares)?;
            let is_cut = saturated.iter().enumerate().filter(|(_, rows)| **rows > 0);
            cut.extend(is_cut.map(|(joint, own)| CutTorque {
                recording: recording.label(),
                joint,
                limits: self.plan.treatment.saturation[joint],
                rows: *own,
                of: rows,
            }));
            parts.extend(segments);
            if own.loaded {
                samples.push((with[k].label(), kept));
            }
        }
        let noise = noise_of(&parts);
        let mut collected = Collected {
            parts,
            samples,
            sizes: (squares.iter())
                .map(|(sum, rows)| (sum / (*rows).max(1) as f64).sqrt())
                .collect(),
            noise,
            solution: DVector::zeros(self.assembly.count() + squares.len()),
            cut,
        };
        let segments = collected.segments();
        if let Some(first) = segments.first() {
            let mut whole = TriangularFactor::new(first.columns());
            segments.iter().for_each(|own| whole.merge(own, 1.0));
            let (r, z) = whole.system();
            collected.solution = solved(&r, &z);
        }
        Ok(collected)
    }

    /// Gives friction that grows with the load to the joints whose torques show it. Returns `constant`, the fit without it,
    /// if none does.
    fn beside_load_friction(
        &self,
        constant: Collected,
    ) -> Result<(Collected, Vec<LoadFriction>), LoadError> {
        let used = |joint: &usize| constant.noise[*joint].is_some();
        let mut joints: Vec<usize> = (0..constant.noise.len()).filter(used).collect();
        while !joints.is_empty() {
            let mut solution = constant.solution.clone();
            let mut collected = None;
            for _ in 0..FRICTION_ROUNDS {
                let carried = self.assembly.carried(&joints, &solution);
                let next = self.collected(Some(&carried))?;
                solution = next.solution.clone();
                collected = Some(next);
            }
            let Some(collected) = collected else { break };
            let found = growing(&collected.segments(), &joints, &collected.sizes);
            if found.len() == joints.len() {
                return Ok((collected, found));
            }
            joints = found.iter().map(|own| own.joint).collect();
        }
        Ok((constant, Vec::new()))
    }
}

/// How a recording is read.
struct Kept<'a> {
    loaded: bool,
    /// Rows.
    expected: u64,
    carried: Option<&'a Carried<'a>>,
}

/// Returns the torques of the joints that are used over time, with those of the fit of all equations.
fn traces(
    segments: &[TriangularFactor],
    samples: &[(String, Vec<Sample>)],
    noise: &[Option<f64>],
) -> Vec<TorqueTrace> {
    let Some(first) = segments.first() else {
        return Vec::new();
    };
    let mut whole = TriangularFactor::new(first.columns());
    segments.iter().for_each(|own| whole.merge(own, 1.0));
    let (r, z) = whole.system();
    let x = solved(&r, &z);
    let used = (0..noise.len()).filter(|joint| noise[*joint].is_some());
    let used: Vec<usize> = used.collect();
    let of = |recording: &str, samples: &[Sample], joint: usize| {
        let own: Vec<&Sample> = samples.iter().filter(|own| own.joint == joint).collect();
        let along = |own: &Sample| {
            own.row
                .iter()
                .zip(x.iter())
                .map(|(a, b)| a * b)
                .sum::<f64>()
        };
        TorqueTrace {
            recording: recording.to_owned(),
            joint,
            time: own.iter().map(|own| own.time).collect(),
            read: own.iter().map(|own| own.read).collect(),
            predicted: own.iter().map(|own| own.known + along(own)).collect(),
        }
    };
    let all = samples.iter();
    all.flat_map(|(label, own)| used.iter().map(move |joint| of(label, own, *joint)))
        .filter(|trace| !trace.time.is_empty())
        .collect()
}

/// What one pass over a recording gives.
struct Segmented {
    /// One factor a segment and joint.
    segments: Vec<Vec<TriangularFactor>>,
    /// Rows for a figure.
    samples: Vec<Sample>,
    /// Number of rows.
    rows: u64,
    /// Per joint, rows whose torque is at a limit.
    saturated: Vec<u64>,
}

/// What the rows of a recording are made of.
struct Assembly<'a> {
    driven: &'a Driven<'a>,
    unknowns: &'a Columns,
    /// Columns of the robot in each row, those of the base parameters first.
    robot: &'a [usize],
    /// Values of the base parameters, if they are known beforehand.
    known: &'a [f64],
    /// Number of columns in each row.
    width: usize,
}

impl Assembly<'_> {
    fn count(&self) -> usize {
        INERTIAL_PARAMETERS + self.unknowns.robot + self.unknowns.changed.len()
    }

    /// Returns the torque that the joints carry by a solution.
    fn carried(&self, joints: &[usize], solution: &DVector<f64>) -> Carried<'_> {
        let (load, others) = solution.as_slice().split_at(INERTIAL_PARAMETERS);
        Carried {
            joints: joints.to_vec(),
            robot: self.robot,
            links: self.driven.robot.link_count(),
            load: load.to_vec(),
            values: match self.known.is_empty() {
                true => others[..self.unknowns.robot].to_vec(),
                false => self.known.to_vec(),
            },
        }
    }

    /// Returns one factor a segment and joint, and rows for a figure; segments without rows are left out. Adds to
    /// `squares`, with the number of rows, the squared columns of friction that grows with the load.
    fn segments(
        &self,
        recording: &dyn Recording,
        plan: &Plan,
        own: &Kept,
        squares: &mut [(f64, u64)],
    ) -> Result<Segmented, LoadError> {
        let Kept {
            loaded, expected, ..
        } = *own;
        let joints = self.driven.robot.joints.len();
        let rubbing = own.carried.map_or(&[][..], |carried| &carried.joints);
        let count = self.count() + rubbing.len();
        let empty = || vec![TriangularFactor::new(count); joints];
        let mut segments: Vec<Vec<TriangularFactor>> = (0..SEGMENTS).map(|_| empty()).collect();
        let mut seen = 0u64;
        let mut row = vec![0.0; count];
        let mut samples = Vec::new();
        let tally = each_rows(recording, plan, ModelKind::Differential, &mut |rows| {
            for k in 0..rows.t.len() {
                let place = u128::from(seen) * SEGMENTS as u128 / u128::from(expected.max(1));
                let segment = &mut segments[(place as usize).min(SEGMENTS - 1)];
                let is_sampled = loaded && seen.is_multiple_of(expected.div_ceil(SAMPLED).max(1));
                seen += 1;
                let equations = segment.iter_mut().zip(&rows.equations);
                for (joint, (factor, equation)) in equations.enumerate() {
                    if equation.keep[k] {
                        let x = &equation.x[k * self.width..(k + 1) * self.width];
                        let known = self.compose(x, loaded, &mut row);
                        if let Some(carried) = own.carried
                            && let Some(place) = rubbing.iter().position(|own| *own == joint)
                        {
                            let robot = &x[..self.robot.len()];
                            let friction = carried.friction(joint, &row, robot);
                            row[self.count() + place] = friction;
                            if loaded {
                                squares[place].0 += friction * friction;
                                squares[place].1 += 1;
                            }
                        }
                        factor.push(&row, equation.y[k] - known, 1.0);
                        if is_sampled {
                            samples.push(Sample {
                                joint,
                                time: rows.t[k],
                                row: row.clone(),
                                read: equation.y[k],
                                known,
                            });
                        }
                    }
                }
            }
            Ok(())
        })?;
        segments.retain(|own| own.iter().any(|factor| factor.rows() > 0));
        Ok(Segmented {
            segments,
            samples,
            rows: seen,
            saturated: tally.saturated,
        })
    }

    /// Composes a row from that of the model; returns the torque that is known.
    fn compose(&self, x: &[f64], loaded: bool, row: &mut [f64]) -> f64 {
        row.fill(0.0);
        let (own, load) = x.split_at(self.robot.len());
        if loaded {
            for (k, to) in row[..INERTIAL_PARAMETERS].iter_mut().enumerate() {
                *to = (0..INERTIAL_PARAMETERS)
                    .map(|c| load[c] * self.driven.to_joint[(c, k)])
                    .sum();
            }
        }
        let base = self.unknowns.robot;
        row[INERTIAL_PARAMETERS..][..base].copy_from_slice(&own[..base]);
        if loaded {
            for (to, changed) in
                (row[INERTIAL_PARAMETERS + base..].iter_mut()).zip(&self.unknowns.changed)
            {
                if let Some(place) = self.robot.iter().position(|c| c == changed) {
                    *to = own[place];
                }
            }
        }
        own.iter().zip(self.known).map(|(x, value)| x * value).sum()
    }
}

/// Adds the equations of the joints in units of their noise. A joint without noise has no equations.
fn merge_weighted(
    whole: &mut TriangularFactor,
    joints: &[TriangularFactor],
    noise: &[Option<f64>],
) {
    for (factor, noise) in joints.iter().zip(noise) {
        if let Some(noise) = noise {
            whole.merge(factor, 1.0 / noise);
        }
    }
}

/// Returns the RMS residual of each joint, all joints weighted by it. A joint has none if no row of its torque is used
/// because it rests, or if all its torques are zero: it tells nothing, and a weight of 1/0 would make every equation
/// not a number.
fn noise_of(parts: &[Vec<TriangularFactor>]) -> Vec<Option<f64>> {
    let Some(columns) = (parts.first())
        .and_then(|own| own.first())
        .map(TriangularFactor::columns)
    else {
        return Vec::new();
    };
    let joints = parts[0].len();
    let whole: Vec<TriangularFactor> = (0..joints)
        .map(|j| {
            let mut sum = TriangularFactor::new(columns);
            for own in parts {
                sum.merge(&own[j], 1.0);
            }
            sum
        })
        .collect();
    let size = |factor: &TriangularFactor| {
        let rms = (factor.right_side_squares() / factor.rows().max(1) as f64).sqrt();
        (rms > 0.0).then_some(rms)
    };
    let sizes: Vec<Option<f64>> = whole.iter().map(size).collect();
    let mut noise = sizes.clone();
    for _ in 0..ROUNDS {
        let mut all = TriangularFactor::new(columns);
        merge_weighted(&mut all, &whole, &noise);
        let (r, z) = all.system();
        let x = solved(&r, &z);
        for ((noise, factor), size) in noise.iter_mut().zip(&whole).zip(&sizes) {
            let rows = factor.rows().max(1) as f64;
            let rms = (factor.residual_squares(x.as_slice()) / rows).sqrt();
            *noise = size.map(|size| rms.max(1e-9 * size));
        }
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A weight of 1/0 would make the equations not a number, and their singular values would never be found.
    #[test]
    fn a_joint_without_rows_has_no_noise_and_leaves_that_of_the_others() {
        let mut moves = TriangularFactor::new(2);
        for k in 0..100 {
            let x = 0.1 * f64::from(k);
            let off = if k % 2 == 0 { 0.5 } else { -0.5 };
            moves.push(&[x.sin(), x.cos()], 3.0 * x.sin() - x.cos() + off, 1.0);
        }
        let rests = TriangularFactor::new(2);
        let mut zero = TriangularFactor::new(2);
        zero.push(&[1.0, 1.0], 0.0, 1.0);
        let noise = noise_of(&[vec![rests, moves, zero]]);
        assert_eq!(noise[0], None);
        assert!((noise[1].unwrap_or(0.0) - 0.5).abs() < 0.02, "{noise:?}");
        assert_eq!(noise[2], None);
        assert!(noise_of(&[]).is_empty());
    }
}
