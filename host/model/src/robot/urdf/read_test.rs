//! Trees: which chain is the robot, where the other joints stand, and what the chain weighs then.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::multibody::{column, inverse_dynamics};

use crate::robot::{ChainChoice, Original, Robot, RobotError};

fn choice(base: Option<&str>, tip: Option<&str>, locks: &[(&str, f64)]) -> ChainChoice {
    ChainChoice {
        base: base.map(str::to_owned),
        tip: tip.map(str::to_owned),
        locks: locks
            .iter()
            .map(|(name, v)| ((*name).to_owned(), *v))
            .collect(),
    }
}

fn read(text: &str, choice: &ChainChoice) -> Result<Original, RobotError> {
    Original::read_chain(text.to_owned(), Path::new("r.urdf"), choice)
}

fn refused(text: &str, choice: &ChainChoice) -> String {
    read(text, choice).unwrap_err().to_string()
}

fn names(original: &Original) -> Vec<&str> {
    let joints = original.robot().joints.iter();
    joints.map(|joint| joint.name.as_str()).collect()
}

/// The remark on the chain.
fn told(original: &Original) -> &str {
    let remarks = original.remarks().iter();
    let mut chain = remarks.filter(|own| own.contains("the robot is the chain"));
    let first = chain.next().unwrap();
    assert_eq!(chain.next(), None, "said once");
    first
}

fn link(name: &str, mass: f64, [x, y, z]: [f64; 3], i: f64) -> String {
    format!(
        "<link name='{name}'><inertial><origin xyz='{x} {y} {z}'/><mass value='{mass}'/><inertia ixx='{i}' ixy='0' ixz='0' iyy='{}' iyz='0' izz='{}'/></inertial></link>\n",
        1.2 * i,
        0.9 * i
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], more: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{more}</joint>\n"
    )
}

/// A chain of turning joints `{prefix}1` … from `base`, with oblique axes; its links are `{prefix}l1` ….
fn arm(prefix: &str, base: &str, joints: usize) -> String {
    let mut text = String::new();
    for k in 1..=joints {
        let own = format!("{prefix}l{k}");
        let parent = if k == 1 {
            base.to_owned()
        } else {
            format!("{prefix}l{}", k - 1)
        };
        let size = k as f64;
        text += &link(&own, 4.0 / size, [0.05, 0.02 * size, 0.1], 0.03 / size);
        text += &joint(
            &format!("{prefix}{k}"),
            "revolute",
            [&parent, &own],
            &format!(
                "<origin xyz='0.1 {} 0.25' rpy='{} 0.3 {}'/><axis xyz='{} 1 0.4'/><limit lower='-2' upper='2' velocity='2' effort='50'/>",
                0.03 * size,
                0.5 * size,
                -0.2 * size,
                0.3 - size
            ),
        );
    }
    text
}

fn finger(name: &str, child: &str, parent: &str, y: f64, more: &str) -> String {
    link(child, 0.1, [0.0, 0.0, 0.02], 1e-4)
        + &joint(
            name,
            "prismatic",
            [parent, child],
            &format!(
                "<origin xyz='0 {y} 0.05'/><axis xyz='0 1 0'/><limit lower='0.01' upper='0.04' velocity='0.1' effort='20'/>{more}"
            ),
        )
}

fn robot(body: &str) -> String {
    format!("<robot name='r'>\n<link name='base'/>\n{body}</robot>")
}

fn gripper_arm() -> String {
    robot(
        &(arm("j", "base", 4)
            + &link("hand", 0.5, [0.0, 0.0, 0.03], 1e-3)
            + &joint(
                "flange",
                "fixed",
                ["jl4", "hand"],
                "<origin xyz='0 0 0.1' rpy='0 0 0.4'/>",
            )
            + &finger("left", "left_pad", "hand", 0.02, "")
            + &finger(
                "right",
                "right_pad",
                "hand",
                -0.02,
                "<mimic joint='left' multiplier='-1'/>",
            )),
    )
}

