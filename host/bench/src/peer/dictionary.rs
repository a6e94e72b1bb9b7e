//! Columns of the candidates for one recording of one joint.

use nalgebra::DVector;
use rig_shared::effects::{Channel, Instant, Kind, MEMORY, SHAPES, Scale};

use crate::error::BenchError;
use rig_data::prepare::{InMemory, LowPass, central_difference, second_difference};
use rig_data::runs::{JointRun, Run, runs_of};
use rig_diagnose::DiagnoseError;
use rig_model::robot::{Joint, Robot};

/// Sample rate of the recordings, Hz.
const RATE: f64 = 1000.0;
/// Cut-off of the filter, Hz.
const BAND: f64 = 40.0;
/// Every tenth sample is used.
const STRIDE: usize = 10;
/// Speed below which the sign of q̇ is not reliable, rad/s.
const MOVING: f64 = 0.01;
/// Orders that are tried: those of gears, slots and poles, and their multiples.
const ORDERS: [f64; 11] = [1.0, 2.0, 3.0, 4.0, 6.0, 12.0, 14.0, 24.0, 36.0, 42.0, 84.0];
/// Grid points over a continuous range.
const POINTS: usize = 6;

/// One column of the dictionary.
pub(super) struct Term {
    pub(super) kind: Kind,
    pub(super) column: DVector<f64>,
}

/// All columns of one recording.
pub(super) struct Dictionary {
    pub(super) nominal: Vec<DVector<f64>>,
    pub(super) terms: Vec<Term>,
    pub(super) torque: DVector<f64>,
}

struct Signals {
    run: Run,
    filter: LowPass,
    kept: Vec<usize>,
}

impl Signals {
    fn of(recording: &InMemory) -> Result<Self, BenchError> {
        let failed = |what: &str| BenchError::from(DiagnoseError::Model(what.into()));
        let filter =
            LowPass::butterworth(4, BAND, RATE).ok_or_else(|| failed("no such low-pass."))?;
        let run = runs_of(recording, 0, RATE, &filter).map_err(DiagnoseError::from)?;
        let run = run.into_iter().next().ok_or(DiagnoseError::NoRecording)?;
        let joint = run.joints.first();
        let joint = joint.ok_or_else(|| failed("the recording has no joint."))?;
        let kept = (0..run.len())
            .step_by(STRIDE)
            .filter(|&k| joint.qd[k].abs() > MOVING)
            .collect();
        Ok(Self { run, filter, kept })
    }

    fn column(&self, signal: &[f64]) -> DVector<f64> {
        let smooth = self.filter.zero_phase(signal);
        DVector::from_fn(self.kept.len(), |k, _| smooth[self.kept[k]])
    }
}

impl Dictionary {
    /// Returns the filtered torque, with rows at rest, so that two runs can be compared sample by sample.
    pub(super) fn torque_of(recording: &InMemory) -> Result<Vec<f64>, BenchError> {
        let signals = Signals::of(recording)?;
        let joint = signals.run.joints.into_iter().next();
        let torque = joint.map(|j| signals.filter.zero_phase(&j.tau));
        Ok(torque
            .unwrap_or_default()
            .into_iter()
            .step_by(STRIDE)
            .collect())
    }

    pub(super) fn of(
        robot: &Robot,
        recording: &InMemory,
        without: &[Kind],
    ) -> Result<Self, BenchError> {
        let signals = Signals::of(recording)?;
        let (Some(joint), Some(described)) = (signals.run.joints.first(), robot.joints.first())
        else {
            return Err(DiagnoseError::NoRecording.into());
        };
        let gravity: Vec<f64> = joint
            .q
            .iter()
            .map(|q| (q + described.theta).cos())
            .collect();
        let sign: Vec<f64> = joint.qd.iter().map(|v| v.signum()).collect();
        let nominal = [&joint.qdd, &gravity, &joint.qd, &sign]
            .map(|signal| signals.column(signal))
            .to_vec();
        let motion = Motion::of(&signals, joint, described, robot.gravity, &gravity, sign);
        let mut terms = Vec::new();
        for &kind in Kind::ALL.iter().filter(|k| !without.contains(k)) {
            motion.columns(kind, &mut |signal| {
                let column = signals.column(signal);
                terms.push(Term { kind, column });
            });
        }
        Ok(Self {
            nominal,
            terms,
            torque: signals.column(&joint.tau),
        })
    }
}

/// Motion and torques of the joint, with the values of its description.
struct Motion<'a> {
    joint: &'a JointRun,
    t: &'a [f64],
    /// Direction of motion.
    sign: Vec<f64>,
    /// Filtered torque, N·m.
    torque: Vec<f64>,
    /// Torque of inertia and weight of the link, N·m.
    load: Vec<f64>,
    /// Inertia of the link, and of the rotor at the joint, kg·m².
    inertia: f64,
    rotor: f64,
    ratio: f64,
}

