//! Values written into many kinds of files: the rest stays, and the author's frames get the new dynamics.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rig_shared::effects::{Effect, Kind};
use rig_shared::multibody::{Chain, column, inverse_dynamics};

use super::Original;
use crate::robot::dh::tests::random_urdf;
use crate::robot::dh::{convert, joint_pose};
use crate::robot::urdf::SpatialInertia;
use crate::robot::urdf::write::tests::body;
use crate::robot::{Inertial, JointFriction, Robot, RobotEffect};

/// A file with everything that concerns the display and not the dynamics.
const SKEW: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<!-- drawn by hand -->
<robot name="skew" xmlns:xacro="http://ros.org/wiki/xacro">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="floor"/>
  <joint name="feet" type="fixed">
    <origin xyz="0.3 -0.2 1.1" rpy="0.2 -0.4 2.1"/>
    <parent link="floor"/> <child link="plinth"/>
  </joint>
  <link name="plinth"><inertial><mass value="4"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="upper"><!-- cast -->
    <visual><geometry><mesh filename="package://a/upper.dae" scale="1e-3 1e-3 1e-3"/></geometry></visual>
    <inertial>
      <origin xyz="0.1 0 0.2" rpy="0.1 0.2 0.3"/>
      <mass value="3.50"/>
      <inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.12" iyz="0" izz="0.09"/>
    </inertial>
    <collision><geometry><sphere radius=".1"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="plinth"/><child link="upper"/>
    <origin xyz="0.05 0.1 0.2" rpy="0.7 -0.1 0.4"/>
    <axis xyz="0.3 -0.5 0.8"/>
    <limit lower="-2" upper="2" velocity="3" effort="80"/>
    <dynamics friction="0.50" spring="kept"/>
  </joint>
  <link name="slide" />
  <link name="rail"><inertial><mass value="1"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="bolted" type="fixed"><origin xyz="0 0.1 0" rpy="0 0 0.5"/><parent link="slide"/><child link="rail"/></joint>
  <joint name="feed" type="prismatic">
    <origin xyz="0.3 0 0.1" rpy="0 1.2 0"/><parent link="upper"/><child link="slide"/><axis xyz="0 -1 0"/>
    <limit lower="-.2" upper=".4" velocity="1" effort="200"/>
  </joint>
  <link name="hand"><inertial><mass value="0.7"/><origin xyz="0 0 0.05"/><inertia ixx="0.003" ixy="0" ixz="0" iyy="0.003" iyz="0" izz="0.002"/></inertial></link>
  <joint name="wrist" type="continuous"><origin xyz="0.1 0.2 0" rpy="1.1 0.3 0"/><parent link="rail"/><child link="hand"/><axis xyz="1 0 0"/><dynamics damping="0.1" friction="0.2"/></joint>
  <link name="tool"><inertial><mass value="0.2"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="grip" type="fixed"><origin xyz="0 0 0.1" rpy="0 0.2 0"/><parent link="hand"/><child link="tool"/></joint>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="shoulder"/><actuator name="m"><mechanicalReduction>120</mechanicalReduction></actuator></transmission>
  <gazebo reference="hand"><material>Gazebo/Red</material></gazebo>
</robot>
"#;

/// The same robot with other bodies and friction.
fn changed(robot: &Robot, rng: &mut Pcg64) -> Robot {
    let mut robot = robot.clone();
    for joint in &mut robot.joints {
        joint.inertial = Some(body(rng));
        joint.friction = Some(JointFriction {
            coulomb: rng.random_range(0.1..2.0),
            viscous: rng.random_range(0.1..2.0),
            offset: 0.0,
        });
    }
    robot
}

fn torques(robot: &Robot, gravity: [f64; 3], q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let chain = Chain::new(&robot.geometry(), gravity).unwrap();
    let mut parameters = robot.standard_parameters();
    for row in &mut parameters {
        row[column::DRIVE_INERTIA] = 0.0;
        row[column::OFFSET] = 0.0;
    }
    let mut tau = vec![f64::NAN; q.len()];
    inverse_dynamics(&chain, &parameters, q, qd, qdd, &mut tau).unwrap();
    tau
}