fn torques(robot: &Robot, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let chain = robot.chain().unwrap();
    let mut tau = vec![0.0; q.len()];
    inverse_dynamics(&chain, &robot.standard_parameters(), q, qd, qdd, &mut tau).unwrap();
    tau
}

/// Mass, first moment and inertia about the origin, by the parallel axis theorem.
fn placed(
    mass: f64,
    centre: Vector3<f64>,
    diagonal: [f64; 3],
    turn: Matrix3<f64>,
) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let own = turn * Matrix3::from_diagonal(&Vector3::from(diagonal)) * turn.transpose();
    let steiner = Matrix3::identity() * centre.norm_squared() - centre * centre.transpose();
    (mass, centre * mass, own + steiner * mass)
}

#[test]
fn a_gripper_is_merged_as_one_body_at_its_nearest_limit() {
    let original = read(&gripper_arm(), &ChainChoice::default()).unwrap();
    assert_eq!(names(&original), ["j1", "j2", "j3", "j4"]);
    let remark = told(&original);
    for part in [
        "left at 0.01",
        "right at -0.01 m",
        "mimics left",
        "0.2000 kg into link `jl4`",
        "link `base` to link `jl4`",
    ] {
        assert!(remark.contains(part), "{part}: {remark}");
    }
    // By hand: link, hand and both fingers in the frame of the last link.
    let (s, c) = 0.4f64.sin_cos();
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    let at = |x: f64, y: f64, z: f64| turn * Vector3::new(x, y, z) + Vector3::new(0.0, 0.0, 0.1);
    let shaped = |i: f64| [i, 1.2 * i, 0.9 * i];
    let parts = [
        placed(
            1.0,
            Vector3::new(0.05, 0.08, 0.1),
            shaped(0.0075),
            Matrix3::identity(),
        ),
        placed(0.5, at(0.0, 0.0, 0.03), shaped(1e-3), turn),
        placed(0.1, at(0.0, 0.02 + 0.01, 0.05 + 0.02), shaped(1e-4), turn),
        placed(0.1, at(0.0, -0.02 - 0.01, 0.05 + 0.02), shaped(1e-4), turn),
    ];
    let body = &original.chain_for_tests().bodies[3].inertia;
    let mass: f64 = parts.iter().map(|part| part.0).sum();
    let moment: Vector3<f64> = parts.iter().map(|part| part.1).sum();
    let inertia: Matrix3<f64> = parts.iter().map(|part| part.2).sum();
    assert!((body.mass - mass).abs() < 1e-15);
    assert!((body.first_moment - moment).amax() < 1e-15);
    assert!((body.inertia - inertia).amax() < 1e-15);
}

/// A gripper of one drive and five joints that mimic it, as of the Robotiq 2F-85, is behind the last joint of arms of any
/// length: however many joints follow in it, the joints before it are those of the arm.
#[test]
fn an_arm_ends_before_its_gripper_however_large_that_is() {
    for count in [1, 3, 5, 6, 7] {
        let last = format!("jl{count}");
        let mut text = arm("j", "base", count) + &link("palm", 0.5, [0.0, 0.0, 0.03], 1e-3);
        text += &joint("flange", "fixed", [&last, "palm"], "");
        text += &finger("drive", "drive_pad", "palm", 0.02, "");
        for k in 1..=5 {
            let [name, pad] = ["m", "mp"].map(|stem| format!("{stem}{k}"));
            text += &finger(&name, &pad, "palm", -0.02, "<mimic joint='drive'/>");
        }
        let original = read(&robot(&text), &ChainChoice::default()).unwrap();
        let expected: Vec<String> = (1..=count).map(|k| format!("j{k}")).collect();
        assert_eq!(names(&original), expected);
    }
}

