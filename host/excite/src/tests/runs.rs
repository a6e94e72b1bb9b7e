//! Runs through the simulated closed loop.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{kinetic_energy, potential_energy};

use super::*;
use rig_data::Source;
use rig_model::robot::JointFriction;

#[test]
fn the_simulated_run_conserves_energy_and_reads_back() {
    let mut robot = one_link();
    let friction = JointFriction {
        coulomb: 0.4,
        viscous: 0.3,
        offset: 0.1,
    };
    robot.joints[0].friction = Some(friction);
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let reference = file.sampled(1000.0).unwrap();
    let run = replay(&robot, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    assert!(
        run.notes.iter().any(|n| n.contains("stand-in")),
        "{:?}",
        run.notes
    );
    let motion = &run.motion;
    let model = Model::from_robot(&robot).unwrap();
    let energy = |k: usize| {
        let (q, qd) = (&motion.q[0][k..=k], &motion.qd[0][k..=k]);
        kinetic_energy(&model.chain, &model.parameters, q, qd).unwrap()
            + potential_energy(&model.chain, &model.parameters, q).unwrap()
    };
    // Work done minus friction loss and work of the offset equals the gained energy.
    let (mut put_in, mut lost) = (0.0, 0.0);
    let last = motion.q[0].len() - 1;
    for k in 0..last {
        let way = motion.q[0][k + 1] - motion.q[0][k];
        let speed = way / run.period;
        put_in += 0.5 * (motion.tau[0][k] + motion.tau[0][k + 1]) * way;
        lost += 0.4 * way.abs() + 0.3 * speed * way + 0.1 * way;
    }
    let gained = energy(last) - energy(0);
    assert!(put_in > 10.0, "{put_in}");
    assert!(
        (put_in - lost - gained).abs() < 2e-3 * put_in,
        "{put_in} {lost} {gained}"
    );
    // It follows its reference.
    let worst = motion.q[0]
        .iter()
        .zip(&run.reference[0])
        .map(|(q, r)| (q - r).abs())
        .fold(0.0, f64::max);
    println!("off by {worst} rad at most");
    assert!(worst < 0.1, "{worst}");
    let folder = tempfile::tempdir().unwrap();
    for name in ["run.csv", "run.mcap"] {
        let path = folder.path().join(name);
        run.save(&path, &robot).unwrap();
        let (blocks, warnings) = Source::open(&path, &robot).unwrap().read_all().unwrap();
        assert!(blocks.len() == 1 && warnings.is_empty());
        assert_eq!(blocks[0].joints[0].tau, motion.tau[0]);
        assert_eq!(
            blocks[0].joints[0].reference.as_ref(),
            Some(&run.reference[0])
        );
        // A recording's reference can be run again.
        assert_eq!(
            load_reference(&path, &robot, 1.0).unwrap().position,
            reference.position
        );
    }
}

/// A loop that ran once per recorded sample was not stable in other poses than the start, and gave torques from limit
/// to limit.
#[test]
fn the_rate_of_the_recorder_does_not_change_the_motion() {
    let robot = Robot::from_toml(
        rig_model::robot::template("edda").unwrap(),
        Path::new("edda.toml"),
    )
    .unwrap();
    let run = |rate: f64| {
        let t = |k: usize| k as f64 / rate;
        // From stretched to folded and back; the elbow turns twice as fast.
        let shoulder = |t: f64| 0.8 * (1.0 - (1.5 * t).cos());
        let elbow = |t: f64| 1.1 * (1.0 - (3.0 * t).cos());
        let count = (8.0 * rate) as usize + 1;
        let reference = SampledReference {
            period: 1.0 / rate,
            position: vec![
                (0..count).map(|k| shoulder(t(k))).collect(),
                (0..count).map(|k| elbow(t(k))).collect(),
            ],
            velocity: Vec::new(),
            acceleration: Vec::new(),
        };
        let run = replay(&robot, &reference, Noise::default(), 1, |_, _| ()).unwrap();
        assert_eq!(run.motion.saturated, [0, 0]);
        run.motion
    };
    let (coarse, fine) = (run(50.0), run(2000.0));
    for j in 0..2 {
        let apart = |a: &[f64], b: &[f64]| {
            let differences = a
                .iter()
                .zip(b.iter().step_by(40))
                .map(|(a, b)| (a - b).abs());
            differences.fold(0.0, f64::max)
        };
        let torque = fine.tau[j]
            .iter()
            .fold(0.0f64, |most, tau| most.max(tau.abs()));
        let found = [
            apart(&coarse.q[j], &fine.q[j]),
            apart(&coarse.tau[j], &fine.tau[j]) / torque,
        ];
        println!(
            "joint {}: {:e} rad, {:.2} % of the torque",
            j + 1,
            found[0],
            100.0 * found[1]
        );
        assert!(found[0] < 1e-3 && found[1] < 0.03, "{found:?}");
    }
}

#[test]
fn a_noiseless_run_gives_its_parameters_back() {
    let robot = one_link();
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let reference = file.sampled(1000.0).unwrap();
    let run = replay(&robot, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    let (q, qd, tau) = (&run.motion.q[0], &run.motion.qd[0], &run.motion.tau[0]);
    // The whole periods, by the explicit model; acceleration by central differences.
    let used: Vec<usize> = (3300..q.len() - 3300)
        .filter(|k| qd[*k].abs() > 0.05)
        .collect();
    let rows = DMatrix::from_fn(used.len(), 6, |row, c| {
        let k = used[row];
        let acceleration = (qd[k + 1] - qd[k - 1]) / (2.0 * run.period);
        let (s, cos) = q[k].sin_cos();
        [
            9.81 * cos,
            -9.81 * s,
            acceleration,
            qd[k],
            qd[k].signum(),
            1.0,
        ][c]
    });
    let right = DVector::from_iterator(used.len(), used.iter().map(|k| tau[*k]));
    let found = rig_numerics::svd::Svd::of(rows).solve(&right, 0.0);
    for (value, truth) in found.iter().zip([0.3, 0.0, 0.17, 0.3, 0.4, 0.0]) {
        assert!((value - truth).abs() < 1e-3, "{found}");
    }
}

#[test]
fn noise_has_its_deviation_and_its_seed_and_saturation_is_said() {
    let mut robot = one_link();
    let file = staged(&robot, StagedKind::Staircase, &StagedOptions::default())
        .unwrap()
        .0;
    let reference = file.sampled(500.0).unwrap();
    let run =
        |robot: &Robot, noise, seed| replay(robot, &reference, noise, seed, |_, _| ()).unwrap();
    let clean = run(&robot, Noise::default(), 1);
    let noise = Noise {
        position: 0.01,
        velocity: 0.0,
        torque: 0.2,
    };
    let noisy = run(&robot, noise, 1);
    let deviation = |a: &[f64], b: &[f64]| {
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
    };
    assert!((deviation(&noisy.motion.q[0], &clean.motion.q[0]) / 0.01 - 1.0).abs() < 0.05);
    assert!((deviation(&noisy.motion.tau[0], &clean.motion.tau[0]) / 0.2 - 1.0).abs() < 0.05);
    assert_eq!(noisy.motion.qd, clean.motion.qd);
    assert_eq!(noisy, run(&robot, noise, 1));
    assert_ne!(noisy, run(&robot, noise, 2));
    assert!(!clean.notes.iter().any(|n| n.contains("cut in")));
    robot.joints[0].limits.as_mut().unwrap().torque = Some(2.5);
    let cut = run(&robot, Noise::default(), 1);
    assert!(
        cut.notes.iter().any(|n| n.contains("cut in")),
        "{:?}",
        cut.notes
    );
    assert!(cut.motion.tau[0].iter().all(|t| t.abs() <= 2.5));
}

/// A wrist that is light compared with its dry friction, as in most URDFs: feedback by inertia alone does not move it.
#[test]
fn a_light_link_with_much_dry_friction_follows_and_what_does_not_is_said() {
    let mut robot = one_link();
    let joint = &mut robot.joints[0];
    joint.controller = None;
    joint.drive = None;
    joint.friction = Some(JointFriction {
        coulomb: 1.0,
        viscous: 1.0,
        offset: 0.0,
    });
    let inertial = joint.inertial.as_mut().unwrap();
    for value in [&mut inertial.mass]
        .into_iter()
        .chain(&mut inertial.first_moment)
        .chain(&mut inertial.inertia)
    {
        *value *= 1e-2;
    }
    let reference = SampledReference::about_middle(&robot, 1e-3, 6.0, |_, t| 0.5 * t.sin().powi(2));
    let run = |robot: &Robot| replay(robot, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    let free = run(&robot);
    let off = free.motion.q[0].iter().zip(&free.reference[0]);
    let off = off.map(|(q, r)| (q - r).abs()).fold(0.0, f64::max);
    println!("off by {off}");
    assert!(off < 0.05, "{off}");
    assert!(
        free.notes.iter().all(|n| !n.contains("off its reference")),
        "{:?}",
        free.notes
    );
    // The torque is below friction: the joint stays, and a note reports it.
    robot.joints[0].limits.as_mut().unwrap().torque = Some(0.9);
    let held = run(&robot);
    assert!(
        held.notes.iter().any(|n| n.contains("off its reference")),
        "{:?}",
        held.notes
    );
}
