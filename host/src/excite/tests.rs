#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rig_shared::multibody::{inverse_dynamics, kinetic_energy, potential_energy};
use rig_shared::trajectory::{Fourier, Trajectory};

use super::optimise::Objective;
use super::*;
use crate::data::Source;
use crate::robot::{EMPS, JointFriction, ONE_LINK_TEMPLATE};

fn one_link() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

/// Two of these links in a row, the second 0.4 m out.
fn two_links() -> Robot {
    let mut robot = one_link();
    let mut second = robot.joints[0].clone();
    second.name = "forearm".into();
    (second.alpha, second.a) = (0.0, 0.4);
    robot.joints[0].limits.as_mut().unwrap().torque = Some(30.0);
    robot.joints.push(second);
    robot
}

fn quick(criterion: Criterion) -> Options {
    Options {
        criterion,
        starts: 4,
        ..Options::default()
    }
}

fn designed(robot: &Robot, options: &Options) -> Design {
    design(robot, options, |_, _| ()).unwrap()
}

/// The furthest that position, velocity, acceleration and torque go at many instants of the whole motion.
fn sampled_reach(robot: &Robot, file: &TrajectoryFile) -> Vec<[f64; 5]> {
    let n = robot.joints.len();
    let model = Model::from_robot(robot).unwrap();
    let mut most = vec![[f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0, 0.0]; n];
    let count = 300_000;
    let mut tau = vec![0.0; n];
    for k in 0..=count {
        let t = file.duration() * f64::from(k) / f64::from(count);
        let at: Vec<_> = file.joints.iter().map(|j| j.trajectory.at(t)).collect();
        let q: Vec<f64> = at
            .iter()
            .zip(&file.joints)
            .map(|(r, j)| j.start + r.position)
            .collect();
        let qd: Vec<f64> = at.iter().map(|r| r.velocity).collect();
        let qdd: Vec<f64> = at.iter().map(|r| r.acceleration).collect();
        inverse_dynamics(&model.chain, &model.parameters, &q, &qd, &qdd, &mut tau).unwrap();
        for j in 0..n {
            let m = &mut most[j];
            *m = [
                m[0].min(q[j]),
                m[1].max(q[j]),
                m[2].max(qd[j].abs()),
                m[3].max(qdd[j].abs()),
                m[4].max(tau[j].abs()),
            ];
        }
    }
    most
}

#[test]
fn limits_hold_at_every_instant_and_are_used() {
    for (robot, options) in [
        (one_link(), quick(Criterion::Determinant)),
        (
            two_links(),
            Options {
                harmonics: 3,
                starts: 2,
                ..quick(Criterion::ConditionNumber)
            },
        ),
    ] {
        let found = designed(&robot, &options);
        let sampled = sampled_reach(&robot, &found.file);
        let mut fullest = 0.0_f64;
        for ((joint, s), proved) in robot.joints.iter().zip(&sampled).zip(&found.reach) {
            let limits = joint.limits.as_ref().unwrap();
            let torque = proved.torque.unwrap();
            // The samples lie within the proof, the proof within the limits …
            assert!(proved.position[0] <= s[0] && s[1] <= proved.position[1]);
            assert!(s[2] <= proved.velocity && s[3] <= proved.acceleration && s[4] <= torque);
            assert!(
                limits.position[0] <= proved.position[0]
                    && proved.position[1] <= limits.position[1]
            );
            assert!(proved.velocity <= limits.velocity);
            assert!(proved.acceleration <= limits.acceleration.unwrap());
            assert!(torque <= limits.torque.unwrap());
            // … and the proof is not wasteful.
            assert!(
                proved.velocity < 1.01 * s[2] && torque < 1.05 * s[4],
                "{proved:?} {s:?}"
            );
            fullest = fullest
                .max(s[2] / limits.velocity)
                .max(s[4] / limits.torque.unwrap());
        }
        assert!(fullest > 0.9, "a good motion touches a limit: {fullest}");
    }
}

