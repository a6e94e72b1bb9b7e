//! Reading descriptions, and the messages on wrong ones.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use super::*;

fn example() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

fn toml_error(text: &str) -> String {
    Robot::from_toml(text, Path::new("r.toml"))
        .unwrap_err()
        .to_string()
}

fn urdf_error(text: &str) -> String {
    Robot::from_urdf(text, Path::new("r.urdf"))
        .unwrap_err()
        .to_string()
}

/// The template with one line replaced.
fn with(old: &str, new: &str) -> String {
    let lines: Vec<&str> = ONE_LINK_TEMPLATE
        .lines()
        .map(|l| if l.starts_with(old) { new } else { l })
        .collect();
    assert!(
        lines.contains(&new),
        "nothing in the template begins with {old}"
    );
    lines.join("\n")
}

fn line_of(text: &str, part: &str) -> usize {
    text.lines().position(|l| l.contains(part)).unwrap() + 1
}

#[test]
fn shipped_descriptions_read_and_survive_writing() {
    let rig = example();
    assert_eq!(
        rig.joints[0].drive.as_ref().unwrap().encoder_counts_per_rev,
        Some(8192.0)
    );
    let emps = Robot::from_toml(EMPS, Path::new("emps.toml")).unwrap();
    // The slide is along z: gravity must have no component there.
    assert_eq!(
        (emps.gravity[2], emps.joints[0].alpha, emps.joints[0].kind),
        (0.0, 0.0, JointKind::Prismatic)
    );
    for robot in [rig, emps] {
        let text = robot.to_toml().unwrap();
        assert_eq!(Robot::from_toml(&text, Path::new("x.toml")).unwrap(), robot);
    }
}

#[test]
fn everything_optional_survives_writing() {
    let mut robot = example();
    robot.name = "quote \" backslash \\ line\nend".into();
    let joint = &mut robot.joints[0];
    joint.limits.as_mut().unwrap().position = [f64::NEG_INFINITY, f64::INFINITY];
    joint.drive.as_mut().unwrap().torque_constant = 0.0;
    joint.drive.as_mut().unwrap().gear_ratio = -1.0 / 3.0;
    joint.inertial.as_mut().unwrap().mass = 1e9;
    joint.inertial.as_mut().unwrap().inertia =
        [1e-300, -0.0, 0.1 + 0.2, 5e11, -1e-7, 123_456_789.0];
    joint.controller = Some(Controller {
        position_gain: 1.0,
        velocity_gain: 1e-9,
        torque_gain: -2.5,
    });
    let effect: RobotEffect =
        toml::from_str("kind = 'stribeck'\njoint = 'link'\nbreakaway = 0.31\nvelocity = 1e-3\n")
            .unwrap();
    let mut second = effect.clone();
    (second.joint, second.effect.gains[0]) = (None, 0.1 + 0.2);
    robot.effects = vec![effect, second];
    let text = robot.to_toml().unwrap();
    assert_eq!(
        Robot::from_toml(&text, Path::new("x.toml")).unwrap(),
        robot,
        "{text}"
    );
}