/// Checks that the written file has the dynamics of `robot`: body by body in the author's base frame, and as torques.
fn same_dynamics(original: &Original, robot: &Robot, rng: &mut Pcg64) {
    let text = original.with_values(robot).unwrap().text;
    let chain = crate::robot::urdf::read(
        &text,
        Path::new("r.urdf"),
        &crate::robot::ChainChoice::default(),
    )
    .unwrap();
    let back = convert(&chain).robot;
    let tilted = robot.gravity != original.robot().gravity;
    for _ in 0..5 {
        let mut signal = |range: f64| -> Vec<f64> {
            (0..robot.joints.len())
                .map(|_| rng.random_range(-range..range))
                .collect()
        };
        let (q, qd, qdd) = (signal(3.0), signal(3.0), signal(10.0));
        let a = torques(robot, robot.gravity, &q, &qd, &qdd);
        let b = torques(&back, back.gravity, &q, &qd, &qdd);
        let scale = a.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        for (x, y) in a.iter().zip(&b) {
            assert!((x - y).abs() < 1e-8 * scale, "{a:?} {b:?}\n{text}");
        }
        if tilted {
            continue;
        }
        // Links of the written file in its own frames, compared with the description in its frames.
        let mut pose = Isometry3::identity();
        let mut frame = original.base;
        for ((body, joint), own) in chain.bodies.iter().zip(&robot.joints).zip(&q) {
            let turned = match body.kind {
                crate::robot::JointKind::Revolute => Isometry3::rotation(body.axis * *own),
                crate::robot::JointKind::Prismatic => {
                    let by: Vector3<f64> = body.axis * *own;
                    Isometry3::translation(by.x, by.y, by.z)
                }
            };
            pose = pose * body.origin * turned;
            frame *= joint_pose(joint, *own);
            let (written, meant) = (
                body.inertia.seen_from(&pose),
                SpatialInertia::of(joint.inertial.as_ref().unwrap()).seen_from(&frame),
            );
            assert!((written.mass - meant.mass).abs() < 1e-9);
            assert!((written.first_moment - meant.first_moment).amax() < 1e-8);
            assert!((written.inertia - meant.inertia).amax() < 1e-8, "{text}");
        }
    }
}

/// Returns the text without `<inertial>`, `<dynamics>` and comments, with white space between elements merged.
fn frame_of(text: &str) -> String {
    let mut rest = text.to_owned();
    for (from, to) in [
        ("<!--", "-->"),
        ("<inertial", "</inertial>"),
        ("<dynamics", "/>"),
    ] {
        while let Some(start) = rest.find(from) {
            let end = start + rest[start..].find(to).unwrap() + to.len();
            rest.replace_range(start..end, "");
        }
    }
    // A link whose only content was inertia may have been written as an empty element.
    rest.replace("<link name=\"slide\" />", "<link name=\"slide\"></link>")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace("> <", "><")
}

#[test]
fn values_stand_in_the_authors_frames_and_the_rest_stays() {
    let mut rng = Pcg64::seed_from_u64(5);
    let original = Original::read(SKEW.into(), Path::new("skew.urdf")).unwrap();
    let robot = changed(original.robot(), &mut rng);
    same_dynamics(&original, &robot, &mut rng);
    let written = original.with_values(&robot).unwrap();
    assert_eq!(frame_of(&written.text), frame_of(SKEW));
    for kept in [
        "<!-- drawn by hand -->\n<!-- Replaced by those of the description \"skew\"",
        "<!-- cast -->",
        "spring=\"kept\"",
        "<link name=\"floor\"/>",
        "<link name=\"plinth\"><inertial><mass value=\"4\"/>",
        "<!-- The inertia of this link is part of that of hand. -->",
        "<!-- The inertia of this link is part of that of slide. -->",
    ] {
        assert!(written.text.contains(kept), "{kept}\n{}", written.text);
    }
    let message = written.remarks.join(" ");
    assert!(
        message.contains("the inertial values of upper, slide, hand; damping and friction of shoulder, feed, wrist")
            && message.contains("<inertial> of slide holds that of rail too, which has one no more"),
        "{message}"
    );
    for _ in 0..100 {
        let text = random_urdf(&mut rng);
        let original = Original::read(text.clone(), Path::new("r.urdf")).unwrap();
        let robot = changed(original.robot(), &mut rng);
        same_dynamics(&original, &robot, &mut rng);
        let written = original.with_values(&robot).unwrap().text;
        assert_eq!(frame_of(&written), frame_of(&text));
    }
}