#[test]
fn starts_and_stops_at_rest() {
    let found = designed(&one_link(), &quick(Criterion::ConditionNumber));
    let trajectory = &found.file.joints[0].trajectory;
    let end = trajectory.duration();
    assert!(found.file.duration() > 20.0);
    for t in [0.0, 1e-9, end - 1e-9, end, end + 1.0] {
        let at = trajectory.at(t);
        let size = at.position.abs() + at.velocity.abs() + at.acceleration.abs();
        assert!(size < 1e-5, "{t}: {at:?}");
    }
}

/// The criterion of a motion of one joint, by the frame that a design uses.
fn judged(options: &Options, motions: &[JointMotion]) -> Values {
    let (frame, _, _) = frame_of(&one_link(), options).unwrap();
    values_of(&frame, motions, 1000).unwrap()
}

#[test]
fn better_than_chance_and_than_a_sine() {
    for criterion in [
        Criterion::ConditionNumber,
        Criterion::SmallestSingularValue,
        Criterion::Determinant,
    ] {
        let options = quick(criterion);
        let found = designed(&one_link(), &options);
        let (frame, _, _) = frame_of(&one_link(), &options).unwrap();
        let mut rivals = Vec::new();
        for index in 0..50 {
            let mut problem = Problem::new(&frame);
            let x = random_start(&mut problem, &frame, 99, index);
            rivals.push(judged(&options, &problem.decode(&x)));
        }
        for harmonic in 0..3 {
            let mut coefficients = vec![0.0; 10];
            coefficients[harmonic] = 5.0 / (frame.schedule.omega() * (harmonic + 1) as f64);
            rivals.push(judged(
                &options,
                &[JointMotion {
                    base: 0.0,
                    coefficients,
                }],
            ));
        }
        for rival in rivals {
            let (ours, theirs) = (criterion.cost(&found.values), criterion.cost(&rival));
            assert!(
                ours < theirs || theirs.is_nan(),
                "{criterion:?}: {ours} {theirs}"
            );
        }
    }
}

#[test]
fn the_printed_condition_number_is_that_of_the_regressor() {
    let robot = one_link();
    let found = designed(&robot, &quick(Criterion::ConditionNumber));
    let trajectory = &found.file.joints[0].trajectory;
    let start = found.file.joints[0].start;
    let Trajectory::Fourier(Fourier {
        period_us, ramp_us, ..
    }) = trajectory
    else {
        panic!("not a Fourier series");
    };
    // The model written out by hand: gravity acts along −z, the joint axis lies along −y of the base.
    let count = 20_000;
    let mut rows = DMatrix::zeros(count, 6);
    for k in 0..count {
        let t = 1e-6 * (f64::from(*ramp_us) + f64::from(*period_us) * k as f64 / count as f64);
        let at = trajectory.at(t);
        let (s, c) = (start + at.position).sin_cos();
        let columns = [
            9.81 * c,
            -9.81 * s,
            at.acceleration,
            at.velocity,
            at.velocity.signum(),
            1.0,
        ];
        for (i, value) in columns.into_iter().enumerate() {
            rows[(k, i)] = value;
        }
    }
    let singular = rows.singular_values();
    let condition = singular.max() / singular.min();
    let printed = found.values.si_condition_number;
    assert!(
        (condition / printed - 1.0).abs() < 2e-3,
        "{condition} {printed}"
    );
    assert_eq!(
        found.base_parameters,
        ["mx1", "my1", "Izz1 + Ia1", "fv1", "fc1", "off1"]
    );
    // Scaling by the hand-made sizes of evenly drawn states gives the other one.
    let fastest = 5.0 * core::f64::consts::TAU / (1e-6 * f64::from(*period_us)) * 6.0;
    let mean_cos2 = 0.5 + (6.2_f64).sin() / (4.0 * 3.1);
    let sizes = [
        9.81 * mean_cos2.sqrt(),
        9.81 * (1.0 - mean_cos2).sqrt(),
        fastest.min(60.0) / 3.0_f64.sqrt(),
        6.0 / 3.0_f64.sqrt(),
        1.0,
        1.0,
    ];
    for (i, size) in sizes.into_iter().enumerate() {
        rows.column_mut(i).scale_mut(1.0 / size);
    }
    let singular = rows.singular_values();
    let condition = singular.max() / singular.min();
    let printed = found.values.condition_number;
    assert!(
        (condition / printed - 1.0).abs() < 0.05,
        "{condition} {printed}"
    );
}

