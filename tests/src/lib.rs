//! What the tests of the whole rig share: rigs on the bench, excitation, recordings.
#![allow(clippy::unwrap_used, clippy::panic)]

pub mod circle;
pub mod engines;

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use rand::RngExt;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};
use rig_link::experiment::{Experiment, run};
use rig_link::{
    Converter, EmulatedPort, Event, LinkError, LossReport, Port, Row, Session, SessionSettings,
};
use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
use rig_plant::PlantConfig;
use rig_plant::emulated::{EmulatedRig, Nameplate};
use rig_shared::effects::{Effect, Kind};
use rig_shared::friction::Friction;
use rig_shared::link::{LinkParameters, PARAMETER_COUNT};
use rig_shared::safety::FaultRecord;
use rig_shared::trajectory::{Fourier, Trajectory};
use rig_shared::wire::message::{Estimate, Refusal, Report, RequestBody};

/// The one-link rig as its description has it.
pub fn robot() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// The nameplate for a plant: the description, but for the torque constant, which is the plant's own. An error in
/// it scales every parameter alike, and no motion of this rig can show it.
pub fn nameplate(plant: &PlantConfig) -> Nameplate {
    let mut robot = robot();
    robot.joints[0].drive.as_mut().unwrap().torque_constant = plant.motor.torque_constant;
    Nameplate::from_robot(&robot).unwrap()
}

/// A session with an emulated rig.
pub type Line = Session<EmulatedPort<EmulatedRig>>;

/// Powers a rig up and greets it.
pub fn connect(nameplate: &Nameplate, plant: PlantConfig, seed: u64) -> Line {
    let rig = EmulatedRig::new(nameplate, plant, seed).unwrap();
    Session::open(EmulatedPort::new(rig), SessionSettings::default()).unwrap()
}

/// A laboratory rig, powered up, calibrated, told where it hangs.
pub fn bench(seed: u64) -> (Line, PlantConfig) {
    let plant = PlantConfig::laboratory(seed);
    let mut line = connect(&nameplate(&plant), plant.clone(), seed);
    calibrated(&mut line);
    line.request(RequestBody::SetPosition(plant.initial_position as f32))
        .unwrap();
    (line, plant)
}

/// The plant's own model and steady friction, as the host would send them.
pub fn truth_of(plant: &PlantConfig) -> Vec<RequestBody> {
    let truth = plant.equivalent().to_array().map(|value| value as f32);
    let model = LinkParameters::from_array(truth);
    vec![
        RequestBody::SetModel(model),
        RequestBody::SetFriction(Friction {
            coulomb: model.coulomb,
            viscous: model.viscous,
            ..Friction::default()
        }),
    ]
}

/// What the drive has to give against a torque amplitude·sin(order·θ + phase) on the joint, θ the motor's angle.
pub fn periodic(amplitude: f64, order: f64, phase: f64) -> Effect<f32> {
    let (sine, cosine) = phase.sin_cos();
    Effect {
        kind: Kind::Cogging,
        gains: [
            (-amplitude * sine) as f32,
            (-amplitude * cosine) as f32,
            0.0,
            0.0,
        ],
        shapes: [order as f32, 0.0, 0.0, 0.0],
    }
}

/// The plant's cogging as an effect.
pub fn cogging_of(plant: &PlantConfig) -> Effect<f32> {
    let cogging = plant.motor.cogging.unwrap();
    let amplitude = plant.mechanism.ratio * cogging.amplitude;
    periodic(amplitude, cogging.order, cogging.phase)
}

/// Gravity acceleration of description and plant, m/s².
pub const GRAVITY: f64 = 9.81;

/// A plant's base parameters, in the order of the identification. The joint of the description lies horizontally, so that
/// gravity acts with −y of its frame: gc = g·mx, gs = −g·my.
pub fn base_parameters_of(plant: &PlantConfig) -> [f64; PARAMETER_COUNT] {
    let [inertia, cos, sin, viscous, coulomb, offset] = plant.equivalent().to_array();
    [
        cos / GRAVITY,
        -sin / GRAVITY,
        inertia,
        viscous,
        coulomb,
        offset,
    ]
}

/// By how many of its own standard deviations each parameter of an on-line estimate is off the plant's.
pub fn deviations(estimate: &Estimate, plant: &PlantConfig) -> [f64; PARAMETER_COUNT] {
    let truth = plant.equivalent().to_array();
    std::array::from_fn(|k| (f64::from(estimate.value[k]) - truth[k]) / f64::from(estimate.std[k]))
}

/// Waits until the rig has measured its current offset.
pub fn calibrated<P: Port>(line: &mut Session<P>) {
    for _ in 0..100 {
        match line.request(RequestBody::SetPosition(0.0)) {
            Ok(()) => return,
            Err(LinkError::Refused {
                refusal: Refusal::WrongMode,
                ..
            }) => wait(line, 0.05),
            Err(other) => panic!("{other}"),
        }
    }
    panic!("the rig never ended its calibration");
}

/// Lets emulated time pass; what comes meanwhile is dropped.
pub fn wait<P: Port>(line: &mut Session<P>, seconds: f64) {
    let until = line.port().now() + std::time::Duration::from_secs_f64(seconds);
    loop {
        let left = until.saturating_sub(line.port().now());
        if left.is_zero() {
            return;
        }
        line.next_report(left).unwrap();
    }
}