#[test]
fn every_written_value_has_its_comment_in_the_joint_s_units() {
    let shipped = [ONE_LINK_TEMPLATE, EDDA_TEMPLATE, IRP6_TEMPLATE, TX40, XL330];
    let load = |text: &str| Robot::from_toml(text, Path::new("x.toml")).unwrap();
    let mut robots: Vec<Robot> = shipped.map(load).to_vec();
    let mut full = robots[4].clone();
    full.workspace = vec![Region {
        joint: full.joints[0].name.clone(),
        point: [0.0; 3],
        min: Some([-1.0; 3]),
        max: Some([1.0; 3]),
        normal: Some([0.0, 0.0, 1.0]),
        beyond: Some(0.1),
    }];
    full.identified = Some(IdentifiedBand {
        cutoff: 20.0,
        rate: 200.0,
        min_speed: vec![0.05],
        torque_lead: 1e-3,
    });
    let joint = &mut full.joints[0];
    joint.friction = Some(JointFriction::default());
    joint.controller = Some(Controller {
        position_gain: 1.0,
        velocity_gain: 2.0,
        torque_gain: 3.0,
    });
    joint.limits.as_mut().unwrap().soft_position = Some([-0.5, 0.5]);
    joint.voltage_controller = Some(VoltageController {
        proportional: 1.0,
        integral: 0.1,
        derivative: 0.2,
        velocity_feedforward: 0.3,
        acceleration_feedforward: 0.4,
        bias: 0.5,
        limit: Some(0.9),
        anti_windup: AntiWindup::Clamping,
        supply: [12.0, -1.0],
    });
    let drive = joint.drive.as_mut().unwrap();
    (
        drive.zero,
        drive.joint_inertia,
        drive.coulomb,
        drive.viscous,
    ) = (0.1, 1e-300, 1e-3, 1e-5);
    drive.duty_full_scale = Some(885.0);
    (drive.inductance, drive.pole_pairs) = (Some(1e-3), Some(7));
    let mut slide = full.clone();
    slide.joints[0].kind = JointKind::Prismatic;
    robots.extend([full, slide]);
    for robot in robots {
        let text = robot.to_toml().unwrap();
        let values = text
            .lines()
            .filter(|l| !l.is_empty() && !l.starts_with('['));
        for line in values {
            let (value, comment) = line.split_once(" # ").unwrap_or((line, ""));
            assert!(value.len() >= 40 && !comment.is_empty(), "{line}");
            assert!(!comment.contains('{'), "{line}");
        }
    }
}

#[test]
fn wrong_toml_is_named_by_line_and_mend() {
    let cases: [(&str, &str, &[&str]); 18] = [
        (
            "mass",
            "mass = -1.0",
            &["mass of joint `link` is -1", "0 or greater, in kg"],
        ),
        ("mass", "mass = nan", &["mass of joint `link` is NaN", "kg"]),
        ("mass", "mass = \"heavy\"", &["heavy", "expected a number"]),
        ("mass", "mas = 1.0", &["unknown field `mas`", "mass"]),
        (
            "gear_ratio",
            "gear_ratio = 0",
            &["gear ratio of joint `link` is 0", "different from 0"],
        ),
        (
            "torque_constant",
            "torque_constant = 0.0",
            &["torque constant", "greater than 0"],
        ),
        (
            "resistance",
            "resistance = -0.1",
            &["resistance", "greater than 0, in Ω"],
        ),
        (
            "position",
            "position = [3.1, -3.1]",
            &["[3.1, -3.1]", "[lowest, highest]"],
        ),
        ("position", "position = [1.0, 1.0]", &["position range"]),
        ("position", "position = [-1.0, inf]", &["position range"]),
        (
            "first_moment",
            "first_moment = [0.3, 0.0]",
            &["length 2", "3"],
        ),
        (
            "first_moment",
            "first_moment = [0.3, inf, 0.0]",
            &["first_moment of joint `link` is inf"],
        ),
        (
            "kind",
            "kind = \"linear\"",
            &["linear", "revolute", "prismatic"],
        ),
        ("velocity", "velocity = 0.0", &["velocity limit", "rad/s"]),
        (
            "first_moment",
            "first_moment = [1e200, 0.0, 0.0]",
            &["first_moment of joint `link` is 1e200", "at most 1e12"],
        ),
        (
            "gravity",
            "gravity = [0.0, nan, -9.81]",
            &["gravity is NaN", "m/s²"],
        ),
        ("alpha", "alpha = 1.5 rad", &["TOML"]),
        (
            "alpha",
            "alpha = twenty",
            &["no TOML value", "a number like 20"],
        ),
    ];
    for (old, new, parts) in cases {
        let text = with(old, new);
        let message = toml_error(&text);
        let place = format!("r.toml:{}:", line_of(&text, new));
        assert!(message.starts_with(&place), "{new}: {message}");
        assert!(!message.contains('\n'), "{new}: {message}");
        for part in parts {
            assert!(message.contains(part), "{new}: {message}");
        }
    }
}