/// The full chain with a joint at rest has the torques of the chain in which this joint is locked: in the middle, before
/// the base, and as a whole end beyond the tip.
#[test]
fn a_locked_joint_is_one_that_rests() {
    let text = robot(&arm("j", "base", 6));
    let whole = read(&text, &ChainChoice::default()).unwrap();
    let mut rng = Pcg64::seed_from_u64(3);
    for (chosen, rest) in [
        (choice(None, None, &[("j3", 0.7)]), vec![(2, 0.7)]),
        (
            choice(None, None, &[("j2", -1.1), ("j4", 0.3)]),
            vec![(1, -1.1), (3, 0.3)],
        ),
        (
            choice(Some("jl2"), None, &[("j1", 0.4)]),
            vec![(0, 0.4), (1, 0.0)],
        ),
        (
            choice(Some("jl1"), Some("jl4"), &[("j6", 1.5)]),
            vec![(0, 0.0), (4, 0.0), (5, 1.5)],
        ),
    ] {
        let locked = read(&text, &chosen).unwrap();
        let moving: Vec<usize> = (0..6)
            .filter(|k| rest.iter().all(|(own, _)| own != k))
            .collect();
        assert_eq!(locked.robot().joints.len(), moving.len());
        for _ in 0..20 {
            let mut state = [[0.0; 6]; 3];
            for row in &mut state {
                moving
                    .iter()
                    .for_each(|k| row[*k] = rng.random_range(-2.0..2.0));
            }
            rest.iter().for_each(|(k, value)| state[0][*k] = *value);
            let all = torques(whole.robot(), &state[0], &state[1], &state[2]);
            let part = state.map(|row| moving.iter().map(|k| row[*k]).collect::<Vec<f64>>());
            let own = torques(locked.robot(), &part[0], &part[1], &part[2]);
            for (k, tau) in moving.iter().zip(own) {
                assert!(
                    (tau - all[*k]).abs() < 1e-11,
                    "{chosen:?}: {tau} {}",
                    all[*k]
                );
            }
        }
    }
}

#[test]
fn what_branches_off_clearly_is_locked_and_the_arm_is_followed() {
    let camera = arm("cam", "jl2", 1);
    let cases = [
        // A camera on the forearm, wheels on the base, a fixed branch.
        (robot(&(arm("j", "base", 6) + &camera)), 6),
        (
            robot(&(arm("w", "base", 1) + &arm("v", "base", 1) + &arm("j", "base", 5))),
            5,
        ),
        (
            robot(
                &(arm("j", "base", 3)
                    + &link("box", 1.0, [0.0; 3], 0.1)
                    + &joint("bolt", "fixed", ["jl1", "box"], "")),
            ),
            3,
        ),
        // Four alike fingers of two joints behind six.
        (
            robot(
                &(arm("j", "base", 6)
                    + &arm("f", "jl6", 2)
                    + &arm("g", "jl6", 2)
                    + &arm("h", "jl6", 2)),
            ),
            6,
        ),
    ];
    for (text, n) in cases {
        let original = read(&text, &ChainChoice::default()).unwrap();
        assert_eq!(original.robot().joints.len(), n);
        assert!(names(&original).iter().all(|name| name.starts_with('j')));
    }
    // A tree without anything to assume says nothing.
    let plain = read(&robot(&arm("j", "base", 3)), &ChainChoice::default()).unwrap();
    assert_eq!(plain.remarks(), Vec::<String>::new());
    // The finger of a holder that is held: the other follows it.
    let wide = read(&gripper_arm(), &choice(None, None, &[("left", 0.03)])).unwrap();
    assert_eq!(names(&wide).len(), 4);
    assert!(told(&wide).contains("right at -0.03"));
}

