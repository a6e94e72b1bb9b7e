//! URDF files as people have them: grippers, two arms, wrong names, doubtful values.

use std::fs;
use std::path::Path;

use rig_model::robot::Load;

use crate::run::{refuse, rig, succeed};

/// An arm of `n` joints from `base`, named with `prefix`.
fn arm(prefix: &str, base: &str, n: usize) -> String {
    (1..=n)
        .map(|k| {
            let parent = match k {
                1 => base.to_owned(),
                _ => format!("{prefix}link{}", k - 1),
            };
            let axis = if k % 2 == 1 { "0 0 1" } else { "0 1 0" };
            format!(
                "<link name='{prefix}link{k}'><inertial><origin xyz='0.02 0.01 0.1'/><mass value='2'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.01'/></inertial></link>
<joint name='{prefix}joint{k}' type='revolute'><parent link='{parent}'/><child link='{prefix}link{k}'/><origin xyz='0 0 0.2'/><axis xyz='{axis}'/><limit lower='-2' upper='2' velocity='2' effort='60'/><dynamics damping='0.5' friction='0.3'/></joint>\n"
            )
        })
        .collect()
}

fn finger(name: &str, y: f64, more: &str) -> String {
    format!(
        "<link name='{name}_pad'><inertial><mass value='0.05'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial></link>
<joint name='{name}' type='prismatic'><parent link='link3'/><child link='{name}_pad'/><origin xyz='0 {y} 0.1'/><axis xyz='0 1 0'/><limit lower='0' upper='0.04' velocity='0.1' effort='20'/>{more}</joint>\n"
    )
}

fn written(folder: &Path, name: &str, body: &str) {
    let text = format!("<robot name='r'>\n<link name='base'/>\n{body}</robot>\n");
    fs::write(folder.join(name), text).unwrap();
}

/// An arm with a gripper, as `gripper.urdf`, and one with two arms, as `dual.urdf`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fingers = finger("left", 0.02, "") + &finger("right", -0.02, "<mimic joint='left'/>");
    written(
        folder.path(),
        "gripper.urdf",
        &(arm("", "base", 3) + &fingers),
    );
    written(
        folder.path(),
        "dual.urdf",
        &(arm("l_", "base", 3) + &arm("r_", "base", 3)),
    );
    folder
}