#[test]
fn missing_and_repeated_parts_are_named() {
    let message = toml_error(&with("alpha", "# gone"));
    assert!(message.contains("missing field `alpha`"), "{message}");
    assert_eq!(
        message.split(':').nth(1).unwrap(),
        line_of(ONE_LINK_TEMPLATE, "[[joint]]").to_string(),
        "{message}"
    );
    assert!(toml_error("name = 'x'\ngravity = [0, 0, 0]\n").contains("missing field `joint`"));
    assert!(
        toml_error("name = 'x'\ngravity = [0, 0, 0]\njoint = []\n")
            .contains("at least one [[joint]]")
    );
    let joint = ONE_LINK_TEMPLATE.split_once("[[joint]]").unwrap().1;
    let twice = format!("{ONE_LINK_TEMPLATE}\n[[joint]]{joint}");
    let message = toml_error(&twice);
    assert!(message.contains("`link` again"), "{message}");
    let effect = |body: &str| toml_error(&format!("{ONE_LINK_TEMPLATE}\n[[effect]]\n{body}\n"));
    assert!(effect("kind = 'magic'").contains("`magic`, but it must be one of stribeck"));
    assert!(effect("joint = 'link'").contains("kind of effect 1 is missing"));
    assert!(
        effect("kind = 'torque_offset'\noffset = 1\njoint = 'elbow'").contains("joints are link")
    );
}

#[test]
fn wrong_files_are_refused_without_reading_them_through() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Robot::load(&path).unwrap_err()
    };
    assert!(matches!(
        Robot::load(dir.path()).unwrap_err(),
        RobotError::Directory { .. }
    ));
    assert!(matches!(
        Robot::load(&dir.path().join("none.toml")).unwrap_err(),
        RobotError::Read { .. }
    ));
    assert!(matches!(file("a.toml", b""), RobotError::Empty { .. }));
    assert!(matches!(file("a.toml", b" \n\n"), RobotError::Empty { .. }));
    assert!(matches!(
        file("a.toml", &[0x7f, b'E', b'L', b'F', 2, 0]),
        RobotError::NotText { offset: 4, .. }
    ));
    assert!(matches!(
        file("a.urdf", &[b'<', 0xff, 0xfe]),
        RobotError::NotText { offset: 1, .. }
    ));
    let huge = dir.path().join("huge.toml");
    std::fs::File::create(&huge)
        .unwrap()
        .set_len(2 << 30)
        .unwrap();
    assert!(matches!(
        Robot::load(&huge).unwrap_err(),
        RobotError::TooLarge { .. }
    ));
    // An unknown extension: the content decides.
    let path = dir.path().join("robot.txt");
    std::fs::write(&path, format!("\u{feff}{ONE_LINK_TEMPLATE}")).unwrap();
    assert_eq!(Robot::load(&path).unwrap(), example());
    std::fs::write(&path, "<robot/>").unwrap();
    assert!(matches!(
        Robot::load(&path).unwrap_err(),
        RobotError::Urdf { .. }
    ));
}

const LINK: &str = "<link name='NAME'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>";

fn urdf(body: &str) -> String {
    let mut text = String::from("<robot name='r'>\n<link name='base'/>\n");
    for name in ["a", "b"] {
        text += &LINK.replace("NAME", name);
        text.push('\n');
    }
    format!("{text}{body}\n</robot>")
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        "<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>{more}</joint>\n"
    )
}

