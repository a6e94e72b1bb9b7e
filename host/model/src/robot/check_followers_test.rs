//! Each fault of a [[follower]] is named with its line.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use crate::robot::Robot;

const TEXT: &str = "name = 'r'
gravity = [0.0, 0.0, -9.81]
[[joint]]
name = 'a'
kind = 'revolute'
alpha = 0.0
a = 0.0
theta = 0.0
d = 0.0
[[joint]]
name = 'b'
kind = 'revolute'
alpha = 0.0
a = 0.3
theta = 0.0
d = 0.0
[[follower]]
name = 'f'
follows = 'a'
ratio = -1.0
after = 'a'
kind = 'revolute'
alpha = 0.0
a = 0.2
theta = 0.0
d = 0.0
";

fn read(text: &str) -> Result<Robot, String> {
    Robot::from_toml(text, Path::new("r.toml")).map_err(|e| e.to_string())
}

#[test]
fn faults_are_named_with_their_line() {
    let robot = read(TEXT).unwrap();
    assert_eq!(robot.links_outwards(), [0, 2, 1]);
    assert_eq!(robot.chain::<f64>().unwrap().link_count(), 3);
    for (from, to, line, parts) in [
        ("follows = 'a'", "follows = 'x'", 19, ["`x`", "a, b"]),
        (
            "ratio = -1.0",
            "ratio = 0.0",
            20,
            ["ratio of follower `f`", "other than 0"],
        ),
        (
            "ratio = -1.0",
            "ratio = nan",
            20,
            ["ratio of follower `f`", "NaN"],
        ),
        (
            "after = 'a'",
            "after = 'y'",
            21,
            ["`y`", "before the first"],
        ),
        ("name = 'f'", "name = 'b'", 18, ["`b` again", "of its own"]),
        ("name = 'f'", "name = ' '", 18, ["empty", "of its own"]),
        ("a = 0.2", "a = 200.0", 24, ["200 m", "mm"]),
        (
            "alpha = 0.0\na = 0.2",
            "alpha = 90.0\na = 0.2",
            23,
            ["alpha of follower `f`", "degrees"],
        ),
        ("ratio = -1.0", "gear = -1.0", 20, ["gear", "ratio"]),
    ] {
        let message = read(&TEXT.replace(from, to)).unwrap_err();
        assert!(message.starts_with(&format!("r.toml:{line}:")), "{message}");
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
}

#[test]
fn coupled_drives_and_elastic_gears_are_refused_beside_a_follower() {
    let coupled = TEXT.replace(
        "[[follower]]",
        "[joint.drive]\ngear_ratio = 50.0\ncouples = { a = -10.0 }\n[[follower]]",
    );
    let message = read(&coupled).unwrap_err();
    assert!(
        message.contains("drive of joint `b`") && message.contains("follower `f`"),
        "{message}"
    );
    let elastic = format!(
        "{TEXT}[[effect]]\njoint = 'a'\nkind = 'joint_elasticity'\nstiffness = 1000.0\ndamping = 1.0\nlink_friction = 0.5\n"
    );
    let message = read(&elastic).unwrap_err();
    assert!(message.contains("follower `f`"), "{message}");
}
