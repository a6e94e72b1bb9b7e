//! Files in which one drive turns several axes of the chain.
#![allow(clippy::unwrap_used)]

use std::collections::HashMap;
use std::path::Path;

use rig_shared::multibody::{
    Chain, column, differential_regressor, forward_dynamics, inertia_matrix, inverse_dynamics,
    kinetic_energy, potential_energy,
};

use crate::robot::{ChainChoice, Follower, JointKind, Original, Robot};

/// The links of a body: mass, centre and moments of inertia.
fn link(name: &str, mass: f64) -> String {
    format!(
        "<link name='{name}'><inertial><origin xyz='0.1 -0.05 0.08'/><mass value='{mass}'/><inertia ixx='0.03' ixy='0.001' ixz='0' iyy='0.04' iyz='-0.002' izz='0.035'/></inertial></link>\n"
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], rpy: &str, more: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><origin xyz='0.2 0.1 0.3' rpy='{rpy}'/><axis xyz='0 0 1'/>{more}</joint>\n"
    )
}

const LIMIT: &str = "<limit lower='-2' upper='2' velocity='3' effort='50'/>";

/// Five axes: `b` follows `a`, `d` follows `c` across kinds, `e` turns last.
fn arm(b: &str, d: &str) -> String {
    let body = link("l1", 4.0)
        + &link("l2", 3.0)
        + &link("l3", 2.0)
        + &link("l4", 1.5)
        + &link("l5", 1.0)
        + &joint("a", "revolute", ["base", "l1"], "0.3 0 0", LIMIT)
        + &joint("b", "revolute", ["l1", "l2"], "1.2 0.4 0", b)
        + &joint("c", "revolute", ["l2", "l3"], "0 -1.1 0.2", LIMIT)
        + &joint("d", "prismatic", ["l3", "l4"], "0.7 0 0", d)
        + &joint("e", "revolute", ["l4", "l5"], "0.2 0.9 -0.4", LIMIT);
    format!("<robot name='r'>\n<link name='base'/>\n{body}</robot>")
}

const B: &str =
    "<mimic joint='a' multiplier='-1'/><limit lower='-9' upper='9' velocity='9' effort='1'/>";
const D: &str = "<mimic joint='c' multiplier='0.5' offset='0.1'/><limit lower='-9' upper='9' velocity='9' effort='1'/>";

fn read(text: &str) -> Original {
    Original::read(text.to_owned(), Path::new("r.urdf")).unwrap()
}

fn refused(text: &str) -> String {
    let found = Original::read(text.to_owned(), Path::new("r.urdf"));
    found.unwrap_err().to_string()
}

fn torques(robot: &Robot, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let chain = robot.chain().unwrap();
    let mut tau = vec![0.0; robot.joints.len()];
    inverse_dynamics(&chain, &robot.standard_parameters(), q, qd, qdd, &mut tau).unwrap();
    tau
}

fn alike(a: &[f64], b: &[f64], most: f64) {
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < most * (1.0 + b.abs()), "{a} {b}");
    }
}

const STATE: [[f64; 3]; 3] = [[0.4, -0.7, 1.1], [1.2, -0.5, 0.8], [2.0, 3.0, -1.5]];

/// The same file without <mimic> has five joints; its torques at the positions that the gears give, projected.
#[test]
fn torques_are_those_of_the_whole_tree_projected() {
    let robot = read(&arm(B, D)).robot().clone();
    let names: Vec<&str> = robot.joints.iter().map(|own| own.name.as_str()).collect();
    assert_eq!(names, ["a", "c", "e"]);
    let gears: Vec<_> = (robot.followers.iter())
        .map(|own| {
            (
                own.name.as_str(),
                own.follows.as_str(),
                own.after.as_deref(),
            )
        })
        .collect();
    assert_eq!(gears, [("b", "a", Some("a")), ("d", "c", Some("c"))]);
    let whole = read(&arm(LIMIT, LIMIT)).robot().clone();
    let [q, qd, qdd] = STATE;
    let axes = |[a, c, e]: [f64; 3], offset: f64| [a, -a, c, 0.5 * c + offset, e];
    let tau = torques(&whole, &axes(q, 0.1), &axes(qd, 0.0), &axes(qdd, 0.0));
    let projected = [tau[0] - tau[1], tau[2] + 0.5 * tau[3], tau[4]];
    alike(&torques(&robot, &q, &qd, &qdd), &projected, 1e-12);
}