/// ROS 1, ROS 2 and Drake state ratios. A value of 1 beside another is ignored; two different values are refused.
#[test]
fn gear_ratios_are_read_in_every_form() {
    let read = |transmission: &str| {
        let text = urdf(&format!(
            "{}{}{transmission}",
            joint("one", "continuous", "base", "a", ""),
            joint("two", "continuous", "a", "b", "")
        ));
        let robot = Robot::from_urdf(&text, Path::new("r.urdf"));
        robot.map(|robot| robot.joints[0].drive.as_ref().map(|drive| drive.gear_ratio))
    };
    let ros_2 = |of_actuator: &str, of_joint: &str| {
        format!(
            "<ros2_control name='c' type='system'>\n<transmission name='t'><actuator name='m'>{of_actuator}</actuator>\n<joint name='one'>{of_joint}</joint></transmission></ros2_control>"
        )
    };
    let reduction = |value: f64| format!("<mechanical_reduction>{value}</mechanical_reduction>");
    for transmission in [
        ros_2("", &reduction(50.0)),
        ros_2(&reduction(1.0), &reduction(50.0)),
        ros_2(&reduction(50.0), &reduction(50.0)),
        ros_2("", "<param name='mechanical_reduction'>50</param>"),
        "<transmission name='t'><joint name='one'/><actuator name='m'><mechanicalReduction>1</mechanicalReduction><drake:gear_ratio xmlns:drake='d' value='50'/></actuator></transmission>".to_owned(),
    ] {
        assert_eq!(read(&transmission).unwrap(), Some(50.0), "{transmission}");
    }
    let two = read(&ros_2(&reduction(60.0), &reduction(50.0))).unwrap_err();
    let two = two.to_string();
    assert!(
        two.contains("r.urdf:9:19") && two.contains("60 at 8:"),
        "{two}"
    );
    for conflict in [
        ros_2("", &reduction(60.0)) + &ros_2("", &reduction(50.0)).replace("name='t'", "name='u'"),
        "<transmission name='t'><joint name='one'/><actuator name='m'><mechanicalReduction>40</mechanicalReduction><drake:gear_ratio xmlns:drake='d' value='50'/></actuator></transmission>".to_owned(),
        "<transmission name='t'><joint name='one'/><actuator name='m'><mechanicalReduction>40</mechanicalReduction></actuator></transmission><transmission name='u'><joint name='one'/><actuator name='n'><mechanicalReduction>-40</mechanicalReduction></actuator></transmission>".to_owned(),
    ] {
        let message = read(&conflict).unwrap_err().to_string();
        assert!(
            message.contains("give a joint one reduction") && message.contains("r.urdf:"),
            "{message}"
        );
    }
    // A joint that another file describes.
    let other = ros_2("", &reduction(50.0)).replace("'one'", "'gripper'");
    assert_eq!(read(&other).unwrap(), None);
}

#[test]
fn urdf_drives_friction_and_limits_are_kept() {
    let text = urdf(&format!(
        "{}{}<transmission name='t'><joint name='one'/><actuator name='m'><mechanicalReduction>-50</mechanicalReduction></actuator></transmission>",
        joint(
            "one",
            "revolute",
            "base",
            "a",
            "<axis xyz='0 0 2'/><limit lower='-1' upper='2' velocity='3' effort='4'/><dynamics damping='0.5' friction='0.25'/>"
        ),
        joint("two", "prismatic", "a", "b", "")
    ));
    let robot = Robot::from_urdf(&text, Path::new("r.urdf")).unwrap();
    let [one, two] = robot.joints.as_slice() else {
        panic!("two joints expected")
    };
    assert_eq!(
        one.limits,
        Some(JointLimits {
            position: [-1.0, 2.0],
            soft_position: None,
            velocity: 3.0,
            acceleration: None,
            torque: Some(4.0)
        })
    );
    assert_eq!(
        one.friction,
        Some(JointFriction {
            coulomb: 0.25,
            viscous: 0.5,
            offset: 0.0
        })
    );
    assert_eq!(one.drive.as_ref().map(|d| d.gear_ratio), Some(-50.0));
    assert_eq!((one.gear_ratio(), two.gear_ratio()), (-50.0, 1.0));
    assert_eq!(one.kind.units(), ("rad", "N*m"));
    assert_eq!(two.kind.units(), ("m", "N"));
    assert_eq!(
        (two.kind, &two.limits, &two.friction, &two.drive),
        (JointKind::Prismatic, &None, &None, &None)
    );
    let text = robot.to_toml().unwrap();
    let mut read_back = Robot::from_toml(&text, Path::new("x.toml")).unwrap();
    // TOML does not store the origin of the values.
    assert_ne!(read_back.origin, robot.origin);
    read_back.origin = robot.origin;
    assert_eq!(read_back, robot);
}

