//! Torques of MJCF models as MuJoCo computes them (`tests/mjcf/check.py`), and what is refused.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::batch::ModelBatch;
use crate::robot::{ChainChoice, Description, JointKind, Robot};

#[derive(Deserialize)]
struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/mjcf")
        .join(name)
}

fn torques(robot: &Robot, state: &State) -> Vec<f64> {
    let chain = robot.chain().unwrap();
    let model = ModelBatch::new(&chain, &robot.standard_parameters()).unwrap();
    let column = |values: &[f64]| values.iter().map(|v| vec![*v]).collect::<Vec<_>>();
    let mut torque = vec![0.0; robot.joints.len()];
    let [q, qd, qdd] = [&state.q, &state.qd, &state.qdd].map(|own| column(own));
    model.inverse_dynamics(&q, &qd, &qdd, &mut torque).unwrap();
    torque
}

#[test]
fn torques_are_those_of_mujoco() {
    let description = Description::load(&file("arm.xml")).unwrap();
    let mut robot = description.robot;
    let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    // The fingers are a gripper, before which the chain ends.
    assert_eq!(names, ["pan", "lift", "slide", "roll"]);
    assert_eq!(robot.joints[2].kind, JointKind::Prismatic);
    // Classes of defaults: `strong` with its own damping and friction, and the armature of the outermost.
    let friction = robot.joints[0].friction.clone().unwrap();
    assert_eq!((friction.viscous, friction.coulomb), (1.5, 0.8));
    let friction = robot.joints[2].friction.clone().unwrap();
    assert_eq!((friction.viscous, friction.coulomb), (0.2, 0.0));
    assert_eq!(
        [robot.joints[0].gear_ratio(), robot.joints[1].gear_ratio()],
        [50.0, -80.0]
    );
    assert!(
        description
            .remarks
            .iter()
            .any(|r| r.contains("left_finger, right_finger"))
    );
    for joint in &mut robot.joints {
        joint.friction = None;
    }
    let text = std::fs::read_to_string(file("states.json")).unwrap();
    let states: Vec<State> = serde_json::from_str(&text).unwrap();
    for state in &states {
        for (own, theirs) in torques(&robot, state).iter().zip(&state.tau) {
            assert!(
                (own - theirs).abs() < 1e-9 * (1.0 + theirs.abs()),
                "{own} {theirs}"
            );
        }
    }
}

/// Compares the torques of a file with those of `mj_inverse`, to `share` of their size.
fn compare(name: &str, joints: [&str; 3], share: f64) -> Robot {
    let robot = Description::load(&file(&format!("{name}.xml")))
        .unwrap()
        .robot;
    let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, joints);
    let text = std::fs::read_to_string(file(&format!("{name}.json"))).unwrap();
    let states: Vec<State> = serde_json::from_str(&text).unwrap();
    for state in &states {
        for (own, theirs) in torques(&robot, state).iter().zip(&state.tau) {
            let most = share * (1.0 + theirs.abs());
            assert!((own - theirs).abs() < most, "{name}: {own} {theirs}");
        }
    }
    robot
}

#[test]
fn frames_bounds_and_actuators_count_as_in_mujoco() {
    let robot = compare("frames", ["pan", "lift", "elbow"], 1e-9);
    let gears: Vec<f64> = robot.joints.iter().map(|j| j.gear_ratio()).collect();
    assert_eq!(gears, [12.0, -3.0, 5.0]);
}

/// The file is what the remedy of the messages writes of a model of geoms alone, with six digits.
#[test]
fn a_model_that_mujoco_saved_with_its_inertias_is_read() {
    compare("saved", ["first", "second", "third"], 2e-5);
}

