//! Compares the converted robot with the URDF evaluated directly, by plain matrices and a separate walk over the XML:
//! mass, first moment and inertia of every body seen from the base at random q.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use roxmltree::Document;

use super::super::frame::GRAVITY;
use super::super::urdf;
use super::{convert, joint_pose};
use crate::robot::{JointKind, Robot};

type Mat = [[f64; 4]; 4];

fn times(a: Mat, b: Mat) -> Mat {
    let mut c = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            c[i][j] = (0..4).map(|k| a[i][k] * b[k][j]).sum();
        }
    }
    c
}

fn shift(p: [f64; 3]) -> Mat {
    [
        [1.0, 0.0, 0.0, p[0]],
        [0.0, 1.0, 0.0, p[1]],
        [0.0, 0.0, 1.0, p[2]],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

/// Rodrigues.
fn turn(axis: [f64; 3], angle: f64) -> Mat {
    let n = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
    let [x, y, z] = axis.map(|v| v / n);
    let (s, c) = angle.sin_cos();
    let v = 1.0 - c;
    [
        [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0.0],
        [y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0.0],
        [z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

fn three(text: Option<&str>) -> [f64; 3] {
    let v: Vec<f64> = text
        .unwrap_or("0 0 0")
        .split_whitespace()
        .map(|w| w.parse().unwrap())
        .collect();
    [v[0], v[1], v[2]]
}

fn origin(node: roxmltree::Node<'_, '_>) -> Mat {
    let Some(o) = node.children().find(|n| n.has_tag_name("origin")) else {
        return shift([0.0; 3]);
    };
    let rpy = three(o.attribute("rpy"));
    let mut m = shift(three(o.attribute("xyz")));
    m = times(m, turn([0.0, 0.0, 1.0], rpy[2]));
    m = times(m, turn([0.0, 1.0, 0.0], rpy[1]));
    times(m, turn([1.0, 0.0, 0.0], rpy[0]))
}

/// Σm, Σm·c and the inertia about the base's origin, in the base frame.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    mass: f64,
    moment: [f64; 3],
    inertia: [[f64; 3]; 3],
}

/// Evaluates directly: bodies by the name of the joint that moves them.
fn direct(text: &str, q: &HashMap<String, f64>) -> HashMap<String, Seen> {
    let document = Document::parse(text).unwrap();
    let root = document.root_element();
    let attribute = |n: roxmltree::Node<'_, '_>, tag: &str| {
        n.children()
            .find(|c| c.has_tag_name(tag))
            .and_then(|c| c.attribute("link"))
            .unwrap()
            .to_owned()
    };
    let joints: Vec<_> = root
        .children()
        .filter(|n| n.has_tag_name("joint"))
        .collect();
    let moved: Vec<String> = joints.iter().map(|j| attribute(*j, "child")).collect();
    let base = root
        .children()
        .filter(|n| n.has_tag_name("link"))
        .map(|n| n.attribute("name").unwrap().to_owned())
        .find(|n| !moved.contains(n))
        .unwrap();
    let mut result: HashMap<String, Seen> = HashMap::new();
    let mut todo = vec![(base, shift([0.0; 3]), String::new())];
    while let Some((link, pose, mover)) = todo.pop() {
        let node = root
            .children()
            .find(|n| n.has_tag_name("link") && n.attribute("name") == Some(&link))
            .unwrap();
        if let Some(inertial) = node.children().find(|n| n.has_tag_name("inertial")) {
            let tag = |t: &str| inertial.children().find(|n| n.has_tag_name(t)).unwrap();
            let m: f64 = tag("mass").attribute("value").unwrap().parse().unwrap();
            let g = |k: &str| tag("inertia").attribute(k).unwrap().parse::<f64>().unwrap();
            let i = [
                [g("ixx"), g("ixy"), g("ixz")],
                [g("ixy"), g("iyy"), g("iyz")],
                [g("ixz"), g("iyz"), g("izz")],
            ];
            let at = times(pose, origin(inertial));
            let c = [at[0][3], at[1][3], at[2][3]];
            let seen = result.entry(mover.clone()).or_default();
            seen.mass += m;
            let c2: f64 = c.iter().map(|v| v * v).sum();
            for r in 0..3 {
                seen.moment[r] += m * c[r];
                for s in 0..3 {
                    let mut turned = 0.0;
                    for k in 0..3 {
                        for l in 0..3 {
                            turned += at[r][k] * i[k][l] * at[s][l];
                        }
                    }
                    let unit = if r == s { c2 } else { 0.0 };
                    seen.inertia[r][s] += turned + m * (unit - c[r] * c[s]);
                }
            }
        }
        for joint in joints.iter().filter(|j| attribute(**j, "parent") == link) {
            let name = joint.attribute("name").unwrap().to_owned();
            let mut next = times(pose, origin(*joint));
            let axis = three(
                joint
                    .children()
                    .find(|n| n.has_tag_name("axis"))
                    .map_or(Some("1 0 0"), |n| n.attribute("xyz")),
            );
            let kind = joint.attribute("type").unwrap();
            let value = q.get(&name).copied().unwrap_or(0.0);
            if kind == "prismatic" {
                let n = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
                next = times(next, shift(axis.map(|v| v / n * value)));
            } else if kind != "fixed" {
                next = times(next, turn(axis, value));
            }
            let by = if kind == "fixed" { mover.clone() } else { name };
            todo.push((attribute(*joint, "child"), next, by));
        }
    }
    result
}

/// Returns the largest difference between both evaluations over `draws` random configurations, relative to the scale.
fn worst(text: &str, seed: u64, draws: usize) -> (Robot, f64) {
    let chain = urdf::read(text, Path::new("test.urdf"), &urdf::ChainChoice::default()).unwrap();
    let converted = convert(&chain);
    let robot = converted.robot;
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut worst: f64 = 0.0;
    for _ in 0..draws {
        let q: HashMap<String, f64> = robot
            .joints
            .iter()
            .map(|j| (j.name.clone(), rng.random_range(-3.0..3.0)))
            .collect();
        let expected = direct(text, &q);
        let mut pose: Isometry3<f64> = converted.base;
        for joint in &robot.joints {
            pose *= joint_pose(joint, q[&joint.name]);
            let body = urdf::SpatialInertia::of(joint.inertial.as_ref().unwrap()).seen_from(&pose);
            let want = expected[&joint.name];
            worst = worst.max((body.mass - want.mass).abs());
            for r in 0..3 {
                worst = worst.max((body.first_moment[r] - want.moment[r]).abs());
                for s in 0..3 {
                    worst = worst.max((body.inertia[(r, s)] - want.inertia[r][s]).abs());
                }
            }
        }
    }
    // Gravity keeps its direction in the base: frame 0 differs from the base by a turn about z only.
    let gravity = converted.base.rotation * Vector3::from(robot.gravity);
    worst = worst.max((gravity - Vector3::new(0.0, 0.0, -GRAVITY)).norm());
    (robot, worst)
}

/// A chain with random axes: skew, parallel, intersecting and coincident, with fixed links in between.
pub(in crate::robot) fn random_urdf(rng: &mut Pcg64) -> String {
    let mut text = String::from("<robot name='r'><link name='l0'/>");
    let right = std::f64::consts::FRAC_PI_2;
    for i in 0..rng.random_range(1..7) {
        let kind = ["revolute", "prismatic", "continuous"][rng.random_range(0..3)];
        let mut rpy = [0.0; 3];
        let mut xyz = [0.0; 3];
        for k in 0..3 {
            rpy[k] = if rng.random_bool(0.4) {
                rng.random_range(-3.0..3.0)
            } else {
                right * rng.random_range(-2..3) as f64
            };
            xyz[k] = if rng.random_bool(0.5) {
                rng.random_range(-0.5..0.5)
            } else {
                0.0
            };
        }
        let axis = ["0 0 1", "0 -1 0", "1 0 0", "0 0 -1", "0.3 -0.5 0.8"][rng.random_range(0..5)];
        let mut inertial = |prefix: &str| {
            let v: Vec<f64> = (0..12).map(|_| rng.random_range(-0.4..0.4)).collect();
            format!(
                "<link name='{prefix}'><inertial><origin xyz='{} {} {}' rpy='{} {} {}'/><mass value='{}'/>\
                 <inertia ixx='0.3' ixy='{}' ixz='{}' iyy='0.4' iyz='{}' izz='0.5'/></inertial></link>",
                v[0],
                v[1],
                v[2],
                v[3] * 4.0,
                v[4] * 4.0,
                v[5] * 4.0,
                v[6] + 1.0,
                v[7] * 0.1,
                v[8] * 0.1,
                v[9] * 0.1
            )
        };
        text += &inertial(&format!("l{}", i + 1));
        text += &inertial(&format!("f{}", i + 1));
        text += &format!(
            "<joint name='j{n}' type='{kind}'><parent link='{parent}'/><child link='l{n}'/><axis xyz='{axis}'/>\
             <origin xyz='{} {} {}' rpy='{} {} {}'/><limit lower='-1' upper='1' velocity='1' effort='1'/></joint>\
             <joint name='x{n}' type='fixed'><parent link='l{n}'/><child link='f{n}'/><origin xyz='0.1 -0.2 0.05' rpy='0.3 0 1.2'/></joint>",
            xyz[0],
            xyz[1],
            xyz[2],
            rpy[0],
            rpy[1],
            rpy[2],
            n = i + 1,
            // The next joint is attached to the fixed link, so that the link's pose is part of the chain.
            parent = if i == 0 {
                "l0".to_owned()
            } else {
                format!("f{i}")
            },
        );
    }
    text + "</robot>"
}

#[test]
fn random_chains_keep_their_masses_in_place_at_every_position() {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut kinds = [0, 0];
    for n in 0..300 {
        let text = random_urdf(&mut rng);
        let (robot, worst) = worst(&text, n, 5);
        for joint in &robot.joints {
            kinds[usize::from(joint.kind == JointKind::Prismatic)] += 1;
        }
        // Skew axes that meet far away give lengths up to some tens of metres; the bound is their rounding.
        assert!(worst < 1e-8, "chain {n} differs by {worst:e}:\n{text}");
    }
    assert!(kinds.iter().all(|&k| k > 100));
}

#[test]
fn published_robots_keep_their_masses_in_place() {
    let Some(data) = rig_output::data_dir() else {
        println!("no real recordings here (set RIG_DATA): nothing compared");
        return;
    };
    for (file, joints) in [
        ("kuka_lwr4/kuka_lwr4.urdf", 7),
        ("staubli_tx40/tx40.urdf", 6),
    ] {
        let path = data.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        let (robot, worst) = worst(&text, 1, 100);
        assert_eq!(robot.joints.len(), joints);
        assert!(worst < 1e-9, "{file} differs by {worst:e}");
        let mut read_back =
            Robot::from_toml(&robot.to_toml().unwrap(), Path::new("x.toml")).unwrap();
        // TOML does not store the origin of the values.
        read_back.origin = robot.origin;
        assert_eq!(read_back, robot);
        assert_eq!(Robot::load(&path).unwrap(), robot);
    }
}

#[test]
fn a_planar_arm_gets_the_textbook_parameters() {
    let link = |n: u32| {
        format!(
            "<link name='l{n}'><inertial><origin xyz='0.2 0 0'/><mass value='2'/><inertia ixx='0' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial></link>"
        )
    };
    let joint = |n: u32, xyz: &str, rpy: &str| {
        format!(
            "<joint name='j{n}' type='continuous'><parent link='l{}'/><child link='l{n}'/><origin xyz='{xyz}' rpy='{rpy}'/><axis xyz='0 0 1'/></joint>",
            n - 1
        )
    };
    let text = format!(
        "<robot name='planar'><link name='l0'/>{}{}{}{}</robot>",
        link(1),
        link(2),
        joint(1, "0 0 0", "1.5707963267948966 0 0"),
        joint(2, "0.4 0 0", "0 0 0")
    );
    let robot = Robot::from_urdf(&text, Path::new("planar.urdf")).unwrap();
    let dh: Vec<[f64; 4]> = robot
        .joints
        .iter()
        .map(|j| [j.alpha, j.a, j.theta, j.d])
        .collect();
    assert_eq!(
        dh,
        [
            [std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0],
            [0.0, 0.4, 0.0, 0.0]
        ]
    );
    let inertial = robot.joints[1].inertial.as_ref().unwrap();
    assert_eq!(inertial.mass, 2.0);
    assert!((inertial.first_moment[0] - 0.4).abs() < 1e-15);
    // Steiner: 0.01 + 2·0.2².
    assert!((inertial.inertia[5] - 0.09).abs() < 1e-15);
}
