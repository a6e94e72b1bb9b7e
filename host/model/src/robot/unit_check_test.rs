//! Lengths and inertias in another unit.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use crate::robot::{EDDA_TEMPLATE, ONE_LINK_TEMPLATE, Robot, TX40};

/// Returns the message on a URDF whose second link is at `xyz` with this inertial, or no message.
fn urdf(xyz: &str, inertial: &str) -> Result<Robot, String> {
    let text = format!(
        "<robot name='r'>\n<link name='base'/>\n\
         <link name='upper'><inertial><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>\n\
         <link name='fore'><inertial>\n{inertial}</inertial></link>\n\
         <joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/><axis xyz='0 0 1'/></joint>\n\
         <joint name='elbow' type='continuous'><parent link='upper'/><child link='fore'/><origin xyz='{xyz}'/><axis xyz='0 1 0'/></joint>\n\
         </robot>"
    );
    Robot::from_urdf(&text, Path::new("arm.urdf")).map_err(|e| e.to_string())
}

fn inertial(centre: &str, mass: f64, largest: f64) -> String {
    format!(
        "<mass value='{mass}'/><origin xyz='{centre}'/><inertia ixx='{largest}' ixy='0' ixz='0' iyy='{largest}' iyz='0' izz='{largest}'/>"
    )
}

#[test]
fn a_urdf_in_another_unit_is_refused_by_line() {
    let good = inertial("0.1 0 0", 3.0, 0.04);
    assert!(urdf("0.3 0 0.2", &good).is_ok());
    let cases = [
        (
            urdf("0 0 0", &inertial("0.1 0 0", 3.0, 0.04e9)),
            "arm.urdf:5:",
            "the inertia of link `fore` is up to 4.000·10⁷ kg·m², but at a mass of 3.000 kg that is a radius of gyration of 3651 m",
        ),
        (
            urdf("300 0 0.2", &good),
            "arm.urdf:7:",
            "axis of joint `elbow` from the one before (a) is 300 m",
        ),
        (urdf("0 0 450", &good), "arm.urdf:", "(d) is 450 m"),
        (
            urdf("0 0 0", &inertial("150 0 0", 3.0, 0.04)),
            "arm.urdf:7:",
            "centre of mass of the link of joint `elbow` from its axis is 150.0 m",
        ),
    ];
    for (found, place, words) in cases {
        let message = found.unwrap_err();
        println!("{message}");
        assert!(
            message.starts_with(place) && message.contains(words),
            "{words}: {message}"
        );
    }
    let message = urdf("0 0 0", &inertial("0 0 0", 3.0, 0.04e9)).unwrap_err();
    assert!(
        message.contains("in kg·mm², it would be 40.00, in g·mm² 0.04000"),
        "{message}"
    );
}

/// Axes that a calibration found 10⁻⁴ rad off parallel have a common normal kilometres away.
#[test]
fn axes_that_are_nearly_parallel_are_no_long_links() {
    let text = "<robot name='r'><link name='base'/>\
        <link name='a'><inertial><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>\
        <link name='b'><inertial><origin xyz='0.1 0 0'/><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link>\
        <joint name='one' type='continuous'><parent link='base'/><child link='a'/><axis xyz='0 0 1'/></joint>\
        <joint name='two' type='continuous'><parent link='a'/><child link='b'/><origin xyz='0.3 0.3 0' rpy='0.0002 0 0'/><axis xyz='0 0 1'/></joint>\
        </robot>";
    let robot = Robot::from_urdf(text, Path::new("arm.urdf")).unwrap();
    assert!(robot.joints.iter().any(|j| j.d.abs() > 1000.0));
    let written = robot.to_toml().unwrap();
    assert!(Robot::from_toml(&written, Path::new("arm.toml")).is_ok());
    let urdf = robot.to_urdf().unwrap().text;
    assert!(Robot::from_urdf(&urdf, Path::new("arm.urdf")).is_ok());
}

#[test]
fn toml_in_another_unit_is_refused_by_line() {
    let read = |robot: &Robot| {
        let text = robot.to_toml().unwrap();
        Robot::from_toml(&text, Path::new("arm.toml"))
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    for text in [ONE_LINK_TEMPLATE, EDDA_TEMPLATE, TX40] {
        read(&Robot::from_toml(text, Path::new("arm.toml")).unwrap()).unwrap();
    }
    let tx40 = Robot::from_toml(TX40, Path::new("arm.toml")).unwrap();
    let refused = |change: &dyn Fn(&mut Robot), words: &str| {
        let mut robot = tx40.clone();
        change(&mut robot);
        let message = read(&robot).unwrap_err();
        println!("{message}");
        assert!(
            message.starts_with("arm.toml:") && message.contains(words),
            "{words}: {message}"
        );
    };
    let third = &tx40.joints[2].name;
    refused(
        &|r| {
            r.joints
                .iter_mut()
                .for_each(|j| (j.a, j.d) = (1e3 * j.a, 1e3 * j.d))
        },
        "no link of a robot is 100 m long; it must be in m, and were these mm",
    );
    refused(
        &|r| {
            let own = r.joints[2].inertial.as_mut().unwrap();
            own.inertia = own.inertia.map(|v| 1e9 * v);
        },
        &format!("the inertia of the link of joint `{third}` about its centre of mass is"),
    );
    refused(
        &|r| {
            let own = r.joints[2].inertial.as_mut().unwrap();
            own.first_moment = own.first_moment.map(|v| 1e6 * v);
        },
        &format!("centre of mass of the link of joint `{third}` from its axis is"),
    );
}

#[test]
fn angles_beyond_a_turn_are_refused_by_line() {
    let good = inertial("0.1 0 0", 3.0, 0.04);
    let message = urdf("0.3 0 0.2' rpy='-90 0 0", &good).unwrap_err();
    assert!(
        message.starts_with("arm.urdf:7:")
            && message.contains("`rpy` of <origin> is \"-90 0 0\"")
            && message.contains("were these degrees, it would be \"-1.570796 0.000000 0.000000\""),
        "{message}"
    );
    assert!(urdf("0.3 0 0.2' rpy='-6.2832 0 3.14", &good).is_ok());
}