/// Fourier excitation drawn at random: five harmonics of `period_s`, scaled to a top speed of 3 rad/s or an
/// amplitude of 1 rad, whichever comes first: the link then keeps to its range wherever friction let it hang.
pub fn excitation(seed: u64, period_s: u32, periods: u16) -> Trajectory<f32> {
    let mut rng = Pcg64Mcg::seed_from_u64(0x00EC_17A7 ^ (seed << 8));
    let mut draw = |k: u32| rng.random_range(-1.0_f32..1.0) / k as f32;
    let shape = Fourier {
        period_us: period_s * 1_000_000,
        periods,
        ramp_us: 2_000_000,
        sine: (1..=5).map(&mut draw).collect(),
        cosine: (1..=5).map(&mut draw).collect(),
    };
    let all = Trajectory::Fourier(shape.clone()).extremes();
    let scale = (3.0 / all.velocity).min(1.0 / all.highest.max(-all.lowest));
    Trajectory::Fourier(Fourier {
        sine: shape.sine.iter().map(|x| x * scale).collect(),
        cosine: shape.cosine.iter().map(|x| x * scale).collect(),
        ..shape
    })
}

/// All that a run of an experiment gave.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// The telemetry, in SI units.
    pub rows: Vec<Row>,
    /// Every on-line estimate.
    pub estimates: Vec<Estimate>,
    /// Every fault that was announced.
    pub faults: Vec<FaultRecord>,
    /// What became of the samples.
    pub losses: LossReport,
}

impl Recording {
    /// The last on-line estimate.
    pub fn estimate(&self) -> Estimate {
        *self.estimates.last().unwrap()
    }

    /// The recording as the identification takes it, without the columns of the rig's marks.
    pub fn in_memory(&self, label: &str, torque_per_ampere: f64) -> InMemory {
        let of = |f: &dyn Fn(&Row) -> f64| self.rows.iter().map(f).collect::<Vec<_>>();
        InMemory {
            label: label.into(),
            blocks: vec![Block {
                t: of(&|row| row.t),
                joints: vec![JointColumns {
                    q: of(&|row| row.q1),
                    tau: of(&|row| row.i1 * torque_per_ampere),
                    ..JointColumns::default()
                }],
                first_line: 2,
                ..Block::default()
            }],
        }
    }

    /// RMS of position minus reference over the rows between two times from the first row, rad.
    pub fn tracking_rms(&self, from: f64, to: f64) -> f64 {
        let start = self.rows[0].t;
        let of = |row: &&Row| (from..to).contains(&(row.t - start));
        let count = self.rows.iter().filter(of).count();
        let sum: f64 = self
            .rows
            .iter()
            .filter(of)
            .map(|row| (row.q1 - row.ref1).powi(2))
            .sum();
        (sum / count as f64).sqrt()
    }
}

/// Runs an experiment and keeps everything.
pub fn recorded<P: Port>(line: &mut Session<P>, experiment: &Experiment) -> Recording {
    let converter = Converter::new(line.greeting());
    let mut out = Recording::default();
    out.losses = run(line, experiment, |event| {
        match event {
            Event::Samples {
                first_tick,
                samples,
            } => out.rows.extend(
                samples
                    .iter()
                    .enumerate()
                    .map(|(k, sample)| converter.row(first_tick, k, sample)),
            ),
            Event::Estimate(estimate) => out.estimates.push(*estimate),
            Event::Fault(fault) => out.faults.push(*fault),
            Event::Gap { .. } | Event::Snapshot(_) | Event::Capture(_) | Event::Health(_) => {}
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    out
}

/// Runs a trajectory from where the link stands, with these settings; `rest` seconds of holding are kept too.
pub fn driven<P: Port>(
    line: &mut Session<P>,
    settings: Vec<RequestBody>,
    trajectory: Trajectory<f32>,
    rest: f64,
) -> Recording {
    recorded(
        line,
        &Experiment {
            settings,
            trajectory: Some(trajectory),
            rest,
            ..Experiment::default()
        },
    )
}

/// Works through `jobs` numbers on two threads and gives the results in order.
pub fn in_parallel<T: Send>(jobs: u64, job: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let job = &job;
    let mut parts: Vec<Vec<(u64, T)>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2)
            .map(|part| {
                scope.spawn(move || {
                    (0..jobs)
                        .filter(|k| k % 2 == part)
                        .map(|k| (k, job(k)))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap())
            .collect()
    });
    let mut all: Vec<(u64, T)> = parts.drain(..).flatten().collect();
    all.sort_by_key(|(k, _)| *k);
    all.into_iter().map(|(_, value)| value).collect()
}

/// The latched fault and the ticks of its snapshot, over the wire.
pub fn snapshot<P: Port>(line: &mut Session<P>) -> (FaultRecord, Vec<u64>) {
    line.request(RequestBody::GetSnapshot).unwrap();
    let (mut ticks, mut record, mut total) = (Vec::new(), None, usize::MAX);
    while ticks.len() < total {
        match line
            .next_report(Duration::from_millis(500))
            .unwrap()
            .unwrap()
        {
            Report::Fault(found) => record = Some(found),
            Report::Snapshot(part) => {
                assert_eq!(usize::from(part.first), ticks.len());
                total = usize::from(part.total);
                ticks.extend(part.samples.iter().map(|sample| sample.tick));
            }
            _ => {}
        }
    }
    (record.unwrap(), ticks)
}
