//! Columns of the candidates for one recording of one joint.

use nalgebra::DVector;
use rig_shared::effects::{Channel, Instant, Kind, MEMORY, SHAPES, Scale};

use crate::BenchError;
use rig_data::prepare::{InMemory, LowPass, central_difference, second_difference};
use rig_data::runs::{Run, runs_of};
use rig_diagnose::DiagnoseError;
use rig_model::robot::Robot;

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
        let inertial = described.inertial.as_ref();
        let inertia = inertial.map_or(0.0, |i| i.inertia[5]);
        let moment = inertial.map_or(0.0, |i| i.first_moment[0]);
        let drive = described.drive.as_ref();
        let ratio = drive.map_or(1.0, |d| d.gear_ratio);
        let rotor = drive.map_or(0.0, |d| d.rotor_inertia * ratio * ratio);
        // The joint axis is horizontal: gravity depends on the link's angle to the horizontal.
        let weight = -moment * robot.gravity[2];
        let gravity: Vec<f64> = joint
            .q
            .iter()
            .map(|q| (q + described.theta).cos())
            .collect();
        let load: Vec<f64> = (joint.qdd.iter().zip(&gravity))
            .map(|(a, g)| inertia * a + weight * g)
            .collect();
        let torque = signals.filter.zero_phase(&joint.tau);
        let sign: Vec<f64> = joint.qd.iter().map(|v| v.signum()).collect();
        let nominal = [&joint.qdd, &gravity, &joint.qd, &sign]
            .map(|signal| signals.column(signal))
            .to_vec();

        let at = |k: usize| Instant {
            position: joint.q[k],
            velocity: joint.qd[k],
            acceleration: joint.qdd[k],
            direction: sign[k],
            motor_angle: joint.q[k] * ratio,
            drive_torque: torque[k],
            load: load[k],
            time: signals.run.t[k],
            period: 1.0 / RATE,
            ..Instant::default()
        };
        let mut terms = Vec::new();
        for &kind in Kind::ALL.iter().filter(|k| !without.contains(k)) {
            let about = kind.about();
            let mut push = |signal: &[f64]| {
                let column = signals.column(signal);
                terms.push(Term { kind, column });
            };
            match kind {
                Kind::MeasurementDelay => push(&central_difference(&torque, 1.0 / RATE)),
                // Motor side: the deflection of the spring accelerates the rotor.
                Kind::JointElasticity => {
                    let bend = second_difference(&load, 1.0 / RATE);
                    push(&bend.iter().map(|b| rotor * b).collect::<Vec<_>>());
                }
                Kind::InertiaCoupling
                | Kind::Payload
                | Kind::ViscousWarmupTemperature
                | Kind::ViscousWarmupHeat => {}
                _ if about.shapes.len() > 1 => {}
                _ if matches!(about.channel, Channel::Transmission | Channel::Voltage) => {}
                _ => {
                    for shapes in grid(kind) {
                        let mut memory = [0.0; MEMORY];
                        let mut columns = vec![Vec::new(); about.gains.len()];
                        for k in 0..signals.run.len() {
                            let values = kind.terms(&shapes, &mut memory, &at(k));
                            for (column, value) in columns.iter_mut().zip(values) {
                                column.push(value);
                            }
                        }
                        for column in columns {
                            if about.channel == Channel::Position {
                                // An error of the position reading acts through the inertia.
                                let column = second_difference(&column, 1.0 / RATE);
                                push(
                                    &column
                                        .iter()
                                        .map(|e| (inertia + rotor) * e)
                                        .collect::<Vec<_>>(),
                                );
                            } else {
                                push(&column);
                            }
                        }
                    }
                }
            }
        }
        Ok(Self {
            nominal,
            terms,
            torque: signals.column(&joint.tau),
        })
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