/// A drawn-out gear: `d` mimics a joint beside the chain, which mimics `c`.
#[test]
fn gears_are_joined_through_joints_beside_the_chain() {
    let between = D.replace("joint='c'", "joint='side'");
    let side = link("lever", 0.0001)
        + &joint(
            "side",
            "revolute",
            ["base", "lever"],
            "0 0 0",
            "<mimic joint='c' multiplier='4' offset='-0.2'/>",
        );
    let text = arm(B, &between).replace("</robot>", &format!("{side}</robot>"));
    let choice = ChainChoice {
        tip: Some("l5".to_owned()),
        locks: vec![("side".to_owned(), 0.0)],
        ..ChainChoice::default()
    };
    // Held beside the chain, it holds its follower.
    let held = Original::read_chain(text.clone(), Path::new("r.urdf"), &choice).unwrap();
    assert_eq!(held.robot().followers.len(), 1);
    let choice = ChainChoice {
        locks: Vec::new(),
        ..choice
    };
    let moved = Original::read_chain(text, Path::new("r.urdf"), &choice).unwrap();
    let own = moved.robot().followers.last().unwrap();
    assert_eq!((own.name.as_str(), own.follows.as_str()), ("d", "c"));
    assert!((own.ratio - 2.0).abs() < 1e-15 && own.offset.abs() < 1e-15);
}

#[test]
fn limits_and_friction_of_a_follower_are_those_of_its_joint() {
    let narrow = "<mimic joint='a' multiplier='-0.5'/><limit lower='-0.3' upper='0.8' velocity='1' effort='1'/><dynamics damping='2' friction='3'/>";
    let original = read(&arm(narrow, D));
    let joint = &original.robot().joints[0];
    let limits = joint.limits.as_ref().unwrap();
    assert_eq!((limits.position, limits.velocity), ([-1.6, 0.6], 2.0));
    assert_eq!(limits.torque, Some(50.0));
    let friction = joint.friction.as_ref().unwrap();
    assert_eq!((friction.viscous, friction.coulomb), (0.5, 1.5));
    let told = original.remarks().join("\n");
    for part in [
        "limits are narrowed",
        "acts like friction of `a`",
        "`b` = -0.5·`a`",
    ] {
        assert!(told.contains(part), "{told}");
    }
    // Written back, the friction stands once.
    let mut other = original.robot().clone();
    other.joints[0].friction.as_mut().unwrap().viscous = 0.75;
    let text = original.with_values(&other).unwrap().text;
    assert_eq!(
        read(&text).robot().joints[0].friction,
        other.joints[0].friction
    );
}

#[test]
fn what_cannot_follow_is_refused_with_its_line() {
    for (b, parts) in [
        (
            "<mimic joint='a' multiplier='0'/>",
            vec!["7:1", "`b`", "multiplier of 0"],
        ),
        (
            "<mimic joint='aa'/>",
            vec!["`b` mimics joint `aa`", "is `a` meant?"],
        ),
        (
            "<mimic joint='a'/><limit lower='5' upper='6' velocity='1' effort='1'/>",
            vec!["leave `a` no range"],
        ),
    ] {
        let message = refused(&arm(b, D));
        let line = message.replace(":8:", ":7:").replace(":9:", ":7:");
        for part in parts.iter().filter(|part| **part != "7:1") {
            assert!(line.contains(part), "{message}");
        }
    }
}

/// A file of its own, the author's file with other values, and TOML: all read back as the robot.
#[test]
fn the_robot_survives_every_file() {
    let original = read(&arm(B, D));
    let robot = original.robot();
    let [q, qd, qdd] = STATE;
    let expected = torques(robot, &q, &qd, &qdd);
    let urdf = robot.to_urdf().unwrap().text;
    assert!(urdf.contains("<mimic joint=\"a\" multiplier=\"-1.0\" offset=\"0.0\"/>"));
    let again = read(&urdf);
    assert_eq!(again.robot().followers.len(), 2);
    alike(&torques(again.robot(), &q, &qd, &qdd), &expected, 1e-10);
    let toml = robot.to_toml().unwrap();
    let mut back = Robot::from_toml(&toml, Path::new("r.toml")).unwrap();
    back.origin = robot.origin;
    assert_eq!(&back, robot);
    // Other values for all links.
    let rows: Vec<_> = (robot.standard_parameters().into_iter())
        .map(|mut row| {
            row[..column::DRIVE_INERTIA]
                .iter_mut()
                .for_each(|x| *x *= 1.5);
            row
        })
        .collect();
    let (heavier, said) = robot.with_parameters(&rows, &[]);
    assert!(said.is_empty(), "{said:?}");
    let written = original.with_values(&heavier).unwrap().text;
    let found = torques(read(&written).robot(), &q, &qd, &qdd);
    alike(&found, &expected.map_times(1.5), 1e-10);
}

trait Times {
    fn map_times(&self, factor: f64) -> Vec<f64>;
}

