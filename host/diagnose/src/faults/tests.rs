#![allow(clippy::unwrap_used, clippy::panic)]

mod alike;
mod coarse;
mod doubts;
mod gain;
mod geared;
mod mounts;
mod scales;
mod transformed;
mod windows;

use std::path::{Path, PathBuf};

use crate::faults::*;
use rig_data::prepare::LowPass;
use rig_data::runs::runs_of;
use rig_data::{EffortNeed, Source};
use rig_link::recorded_run::pause;
use rig_link::{EmulatedPort, RecordedRun, Session, SessionSettings};
use rig_model::robot::{EMPS, TX40, template};
use rig_output::data_dir;
use rig_plant::PlantConfig;
use rig_plant::emulated::{EmulatedRig, Nameplate, description_of, friction_sweep};
use rig_shared::trajectory::Trajectory;
use rig_shared::wire::message::RequestBody;

/// A robot with its recordings.
struct Set {
    name: &'static str,
    robot: Robot,
    files: Vec<PathBuf>,
}

fn text(name: &str, toml: &str) -> Robot {
    Robot::from_toml(toml, Path::new(name)).unwrap()
}

fn double_pendulum() -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/double-pendulum.toml");
    Robot::load(&path).unwrap()
}

fn measured() -> Vec<Set> {
    let Some(data) = data_dir() else {
        println!("no real recordings here (set RIG_DATA): only emulated ones are judged");
        return Vec::new();
    };
    let files = |list: &[&str]| list.iter().map(|f| data.join(f)).collect::<Vec<_>>();
    vec![
        Set {
            name: "emps",
            robot: text("emps.toml", EMPS),
            files: files(&["emps/train.csv", "emps/test_pulses.csv"]),
        },
        Set {
            name: "dfki",
            robot: double_pendulum(),
            files: files(&[
                "dfki_double_pendulum/train.csv",
                "dfki_double_pendulum/test.csv",
            ]),
        },
        Set {
            name: "kuka",
            robot: Robot::load(&data.join("kuka_lwr4/kuka_lwr4.urdf")).unwrap(),
            files: files(&[
                "kuka_lwr4/run1.csv",
                "kuka_lwr4/run2.csv",
                "kuka_lwr4/run3.csv",
            ]),
        },
        Set {
            name: "tx40",
            robot: text("tx40.toml", TX40),
            files: files(&["staubli_tx40/motor_1kHz.csv"]),
        },
    ]
}

fn read(robot: &Robot, path: &Path, number: usize) -> Vec<Run> {
    let source = Source::open_with(path, robot, EffortNeed::Optional).unwrap();
    let rate = 1.0 / source.sampling().period;
    let low_pass = LowPass::butterworth(4, 20.0, rate).unwrap();
    runs_of(&source, number, rate, &low_pass).unwrap()
}

fn all(set: &Set) -> Vec<Run> {
    let files = set.files.iter().enumerate();
    files.flat_map(|(k, f)| read(&set.robot, f, k)).collect()
}

/// Returns the runs with changed columns of a joint, filtered and differentiated again.
fn injured(runs: &[Run], change: impl Fn(&mut Run)) -> Vec<Run> {
    let mut runs = runs.to_vec();
    for run in &mut runs {
        change(run);
        let low_pass = LowPass::butterworth(4, f64::min(20.0, 0.2 * run.rate), run.rate).unwrap();
        for joint in &mut run.joints {
            joint.q = low_pass.zero_phase(&joint.q_raw);
            joint.qd = rig_data::prepare::central_difference(&joint.q, 1.0 / run.rate);
            joint.qdd = rig_data::prepare::second_difference(&joint.q, 1.0 / run.rate);
        }
    }
    runs
}

fn times(column: &mut [f64], factor: f64) {
    column.iter_mut().for_each(|v| *v *= factor);
}

