//! Trajectory files.

use std::path::Path;

use rig_shared::trajectory::Trajectory;

use super::*;

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

/// A file of another kind is named, not read as broken TOML; samples are no parameters of a motion.
#[test]
fn other_files_are_told_from_the_parameters_of_a_motion() {
    let robot = one_link();
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    file.save(&at("samples.csv"), &robot, 500.0).unwrap();
    std::fs::copy(at("samples.csv"), at("named.toml")).unwrap();
    std::fs::write(at("run.mcap"), b"\x89MCAP0\r\n\x01").unwrap();
    std::fs::write(at("robot.toml"), ONE_LINK_TEMPLATE).unwrap();
    std::fs::write(at("robot.urdf"), "<?xml version=\"1.0\"?>\n<robot/>").unwrap();
    for (name, found) in [
        ("samples.csv", "samples in columns (CSV)"),
        ("named.toml", "samples in columns (CSV)"),
        ("run.mcap", "a recording (MCAP)"),
        ("robot.toml", "a robot description"),
        ("robot.urdf", "XML, as a URDF does"),
    ] {
        let text = TrajectoryFile::load(&at(name)).unwrap_err().to_string();
        assert!(
            text.contains(name) && text.contains(&format!("holds {found}, not the parameters")),
            "{text}"
        );
        assert!(text.contains("rig excite --out motion.toml"), "{text}");
    }
    let text = load_reference(&at("robot.toml"), &robot, 500.0).unwrap_err();
    assert!(text.to_string().contains("a robot description"), "{text}");
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
        let (file, notes) = staged(&robot, kind, &StagedOptions::default()).unwrap();
        assert!(
            notes.iter().all(|n| n.contains("shortens"))
                && file.duration() > 5.0
                && file.duration() < 1800.0,
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
        drive_off: Some(0.1),
        joints: vec![JointTrajectory {
            name: "link".into(),
            start: 0.1,
            trajectory: Trajectory::Hold(123_457),
        }],
    });
    let mut seeded = files[0].clone();
    seeded.design.as_mut().unwrap().seed = u64::MAX;
    files.push(seeded);
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let text = file.to_toml(&robot);
        let mut values = text
            .lines()
            .filter(|l| !l.is_empty() && !l.starts_with('['));
        assert!(
            values.all(|l| l.contains(" # ") && !l.contains('{')),
            "{text}"
        );
        let path = folder.path().join("t.toml");
        file.save(&path, &robot, 1000.0).unwrap();
        assert_eq!(TrajectoryFile::load(&path).unwrap(), file);
    }
}

/// Two sines of 0.3 and 1.1 Hz as a recording at `rate`, whose positions are not the reference.
fn sines(path: &Path, rate: f64, seconds: f64) {
    let mut text = "t,q1,ref1\n".to_owned();
    for k in 0..=(seconds * rate) as usize {
        let t = k as f64 / rate;
        let [q, ..] = two_sines(t);
        text.push_str(&format!("{t},{},{q}\n", q + 1e-3));
    }
    std::fs::write(path, text).unwrap();
}

/// Position, velocity and acceleration, from rest.
fn two_sines(t: f64) -> [f64; 3] {
    let [a, b] = [0.3, 1.1].map(|f| core::f64::consts::TAU * f);
    // 1 − cos is at rest in the beginning.
    [
        0.4 * (1.0 - (a * t).cos()) + 0.1 * (1.0 - (b * t).cos()),
        0.4 * a * (a * t).sin() + 0.1 * b * (b * t).sin(),
        0.4 * a * a * (a * t).cos() + 0.1 * b * b * (b * t).cos(),
    ]
}

#[test]
fn samples_of_another_rate_become_a_smooth_motion() {
    let robot = one_link();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("slow.csv");
    for (rate, [q, qd, qdd]) in [(100.0, [1e-8, 1e-5, 2e-3]), (20.0, [1e-5, 1e-2, 0.15])] {
        sines(&path, rate, 10.0);
        let (read, from) = reference_at(&path, &robot, 1000.0).unwrap();
        assert!((from.unwrap() - rate).abs() < 1e-6);
        assert_eq!(read.position[0].len(), 10_001);
        let motion =
            |k: usize| [&read.position, &read.velocity, &read.acceleration].map(|l| l[0][k]);
        // Without the ends, beyond which nothing is known.
        let margin = (3.0 * 1000.0 / rate) as usize;
        for k in margin..10_000 - margin {
            let expected = two_sines(k as f64 * 1e-3);
            for ((found, expected), most) in motion(k).iter().zip(expected).zip([q, qd, qdd]) {
                assert!(
                    (found - expected).abs() < most,
                    "{rate} Hz, {k}: {found} {expected}"
                );
            }
        }
        // Each is the derivative of the one before.
        for k in margin..10_000 - margin {
            let [before, now, after] = [k - 1, k, k + 1].map(motion);
            for d in 0..2 {
                let slope = (after[d] - before[d]) / 2e-3;
                assert!(
                    (slope - now[d + 1]).abs() < 0.05,
                    "{rate} Hz, {k}: {slope} {now:?}"
                );
            }
        }
    }
    // At its own rate the file stays as it is.
    let (same, from) = reference_at(&path, &robot, 20.0).unwrap();
    assert!(from.is_none() && same.velocity.is_empty());
}

#[test]
fn too_few_samples_for_the_motion_are_refused() {
    let robot = one_link();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("coarse.csv");
    sines(&path, 5.0, 10.0);
    let text = reference_at(&path, &robot, 1000.0).unwrap_err().to_string();
    assert!(
        text.contains("coarse.csv")
            && text.contains("5.000 Hz, too seldom")
            && text.contains("\"link\""),
        "{text}"
    );
}

#[test]
fn a_sampled_design_brings_its_own_velocities() {
    let robot = one_link();
    let file = designed(&robot, &quick(Criterion::ConditionNumber)).file;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.csv");
    file.save(&path, &robot, 100.0).unwrap();
    let (read, _) = reference_at(&path, &robot, 1000.0).unwrap();
    let direct = file.sampled(1000.0).unwrap();
    for (found, expected, most) in [
        (&read.position, &direct.position, 1e-6),
        (&read.velocity, &direct.velocity, 1e-4),
        (&read.acceleration, &direct.acceleration, 2e-2),
    ] {
        assert_eq!(found[0].len(), expected[0].len());
        for (a, b) in found[0].iter().zip(&expected[0]) {
            assert!((a - b).abs() < most, "{a} {b}");
        }
    }
}
