//! Sound data that look faulty, and faults that look like others.

use rig_shared::trajectory::SlowReversals;

use crate::faults::tests::windows::changed_wrist;
use crate::faults::tests::*;
use rig_plant::effect::cogging::Cogging;

/// Adds an undescribed mass at a place of the last link.
fn prepared(robot: &mut Robot, mass: f64, [x, y, z]: [f64; 3]) {
    let last = robot.joints.last_mut().unwrap();
    let inertial = last.inertial.as_mut().unwrap();
    inertial.mass += mass;
    for (moment, p) in inertial.first_moment.iter_mut().zip([x, y, z]) {
        *moment += mass * p;
    }
    let own = [
        y * y + z * z,
        -x * y,
        -x * z,
        x * x + z * z,
        -y * z,
        x * x + y * y,
    ];
    for (inertia, i) in inertial.inertia.iter_mut().zip(own) {
        *inertia += mass * i;
    }
}

fn certain(robot: &Robot, runs: &[Run]) -> Vec<String> {
    let found = faults(robot, runs).unwrap().into_iter();
    let texts = found.map(|fault| (fault.certain, fault.text));
    let all: Vec<(bool, String)> = texts.collect();
    println!("{all:?}");
    (all.into_iter().filter(|f| f.0)).map(|f| f.1).collect()
}

#[test]
fn a_payload_is_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    let places = [[0.0, 0.0, 0.15], [0.1, -0.05, 0.2], [-0.15, 0.1, 0.05]];
    for (seed, place) in places.into_iter().enumerate() {
        for mass in [0.5, 2.8] {
            let (robot, runs) = changed_wrist(folder.path(), 20.0, seed as u64, |robot| {
                prepared(robot, mass, place);
            });
            assert_eq!(certain(&robot, &runs), [""; 0], "{mass} kg at {place:?}");
        }
    }
}

#[test]
fn a_recording_cut_in_two_is_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    let (robot, runs) = changed_wrist(folder.path(), 20.0, 1, |_| ());
    let half = |from: usize, to: usize| {
        let mut run = runs[0].clone();
        run.t = run.t[from..to].to_vec();
        for joint in &mut run.joints {
            joint.q_raw = joint.q_raw[from..to].to_vec();
            joint.tau = joint.tau[from..to].to_vec();
            joint.measured_velocity = None;
            joint.reference = None;
        }
        run
    };
    let middle = runs[0].len() / 2;
    let both = injured(&[half(0, middle), half(middle, runs[0].len())], |_| ());
    assert_eq!(faults(&robot, &both).unwrap(), []);
}

/// Rows at steps of 8 to 16 ms were once not judged at all.
#[test]
fn uneven_rows_are_judged_like_even_ones() {
    let (robot, runs) = emulated();
    let folder = tempfile::tempdir().unwrap();
    for sense in [1.0, -1.0] {
        let run = &runs[0];
        let mut text = String::from("t,q1,tau1\n");
        let mut k = 0;
        for row in 0.. {
            if k >= run.len() {
                break;
            }
            let joint = &run.joints[0];
            text += &format!("{},{},{}\n", run.t[k], joint.q_raw[k], sense * joint.tau[k]);
            k += [8, 13, 16, 9, 11, 15, 10][row % 7];
        }
        let path = folder.path().join("uneven.csv");
        std::fs::write(&path, text).unwrap();
        let source = Source::open_with(&path, &robot, EffortNeed::Optional).unwrap();
        assert!(source.sampling().irregular);
        let found = faults_at_start(&robot, &source, 100_000).unwrap();
        let kinds: Vec<(&str, bool)> = (found.iter())
            .map(|f| (f.kind.as_str(), f.certain))
            .collect();
        let wanted: &[(&str, bool)] = if sense > 0.0 { &[] } else { &[("sign", true)] };
        assert_eq!(kinds, wanted, "{found:?}");
    }
}

/// It was once called a reversed sense, a delay and a wrong scale.
#[test]
fn a_torque_that_lost_its_sign_is_named_as_that() {
    let folder = tempfile::tempdir().unwrap();
    let (robot, runs) = changed_wrist(folder.path(), 20.0, 2, |_| ());
    for j in [0, 3, 4] {
        let lost = injured(&runs, |run| {
            run.joints[j].tau.iter_mut().for_each(|v| *v = v.abs());
        });
        only(&robot, &lost, "magnitude", j, "never negative");
        assert_eq!(certain(&robot, &lost).len(), 1, "joint {}", j + 1);
    }
    let (robot, runs) = emulated();
    let lost = injured(&runs[..1], |run| {
        run.joints[0].tau.iter_mut().for_each(|v| *v = v.abs());
    });
    only(&robot, &lost, "magnitude", 0, "never negative");
}

/// Cogging that is not described makes waves in torque and acceleration, and a shift can imitate it.
#[test]
fn hidden_cogging_at_slow_reversals_is_no_late_torque() {
    let robot = text("one-link.toml", template("one-link").unwrap());
    for seed in 60..64 {
        let mut plant = PlantConfig::laboratory(seed);
        plant.motor.cogging = Some(Cogging {
            amplitude: 0.006,
            order: 12.0,
            phase: 0.7,
        });
        let at = plant.initial_position as f32;
        let rig = EmulatedRig::new(&Nameplate::from_robot(&robot).unwrap(), plant, seed).unwrap();
        let mut line = Session::open(EmulatedPort::new(rig), SessionSettings::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("slow.csv");
        let slow = SlowReversals::new(0.1, 0.1, &[0.15, 0.1], 1).unwrap();
        let told = vec![RequestBody::SetPosition(at)];
        RecordedRun::record(
            &mut line,
            told,
            &Trajectory::SlowReversals(slow),
            0.2,
            &path,
        )
        .unwrap();
        assert_eq!(certain(&robot, &read(&robot, &path, 0)), [""; 0], "{seed}");
    }
}