/// The emulated rig of the laboratory: two designed motions and a friction sweep, as in its telemetry.
fn emulated() -> (Robot, Vec<Run>) {
    let folder = tempfile::tempdir().unwrap();
    let plant = PlantConfig::laboratory(7);
    let robot = description_of(&plant).unwrap();
    let home = plant.initial_position;
    let designed = |seed: u64| {
        let options = rig_excite::Options {
            start: Some(vec![home]),
            seed,
            ..rig_excite::Options::default()
        };
        let design = rig_excite::design(&robot, &options, |_, _| ()).unwrap();
        design.file.joints[0].trajectory.clone()
    };
    let sweep = friction_sweep().unwrap();
    let motions = [designed(7), designed(8), Trajectory::FrictionSweep(sweep)];
    let nameplate = Nameplate::from_robot(&robot).unwrap();
    let cooling = f64::from(nameplate.config.monitor.thermal_time);
    let rig = EmulatedRig::new(&nameplate, plant, 7).unwrap();
    let mut line = Session::open(EmulatedPort::new(rig), SessionSettings::default()).unwrap();
    let mut told = vec![RequestBody::SetPosition(home as f32)];
    let mut runs = Vec::new();
    for (k, motion) in motions.iter().enumerate() {
        let path = folder.path().join(format!("{k}.csv"));
        pause(&mut line, cooling).unwrap();
        RecordedRun::record(&mut line, std::mem::take(&mut told), motion, 0.5, &path).unwrap();
        runs.extend(read(&robot, &path, k));
    }
    (robot, runs)
}

/// Asserts the only fault of a joint, certain in at least one recording.
fn only(robot: &Robot, runs: &[Run], kind: &str, joint: usize, words: &str) {
    named(robot, runs, kind, joint, words, true);
}

/// Asserts the only fault of a joint, which something else explains as well.
fn open(robot: &Robot, runs: &[Run], kind: &str, joint: usize, words: &str) {
    named(robot, runs, kind, joint, words, false);
}

fn named(robot: &Robot, runs: &[Run], kind: &str, joint: usize, words: &str, certain: bool) {
    let found = faults(robot, runs).unwrap();
    for fault in &found {
        println!(
            "  {} {} {}: {} {}",
            if fault.certain { "certain" } else { "open" },
            fault.kind,
            fault.joint,
            fault.recording,
            fault.text
        );
    }
    assert!(!found.is_empty(), "nothing found: {kind} {words}");
    for fault in &found {
        assert_eq!(fault.kind.as_str(), kind, "{}", fault.text);
        assert_eq!(fault.joint, robot.joints[joint].name);
        assert!(fault.text.contains(words), "{words}: {}", fault.text);
    }
    assert_eq!(found.iter().any(|fault| fault.certain), certain, "{words}");
}

#[test]
fn healthy_recordings_raise_nothing() {
    for set in measured() {
        let began = std::time::Instant::now();
        assert_eq!(faults(&set.robot, &all(&set)).unwrap(), [], "{}", set.name);
        println!("{}: {:?}", set.name, began.elapsed());
    }
    if let Some(data) = data_dir() {
        let robot = text("one-link.toml", template("one-link").unwrap());
        for entry in std::fs::read_dir(data.join("rhoban_xl330")).unwrap() {
            let runs = read(&robot, &entry.unwrap().path(), 0);
            assert_eq!(faults(&robot, &runs).unwrap(), [], "{}", runs[0].label);
        }
    }
    let (robot, runs) = emulated();
    assert_eq!(faults(&robot, &runs).unwrap(), []);
}

/// Returns the named set with its recordings; `None` without real recordings.
fn one(name: &str) -> Option<(Robot, Vec<Run>)> {
    let set = measured().into_iter().find(|set| set.name == name)?;
    let runs = all(&set);
    Some((set.robot, runs))
}

fn tau(runs: &[Run], j: usize, factor: f64) -> Vec<Run> {
    injured(runs, |r| times(&mut r.joints[j].tau, factor))
}

fn q(runs: &[Run], j: usize, factor: f64) -> Vec<Run> {
    injured(runs, |r| times(&mut r.joints[j].q_raw, factor))
}

/// A position that jumps by 0.3 rad or m halfway: the joint is named, without consequences.
fn jumps(robot: &Robot, runs: &[Run], joint: usize) {
    let jumps = injured(runs, |r| {
        let half = r.len() / 2;
        r.joints[joint].q_raw[half..]
            .iter_mut()
            .for_each(|q| *q += 0.3);
    });
    only(robot, &jumps, "jump", joint, "jumps by 0.");
}

