//! Possible and impossible bodies.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use super::{SpatialInertia, is_taken};
use crate::robot::{
    Description, EDDA_TEMPLATE, EMPS, IRP6_TEMPLATE, JointLimits, ONE_LINK_TEMPLATE, Original,
    Robot, TX40, XL330,
};

fn remarks(inertial: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    let link = |name: &str, inertial: &str| {
        format!("<link name='{name}'><inertial>{inertial}</inertial></link>")
    };
    let good = "<mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/>";
    let joint = |name: &str, parent: &str, child: &str, axis: &str| {
        format!(
            "<joint name='{name}' type='continuous'><parent link='{parent}'/><child link='{child}'/><axis xyz='{axis}'/></joint>"
        )
    };
    let text = format!(
        "<robot name='r'><link name='base'/>{}{}{}{}</robot>",
        link("upper", good),
        link("fore", inertial),
        joint("shoulder", "base", "upper", "0 0 1"),
        joint("elbow", "upper", "fore", "0 1 0"),
    );
    std::fs::write(&path, text).unwrap();
    Description::load(&path).unwrap().remarks
}

#[test]
fn what_no_body_has_is_named_by_link_and_joint() {
    let inertia = |i: [f64; 3]| {
        format!(
            "<mass value='2'/><origin xyz='0.1 0.2 0.3' rpy='0.3 0.2 0.1'/><inertia ixx='{}' ixy='0' ixz='0' iyy='{}' iyz='0' izz='{}'/>",
            i[0], i[1], i[2]
        )
    };
    for (text, words) in [
        (inertia([0.0, 0.0, 0.0]), "no inertia about its centre"),
        (inertia([0.1, 0.1, 0.3]), "0.1000, 0.1000 and 0.3000 kg"),
        (
            inertia([0.1, -0.05, 0.1]),
            "below zero about its centre of mass, −0.05000 kg",
        ),
        (
            inertia([0.1, 0.2, 0.05]).replace("'2'", "'0'"),
            "mass 0, but",
        ),
        (
            inertia([0.0, 0.0, 0.0]).replace("'2'", "'0'"),
            "neither mass nor",
        ),
    ] {
        let remarks = remarks(&text);
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        assert!(
            remarks[0].starts_with("Link `fore`, moved by joint `elbow`,")
                && remarks[0].contains(words),
            "{words}: {remarks:?}"
        );
    }
    // A thin plate, rounded to three digits, and a rod.
    for possible in [[0.1, 0.2, 0.302], [0.1, 0.1, 0.0]] {
        assert_eq!(remarks(&inertia(possible)), [""; 0]);
    }
}

#[test]
fn what_a_motion_does_not_show_may_stay_open() {
    for text in [ONE_LINK_TEMPLATE, EDDA_TEMPLATE, IRP6_TEMPLATE, EMPS, XL330] {
        let robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
        assert_eq!(robot.implausible_bodies(None), [""; 0], "{}", robot.name);
    }
    // As published: the last link is a point mass.
    let tx40 = Robot::from_toml(TX40, Path::new("r.toml")).unwrap();
    let remarks = tx40.implausible_bodies(None);
    assert!(
        remarks.len() == 1 && remarks[0].contains("joint `joint_6` has no inertia"),
        "{remarks:?}"
    );
    let mut robot = Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("r.toml")).unwrap();
    // Less than the moment of its own mass at its centre of mass about the axis.
    robot.joints[0].inertial.as_mut().unwrap().inertia[5] = 0.01;
    let remarks = robot.implausible_bodies(None);
    assert!(
        remarks.len() == 1 && remarks[0].contains("joint `link` has a moment of inertia of −0.0"),
        "{remarks:?}"
    );
}

