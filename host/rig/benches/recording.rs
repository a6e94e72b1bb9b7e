//! How long a recording takes, from file to parameters, and what its parts cost.
//!
//! That memory does not grow with the recording is shown by `tests/cli/memory.rs`, which watches the peak resident
//! memory of `rig identify`.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use std::hint::black_box;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use rig_data::Source;
use rig_firmware::sample::Command;
use rig_identify::{Estimator, Options, TriangularFactor, chain_of, identify};
use rig_link::experiment::{Experiment, run};
use rig_link::{EmulatedPort, Session, SessionSettings};
use rig_model::robot::{Inertial, Joint, JointKind, ONE_LINK_TEMPLATE, Robot};
use rig_plant::emulated::{EmulatedRig, Nameplate};
use rig_plant::{Plant, PlantConfig};
use rig_shared::multibody::{COLUMNS, column, inverse_dynamics};
use rig_shared::trajectory::{Fourier, Trajectory};
use rig_shared::units::Duty;

const MILLION: usize = 1_000_000;

fn one_link() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// An elbow arm with spherical wrist: every link has mass, so that all base parameters come into play.
fn six_joints() -> Robot {
    let quarter = std::f64::consts::FRAC_PI_2;
    let geometry = [
        (0.0, 0.0, 0.4),
        (quarter, 0.0, 0.0),
        (0.0, 0.45, 0.0),
        (quarter, 0.05, 0.42),
        (-quarter, 0.0, 0.0),
        (quarter, 0.0, 0.0),
    ];
    let joints = geometry.iter().enumerate().map(|(j, &(alpha, a, d))| {
        let name = format!("joint{}", j + 1);
        Joint::new(&name, JointKind::Revolute, [alpha, a, 0.0, d])
    });
    Robot::new("six joints", joints.collect())
}

/// What moves in the recordings of an arm of `n` joints.
fn parameters(n: usize) -> Vec<[f64; COLUMNS]> {
    let link = |j: usize| {
        let mut p = [0.0; COLUMNS];
        let mass = 4.0 / (1 + j) as f64;
        p[column::MASS] = mass;
        p[column::FIRST_MOMENT] = 0.08 * mass;
        p[column::FIRST_MOMENT + 1] = 0.02 * mass;
        p[column::FIRST_MOMENT + 2] = 0.03 * mass;
        p[column::INERTIA] = 0.02 * mass;
        p[column::INERTIA + 3] = 0.03 * mass;
        p[column::INERTIA + 5] = 0.035 * mass;
        p[column::DRIVE_INERTIA] = 0.05;
        p[column::VISCOUS] = 0.3;
        p[column::COULOMB] = 0.4;
        p
    };
    (0..n).map(link).collect()
}

/// The arm with its links stated a fifth too heavy: what is looked for beyond a description is looked for where it states all
/// links.
fn described(mut robot: Robot) -> Robot {
    let links = parameters(robot.joints.len());
    for (joint, p) in robot.joints.iter_mut().zip(&links) {
        let part = |from: usize, k: usize| 1.2 * p[from + k];
        joint.inertial = Some(Inertial {
            mass: part(column::MASS, 0),
            first_moment: std::array::from_fn(|k| part(column::FIRST_MOMENT, k)),
            inertia: std::array::from_fn(|k| part(column::INERTIA, k)),
        });
    }
    robot.name = "six joints described".into();
    robot
}

/// A recording of `rows` samples at 1 kHz, three sines a joint, its torque by inverse dynamics to five decimals.
fn write(folder: &Path, robot: &Robot, rows: usize) -> PathBuf {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let parameters = parameters(n);
    let path = folder.join(format!("{n}-joints.csv"));
    let mut file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    let names = |prefix: &str| (1..=n).map(|k| format!(",{prefix}{k}")).collect::<String>();
    writeln!(file, "t{}{}", names("q"), names("tau")).unwrap();
    let (mut q, mut qd, mut qdd, mut tau) =
        (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 0..rows {
        let t = k as f64 * 1e-3;
        for j in 0..n {
            (q[j], qd[j], qdd[j]) = (0.0, 0.0, 0.0);
            for (m, amplitude) in [0.5, 0.25, 0.1].iter().enumerate() {
                let w = 0.9 + 0.37 * j as f64 + 2.3 * m as f64;
                let (s, c) = (w * t + (j * m) as f64).sin_cos();
                q[j] += amplitude * s;
                qd[j] += amplitude * w * c;
                qdd[j] -= amplitude * w * w * s;
            }
        }
        inverse_dynamics(&chain, &parameters, &q, &qd, &qdd, &mut tau).unwrap();
        write!(file, "{t:.3}").unwrap();
        q.iter().for_each(|x| write!(file, ",{x:.7}").unwrap());
        tau.iter().for_each(|x| write!(file, ",{x:.5}").unwrap());
        writeln!(file).unwrap();
    }
    file.flush().unwrap();
    path
}

/// (a), (b): from file to parameters, as `rig identify` goes there, and reading alone.
fn recordings(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().unwrap();
    for (name, robot, rows) in [
        ("one link, a million rows", one_link_torque(), MILLION),
        ("six joints, a million rows", six_joints(), MILLION),
        (
            "six joints described, a million rows",
            described(six_joints()),
            MILLION,
        ),
    ] {
        let options = Options {
            estimator: Estimator::for_robot(&robot),
            look_beyond: true,
            ..Options::default()
        };
        let path = write(folder.path(), &robot, rows);
        let mut group = criterion.benchmark_group("identify");
        group
            .sample_size(10)
            .measurement_time(Duration::from_secs(15))
            .throughput(Throughput::Elements(rows as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let source = Source::open(&path, &robot).unwrap();
                black_box(identify(&robot, &[&source], &[], &options).unwrap())
            });
        });
        group.finish();
        let bytes = std::fs::metadata(&path).unwrap().len();
        let mut group = criterion.benchmark_group("read CSV");
        group.sample_size(10).throughput(Throughput::Bytes(bytes));
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let source = Source::open(&path, &robot).unwrap();
                source
                    .blocks(1 << 16)
                    .map(|block| block.unwrap().len())
                    .sum::<usize>()
            });
        });
        group.finish();
    }
}