#[test]
fn what_was_not_identified_stays_to_the_byte() {
    let original = Original::read(SKEW.into(), Path::new("skew.urdf")).unwrap();
    let same = original.with_values(original.robot()).unwrap();
    assert_eq!(same.text, SKEW);
    // Also through TOML and back, because identified values come from TOML.
    let toml = original.robot().to_toml().unwrap();
    let mut robot = Robot::from_toml(&toml, Path::new("r.toml")).unwrap();
    assert_eq!(original.with_values(&robot).unwrap().text, SKEW);
    robot.joints[0].friction.as_mut().unwrap().viscous = 0.75;
    let written = original.with_values(&robot).unwrap();
    assert!(
        written
            .text
            .contains("<dynamics damping=\"0.75\" friction=\"0.5\" spring=\"kept\"/>"),
        "{}",
        written.text
    );
    let begin = written.text.find("<robot").unwrap();
    let rest =
        written.text[begin..].replace(" damping=\"0.75\" friction=\"0.5\"", " friction=\"0.50\"");
    assert_eq!(rest, SKEW[SKEW.find("<robot").unwrap()..]);
    // The author's line ends are kept.
    let dos = SKEW.replace('\n', "\r\n");
    let original = Original::read(dos, Path::new("skew.urdf")).unwrap();
    robot = changed(original.robot(), &mut Pcg64::seed_from_u64(1));
    let written = original.with_values(&robot).unwrap().text;
    assert_eq!(
        written.matches('\n').count(),
        written.matches("\r\n").count()
    );
}

#[test]
fn what_urdf_cannot_hold_is_said_and_a_tilt_has_a_link_of_its_own() {
    let mut rng = Pcg64::seed_from_u64(6);
    let original = Original::read(SKEW.into(), Path::new("skew.urdf")).unwrap();
    let mut robot = changed(original.robot(), &mut rng);
    robot.gravity = [0.3, -0.2, -(9.81f64 * 9.81 - 0.13).sqrt()];
    robot.effects.push(RobotEffect {
        joint: Some("wrist".into()),
        other: None,
        effect: Effect::new(Kind::Spring, &[0.25, 0.5], &[]),
    });
    robot.joints[1].friction.as_mut().unwrap().offset = 0.125;
    same_dynamics(&original, &robot, &mut rng);
    let written = original.with_values(&robot).unwrap();
    let message = written.remarks.join(" ");
    for words in [
        "level_world_to_base at the end of the file turns floor in it by 2.1",
        "spring of wrist (stiffness 0.25 N*m/rad, preload 0.5 N*m)",
        "constant torques at the joints: feed 0.1250 N",
    ] {
        assert!(
            message.contains(words) && written.text.contains(words),
            "{words}: {message}"
        );
    }
}

#[test]
fn another_robots_values_are_refused() {
    let original = Original::read(SKEW.into(), Path::new("skew.urdf")).unwrap();
    let refused = |change: fn(&mut Robot)| {
        let mut robot = original.robot().clone();
        change(&mut robot);
        original.with_values(&robot).unwrap_err().to_string()
    };
    assert!(
        refused(|r| r.joints[1].name = "lift".into())
            .contains("joint `lift` stands where the URDF file has joint `feed`")
    );
    assert!(refused(|r| r.joints[1].a += 0.01).contains("joint `feed` has another frame"));
    assert!(
        refused(|r| drop(r.joints.pop()))
            .contains("the description has 2 joints and the URDF file 3")
    );
    let no_mass = refused(|r| {
        r.joints[2].inertial = Some(Inertial {
            mass: 0.0,
            first_moment: [0.1, 0.0, 0.0],
            inertia: [0.0; 6],
        });
    });
    assert!(
        no_mass.contains("joint `wrist` has a first moment but no mass"),
        "{no_mass}"
    );
}