#[test]
fn placeholders_of_exporters_are_no_limits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    let load = |limit: &str| {
        let text = format!(
            "<robot name='r'><link name='base'/><link name='arm'><inertial><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial></link><joint name='one' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/><limit {limit}/></joint></robot>"
        );
        std::fs::write(&path, text).unwrap();
        Description::load(&path)
    };
    for effort in ["0", "10000", "1e6", "99999", "2500000"] {
        let read = load(&format!(
            "lower='-1' upper='1' velocity='2' effort='{effort}'"
        ))
        .unwrap();
        assert_eq!(read.robot.joints[0].limits.as_ref().unwrap().torque, None);
        assert!(
            read.remarks.len() == 1
                && read.remarks[0].contains("joint `one` looks like a placeholder"),
            "{:?}",
            read.remarks
        );
    }
    for effort in [87.0, 1000.0, 12000.0] {
        let read = load(&format!(
            "lower='-1' upper='1' velocity='2' effort='{effort}'"
        ))
        .unwrap();
        assert_eq!(
            read.robot.joints[0].limits.as_ref().unwrap().torque,
            Some(effort)
        );
        assert_eq!(read.remarks, [""; 0]);
    }
    let read = load("lower='0' upper='0' velocity='0' effort='0'").unwrap();
    assert_eq!(read.robot.joints[0].limits, None);
    assert!(
        read.remarks[0].contains("zero throughout"),
        "{:?}",
        read.remarks
    );
    assert!(
        load("lower='-1' upper='1' velocity='2' effort='-3'")
            .unwrap_err()
            .to_string()
            .contains("effort limit of joint `one` is -3")
    );
}

/// Published files have `velocity="0"`, none at all, or a range of 0 to 0 beside a speed.
#[test]
fn unknown_limits_of_all_joints_are_told_in_one_sentence() {
    let read = |limit: &str| {
        let inertial = "<inertial><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' izz='0.1'/></inertial>";
        let joint = |name: &str, parent: &str, child: &str| {
            format!(
                "<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/><axis xyz='0 0 1'/>\n<limit {limit}/></joint>"
            )
        };
        let text = format!(
            "<robot name='r'><link name='base'/><link name='a'>{inertial}</link><link name='b'>{inertial}</link>{}{}</robot>",
            joint("one", "base", "a"),
            joint("two", "a", "b")
        );
        Original::read(text, Path::new("r.urdf"))
    };
    for (limit, words) in [
        (
            "lower='-1' upper='1' velocity='0' effort='3'",
            "the velocity limits of joints `one` and `two` are 0, so",
        ),
        (
            "lower='-1' upper='1' velocity='0' effort='0'",
            "neither the velocity nor the effort limits of joints `one` and `two` are stated",
        ),
        (
            "lower='-1' upper='1' effort='3'",
            "<limit> of joints `one` and `two` has no `velocity`, so",
        ),
        (
            "lower='0' upper='0' velocity='2' effort='3'",
            "of joints `one` and `two` are both 0, so",
        ),
        (
            "velocity='2' effort='3'",
            "of joints `one` and `two` are both 0, so",
        ),
        (
            "effort='0' velocity='0'",
            "<limit> of joints `one` and `two` is zero throughout",
        ),
    ] {
        let original = read(limit).unwrap();
        let [remark] = original.remarks() else {
            unreachable!("{limit}: {:?}", original.remarks())
        };
        assert!(
            remark.starts_with("r.urdf:2:1: ") && remark.contains(words),
            "{limit}: {remark}"
        );
        // A stated range stays; the speed is not known.
        let ranged = limit.contains("upper='1'");
        for own in &original.robot().joints {
            let range = own.limits.as_ref().map(|own| own.position);
            assert_eq!(range, ranged.then_some([-1.0, 1.0]), "{limit}");
            let speed = own.limits.as_ref().and_then(JointLimits::known_velocity);
            assert_eq!(speed, None, "{limit}");
            let torque = own.limits.as_ref().and_then(|own| own.torque);
            let known = ranged && limit.contains("effort='3'");
            assert_eq!(torque, known.then_some(3.0), "{limit}");
        }
        // The TOML has a line for the speed, and is read again without it.
        let draft = original.robot().to_toml_draft(&[]).unwrap();
        assert_eq!(draft.matches("# velocity =").count(), 2, "{draft}");
        let again = Robot::from_toml(&draft, Path::new("r.toml")).unwrap();
        assert_eq!(again.joints[0].limits, original.robot().joints[0].limits);
    }
    let original = read("lower='-1' upper='1' velocity='2' effort='0'").unwrap();
    let [remark] = original.remarks() else {
        unreachable!("{:?}", original.remarks())
    };
    assert!(
        remark.contains("the effort limits 0 of joints `one` and `two` look like placeholders"),
        "{remark}"
    );
    for (limit, words) in [
        (
            "lower='-1' upper='1' velocity='-2' effort='3'",
            "velocity limit of joint `one` is -2",
        ),
        (
            "lower='1' upper='-1' velocity='0' effort='3'",
            "lower must be below upper",
        ),
        (
            "lower='1' upper='1' velocity='2' effort='3'",
            "lower must be below upper",
        ),
    ] {
        let message = read(limit).unwrap_err().to_string();
        assert!(message.contains(words), "{limit}: {message}");
    }
}