#[test]
fn equal_arms_are_refused_with_the_tips_that_can_be_chosen() {
    let text = robot(&(arm("l", "base", 4) + &arm("r", "base", 4) + &arm("head", "base", 1)));
    let message = refused(&text, &ChainChoice::default());
    for part in [
        "r.urdf:2:1: ",
        "--tip ll4 (4 joints)",
        "--tip rl4 (4 joints)",
        "`l1`",
    ] {
        assert!(message.contains(part), "{message}");
    }
    assert!(!message.contains("--tip headl1"), "{message}");
    let right = read(&text, &choice(None, Some("rl4"), &[])).unwrap();
    assert_eq!(names(&right), ["r1", "r2", "r3", "r4"]);
    assert!(told(&right).contains("5 movable joints outside of the moved links do not enter"));
    // The branches behind a lift can be held too.
    let lift = arm("z", "base", 1) + &arm("l", "zl1", 4) + &arm("r", "zl1", 4);
    assert!(
        refused(&robot(&lift), &ChainChoice::default())
            .contains("or --tip zl1 (1 joint) to hold the branches")
    );
}

#[test]
fn a_choice_that_does_not_fit_is_refused_with_what_would() {
    let text = gripper_arm();
    for (chosen, parts) in [
        (
            choice(None, Some("jl44"), &[]),
            ["no link `jl44`", "is `jl4` meant?"],
        ),
        (choice(None, Some("j4"), &[]), ["this is a joint", "`jl4`"]),
        (
            choice(Some("jl3"), Some("jl2"), &[]),
            ["does not carry link `jl2`", "`jl1`"],
        ),
        (
            choice(None, None, &[("lefft", 0.02)]),
            ["no joint `lefft`", "is `left` meant?"],
        ),
        (
            choice(None, None, &[("left", 0.2)]),
            ["--lock left=0.2", "0.01 to 0.04 m"],
        ),
        (
            choice(None, None, &[("flange", 0.0)]),
            ["--lock flange", "no single position"],
        ),
        (
            choice(None, Some("base"), &[]),
            ["no movable joint", "link `base`"],
        ),
    ] {
        let message = refused(&text, &chosen);
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
}

#[test]
fn joints_that_move_freely_are_held_before_the_base_and_refused_on_the_chain() {
    let float = |parent: &str, kind: &str| {
        joint(
            "free",
            kind,
            [parent, "hull"],
            "<origin xyz='0 0 1' rpy='0 0.3 0'/>",
        )
    };
    let hull = link("hull", 2.0, [0.0; 3], 0.1);
    let swims = robot(&(hull.clone() + &float("base", "floating") + &arm("j", "hull", 3)));
    let original = read(&swims, &ChainChoice::default()).unwrap();
    assert!(
        told(&original).contains("from link `hull`")
            && told(&original).contains("free at its origin")
    );
    let middle =
        robot(&(arm("a", "base", 2) + &hull + &float("al2", "planar") + &arm("j", "hull", 6)));
    let message = refused(&middle, &ChainChoice::default());
    assert!(
        message.contains("`free` is of type \"planar\"")
            && message.contains("--base hull")
            && message.contains("--tip al2"),
        "{message}"
    );
    assert!(read(&middle, &choice(None, Some("al2"), &[])).is_ok());
    assert!(read(&middle, &choice(Some("hull"), None, &[])).is_ok());
}

#[test]
fn joints_that_follow_a_moving_joint_are_refused_until_they_are_held() {
    let follower = link("bar", 0.3, [0.0; 3], 0.01)
        + &joint(
            "rod",
            "continuous",
            ["jl1", "bar"],
            "<mimic joint='j3' multiplier='2'/>",
        );
    let text = robot(&(arm("j", "base", 6) + &follower));
    let message = refused(&text, &ChainChoice::default());
    assert!(
        message.contains("`rod` mimics joint `j3`") && message.contains("--lock rod=VALUE"),
        "{message}"
    );
    assert!(read(&text, &choice(None, None, &[("rod", 0.2)])).is_ok());
    let held = read(&text, &choice(None, None, &[("j3", 0.2)])).unwrap();
    assert!(told(&held).contains("rod at 0.4"));
    let lost = text.replace("joint='j3' mult", "joint='j33' mult");
    assert!(refused(&lost, &ChainChoice::default()).contains("is `j3` meant?"));
}

/// The fingers keep their values, so that a simulator can move them, and the file reads back as the robot.
#[test]
fn values_are_written_back_beside_the_locked_joints() {
    let text = gripper_arm();
    let original = read(&text, &ChainChoice::default()).unwrap();
    assert_eq!(original.with_values(original.robot()).unwrap().text, text);
    let mut other = original.robot().clone();
    for joint in &mut other.joints {
        let inertial = joint.inertial.as_mut().unwrap();
        inertial.mass *= 1.3;
        inertial.inertia.iter_mut().for_each(|value| *value *= 1.2);
    }
    let written = original.with_values(&other).unwrap().text;
    for pad in ["left_pad", "right_pad"] {
        let line = |text: &str| {
            text.lines()
                .find(|own| own.contains(&format!("link name='{pad}'")))
                .map(str::to_owned)
        };
        assert_eq!(line(&written), line(&text));
    }
    let back = read(&written, &ChainChoice::default()).unwrap();
    for (own, wanted) in back.robot().joints.iter().zip(&other.joints) {
        let [own, wanted] =
            [own, wanted].map(|joint| joint.inertial.as_ref().unwrap().parameters());
        for (a, b) in own.iter().zip(wanted) {
            assert!((a - b).abs() < 1e-13, "{own:?} {wanted:?}");
        }
    }
}

#[test]
fn the_drive_that_a_file_states_is_read_and_the_rest_is_told() {
    let arm = arm("j", "base", 2);
    let with = |transmission: &str| {
        format!(
            "<robot name='r' xmlns:drake='http://drake.mit.edu'>\n<link name='base'/>\n{arm}{transmission}</robot>"
        )
    };
    let drake = with(
        "<transmission name='t'><joint name='j1'/><actuator name='m'><drake:gear_ratio value='50'/><drake:rotor_inertia value='2e-5'/></actuator></transmission>\n",
    );
    let original = read(&drake, &ChainChoice::default()).unwrap();
    let rows = original.robot().standard_parameters();
    // Drake: reflected inertia = rotor inertia times the square of the gear ratio.
    assert!((rows[0][column::DRIVE_INERTIA] - 0.05).abs() < 1e-15);
    assert_eq!(rows[1][column::DRIVE_INERTIA], 0.0);
    assert_eq!(original.remarks(), Vec::<String>::new());
    // Another rotor is written where the file states it.
    let mut other = original.robot().clone();
    other.joints[0].drive.as_mut().unwrap().rotor_inertia = 4e-5;
    let written = original.with_values(&other).unwrap();
    assert!(
        written.text.contains("rotor_inertia value=\"4e-5\"")
            || written.text.contains("rotor_inertia value='4e-5'"),
        "{}",
        written.text
    );
    assert!(
        !written
            .remarks
            .iter()
            .any(|own| own.contains("no place for the inertia"))
    );
    for (text, part) in [
        (
            "<transmission name='t'><joint name='j1'/><actuator name='m'><motorInertia>3e-5</motorInertia></actuator></transmission>",
            "<motorInertia> is not read",
        ),
        (
            "<transmission name='t'><joint name='j1'><offset>0.2</offset></joint><actuator name='m'/></transmission>",
            "<offset> is not read",
        ),
        (
            "<transmission name='t'><joint name='j1'/><joint name='j2'/><actuator name='m'/></transmission>",
            "names 2 joints (j1, j2)",
        ),
        (
            "<transmission name='t'><joint name='elsewhere'/></transmission>",
            "transmissions of `elsewhere` are not read",
        ),
        (
            "<ros2_control name='c' type='system'><joint name='j1'><command_interface name='position'><param name='min'>-1</param></command_interface></joint></ros2_control>",
            "limits of commands in <ros2_control> are not read",
        ),
        (
            "<ros2_control name='c' type='system'><joint name='j1'><param name='gear_ratio'>100</param></joint><joint name='j2'><param name='gear_ratio'>1.0</param></joint></ros2_control>",
            "the parameter `gear_ratio` of <ros2_control> is not read",
        ),
        (
            "<ros2_control name='c' type='system'><joint name='j2'><param name='reduction'>-50</param></joint></ros2_control>",
            "the parameter `reduction` of <ros2_control> is not read",
        ),
    ] {
        let original = read(&with(text), &ChainChoice::default()).unwrap();
        let [remark] = original.remarks() else {
            unreachable!("{text}: {:?}", original.remarks())
        };
        assert!(
            remark.starts_with("r.urdf:") && remark.contains(part),
            "{remark}"
        );
    }
    for (text, part) in [
        (
            "<transmision name='t'><joint name='j1'/></transmision>",
            "is <transmission> meant?",
        ),
        (
            "<transmission name='t'><joint name='j1'/><actuator name='m'><mechanicalReducton>5</mechanicalReducton></actuator></transmission>",
            "is <mechanicalReduction> meant?",
        ),
        (
            "<ros2_control name='c' type='system'><transmission name='t'><plugin>p</plugin><joint name='j1' role='joint1'><mechanical_reducton>5</mechanical_reducton></joint></transmission></ros2_control>",
            "is <mechanical_reduction> meant?",
        ),
        (
            "<ros2_control name='c' type='system'><transmission name='t'><joint name='j1'><param name='mechanical_reducton'>5</param></joint></transmission></ros2_control>",
            "is `mechanical_reduction` meant?",
        ),
        (
            "<ros2_control name='c' type='system'><joint name='j1'><param name='mechanicalReducton'>5</param></joint></ros2_control>",
            "is `mechanicalReduction` meant?",
        ),
        (
            "<transmission name='t'><joint name='j1'/><actuator name='m'><drake:rotor_inertia value='-1'/></actuator></transmission>",
            "an inertia must be 0 or greater",
        ),
    ] {
        let message = refused(&with(text), &ChainChoice::default());
        assert!(
            message.starts_with("r.urdf:") && message.contains(part),
            "{message}"
        );
    }
}

#[test]
fn links_without_values_are_massless_and_a_massless_end_is_told() {
    let bare = robot(
        &(arm("j", "base", 2)
            + "<link name='tool'/>\n"
            + &joint("t", "continuous", ["jl2", "tool"], "")),
    );
    let original = read(&bare, &ChainChoice::default()).unwrap();
    assert!(
        original
            .remarks()
            .iter()
            .any(|own| own.contains("the last link `tool` has no mass"))
    );
    assert_eq!(
        original.robot().joints[2].inertial.as_ref().unwrap().mass,
        0.0
    );
}

/// A tool frame that is fixed beyond the last moved link is listed, unless it is chosen or has the same frame.
#[test]
fn links_beyond_the_tip_are_listed() {
    let text = format!(
        "<robot name='r'>{}{}{}{}{}{}{}</robot>",
        link("base", 1.0, [0.0; 3], 0.1),
        link("arm", 2.0, [0.1, 0.0, 0.0], 0.1),
        "<link name='same'/>",
        "<link name='tool'/>",
        joint(
            "turn",
            "revolute",
            ["base", "arm"],
            "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='9' velocity='1'/>"
        ),
        joint("none", "fixed", ["arm", "same"], ""),
        joint(
            "far",
            "fixed",
            ["same", "tool"],
            "<origin xyz='0 0 0.107'/>"
        ),
    );
    let whole = read(&text, &choice(None, None, &[])).unwrap();
    assert_eq!(
        (whole.tip(), whole.beyond_tip()),
        ("arm", &["tool".to_owned()][..])
    );
    let chosen = read(&text, &choice(None, Some("tool"), &[])).unwrap();
    assert_eq!((chosen.tip(), chosen.beyond_tip().len()), ("tool", 0));
    assert!((chosen.robot().flange_pose().translation.z - 0.107).abs() < 1e-12);
}