impl<'a> Motion<'a> {
    fn of(
        signals: &'a Signals,
        joint: &'a JointRun,
        described: &Joint,
        pull: [f64; 3],
        gravity: &[f64],
        sign: Vec<f64>,
    ) -> Self {
        let inertial = described.inertial.as_ref();
        let inertia = inertial.map_or(0.0, |i| i.inertia[5]);
        let moment = inertial.map_or(0.0, |i| i.first_moment[0]);
        let drive = described.drive.as_ref();
        let ratio = drive.map_or(1.0, |d| d.gear_ratio);
        // The joint axis is horizontal: gravity depends on the link's angle to the horizontal.
        let weight = -moment * pull[2];
        Self {
            joint,
            t: &signals.run.t,
            sign,
            torque: signals.filter.zero_phase(&joint.tau),
            load: (joint.qdd.iter().zip(gravity))
                .map(|(a, g)| inertia * a + weight * g)
                .collect(),
            inertia,
            rotor: drive.map_or(0.0, |d| d.rotor_inertia * ratio * ratio),
            ratio,
        }
    }

    fn at(&self, k: usize) -> Instant<f64> {
        Instant {
            position: self.joint.q[k],
            velocity: self.joint.qd[k],
            acceleration: self.joint.qdd[k],
            direction: self.sign[k],
            motor_angle: self.joint.q[k] * self.ratio,
            drive_torque: self.torque[k],
            load: self.load[k],
            time: self.t[k],
            period: 1.0 / RATE,
            travel: self.joint.qd[k] / RATE,
            ..Instant::default()
        }
    }

    /// Passes each column of an effect to `push`; none if no column is linear in it.
    fn columns(&self, kind: Kind, push: &mut dyn FnMut(&[f64])) {
        let about = kind.about();
        match kind {
            Kind::MeasurementDelay => push(&central_difference(&self.torque, 1.0 / RATE)),
            // Motor side: the deflection of the spring accelerates the rotor.
            Kind::JointElasticity => {
                let bend = second_difference(&self.load, 1.0 / RATE);
                push(&bend.iter().map(|b| self.rotor * b).collect::<Vec<_>>());
            }
            Kind::InertiaCoupling
            | Kind::Payload
            | Kind::ViscousWarmupTemperature
            | Kind::ViscousWarmupHeat => {}
            _ if about.shapes.len() > 1 => {}
            _ if matches!(about.channel, Channel::Transmission | Channel::Voltage) => {}
            _ => {
                for shapes in grid(kind) {
                    for column in self.terms(kind, &shapes) {
                        push(&column);
                    }
                }
            }
        }
    }

    /// Returns the torque per gain of an effect with the given shape parameters, one column for each gain.
    fn terms(&self, kind: Kind, shapes: &[f64; SHAPES]) -> Vec<Vec<f64>> {
        let about = kind.about();
        let mut memory = [0.0; MEMORY];
        let mut columns = vec![Vec::new(); about.gains.len()];
        for k in 0..self.t.len() {
            let values = kind.terms(shapes, &mut memory, &self.at(k));
            for (column, value) in columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
        if about.channel == Channel::Position {
            // An error of the position reading acts through the inertia.
            for column in &mut columns {
                *column = second_difference(column, 1.0 / RATE)
                    .iter()
                    .map(|e| (self.inertia + self.rotor) * e)
                    .collect();
            }
        }
        columns
    }
}

/// Grid over the only shape parameter of an effect, or a single point if it has none.
fn grid(kind: Kind) -> Vec<[f64; SHAPES]> {
    let Some(shape) = kind.about().shapes.first() else {
        return vec![[0.0; SHAPES]];
    };
    // An optional shape parameter stays at zero.
    if kind.optional().contains(&shape.name) {
        return vec![[0.0; SHAPES]];
    }
    let [low, high] = shape.range;
    let mut point = [0.0; SHAPES];
    let mut at = |value: f64| {
        point[0] = value;
        point
    };
    match shape.scale {
        Scale::Linear => (0..POINTS)
            .map(|k| at(low + (high - low) * (k as f64 + 0.5) / POINTS as f64))
            .collect(),
        Scale::Whole => {
            let within = ORDERS.iter().filter(|o| (low..=high).contains(*o));
            within.map(|order| at(*order)).collect()
        }
        Scale::Logarithmic => (0..POINTS)
            .map(|k| at(low * (high / low).powf((k as f64 + 0.5) / POINTS as f64)))
            .collect(),
    }
}