#[test]
fn what_is_no_serial_chain_is_refused_by_name() {
    let one = joint("one", "continuous", "base", "a", "");
    let cases: [(String, &[&str]); 13] = [
        (
            urdf(&(one.clone() + &joint("two", "revolute", "base", "b", ""))),
            &[
                "branches at link `base`",
                "`one` and `two` leave",
                "--tip a",
                "--tip b",
            ],
        ),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "a", "b", "<mimic joint='two'/>"))),
            &["`two` mimics itself"],
        ),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "a", "c", ""))),
            &["link `c`", "does not describe"],
        ),
        (urdf(&one), &["`base` and `b`", "one base"]),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "b", "a", ""))),
            &["closed loop", "`one`", "`two`"],
        ),
        (
            urdf(&(one.clone() + &one)),
            &["joint `one` was already described at 5:1"],
        ),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "a", "b", "<axis xyz='0 0 0'/>"))),
            &["axis of joint `two` is the zero vector"],
        ),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "a", "b", "<axis xyz='0 1'/>"))),
            &["three numbers"],
        ),
        (
            urdf(&(one.clone() + &joint("two", "revolute", "a", "b", "<origin xyz='0 ${l} 1'/>"))),
            &["run xacro"],
        ),
        (
            urdf(
                &(one.clone()
                    + &joint(
                        "two",
                        "revolute",
                        "a",
                        "b",
                        "<limit lower='1' upper='1' velocity='1' effort='1'/>",
                    )),
            ),
            &["lower must be below upper"],
        ),
        (
            urdf(
                &(one.clone()
                    + &joint(
                        "two",
                        "revolute",
                        "a",
                        "b",
                        "<limit lower='0' upper='1' velocity='-1' effort='1'/>",
                    )),
            ),
            &["velocity limit of joint `two` is -1"],
        ),
        ("<html></html>".into(), &["<html>", "<robot>"]),
        ("<robot name='x'><link".into(), &["not well-formed XML"]),
    ];
    for (text, parts) in cases {
        let message = urdf_error(&text);
        assert!(
            message.starts_with("r.urdf:") && !message.contains('\n'),
            "{message}"
        );
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
    // A loop beside the base, and one that includes the base.
    let beside = joint("one", "revolute", "a", "b", "") + &joint("two", "revolute", "b", "a", "");
    let through = one.clone()
        + &joint("two", "fixed", "a", "b", "")
        + &joint("three", "revolute", "b", "base", "");
    for (text, names) in [(beside, "`two`, `one`"), (through, "`two`, `three`, `one`")] {
        let message = urdf_error(&urdf(&text));
        assert!(
            message.contains(&format!("joints {names} form a closed loop")),
            "{message}"
        );
    }
    let all_fixed = joint("one", "fixed", "base", "a", "") + &joint("two", "fixed", "a", "b", "");
    assert!(urdf_error(&urdf(&all_fixed)).contains("no movable joint"));
}

#[test]
fn a_mass_below_zero_is_refused() {
    let text = "<robot name='r'>\n<link name='base'/>\n<link name='arm'/>\n<joint name='one' type='continuous'><parent link='base'/><child link='arm'/></joint>\n</robot>";
    let negative = text.replace(
        "<link name='arm'/>",
        "<link name='arm'><inertial><mass value='-1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>",
    );
    assert!(urdf_error(&negative).contains("mass of link `arm` is -1"));
}