impl Times for Vec<f64> {
    fn map_times(&self, factor: f64) -> Vec<f64> {
        self.iter().map(|x| factor * x).collect()
    }
}

/// An arm whose last joint follows is no gripper.
#[test]
fn a_follower_at_the_end_of_one_path_belongs_to_the_arm() {
    let text = arm(LIMIT, LIMIT).replace(
        &joint("e", "revolute", ["l4", "l5"], "0.2 0.9 -0.4", LIMIT),
        &joint(
            "e",
            "revolute",
            ["l4", "l5"],
            "0.2 0.9 -0.4",
            "<mimic joint='b' multiplier='-1'/>",
        ),
    );
    let robot = read(&text).robot().clone();
    assert_eq!((robot.joints.len(), robot.followers.len()), (4, 1));
    assert_eq!(robot.last_link(), 4);
    // Held, master and follower are no axes.
    let choice = ChainChoice {
        locks: vec![("b".to_owned(), 0.2)],
        ..ChainChoice::default()
    };
    let held = Original::read_chain(text, Path::new("r.urdf"), &choice).unwrap();
    assert_eq!(held.robot().joints.len(), 3);
    assert!(held.robot().followers.is_empty());
}

#[test]
fn a_follower_needs_no_kind_of_its_joint() {
    let robot = read(&arm(B, D)).robot().clone();
    let of =
        |name: &str| -> &Follower { robot.followers.iter().find(|own| own.name == name).unwrap() };
    assert_eq!(of("d").kind, JointKind::Prismatic);
    assert_eq!(of("b").kind, JointKind::Revolute);
}

/// Largest difference of two lists over the larger of 1 and the largest entry.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).fold(1.0, |m: f64, x| m.max(x.abs()));
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |m: f64, (x, y)| m.max((x - y).abs())) / scale
}

/// Torques, accelerations, inertia matrices and energies of an arm of six axes, of which two follow, as MuJoCo and Pinocchio
/// computed them (`tests/other_engine/mimic.py --seed 3`).
#[test]
fn joints_move_as_two_engines_say() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/mimic");
    let robot = Robot::load(&folder.join("robot.urdf")).unwrap();
    let names: Vec<&str> = robot.joints.iter().map(|own| own.name.as_str()).collect();
    assert_eq!(names, ["joint1", "joint2", "joint4", "joint6"]);
    let chain: Chain<f64> = robot.chain().unwrap();
    let (rows, n) = (robot.standard_parameters(), names.len());
    let text = std::fs::read(folder.join("states.json")).unwrap();
    let states: HashMap<String, serde_json::Value> = serde_json::from_slice(&text).unwrap();
    let list =
        |name: &str| -> Vec<Vec<f64>> { serde_json::from_value(states[name].clone()).unwrap() };
    let [q, qd, qdd, inertia] = ["q", "qd", "qdd", "inertia"].map(list);
    let energies: Vec<f64> = serde_json::from_value(states["energy"].clone()).unwrap();
    let energy = |k: usize| {
        kinetic_energy(&chain, &rows, &q[k], &qd[k]).unwrap()
            + potential_energy(&chain, &rows, &q[k]).unwrap()
    };
    let mut worst = [0.0_f64; 5];
    let mut take = |what: usize, off: f64| worst[what] = worst[what].max(off);
    for engine in ["mujoco", "pinocchio"] {
        for (k, torque) in list(engine).iter().enumerate() {
            let (q, qd, qdd) = (&q[k], &qd[k], &qdd[k]);
            take(0, apart(&torques(&robot, q, qd, qdd), torque));
            let mut out = vec![0.0; n];
            forward_dynamics(&chain, &rows, q, qd, torque, &mut out).unwrap();
            take(1, apart(&out, qdd));
            let mut matrix = vec![0.0; n * n];
            inertia_matrix(&chain, &rows, q, &mut matrix).unwrap();
            take(2, apart(&matrix, &inertia[k]));
            let flat = rows.as_flattened();
            let mut regressor = vec![0.0; n * flat.len()];
            differential_regressor(&chain, q, qd, qdd, &mut regressor).unwrap();
            let product: Vec<f64> = (regressor.chunks(flat.len()))
                .map(|row| row.iter().zip(flat).map(|(a, b)| a * b).sum())
                .collect();
            take(3, apart(&product, torque));
            // The height of zero is free.
            take(
                4,
                apart(&[energy(k) - energy(0)], &[energies[k] - energies[0]]),
            );
        }
    }
    println!("torque, acceleration, inertia, regressor, energy: {worst:?}");
    for (off, most) in worst.into_iter().zip([1e-10, 1e-9, 1e-10, 1e-10, 1e-10]) {
        assert!(off < most, "{worst:?}");
    }
}