/// A written link is a possible body if the motion leaves that open; otherwise a remark names it. A test of the writer
/// checks that the motion is the same.
#[test]
fn links_that_a_urdf_is_written_with_are_bodies_or_named() {
    for (text, refused) in [
        (ONE_LINK_TEMPLATE, 0),
        (EMPS, 0),
        (XL330, 0),
        (EDDA_TEMPLATE, 0),
        (IRP6_TEMPLATE, 0),
        (TX40, 1),
    ] {
        let mut robot = Robot::from_toml(text, Path::new("r.toml")).unwrap();
        for joint in &mut robot.joints {
            // As identified: only the mass of a slide.
            joint.inertial.get_or_insert(crate::robot::Inertial {
                mass: 95.0,
                first_moment: [0.0; 3],
                inertia: [0.0; 6],
            });
        }
        let urdf = robot.to_urdf().unwrap();
        let named = urdf
            .remarks
            .iter()
            .filter(|r| r.contains("will refuse"))
            .count();
        assert_eq!(named > 0, refused > 0, "{}: {:?}", robot.name, urdf.remarks);
        let read = Robot::from_urdf(&urdf.text, Path::new("r.urdf")).unwrap();
        if named == 0 {
            for joint in &read.joints {
                let body = SpatialInertia::of(joint.inertial.as_ref().unwrap());
                assert!(is_taken(&body), "{}: {:?}", robot.name, joint.inertial);
            }
        }
    }
}

/// An arm whose angles have four decimals, and whose links have no inertia, is told in one note of each kind.
#[test]
fn rounded_angles_and_massless_links_are_one_note_each() {
    let mut text = "<robot name='r'><link name='l0'/>".to_owned();
    for k in 1..=6 {
        let tilt = if k % 2 == 0 { "1.5708" } else { "-1.5708" };
        text += &format!(
            "<link name='l{k}'/><joint name='j{k}' type='continuous'><parent link='l{}'/><child link='l{k}'/><origin xyz='0 0.1 0.3' rpy='{tilt} 0 0'/><axis xyz='0 0 1'/></joint>\n",
            k - 1
        );
    }
    text += "</robot>";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    std::fs::write(&path, text).unwrap();
    let read = Description::load(&path).unwrap();
    let [angles, massless] = read.notes.as_slice() else {
        unreachable!("{:?}", read.notes)
    };
    assert!(
        angles.contains(
            "the axes of joints `j1`, `j2`, `j3`, `j4`, `j5` and `j6` are up to 3.7·10⁻⁶ rad off"
        ),
        "{angles}"
    );
    assert!(
        massless.starts_with("Links `l1`, `l2`, `l3`, `l4`, `l5` and `l6`, moved by joints `j1`"),
        "{massless}"
    );
    // They are remarks, too; the last massless link asks for a decision and is no note.
    assert!(read.notes.iter().all(|own| read.remarks.contains(own)));
    let others = read.remarks.iter().filter(|own| !read.notes.contains(own));
    let others: Vec<&String> = others.collect();
    assert!(
        others.len() == 1 && others[0].contains("the last link `l6` has no mass"),
        "{others:?}"
    );
}