#[test]
fn what_xacro_has_not_expanded_is_refused_where_it_matters() {
    let one = joint("one", "continuous", "base", "a", "");
    let two = joint("two", "continuous", "a", "b", "");
    let whole = urdf(&(one.clone() + &two));
    assert!(Robot::from_urdf(&whole, Path::new("r.urdf")).is_ok());
    let message = urdf_error(&urdf(&(one.clone() + "<xacro:arm side='left'/>")));
    assert!(
        message.starts_with("r.urdf:6:2: ") && message.contains("run xacro over the file first"),
        "{message}"
    );
    let declared = |text: &str| {
        let root = "<robot name='r' xmlns:xacro='http://www.ros.org/wiki/xacro'>";
        text.replace("<robot name='r'>", root)
    };
    let with_element = declared(&urdf(&(one.clone() + "<xacro:arm side='left'/>")));
    let message = urdf_error(&with_element);
    assert!(
        message.contains("this is <xacro:arm>") && message.contains("run xacro"),
        "{message}"
    );
    let message = urdf_error(&whole.replace("name='two'", "name='${side}_two'"));
    assert!(
        message.contains("`name` of <joint> is \"${side}_two\"") && message.contains("run xacro"),
        "{message}"
    );
    // Macros that xacro leaves, and text that other programs expand.
    let mesh = "<visual><geometry><mesh filename='$(find arm)/a.stl'/></geometry></visual></link>";
    let left = declared(&whole).replacen("</link>", mesh, 1);
    assert!(left.contains("$(find"));
    assert!(Robot::from_urdf(&left, Path::new("r.urdf")).is_ok());
}

#[test]
fn a_transmission_of_no_joint_is_named() {
    let text = urdf(&format!(
        "{}{}<transmission name='t'><joint name='onne'/></transmission>",
        joint("one", "continuous", "base", "a", ""),
        joint("two", "continuous", "a", "b", "")
    ));
    let message = urdf_error(&text);
    assert!(
        message.starts_with("r.urdf:7:") && message.contains("names joint `onne`"),
        "{message}"
    );
}

#[test]
fn a_robot_of_too_many_joints_is_refused_with_its_file() {
    let bare = |k: usize| Joint::new(&format!("j{k}"), JointKind::Revolute, [0.0; 4]);
    let robot = Robot::new("long", (0..17).map(bare).collect());
    let text = robot.to_toml().unwrap();
    let message = toml_error(&text);
    let line = line_of(&text, "name = \"j16\"") - 1;
    assert!(
        message.contains(&format!(":{line}:"))
            && message.contains("the number of joints is 17, but a robot has at most 16"),
        "{message}"
    );
    let mut body = String::new();
    for k in 0..17 {
        let parent = match k {
            0 => "base".to_owned(),
            _ => format!("l{}", k - 1),
        };
        body += &LINK.replace("NAME", &format!("l{k}"));
        body += &joint(
            &format!("j{k}"),
            "continuous",
            &parent,
            &format!("l{k}"),
            "",
        );
    }
    let message = urdf_error(&format!(
        "<robot name='r'><link name='base'/>{body}</robot>"
    ));
    assert!(
        message.starts_with("r.urdf:")
            && message.contains("joint 17")
            && message.contains("at most 16"),
        "{message}"
    );
}

#[test]
fn an_alpha_in_degrees_is_refused() {
    for (line, right) in [("alpha = 90.0", "1.570796"), ("alpha = -180", "-3.141593")] {
        let text = with("alpha", line);
        let message = toml_error(&text);
        let at = format!(":{}:", line_of(&text, line));
        assert!(
            message.contains(&at) && message.contains("in rad") && message.contains(right),
            "{message}"
        );
    }
    assert!(Robot::from_toml(&with("alpha", "alpha = 6.28"), Path::new("r.toml")).is_ok());
}

/// A full 3 x 3 matrix orders its numbers differently from the six of a symmetric one.
#[test]
fn lists_with_surplus_numbers_are_refused() {
    for (right, wrong, length) in [
        (
            "gravity = [0.0, 0.0, -9.81]",
            "gravity = [0.0, 0.0, -9.81, 0.0]",
            4,
        ),
        ("position = [", "position = [-9.0, ", 3),
    ] {
        assert!(ONE_LINK_TEMPLATE.contains(right), "{right}");
        let text = ONE_LINK_TEMPLATE.replacen(right, wrong, 1);
        let error = Robot::from_toml(&text, Path::new("x.toml"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains(&format!("invalid length {length}")),
            "{error}"
        );
    }
}