#[test]
fn an_arm_with_a_gripper_needs_no_option_and_says_once_what_was_assumed() {
    let folder = folder();
    let output = rig()
        .args(["base", "--robot", "gripper.urdf"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    let notes: Vec<&str> = said
        .lines()
        .filter(|line| line.contains("Locked"))
        .collect();
    let [note] = notes[..] else {
        panic!("said once: {said}")
    };
    for part in [
        "left at 0 m",
        "right at 0 m (mimics left)",
        "0.1000 kg into link `link3`",
        "3 joints, joint1 to joint3",
    ] {
        assert!(note.contains(part), "{part}: {note}");
    }
}

#[test]
fn two_arms_are_refused_with_the_options_and_read_with_one() {
    let folder = folder();
    let run = |words: &[&str]| {
        let mut command = rig();
        command.args(words).current_dir(folder.path());
        command
    };
    let message = refuse(&mut run(&["base", "--robot", "dual.urdf"]));
    assert!(
        message.contains("--tip l_link3 (3 joints)")
            && message.contains("--tip r_link3 (3 joints)"),
        "{message}"
    );
    succeed(&mut run(&[
        "base",
        "--robot",
        "dual.urdf",
        "--tip",
        "r_link3",
    ]));
    for (options, parts) in [
        (
            ["--tip", "r_lnk3"],
            ["no link `r_lnk3`", "is `r_link3` meant?"],
        ),
        (["--base", "r_link9x"], ["which --base names", "`r_link"]),
        (
            ["--lock", "r_jont3=0"],
            ["no joint `r_jont3`", "is `r_joint3` meant?"],
        ),
        (
            ["--lock", "r_joint3=2.5"],
            ["outside of the joint's limits", "-2 to 2 rad"],
        ),
    ] {
        let mut words = vec!["base", "--robot", "dual.urdf"];
        words.extend(options);
        let message = refuse(&mut run(&words));
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
    succeed(&mut run(&["init", "one-link", "--out", "rig.toml"]));
    let message = refuse(&mut run(&["base", "--robot", "rig.toml", "--tip", "x"]));
    assert!(message.contains("this file is TOML"), "{message}");
}

/// The motion of the description that `rig init --from` writes is that of the URDF, sample by sample.
#[test]
fn a_description_from_a_urdf_moves_as_the_urdf_does() {
    let folder = folder();
    let run = |words: &[&str]| succeed(rig().args(words).current_dir(folder.path()));
    let options = ["--lock", "left=0.03", "--lock", "joint2=0.5"];
    let with = |words: &[&str]| run(&[words, &options[..]].concat());
    with(&["init", "--from", "gripper.urdf", "--out", "arm.toml"]);
    let text = fs::read_to_string(folder.path().join("arm.toml")).unwrap();
    for part in [
        "# acceleration =   # rad/s^2",
        "# [joint.drive]",
        "# [joint.controller]",
        "joint2 at 0.5 rad",
    ] {
        assert!(text.contains(part), "{part}");
    }
    with(&[
        "excite",
        "--robot",
        "gripper.urdf",
        "--starts",
        "1",
        "--out",
        "m.toml",
    ]);
    let motion = ["--trajectory", "m.toml", "--rate", "100", "--out"];
    with(
        &[
            &["simulate", "--robot", "gripper.urdf"],
            &motion[..],
            &["urdf.csv"],
        ]
        .concat(),
    );
    run(&[
        &["simulate", "--robot", "arm.toml"],
        &motion[..],
        &["toml.csv"],
    ]
    .concat());
    let [urdf, toml] =
        ["urdf.csv", "toml.csv"].map(|name| fs::read_to_string(folder.path().join(name)).unwrap());
    assert_eq!(urdf, toml);
    // Written back beside the gripper, the file is the same.
    with(&[
        "urdf",
        "--robot",
        "arm.toml",
        "--into",
        "gripper.urdf",
        "--out",
        "back.urdf",
    ]);
    let [before, after] =
        ["gripper.urdf", "back.urdf"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(before == after);
}

/// A load has the same ten numbers by a URDF whose tip is turned and shifted, and by the TOML that `rig init --from` makes of it:
/// those that were simulated, in the frame of the tip.
#[test]
fn a_load_has_the_same_flange_by_a_urdf_and_by_the_description_from_it() {
    let folder = tempfile::tempdir().unwrap();
    let tip = "<link name='tool0'/>
<joint name='mount' type='fixed'><parent link='link3'/><child link='tool0'/><origin xyz='0.03 -0.02 0.25' rpy='0.4 1.5707963 -2.1'/></joint>\n";
    written(folder.path(), "arm.urdf", &(arm("", "base", 3) + tip));
    let load = "mass = 1.5\nfirst_moment = [0.06, -0.03, 0.15]\ninertia = [0.03, 0.001, -0.006, 0.028, 0.002, 0.012]\n";
    fs::write(folder.path().join("load.toml"), load).unwrap();
    let run = |line: &str| succeed(rig().args(line.split(' ')).current_dir(folder.path()));
    run("init --from arm.urdf --tip tool0 --out arm.toml");
    run("excite --robot arm.urdf --tip tool0 --starts 1 --out m.toml");
    let simulate = "simulate --robot arm.urdf --tip tool0 --trajectory m.toml --rate 100 --noise-torque 0.05 --out";
    run(&format!("{simulate} bare.csv"));
    run(&format!("{simulate} loaded.csv --load load.toml --seed 2"));
    let identify = "load --by torque --data loaded.csv --without bare.csv --out";
    run(&format!("{identify} by_urdf --robot arm.urdf --tip tool0"));
    run(&format!("{identify} by_toml --robot arm.toml"));
    let read = |name: &str| Load::read(&folder.path().join(name)).unwrap().parameters();
    let [by_urdf, by_toml] = ["by_urdf/load.toml", "by_toml/load.toml"].map(read);
    assert_eq!(by_urdf, by_toml);
    // A URDF that is written from the TOML has a link at the flange.
    run("urdf --robot arm.toml --out back.urdf");
    run(&format!(
        "{identify} by_back --robot back.urdf --tip flange"
    ));
    for (back, own) in read("by_back/load.toml").iter().zip(&by_toml) {
        assert!((back - own).abs() < 1e-6, "{back} {own}");
    }
    for (found, simulated) in by_urdf.iter().zip(read("load.toml")) {
        println!("{found} {simulated}");
        assert!((found - simulated).abs() < 0.01, "{found} {simulated}");
    }
}

#[test]
fn an_audit_names_link_and_line_and_succeeds() {
    let folder = folder();
    let path = folder.path().join("gripper.urdf");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("izz='0.01'", "izz='0.3'", 1)).unwrap();
    let run = |words: &[&str]| {
        let mut command = rig();
        command.args(words).current_dir(folder.path());
        command
    };
    let said = succeed(&mut run(&["urdf", "--audit", "--robot", "gripper.urdf"]));
    assert!(
        said.contains("gripper.urdf:3:") && said.contains("link `link1` has principal moments"),
        "{said}"
    );
    let last = said.lines().last().unwrap();
    assert!(
        last.contains("Checked: ") && last.contains("200 poses"),
        "{last}"
    );
    let json = succeed(&mut run(&[
        "urdf",
        "--audit",
        "--json",
        "--robot",
        "gripper.urdf",
    ]));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["schema"], "rig-urdf-audit/1");
    assert!(
        json["findings"]
            .as_array()
            .unwrap()
            .iter()
            .any(|own| own["name"] == "link1" && own["line"] == 3)
    );
    // Two arms are audited as well; only the inertia matrix needs a choice.
    let said = succeed(&mut run(&["urdf", "--audit", "--robot", "dual.urdf"]));
    assert!(said.contains("6 masses of links"), "{said}");
}

/// The arm of tests/mimic with friction at every axis: that of an axis that follows acts on its joint, by the square of the ratio if
/// viscous.
fn geared(folder: &Path) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/mimic/robot.urdf");
    let text = (fs::read_to_string(path).unwrap())
        .replace("effort=\"10000.0\"", "effort=\"400\"")
        .replace("velocity=\"20\"", "velocity=\"3\"")
        .replace(
            "</joint>",
            "<dynamics damping=\"0.5\" friction=\"1.2\"/></joint>",
        );
    fs::write(folder.join("arm.urdf"), text).unwrap();
}

/// `joint5` moves by half of `joint4`: its drive has 1.2 + 0.5·1.2 N·m of Coulomb and 0.5 + 0.25·0.5 N·m·s/rad of viscous friction.
#[test]
fn an_arm_whose_axes_follow_joints_goes_through_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    geared(folder.path());
    let run = |line: &str| {
        let mut command = rig();
        let words = line.split_whitespace();
        succeed(command.args(words).current_dir(folder.path()))
    };
    let read = |name: &str| -> serde_json::Value {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    run("excite --robot arm.urdf --starts 2 --periods 2 --out motion.csv");
    run(
        "excite --robot arm.urdf --kind sweep --joint joint4 --speeds 4 --speed 0.1,2 --out sweep.csv",
    );
    let noise = "--noise-torque 0.05 --noise-position 1e-5";
    for (motion, seed, out) in [
        ("motion", 1, "a"),
        ("motion", 2, "b"),
        ("sweep", 3, "sweep-run"),
    ] {
        run(&format!(
            "simulate --robot arm.urdf --trajectory {motion}.csv {noise} --seed {seed} --out {out}.csv"
        ));
    }
    run(
        "friction-map --robot arm.urdf --data a.csv --sweep sweep-run.csv --joint joint4 --out map",
    );
    for point in read("map/friction-map.json")["points"].as_array().unwrap() {
        let [speed, friction] = ["speed", "friction"].map(|key| point[key].as_f64().unwrap());
        let expected = 1.8 * speed.signum() + 0.625 * speed;
        assert!(
            (friction - expected).abs() < 0.02,
            "{speed}: {friction} for {expected}"
        );
    }
    run("compare --robot arm.urdf --data a.csv b.csv --out compared");
    assert_eq!(read("compared/compare.json")["grade"], "agree");
    run(
        "control --robot arm.urdf --law pid computed-torque adaptive --duration 4 --no-delay --out laws",
    );
    let laws = read("laws/control.json");
    let error = |k: usize| laws["tracking"][k]["tool_rms"].as_f64().unwrap();
    // The model of both laws is exact: they leave what sampling leaves.
    assert!(
        error(1) < 0.2 * error(0) && error(2) < 0.2 * error(0),
        "{} {} {}",
        error(0),
        error(1),
        error(2)
    );
    run("header --robot arm.urdf --out friction.h");
    let header = fs::read_to_string(folder.path().join("friction.h")).unwrap();
    assert!(
        header.contains("Joint 4, joint6") && header.contains("(rig_real)0.625 * velocity"),
        "{header}"
    );
}