/// A torque that is late.
fn late(robot: &Robot, runs: &[Run], joint: usize) {
    let late = injured(runs, |r| {
        let by = (0.7 * r.rate) as usize;
        let tau = &mut r.joints[joint].tau;
        // A remainder behind a gap is shorter than the shift.
        if by < tau.len() {
            tau.rotate_right(by);
        }
    });
    only(robot, &late, "clock", joint, "0.7");
}

/// A torque that was cut at half its peak.
fn cut(robot: &Robot, runs: &[Run], joint: usize) {
    let cut = injured(runs, |r| {
        let tau = &mut r.joints[joint].tau;
        let top = 0.5 * tau.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        tau.iter_mut().for_each(|v| *v = v.clamp(-top, top));
    });
    only(robot, &cut, "saturation", joint, "cut at");
}

#[test]
fn faults_of_a_real_slide_are_named() {
    let Some((robot, runs)) = one("emps") else {
        return;
    };
    only(&robot, &tau(&runs, 0, -1.0), "sign", 0, "reverse one");
    only(&robot, &q(&runs, 0, -1.0), "sign", 0, "so reverse q1");
    only(&robot, &tau(&runs, 0, 1000.0), "unit", 0, "too large");
    only(&robot, &q(&runs, 0, 1000.0), "unit", 0, "outside");
    jumps(&robot, &runs, 0);
    late(&robot, &runs, 0);
    cut(&robot, &runs, 0);
}

#[test]
fn faults_of_two_real_links_are_named() {
    let Some((robot, runs)) = one("dfki") else {
        return;
    };
    only(&robot, &tau(&runs, 0, -1.0), "sign", 0, "tau1");
    only(&robot, &tau(&runs, 1, -1.0), "sign", 1, "tau2");
    only(&robot, &q(&runs, 0, 57.296), "unit", 0, "degrees");
    let rpm = injured(&runs, |r| {
        let velocity = r.joints[0].measured_velocity.as_mut().unwrap();
        times(velocity, 9.5493);
    });
    only(&robot, &rpm, "unit", 0, "revolutions per minute");
    jumps(&robot, &runs, 1);
    late(&robot, &runs, 1);
    cut(&robot, &runs, 1);
}

#[test]
fn faults_of_a_real_arm_with_torque_sensors_are_named() {
    let Some((robot, runs)) = one("kuka") else {
        return;
    };
    only(&robot, &tau(&runs, 1, -1.0), "sign", 1, "");
    only(&robot, &tau(&runs, 3, 1000.0), "unit", 3, "");
    jumps(&robot, &runs, 3);
    only(&robot, &q(&runs, 1, 57.296), "unit", 1, "degrees");
    // Parameters compensate a late torque here: a few shifted slow harmonics are other sums of the same columns.
    cut(&robot, &runs, 1);
}

#[test]
fn faults_of_a_real_arm_with_geared_motors_are_named() {
    let Some((robot, runs)) = one("tx40") else {
        return;
    };
    for j in 0..4 {
        only(&robot, &tau(&runs, j, -1.0), "sign", j, "");
    }
    only(&robot, &q(&runs, 1, 32.0), "unit", 1, "gear ratio");
    jumps(&robot, &runs, 2);
    late(&robot, &runs, 0);
    cut(&robot, &runs, 0);
}

/// Exchanges columns of two joints.
fn swapped(runs: &[Run], pair: [usize; 2], torque: bool, ratio: [f64; 2]) -> Vec<Run> {
    injured(runs, |run| {
        let [i, j] = pair;
        let share = ratio[0] / ratio[1];
        let (one, other) = run.joints.split_at_mut(j);
        let (a, b) = (&mut one[i], &mut other[0]);
        if torque {
            std::mem::swap(&mut a.tau, &mut b.tau);
            times(&mut a.tau, share);
            times(&mut b.tau, 1.0 / share);
        } else {
            std::mem::swap(&mut a.q_raw, &mut b.q_raw);
            times(&mut a.q_raw, 1.0 / share);
            times(&mut b.q_raw, share);
        }
        for joint in [a, b] {
            joint.reference = None;
            joint.measured_velocity = None;
        }
    })
}

/// Returns true if the only fault has these words; else prints it.
fn says(robot: &Robot, runs: &[Run], kind: &str, words: &str) -> bool {
    let found = faults(robot, runs).unwrap();
    let right = !found.is_empty()
        && found
            .iter()
            .all(|f| f.kind.as_str() == kind && f.text.contains(words));
    if !right {
        println!("{words}: {found:?}");
    }
    right
}

