//! Right angles written with few digits: the same base parameters as with all digits, and a remark for each.
#![allow(clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;
use std::path::Path;

use crate::{Base, ModelKind, agree, grouped};
use rig_model::robot::{Description, JointKind, Original};

/// Deviation of an angle from a right angle below which it was written with all digits, rad.
const ROUNDING: f64 = 1e-10;

/// One joint: kind, alpha as text, a, theta as text, d.
type Row = (JointKind, String, f64, String, f64);

fn revolute(alpha: &str, a: f64, d: f64) -> Row {
    (JointKind::Revolute, alpha.into(), a, "0.0".into(), d)
}

fn toml(rows: &[Row]) -> String {
    let mut text = String::from("name = \"arm\"\ngravity = [0.0, 0.0, -9.81]\n");
    for (k, (kind, alpha, a, theta, d)) in rows.iter().enumerate() {
        let kind = format!("{kind:?}").to_lowercase();
        let _ = write!(
            text,
            "\n[[joint]]\nname = \"joint_{}\"\nkind = \"{kind}\"\nalpha = {alpha}\na = {a:?}\ntheta = {theta}\nd = {d:?}\n",
            k + 1
        );
    }
    text
}

/// The same chain as URDF: per joint one fixed joint that turns and shifts it along x, and one along z.
fn urdf(rows: &[Row]) -> String {
    let mut text = String::from("<robot name='arm'>\n<link name='l0'/>\n");
    for (k, (kind, alpha, a, theta, d)) in rows.iter().enumerate() {
        let kind = format!("{kind:?}").to_lowercase();
        let _ = writeln!(
            text,
            "<link name='x{n}'/><link name='l{n}'><inertial><origin xyz='0.1 0.02 0.03'/><mass value='2'/>\
             <inertia ixx='0.02' ixy='0' ixz='0' iyy='0.03' iyz='0' izz='0.025'/></inertial></link>\n\
             <joint name='fixed_{n}' type='fixed'><parent link='l{k}'/><child link='x{n}'/>\
             <origin xyz='{a:?} 0 0' rpy='{alpha} 0 0'/></joint>\n\
             <joint name='joint_{n}' type='{kind}'><parent link='x{n}'/><child link='l{n}'/>\
             <origin xyz='0 0 {d:?}' rpy='0 0 {theta}'/><axis xyz='0 0 1'/>\
             <limit lower='-1' upper='1' velocity='1' effort='5'/></joint>",
            n = k + 1
        );
    }
    text + "</robot>\n"
}

fn read(text: &str, ending: &str) -> Description {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join(format!("arm.{ending}"));
    std::fs::write(&path, text).unwrap();
    Description::load(&path).unwrap()
}

fn base(description: &Description) -> Base {
    let base = Base::structural(&description.robot, ModelKind::Differential, 1).unwrap();
    assert!(agree(&base, &grouped(&description.robot).unwrap()));
    base
}

/// A UR5 with right angles written as `right`.
fn ur5(right: &str) -> Vec<Row> {
    vec![
        revolute("0.0", 0.0, 0.0892),
        revolute(right, 0.0, 0.1358),
        revolute("0.0", -0.425, 0.0),
        revolute("0.0", -0.3922, -0.0267),
        revolute(right, 0.0, 0.0947),
        revolute(&format!("-{right}"), 0.0, 0.0823),
    ]
}

const DIGITS: [&str; 7] = [
    "1.5708",
    "1.570796",
    "1.5707963",
    "1.57079633",
    "1.570796327",
    "1.5707963268",
    "1.57079632679",
];

#[test]
fn right_angles_of_few_digits_give_the_base_parameters_of_right_angles() {
    let all = format!("{FRAC_PI_2:?}");
    for (ending, write) in [("toml", toml as fn(&[Row]) -> String), ("urdf", urdf)] {
        let exact = read(&write(&ur5(&all)), ending);
        assert_eq!(exact.remarks, Vec::<String>::new(), "{ending}");
        let expected = base(&exact);
        // 36 inertial, Ia of joints 3 to 6, and viscous friction, Coulomb friction and offset of each.
        assert_eq!(expected.len(), 40 + 18, "{ending}");
        for digits in DIGITS {
            let found = read(&write(&ur5(digits)), ending);
            let base = base(&found);
            assert_eq!(base.columns, expected.columns, "{ending} {digits}");
            let off = (&base.combination - &expected.combination).amax();
            // Lengths of a URDF file lie along axes as written: microns of a metre.
            assert!(off < 1e-5, "{ending} {digits}: {off:e}");
            let value: f64 = digits.parse().unwrap();
            let off = (value - FRAC_PI_2).abs();
            let joints = ["joint_2", "joint_5", "joint_6"];
            let place = format!("arm.{ending}:");
            // A URDF tells all joints in one sentence with the largest distance, a TOML each with its value.
            let expected: Vec<Vec<String>> = match (off > ROUNDING, ending) {
                (false, _) => Vec::new(),
                (true, "toml") => (joints.iter())
                    .map(|joint| vec![(*joint).to_owned(), digits.to_owned()])
                    .collect(),
                (true, _) => {
                    let largest = format!("{} rad off", rig_output::format_significant(off, 2));
                    vec![
                        joints
                            .map(str::to_owned)
                            .into_iter()
                            .chain([largest])
                            .collect(),
                    ]
                }
            };
            assert_eq!(found.remarks.len(), expected.len(), "{:?}", found.remarks);
            for (remark, parts) in found.remarks.iter().zip(expected) {
                for part in parts.iter().chain([&place, &"taken as".to_owned()]) {
                    assert!(remark.contains(part), "`{part}` is not in: {remark}");
                }
            }
        }
    }
}