/// Each of these changes the torques of `mj_inverse`, and the description has no term for it.
#[test]
fn terms_without_a_place_are_named_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    let model = |option: &str, body: &str, joint: &str, actuator: &str| {
        format!(
            "<mujoco>\n<option {option}/>\n<default><default class='spring'><joint stiffness='3'/></default></default>\n<worldbody><body {body}>\n<joint name='j' {joint}/><inertial pos='0 0 0.1' mass='1' diaginertia='1 1 1'/></body></worldbody>\n<actuator>\n{actuator}\n</actuator></mujoco>"
        )
    };
    let remarks = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let loaded = Description::load(&path);
        loaded.unwrap_or_else(|e| panic!("{e}")).remarks.join("\n")
    };
    let motor = "<motor joint='j'/>";
    for (text, words) in [
        (
            model("", "gravcomp='0.5'", "", motor),
            "gravity compensation (`gravcomp`) of bodies (line 4)",
        ),
        (
            model("", "", "damping='1 2 3'", motor),
            "damping beyond its first, linear coefficient (line 5)",
        ),
        (
            model("", "", "", "<motor joint='j' damping='0 0.1'/>"),
            "damping beyond its first, linear coefficient (line 7)",
        ),
        (
            model("", "", "class='spring'", motor),
            "springs of joints (line 5)",
        ),
        (
            model("", "", "springdamper='0.1 1'", motor),
            "`springdamper` of joints (line 5)",
        ),
        (
            model("density='1.2' viscosity='2e-5'", "", "", motor),
            "`density` of the medium (line 2), `viscosity` of the medium (line 2) are not read",
        ),
        (
            model(
                "",
                "",
                "",
                "<motor joint='j'/>\n<motor joint='j' gear='2'/>",
            ),
            "gears (line 8) differ from that of the first actuator",
        ),
    ] {
        let found = remarks(&text);
        assert!(found.contains(words), "{words}: {found}");
    }
    let zero = model(
        "density='0'",
        "gravcomp='0'",
        "stiffness='0.0' damping='1 0 0'",
        motor,
    );
    assert!(!remarks(&zero).contains("not read"), "{}", remarks(&zero));
}

#[test]
fn flags_turn_gravity_and_friction_off() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    let text = "<mujoco><option><flag gravity='disable' damper='disable' frictionloss='disable'/></option><worldbody><body><joint name='j' damping='2' frictionloss='1'/><inertial pos='0 0 0.1' mass='1' diaginertia='1 1 1'/></body></worldbody><actuator><motor joint='j' damping='1'/></actuator></mujoco>";
    std::fs::write(&path, text).unwrap();
    let robot = Description::load(&path).unwrap().robot;
    assert_eq!(robot.gravity, [0.0; 3]);
    assert!(robot.joints[0].friction.is_none());
}

#[test]
fn a_chain_is_chosen_and_joints_are_held() {
    let choice = ChainChoice {
        tip: Some("bracket".into()),
        locks: vec![("lift".into(), 0.4)],
        ..ChainChoice::default()
    };
    let robot = Description::load_chain(&file("arm.xml"), &choice)
        .unwrap()
        .robot;
    let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["pan", "slide"]);
    // What hangs behind the tip is part of the last body: the whole arm without the shoulder.
    let mass = |k: usize| robot.joints[k].inertial.as_ref().unwrap().mass;
    assert!((mass(1) - (0.7 + 0.4 + 0.5 + 0.12)).abs() < 1e-12);
    let wrong = ChainChoice {
        tip: Some("nose".into()),
        ..ChainChoice::default()
    };
    let error = Description::load_chain(&file("arm.xml"), &wrong)
        .unwrap_err()
        .to_string();
    assert!(error.contains("--tip is \"nose\""), "{error}");
}

const INERTIAL: &str = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";

/// Returns a file with one body.
fn body(inner: &str) -> String {
    format!("<mujoco>\n<worldbody><body>\n{inner}\n</body></worldbody>\n</mujoco>")
}

/// Checks that each text is refused with the words beside it.
fn refused(cases: &[(String, &str)]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    for (text, words) in cases {
        std::fs::write(&path, text).unwrap();
        let error = Description::load(&path).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
}

/// The inertia of a body that no joint moves does not enter: published arms stand on a mount of geoms alone.
#[test]
fn a_mount_of_geoms_needs_no_inertia() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xml");
    let arm = format!("<body name='link'><joint name='turn'/>{INERTIAL}</body>");
    let mount = format!("<geom size='1'/><body name='mount'><geom size='1'/>{arm}</body>");
    std::fs::write(&path, body(&mount)).unwrap();
    let robot = Description::load(&path).unwrap().robot;
    assert_eq!(robot.joints.len(), 1);
    let moved = "<geom size='1'/><body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><body><geom size='1'/></body></body>";
    refused(&[(body(moved), "has geoms and no <inertial>")]);
}