/// Returns pairs of torques and positions that are not named by both columns.
fn unnamed(
    robot: &Robot,
    runs: &[Run],
    torques: &[[usize; 2]],
    positions: &[[usize; 2]],
) -> Vec<String> {
    let mut wrong = Vec::new();
    let all = torques.iter().map(|p| (p, true));
    for (pair, torque) in all.chain(positions.iter().map(|p| (p, false))) {
        let ratio = pair.map(|j| robot.joints[j].gear_ratio());
        let column = if torque { "tau" } else { "q" };
        let words = format!("{column}{} and {column}{}", pair[0] + 1, pair[1] + 1);
        if !says(robot, &swapped(runs, *pair, torque, ratio), "swap", &words) {
            wrong.push(words);
        }
    }
    wrong
}

/// Returns pairs of joints that are not named if all their columns are exchanged.
fn unordered(robot: &Robot, runs: &[Run], pairs: &[[usize; 2]]) -> Vec<String> {
    let exchanged = |pair: [usize; 2]| {
        let ratio = pair.map(|j| robot.joints[j].gear_ratio());
        swapped(&swapped(runs, pair, true, ratio), pair, false, ratio)
    };
    let words = |[i, j]: [usize; 2]| {
        let name = |k: usize| format!("joint {} ({})", k + 1, robot.joints[k].name);
        format!("The columns of {} and {}", name(i), name(j))
    };
    let unnamed = pairs
        .iter()
        .filter(|p| !says(robot, &exchanged(**p), "swap", &words(**p)));
    unnamed.map(|pair| words(*pair)).collect()
}

#[test]
fn columns_of_real_arms_in_each_others_place_are_named() {
    let mut wrong = Vec::new();
    if let Some((robot, runs)) = one("kuka") {
        let first: Vec<Run> = runs.into_iter().filter(|r| r.recording == 0).collect();
        // Joint 6 carries hardly any load; its friction is from a sensor's spokes, so its sense is not identifiable.
        for j in [0, 1, 2, 3, 4, 6] {
            if !says(&robot, &tau(&first, j, -1.0), "sign", &format!("{}", j + 1)) {
                wrong.push(format!("tau{} reversed", j + 1));
            }
        }
        wrong.extend(unnamed(
            &robot,
            &first,
            &[[0, 1], [1, 3], [2, 4]],
            &[[0, 1], [1, 3], [2, 4]],
        ));
        wrong.extend(unordered(&robot, &first, &[[0, 1], [1, 3]]));
    }
    if let Some((robot, runs)) = one("tx40") {
        wrong.extend(unnamed(
            &robot,
            &runs,
            &[[0, 1], [1, 2], [2, 3]],
            &[[0, 1], [1, 2], [2, 3]],
        ));
    }
    if let Some((robot, runs)) = one("dfki") {
        let first: Vec<Run> = runs.into_iter().filter(|r| r.recording == 0).collect();
        wrong.extend(unnamed(&robot, &first, &[], &[[0, 1]]));
    }
    assert_eq!(wrong, [""; 0]);
}