#[test]
fn a_half_turn_of_few_digits_leaves_axes_parallel() {
    for half in ["3.1416", "3.14159", "3.1415927"] {
        let scara = [revolute(half, 0.0, 0.1), revolute("0.0", 0.4, 0.0)];
        let folded = [revolute("0.0", 0.0, 0.1), revolute(half, 0.4, 0.0)];
        for (ending, write) in [("toml", toml as fn(&[Row]) -> String), ("urdf", urdf)] {
            for (rows, joint) in [(&scara, "joint_1"), (&folded, "joint_2")] {
                let found = read(&write(rows), ending);
                // Vertical axes: Izz, mx and my of the second link, Izz of the first with Ia, Ia of the second.
                assert_eq!(base(&found).len(), 5 + 6, "{ending} {half} {joint}");
                assert!(found.remarks[0].contains(joint), "{:?}", found.remarks);
                for link in &found.robot.joints {
                    assert!(link.a.abs() < 0.5 && link.d.abs() < 0.5, "{link:?}");
                }
            }
        }
    }
}

#[test]
fn the_turn_of_a_slide_is_an_angle_between_axes() {
    let arm = |right: &str, theta: &str| {
        vec![
            revolute("0.0", 0.0, 0.3),
            (JointKind::Prismatic, right.into(), 0.1, theta.into(), 0.2),
            revolute(right, 0.2, 0.1),
            revolute("0.0", 0.3, 0.0),
        ]
    };
    let all = format!("{FRAC_PI_2:?}");
    for (ending, write) in [("toml", toml as fn(&[Row]) -> String), ("urdf", urdf)] {
        let exact = read(&write(&arm(&all, &all)), ending);
        let expected = base(&exact);
        for digits in &DIGITS[..5] {
            let found = read(&write(&arm(&all, digits)), ending);
            assert_eq!(base(&found).columns, expected.columns, "{ending} {digits}");
            assert_eq!(found.remarks.len(), 1, "{ending} {:?}", found.remarks);
            assert!(found.remarks[0].contains("joint_2"), "{:?}", found.remarks);
            let both = read(&write(&arm(digits, digits)), ending);
            assert_eq!(base(&both).columns, expected.columns, "{ending} {digits}");
        }
    }
    // For a revolute joint it is an offset of the position.
    let mut offset = ur5(&all);
    offset[1].3 = DIGITS[0].into();
    let found = read(&toml(&offset), "toml");
    let written: f64 = DIGITS[0].parse().unwrap();
    assert_eq!(found.robot.joints[1].theta, written);
    assert_eq!(found.remarks, Vec::<String>::new());
}

#[test]
fn a_twist_that_was_calibrated_stays() {
    for twist in [1e-3, 1e-4, 6e-5] {
        for right in [0.0, FRAC_PI_2, PI] {
            let alpha = format!("{:?}", right + twist);
            let rows = [
                revolute("0.0", 0.0, 0.1),
                revolute(&alpha, 0.1, 0.2),
                revolute("0.3", 0.4, 0.0),
            ];
            for (ending, write) in [("toml", toml as fn(&[Row]) -> String), ("urdf", urdf)] {
                let found = read(&write(&rows), ending);
                assert_eq!(found.remarks, Vec::<String>::new());
                let alpha = found.robot.joints[1].alpha;
                // The common normal may point either way.
                let turned = (alpha.abs() - (right + twist)).abs();
                let back = (alpha.abs() - (2.0 * PI - right - twist)).abs();
                assert!(
                    turned.min(back) < 1e-9,
                    "{ending}: {alpha} of {}",
                    right + twist
                );
            }
        }
    }
}

/// A joint and the link that it moves, as URDF.
fn moved(n: usize, kind: &str, xyz: &str, rpy: &str) -> String {
    format!(
        r#"<joint name="j{n}" type="{kind}"><parent link="l{}"/><child link="l{n}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="100" velocity="1"/></joint>
<link name="l{n}"><inertial><origin xyz="0.1 0 0"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
"#,
        n - 1
    )
}

fn chain(joints: &[String]) -> String {
    format!(
        "<robot name=\"r\"><link name=\"l0\"/>\n{}</robot>\n",
        joints.concat()
    )
}

/// A lift without a preceding axis: its turn has no reference.
#[test]
fn what_is_written_of_a_slide_goes_back_into_its_urdf() {
    let right = "1.5707963267948966 0 0";
    let text = chain(&[
        moved(1, "prismatic", "0 0 0.5", "0 0 1.5708"),
        moved(2, "revolute", "0 0 0.2", right),
    ]);
    let original = Original::read(text.clone(), Path::new("lift.urdf")).unwrap();
    let written = original.robot().to_toml().unwrap();
    let back = read(&written, "toml");
    assert_eq!(back.remarks, Vec::<String>::new());
    assert_eq!(back.robot.joints, original.robot().joints);
    assert_eq!(original.with_values(&back.robot).unwrap().text, text);
}

/// Axes parallel except for a twist over their distance of 0.4 m: the common normal lies 400 or 4000 m away. The links
/// are unchanged.
#[test]
fn a_common_normal_far_away_is_said_and_no_link_is_taken_for_a_point() {
    let arm = |twist: &str| {
        chain(&[
            moved(1, "revolute", "0 0 0", "0 0 0"),
            moved(2, "revolute", "0 0 0.3", "1.5707963267948966 0 0"),
            moved(3, "revolute", "0.4 0 0", &format!("0 {twist} 0")),
        ])
    };
    assert_eq!(read(&arm("0"), "urdf").remarks, Vec::<String>::new());
    for twist in ["0.001", "0.0001"] {
        let found = read(&arm(twist), "urdf");
        assert!(!found.remarks.is_empty());
        for remark in &found.remarks {
            assert!(remark.contains("common normal lies"), "{remark}");
        }
    }
}
