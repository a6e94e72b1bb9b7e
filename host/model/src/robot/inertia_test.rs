#![allow(clippy::unwrap_used, clippy::panic)]
use std::path::Path;

use super::super::{EMPS, ONE_LINK_TEMPLATE, Robot, RobotError, TX40, XL330};

fn read(text: &str) -> Result<Robot, RobotError> {
    Robot::from_toml(text, Path::new("robot.toml"))
}

/// Returns the sentence that refuses a description, and the text of the line that it names.
fn refused(text: &str) -> (String, String) {
    match read(text) {
        Err(error @ RobotError::Value { place, .. }) => {
            let line = text.lines().nth(place.line - 1).unwrap();
            (error.to_string(), line.to_owned())
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_drive_with_less_inertia_than_none_is_refused_with_its_line() {
    let text = XL330.replace(
        "gear_ratio = 288.4 ",
        "joint_inertia = -0.002\ngear_ratio = 288.4 ",
    );
    let (sentence, line) = refused(&text);
    assert_eq!(line, "joint_inertia = -0.002");
    for part in ["robot.toml:", "`horn`", "-0.002 kg·m²", "0 or greater"] {
        assert!(sentence.contains(part), "{sentence}");
    }
}

#[test]
fn rotors_count_with_the_inertia_of_their_gear() {
    // 1e-8·288.4² is 8.3e-4 kg·m².
    let with = |own: &str| {
        let drive = format!("joint_inertia = {own}\nrotor_inertia = 1.0e-8\ngear_ratio = 288.4 ");
        read(&XL330.replace("gear_ratio = 288.4 ", &drive))
    };
    assert!(with("-0.0008").is_ok());
    assert!(with("-0.0009").is_err());
}

#[test]
fn a_link_with_less_inertia_about_its_axis_than_none_is_refused() {
    let text = XL330.replace("0.0049, 0.0, 0.0049]", "0.0049, 0.0, -0.0049]");
    let (sentence, line) = refused(&text);
    assert!(line.starts_with("inertia = ["), "{line}");
    assert!(
        sentence.contains("-0.0049 kg·m²") && sentence.contains("Izz"),
        "{sentence}"
    );
    // An element that no motion of the joint shows may be part of a combination.
    assert!(read(&XL330.replace("[0.0, 0.0, 0.0, 0.0049,", "[0.0, 0.0, 0.0, -0.09,")).is_ok());
}

#[test]
fn the_descriptions_of_the_program_are_read() {
    for text in [ONE_LINK_TEMPLATE, EMPS, TX40, XL330] {
        read(text).unwrap();
    }
}

#[test]
fn a_urdf_with_less_inertia_about_the_axis_than_none_is_refused() {
    let urdf = |izz: f64| {
        format!(
            r#"<robot name="arm"><link name="base"/>
<link name="arm"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
<inertia ixx="0.001" iyy="0.001" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint></robot>"#
        )
    };
    let read = |izz: f64| Robot::from_urdf(&urdf(izz), Path::new("arm.urdf"));
    assert!(read(0.001).is_ok());
    let error = read(-0.02).unwrap_err();
    let text = error.to_string();
    for part in ["arm.urdf:", "`shoulder`", "-0.015", "greater than 0"] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn parameters_with_less_drive_inertia_than_none_are_written_without() {
    use rig_shared::multibody::column;
    let robot = read(XL330).unwrap();
    let mut rows = robot.standard_parameters();
    rows[0][column::DRIVE_INERTIA] = -0.003;
    let (written, remarks) = robot.with_parameters(&rows, &robot.motor_parameters());
    assert_eq!(written.standard_parameters()[0][column::DRIVE_INERTIA], 0.0);
    assert!(remarks[0].contains("Drive inertia of joint horn") && remarks[0].contains("-0.003"));
    read(&written.to_toml().unwrap()).unwrap();
}
