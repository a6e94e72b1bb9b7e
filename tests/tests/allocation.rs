//! What is computed for every sample takes no memory from the system for every sample.
#![allow(clippy::unwrap_used)]

use std::alloc::System;
use std::io::Write;
use std::path::{Path, PathBuf};

use rig_data::Source;
use rig_identify::{Options, chain_of, identify};
use rig_model::batch::{BLOCK, BatchError, ChainBatch, ModelBatch, RegressorBlock, lower};
use rig_model::robot::{Joint, JointKind, Robot};
use rig_shared::multibody::{COLUMNS, column, inverse_dynamics};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Allocations and enlargements while `work` runs.
fn allocations(work: impl FnOnce()) -> usize {
    let region = Region::new(COUNTED);
    work();
    let change = region.change();
    change.allocations + change.reallocations
}

/// A shoulder, an elbow and a wrist joint.
fn arm() -> Robot {
    let quarter = std::f64::consts::FRAC_PI_2;
    let geometry = [(0.0, 0.0, 0.4), (quarter, 0.1, 0.0), (0.0, 0.45, 0.05)];
    let joint = |(j, (alpha, a, d))| {
        Joint::new(
            &format!("joint{j}"),
            JointKind::Revolute,
            [alpha, a, 0.0, d],
        )
    };
    Robot::new("arm", geometry.into_iter().enumerate().map(joint).collect())
}

fn parameters(n: usize) -> Vec<[f64; COLUMNS]> {
    let link = |j: usize| {
        let mass = 4.0 / (1 + j) as f64;
        let mut p = [0.0; COLUMNS];
        p[column::MASS] = mass;
        p[column::FIRST_MOMENT] = 0.08 * mass;
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

/// Position, velocity and acceleration of every joint at 1 kHz.
fn motion(n: usize, samples: usize) -> [Vec<Vec<f64>>; 3] {
    let mut motion = [(); 3].map(|()| vec![vec![0.0; samples]; n]);
    for j in 0..n {
        for k in 0..samples {
            for (m, amplitude) in [0.5, 0.25, 0.1].iter().enumerate() {
                let w = 0.9 + 0.37 * j as f64 + 2.3 * m as f64;
                let (s, c) = (w * k as f64 * 1e-3 + (j * m) as f64).sin_cos();
                motion[0][j][k] += amplitude * s;
                motion[1][j][k] += amplitude * w * c;
                motion[2][j][k] -= amplitude * w * w * s;
            }
        }
    }
    motion
}

/// One test, because what is counted is what the whole program allocates.
#[test]
fn nothing_is_allocated_a_sample() {
    let robot = arm();
    // Not whole numbers of blocks. The least of three, because the thread that waits for this test may allocate too.
    let counted = |samples| {
        let rounds = [(); 3].map(|()| batches(&robot, samples));
        std::array::from_fn::<_, 7, _>(|k| rounds.map(|r| r[k]).into_iter().min().unwrap())
    };
    let few = counted(1001);
    assert_eq!(few, counted(4004));
    // A regressor that is stored or looked at piece by piece takes none at all.
    assert_eq!(few[5..], [0, 0]);

    let folder = tempfile::tempdir().unwrap();
    let [few, many] =
        [30_000, 120_000].map(|samples| identification(&robot, folder.path(), samples));
    let more = 120_000.0 - 30_000.0;
    let share = [0, 1].map(|k| (many[k] as f64 - few[k] as f64) / more);
    println!(
        "allocations a sample: {:.5} to read it, {:.5} to identify with it",
        share[0], share[1]
    );
    // For pieces and stretches of samples, however many there are.
    assert!(share[0] < 1.0 / 1000.0 && share[1] < 1.0 / 50.0);
}

/// Allocations of every function of a batch.
fn batches(robot: &Robot, samples: usize) -> [usize; 7] {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let model = ModelBatch::new(&chain, &parameters(n)).unwrap();
    let regressors = ChainBatch::new(&chain);
    let [q, qd, qdd] = motion(n, samples);
    let mut out = vec![0.0; n * COLUMNS * samples];
    let (small, triangle) = (n * samples, lower(n, 0) * samples);
    let mut stored = regressors.block(samples);
    let mut block = regressors.block(BLOCK);
    [
        allocations(|| {
            let tau = &mut out[..small];
            model.inverse_dynamics(&q, &qd, &qdd, tau).unwrap();
        }),
        allocations(|| model.gravity(&q, &mut out[..small]).unwrap()),
        allocations(|| model.inertia_matrix(&q, &mut out[..triangle]).unwrap()),
        allocations(|| {
            let accelerations = &mut out[..small];
            model
                .forward_dynamics(&q, &qd, &qdd, accelerations)
                .unwrap();
        }),
        allocations(|| regressors.energy_regressor(&q, &qd, &mut out).unwrap()),
        allocations(|| {
            let into = &mut stored;
            regressors
                .differential_regressor(&q, &qd, &qdd, into)
                .unwrap();
        }),
        allocations(|| {
            let visit = |_: &RegressorBlock| Ok::<(), BatchError>(());
            regressors
                .each_differential_block(&q, &qd, &qdd, &mut block, visit)
                .unwrap();
        }),
    ]
}

/// Allocations of reading a recording, and of identification by the defaults from file to parameters.
fn identification(robot: &Robot, folder: &Path, samples: usize) -> [usize; 2] {
    let path = written(folder, robot, samples);
    let source = Source::open(&path, robot).unwrap();
    let reading = allocations(|| {
        let rows: usize = source
            .blocks(1 << 16)
            .map(|block| block.unwrap().len())
            .sum();
        assert_eq!(rows, samples);
    });
    let options = Options::default();
    let whole = allocations(|| {
        identify(robot, &[&source], &[], &options).unwrap();
    });
    [reading, whole]
}

/// A recording of positions and torques.
fn written(folder: &Path, robot: &Robot, samples: usize) -> PathBuf {
    let n = robot.joints.len();
    let chain = chain_of(robot).unwrap();
    let [q, qd, qdd] = motion(n, samples);
    let path = folder.join(format!("{samples}.csv"));
    let mut file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    let names = |prefix: &str| (1..=n).map(|k| format!(",{prefix}{k}")).collect::<String>();
    writeln!(file, "t{}{}", names("q"), names("tau")).unwrap();
    let mut tau = vec![0.0; n];
    for k in 0..samples {
        let now = |columns: &[Vec<f64>]| columns.iter().map(|c| c[k]).collect::<Vec<_>>();
        let (q, qd, qdd) = (now(&q), now(&qd), now(&qdd));
        inverse_dynamics(&chain, &parameters(n), &q, &qd, &qdd, &mut tau).unwrap();
        write!(file, "{:.3}", k as f64 * 1e-3).unwrap();
        q.iter().for_each(|x| write!(file, ",{x:.7}").unwrap());
        tau.iter().for_each(|x| write!(file, ",{x:.5}").unwrap());
        writeln!(file).unwrap();
    }
    file.flush().unwrap();
    path
}