/// Seconds of processor time, user and system, of the child processes that have ended; none where it is not told.
fn children_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program stands in brackets and may hold anything; cutime and cstime are fields 16 and 17, in
    // hundredths of a second (Linux, proc(5)).
    let (_, fields) = text.rsplit_once(')')?;
    let fields: Vec<&str> = fields.split_whitespace().collect();
    let ticks = |k: usize| fields.get(k)?.parse::<f64>().ok();
    Some((ticks(13)? + ticks(14)?) / 100.0)
}

/// The whole program: `rig identify` on a file of a million rows of six joints, parameters and report written. The
/// machine's other work lengthens the time of the clock, hardly that of the processors, so both are given.
fn program(criterion: &mut Criterion) {
    let data_folder = tempfile::tempdir().unwrap();
    let data = write(data_folder.path(), &six_joints(), MILLION);
    for robot in [six_joints(), described(six_joints())] {
        program_on(criterion, &robot, &data);
    }
}

fn program_on(criterion: &mut Criterion, robot: &Robot, data: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let description = folder.path().join("arm.toml");
    std::fs::write(&description, robot.to_toml().unwrap()).unwrap();
    let mut group = criterion.benchmark_group("rig identify");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(30))
        .throughput(Throughput::Elements(MILLION as u64));
    let before = children_seconds();
    let mut runs = 0u32;
    group.bench_function(format!("{}, a million rows", robot.name), |bencher| {
        bencher.iter(|| {
            let status = std::process::Command::new(env!("CARGO_BIN_EXE_rig"))
                .arg("identify")
                .arg("--robot")
                .arg(&description)
                .arg("--data")
                .arg(data)
                .arg("--out")
                .arg(folder.path().join("result"))
                .arg("--force")
                .stdout(std::process::Stdio::null())
                .status()
                .unwrap();
            assert!(status.success());
            runs += 1;
        });
    });
    group.finish();
    if let (Some(before), Some(after)) = (before, children_seconds())
        && runs > 0
    {
        let each = (after - before) / f64::from(runs);
        println!(
            "rig identify, {}: {each:.2} s of processor time a run, user and system, over {runs} runs",
            robot.name
        );
    }
}

/// The one-link rig, its recording in joint torque.
fn one_link_torque() -> Robot {
    let mut robot = one_link();
    robot.joints[0].drive = None;
    robot
}

/// (c): rows into a triangular factor.
fn factor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("triangular factor");
    for columns in [6, 60] {
        let rows: Vec<f64> = (0..1024 * columns)
            .map(|k| ((k * k) as f64 * 0.7).sin())
            .collect();
        group.throughput(Throughput::Elements(1024));
        group.bench_function(format!("{columns} columns"), |bencher| {
            let mut factor = TriangularFactor::new(columns);
            bencher.iter(|| {
                rows.chunks(columns)
                    .for_each(|row| factor.push(black_box(row), row[0] + 1.0, 1.0))
            });
        });
    }
    group.finish();
}

/// (d), (e): a control tick of the plant alone, and of an experiment: plant, firmware with its estimator, wire, host.
fn ticks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("control ticks");
    group.throughput(Throughput::Elements(1000));
    group.bench_function("plant", |bencher| {
        let mut plant = Plant::new(PlantConfig::laboratory(1), 1);
        let command = Command {
            duty: Duty(0.1),
            bridge: true,
        };
        bencher.iter(|| {
            for _ in 0..1000 {
                black_box(plant.advance(black_box(command)));
            }
        });
    });
    let nameplate = Nameplate::from_robot(&one_link()).unwrap();
    let trajectory = Trajectory::Fourier(Fourier {
        period_us: 5_000_000,
        periods: 1,
        ramp_us: 1_000_000,
        sine: [0.5f32, 0.2, -0.2].into_iter().collect(),
        cosine: [0.1f32, -0.1, 0.1].into_iter().collect(),
    });
    let duration = trajectory.duration_micros() as f64 * 1e-6;
    let control_rate = f64::from(nameplate.config.rates.control_hz);
    let experiment = Experiment {
        settings: Vec::new(),
        trajectory: Some(trajectory),
        ..Experiment::default()
    };
    group
        .sample_size(10)
        .throughput(Throughput::Elements((duration * control_rate) as u64));
    group.bench_function(
        "experiment: plant, firmware with estimator, wire, host",
        |bencher| {
            bencher.iter_batched_ref(
                || {
                    let mut rig =
                        EmulatedRig::new(&nameplate, PlantConfig::laboratory(1), 1).unwrap();
                    for _ in 0..2 * nameplate.config.calibration_ticks {
                        rig.tick();
                    }
                    Session::open(EmulatedPort::new(rig), SessionSettings::default()).unwrap()
                },
                |session| run(session, &experiment, |_| ControlFlow::Continue(())).unwrap(),
                BatchSize::LargeInput,
            );
        },
    );
    group.finish();
}

criterion_group!(all, program, recordings, factor, ticks);
criterion_main!(all);