#[test]
fn what_cannot_be_read_is_named_by_its_line() {
    let inertial = INERTIAL;
    refused(&[
        (
            body("<joint/><geom size='1'/>"),
            ":2:12: body `body1` has geoms and no <inertial>",
        ),
        (
            body(&format!("<freejoint/>{inertial}")),
            ":3:1: body `body1` has a free or ball joint",
        ),
        (
            body(&format!("<joint axis='0 0'/>{inertial}")),
            ":3:1: `axis` of <joint> has 2 numbers, but it must have 3",
        ),
        (
            body(&format!("<joint damping='-1'/>{inertial}")),
            "`damping` of joint `body1_joint1` is -1",
        ),
        (
            body("<joint/><inertial pos='0 0 0' mass='1'/>"),
            "neither `diaginertia` nor `fullinertia`",
        ),
        (body(inertial), "no body has a joint"),
        (
            "<mujoco>\n<include file='b.xml'/></mujoco>".into(),
            ":2:1: <include> is not read",
        ),
        ("<mujoco><worldbody/></mujoco>".into(), "has no <body>"),
    ]);
}

#[test]
fn what_mujoco_does_not_know_is_refused_by_its_line() {
    let inertial = INERTIAL;
    let driven = |actuator: &str| {
        format!(
            "<mujoco><worldbody><body><joint name='j'/>{inertial}</body></worldbody>\n<actuator>\n{actuator}</actuator></mujoco>"
        )
    };
    refused(&[
        (
            body(&format!("<joint armatur='1'/>{inertial}")),
            ":3:1: MuJoCo knows no attribute `armatur` of <joint>; its attributes are ",
        ),
        (
            body(&format!("<jiont/>{inertial}")),
            ":3:1: MuJoCo knows no <jiont> in <body>",
        ),
        (
            "<mujoco>\n<default><joint dampin='1'/></default></mujoco>".into(),
            ":2:10: MuJoCo knows no attribute `dampin` of <joint>",
        ),
        (
            body(&format!("<joint class='strong'/>{inertial}")),
            ":3:1: `class` is \"strong\", but no <default> has this class",
        ),
        (
            body(&format!("<joint armature='1 2'/>{inertial}")),
            "`armature` of <joint> has 2 numbers, but it must have 1",
        ),
        (
            "<mujoco>\n<compiler settotalmass='3'/></mujoco>".into(),
            ":2:1: <compiler settotalmass> scales all masses",
        ),
        (
            "<mujoco>\n<compiler angle='radians'/></mujoco>".into(),
            ":2:1: `angle` is \"radians\"",
        ),
        (
            driven("<motor joint='k'/>"),
            ":3:1: <motor> acts on joint `k`, but the file has no joint of this name",
        ),
        (
            driven("<motor joint='j' gear='0'/>"),
            ":3:1: `gear` of <motor> is 0, so it does not move joint `j`",
        ),
        (
            driven("<motor joint='j' armature='-1'/>"),
            ":3:1: `armature` of <motor> is -1",
        ),
    ]);
}

#[test]
fn values_of_joints_are_written_for_a_model() {
    let robot = Description::load(&file("arm.xml")).unwrap().robot;
    let written = robot.to_mjcf_joints();
    assert!(written.remarks.is_empty(), "{:?}", written.remarks);
    let document = roxmltree::Document::parse(&written.text).unwrap();
    let of = |tag: &str, key: &str, name: &str| {
        let found = document
            .descendants()
            .find(|n| n.has_tag_name(tag) && n.attribute(key) == Some(name));
        found.unwrap_or_else(|| panic!("no {tag} {name}"))
    };
    let number = |text: Option<&str>| text.unwrap().parse::<f64>().unwrap();
    let joint = of("default", "class", "lift")
        .first_element_child()
        .unwrap();
    assert!((number(joint.attribute("armature")) - 0.3).abs() < 1e-15);
    assert_eq!(number(joint.attribute("damping")), 1.5);
    assert_eq!(number(joint.attribute("frictionloss")), 0.8);
    assert_eq!(
        number(of("motor", "joint", "lift").attribute("gear")),
        -80.0
    );
}