#[test]
fn injured_recordings_of_the_emulated_rig_are_named() {
    let (robot, runs) = emulated();
    let tau = |factor: f64| tau(&runs, 0, factor);
    let q = |factor: f64| q(&runs, 0, factor);
    only(&robot, &tau(-1.0), "sign", 0, "reverse tau1");
    only(&robot, &q(-1.0), "sign", 0, "reverse q1");
    let both = injured(&runs, |r| {
        times(&mut r.joints[0].q_raw, -1.0);
        times(&mut r.joints[0].tau, -1.0);
    });
    // A link with its mass on the other side of its axis is as likely.
    open(&robot, &both, "sign", 0, "both counted");
    only(&robot, &tau(1000.0), "unit", 0, "");
    only(&robot, &tau(1e-3), "unit", 0, "");
    open(&robot, &tau(9.549), "unit", 0, "rpm");
    open(&robot, &tau(9.549), "unit", 0, "a tool or payload that");
    // A reference that runs against the position is evidence against it.
    let against = injured(&runs, |r| {
        let joint = &mut r.joints[0];
        times(&mut joint.tau, -1.0);
        joint.reference = Some(joint.q_raw.iter().map(|q| -q).collect());
    });
    only(
        &robot,
        &against,
        "sign",
        0,
        "ref1 runs against q1 as well, so reverse q1",
    );
    only(&robot, &tau(1.0 / 50.0), "ratio", 0, "before its gear");
    // The sweep's few degrees do not determine the factor; only its existence is certain there.
    let wide = |factor: f64| -> Vec<Run> {
        let all = q(factor).into_iter();
        all.filter(|r| r.recording < 2).collect()
    };
    only(&robot, &wide(57.296), "unit", 0, "degrees");
    only(&robot, &wide(50.0), "ratio", 0, "motor");
    only(&robot, &wide(2.0), "ratio", 0, "gear ratio");
    only(&robot, &wide(0.5), "ratio", 0, "gear ratio");
    let sweep: Vec<Run> = q(57.296).into_iter().filter(|r| r.recording == 2).collect();
    assert!(!faults(&robot, &sweep).unwrap().is_empty());
    // Changes of the robot, which other modules judge.
    for factor in [0.7, 1.3] {
        assert_eq!(faults(&robot, &tau(factor)).unwrap(), [], "{factor}");
    }
    let clock = |factor: f64| {
        let mut runs = runs.clone();
        for run in &mut runs {
            times(&mut run.t, factor);
            run.rate /= factor;
        }
        runs = injured(&runs, |_| ());
        faults(&robot, &runs).unwrap()
    };
    for factor in [1.0 / 60.0, 60.0] {
        let found = clock(factor);
        println!("{factor}: {found:?}");
        assert!(
            found
                .iter()
                .any(|f| f.kind.as_str() == "clock" || f.text.contains("units of q1 and t"))
        );
    }
    let mut run = runs[0].clone();
    times(&mut run.t, 1000.0);
    run.rate /= 1000.0;
    let found = faults(&robot, std::slice::from_ref(&run)).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].kind.as_str() == "clock" && found[0].text.contains("milliseconds"));
    let still = injured(&runs[..1], |r| r.joints[0].q_raw.fill(0.3));
    assert_eq!(
        faults(&robot, &still).unwrap()[0].kind.as_str(),
        "not-moving"
    );
    let mut two = runs.clone();
    two[1].joints[0] = still[0].joints[0].clone();
    two[1].t = still[0].t.clone();
    assert_eq!(faults(&robot, &two).unwrap(), []);
}

/// Returns recordings with a link encoder, computed from the joint's position.
fn with_link(runs: &[Run], change: impl Fn(usize, f64) -> f64) -> Vec<Run> {
    let mut runs = runs.to_vec();
    for run in &mut runs {
        let joint = &mut run.joints[0];
        let reading = joint.q_raw.iter().enumerate();
        joint.link_raw = Some(reading.map(|(k, q)| change(k, *q)).collect());
    }
    runs
}

#[test]
fn an_encoder_on_the_link_is_checked_like_the_joint_s_own() {
    let (robot, mut runs) = emulated();
    runs.truncate(1);
    // Its zero is free; a little twist or backlash is allowed.
    let fine = with_link(&runs, |k, q| {
        0.98 * q + 40.0 + 1e-3 * f64::from((k % 7) as u32)
    });
    assert_eq!(faults(&robot, &fine).unwrap(), []);
    let cases: [(&dyn Fn(usize, f64) -> f64, &str, &str); 6] = [
        (&|_, q| 57.296 * q, "unit", "degrees"),
        (&|_, q| -q, "sign", "reverse its sense"),
        (&|_, q| 50.0 * q, "ratio", "gear ratio 50"),
        (&|_, q| 1.7 * q, "unit", "1.7 times"),
        (&|_, _| 0.3, "not-moving", "stands still"),
        (
            &|k, q| {
                if k < 4000 {
                    q
                } else {
                    q + std::f64::consts::TAU
                }
            },
            "jump",
            "ql1 jumps",
        ),
    ];
    for (change, kind, words) in cases {
        let wrong = with_link(&runs, change);
        assert!(says(&robot, &wrong, kind, words), "{kind} {words}");
    }
    // A recording with one is judged by itself, beside one without.
    let mut both = runs.clone();
    both.extend(with_link(&runs, |_, q| -q));
    both[1].recording = 1;
    let found = faults(&robot, &both).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].kind.as_str(), "sign");
}