#[test]
fn the_gradient_is_that_of_central_differences() {
    for (robot, criterion) in [
        (one_link(), Criterion::ConditionNumber),
        (two_links(), Criterion::Determinant),
        (two_links(), Criterion::SmallestSingularValue),
    ] {
        let options = Options {
            harmonics: 2,
            ..quick(criterion)
        };
        let (frame, _, _) = frame_of(&robot, &options).unwrap();
        let mut problem = Problem::new(&frame);
        let x = random_start(&mut problem, &frame, 3, 0);
        problem.update(&x, 10.0);
        problem.press(0.3);
        let mut gradient = DVector::zeros(x.len());
        let mut unused = gradient.clone();
        problem.value(&x, &mut gradient);
        for k in 0..x.len() {
            let h = 1e-6;
            let mut moved = |by: f64| {
                let mut x = x.clone();
                x[k] += by;
                problem.value(&x, &mut unused)
            };
            let difference = (moved(h) - moved(-h)) / (2.0 * h);
            let error = (difference - gradient[k]).abs();
            assert!(
                error < 1e-5 * (1.0 + gradient.amax()),
                "{k}: {difference} {}",
                gradient[k]
            );
        }
    }
}

#[test]
fn the_seed_alone_decides() {
    let with = |threads, seed| {
        let options = Options {
            threads: Some(threads),
            seed,
            ..quick(Criterion::ConditionNumber)
        };
        designed(&one_link(), &options)
    };
    assert_eq!(with(1, 5), with(3, 5));
    assert_ne!(with(1, 5).file, with(1, 6).file);
}

#[test]
fn a_given_start_is_kept_and_progress_ends_complete() {
    let options = Options {
        start: Some(vec![-1.2]),
        ..quick(Criterion::ConditionNumber)
    };
    let mut last = (0, 1);
    let found = design(&one_link(), &options, |done, total| {
        assert!(done > last.0);
        last = (done, total);
    })
    .unwrap();
    assert_eq!(found.file.joints[0].start, -1.2);
    assert_eq!(last.0, last.1);
}

#[test]
fn what_cannot_be_designed_is_said() {
    let text = |robot: &Robot, options: &Options| {
        design(robot, options, |_, _| ()).unwrap_err().to_string()
    };
    let mut robot = one_link();
    robot.joints[0].limits.as_mut().unwrap().torque = Some(0.2);
    let said = text(&robot, &quick(Criterion::ConditionNumber));
    assert!(said.contains("torque") && said.contains("link"), "{said}");
    robot.joints[0].limits = None;
    assert!(text(&robot, &Options::default()).contains("[joint.limits]"));
    let wrong = Options {
        harmonics: 9,
        ..Options::default()
    };
    assert!(text(&one_link(), &wrong).contains('9'));
    let wrong = Options {
        start: Some(vec![4.0]),
        ..Options::default()
    };
    assert!(text(&one_link(), &wrong).contains("3.1"));
}

#[test]
fn a_prismatic_joint_without_prior_is_designed_and_says_what_was_not_checked() {
    let robot = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    let found = designed(&robot, &quick(Criterion::ConditionNumber));
    assert!(
        found
            .notes
            .iter()
            .any(|n| n.contains("torque limit was not checked")),
        "{:?}",
        found.notes
    );
    assert_eq!(found.base_parameters.len(), 4);
    assert!(found.reach[0].velocity <= 0.13 && found.reach[0].torque.is_none());
    assert!(found.values.condition_number < 3.0);
}

