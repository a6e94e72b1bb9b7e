//! Motions of arms whose drives turn several axes.

use super::*;

/// The arm of tests/mimic; the axes that follow, `joint3` and `joint5`, have narrower limits than their joints.
fn narrowed() -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/mimic/robot.urdf");
    let text = std::fs::read_to_string(&path).unwrap();
    let wide = "lower=\"-3.2\" upper=\"3.2\" velocity=\"20\" effort=\"10000.0\"";
    let parts: Vec<&str> = text.split(wide).collect();
    assert_eq!(parts.len(), 7);
    let own = |lower: f64, upper: f64, velocity: f64| {
        format!("lower=\"{lower}\" upper=\"{upper}\" velocity=\"{velocity}\" effort=\"400\"")
    };
    let joint = || own(-3.0, 3.0, 3.0);
    let limits = [
        joint(),
        joint(),
        own(-0.5, 0.9, 1.5),
        joint(),
        own(-0.15, 0.45, 0.6),
        joint(),
    ];
    let mut narrow = parts[0].to_owned();
    for (limits, part) in limits.iter().zip(&parts[1..]) {
        narrow = narrow + limits + part;
    }
    Robot::from_urdf(&narrow, &path).unwrap()
}

/// `joint3` is at −1 times `joint2`, and `joint5` at half of `joint4` plus 0.1 m.
#[test]
fn axes_that_follow_joints_stay_within_their_own_limits() {
    let robot = narrowed();
    let options = Options {
        harmonics: 3,
        starts: 2,
        ..quick(Criterion::Determinant)
    };
    let found = designed(&robot, &options);
    let reach = sampled_reach(&robot, &found.file);
    let [low, high, fast, ..] = reach[1];
    assert!(
        -0.5 <= -high && -low <= 0.9 && fast <= 1.5,
        "{low} {high} {fast}"
    );
    let first = (high - low) / 1.4;
    let [low, high, fast, ..] = reach[2];
    let [low, high, fast] = [0.5 * low + 0.1, 0.5 * high + 0.1, 0.5 * fast];
    assert!(
        -0.15 <= low && high <= 0.45 && fast <= 0.6,
        "{low} {high} {fast}"
    );
    let second = (high - low) / 0.6;
    println!("shares of the ranges of both followers: {first} {second}");
    // A good motion uses the room that is there.
    assert!(first > 0.5 && second > 0.5, "{first} {second}");
}