#[test]
fn staged_motions_keep_the_limits_and_every_kind_survives_its_file() {
    let robot = one_link();
    let limits = robot.joints[0].limits.clone().unwrap();
    let mut files = vec![designed(&robot, &quick(Criterion::ConditionNumber)).file];
    for kind in [
        StagedKind::Chirp,
        StagedKind::Staircase,
        StagedKind::Reversals,
        StagedKind::Sweep,
    ] {
        let (file, notes) = staged(&robot, kind, None, None).unwrap();
        assert!(
            notes.is_empty() && file.duration() > 5.0 && file.duration() < 1800.0,
            "{file:?}"
        );
        let [low, high, v, a, torque] = sampled_reach(&robot, &file)[0];
        assert!(
            limits.position[0] <= low && high <= limits.position[1] && high > 0.1,
            "{kind:?} {low} {high}"
        );
        assert!(
            v <= limits.velocity && a <= 60.0 && torque <= 8.0,
            "{kind:?} {v} {a} {torque}"
        );
        files.push(file);
    }
    files.push(TrajectoryFile {
        robot: "r \"1\"".into(),
        design: None,
        joints: vec![JointTrajectory {
            name: "link".into(),
            start: 0.1,
            trajectory: Trajectory::Hold(123_457),
        }],
    });
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let path = folder.path().join("t.toml");
        file.save(&path, &robot, 1000.0).unwrap();
        assert_eq!(TrajectoryFile::load(&path).unwrap(), file);
    }
}

#[test]
fn samples_in_a_file_are_the_trajectory() {
    let robot = one_link();
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.csv");
    file.save(&path, &robot, 500.0).unwrap();
    let read = load_reference(&path, &robot, 1000.0).unwrap();
    let direct = file.sampled(500.0).unwrap();
    assert!((read.period - 0.002).abs() < 1e-12);
    assert_eq!(read.position, direct.position);
    assert_eq!(direct.position[0].last(), Some(&file.joints[0].start));
}

#[test]
fn faults_in_a_file_are_named_with_their_line() {
    let robot = one_link();
    let good = designed(&robot, &quick(Criterion::ConditionNumber))
        .file
        .to_toml(&robot);
    let said = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        TrajectoryFile::from_toml(&good.replace(from, to), Path::new("t.toml"))
            .unwrap_err()
            .to_string()
    };
    let text = said("period = 3.3", "period = 3.30000001");
    assert!(
        text.starts_with("t.toml:13:") && text.contains("microseconds"),
        "{text}"
    );
    let text = said("kind = \"fourier\"", "kind = \"furrier\"");
    assert!(
        text.starts_with("t.toml:1") && text.contains("furrier"),
        "{text}"
    );
    let text = said("sine = [", "sine = [0.0, 0.0, 0.0, 0.0, ");
    assert!(text.contains("9 entries"), "{text}");
    let text = said("ramp = 3.3", "ramp = 0.0");
    assert!(text.contains("ramp"), "{text}");
    let text = said("\"cond\"", "\"best\"");
    assert!(text.contains("min-singular"), "{text}");
    let missing = load_reference(Path::new("no-such.toml"), &robot, 1000.0)
        .unwrap_err()
        .to_string();
    assert!(missing.contains("no-such.toml"));
}

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
    // Work put in, less what friction takes and the offset holds, is the energy gained.
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
    // It follows its reference as well as a cascade without feed-forward can.
    let worst = motion.q[0]
        .iter()
        .zip(&run.reference[0])
        .map(|(q, r)| (q - r).abs())
        .fold(0.0, f64::max);
    assert!(worst < 0.6, "{worst}");
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

#[test]
fn a_noiseless_run_gives_its_parameters_back() {
    let robot = one_link();
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let reference = file.sampled(1000.0).unwrap();
    let run = replay(&robot, &reference, Noise::default(), 1, |_, _| ()).unwrap();
    let (q, qd, tau) = (&run.motion.q[0], &run.motion.qd[0], &run.motion.tau[0]);
    // The whole periods, by the model written out; acceleration by central differences.
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
    let found = rows.svd(true, true).solve(&right, 0.0).unwrap();
    for (value, truth) in found.iter().zip([0.3, 0.0, 0.17, 0.3, 0.4, 0.0]) {
        assert!((value - truth).abs() < 1e-3, "{found}");
    }
}

#[test]
fn noise_has_its_deviation_and_its_seed_and_saturation_is_said() {
    let mut robot = one_link();
    let file = staged(&robot, StagedKind::Staircase, None, None).unwrap().0;
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
