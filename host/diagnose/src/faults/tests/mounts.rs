//! Arms with another mounting than described.

use crate::faults::tests::windows::sound_arms;
use crate::faults::tests::*;

/// Returns the description with another direction of gravity.
fn described(robot: &Robot, gravity: [f64; 3]) -> Robot {
    let mut robot = robot.clone();
    robot.gravity = gravity;
    robot
}

/// Asserts that the only fault is one of gravity, with these words.
fn gravity_alone(robot: &Robot, runs: &[Run], words: [&str; 2]) {
    let found = faults(robot, runs).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    println!("{}", found[0].text);
    assert_eq!(
        (found[0].kind.as_str(), found[0].joint.as_str()),
        ("gravity", "")
    );
    for word in words {
        assert!(found[0].text.contains(word), "{word}: {}", found[0].text);
    }
}

#[test]
fn an_arm_that_hangs_or_is_mounted_on_a_wall_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    for (robot, runs) in &sound_arms(folder.path()) {
        let g = 9.81;
        let ceiling = described(robot, [0.0, 0.0, g]);
        gravity_alone(&ceiling, runs, ["by 1", "hang upside down"]);
        for wall in [[g, 0.0, 0.0], [0.0, -g, 0.0]] {
            gravity_alone(&described(robot, wall), runs, ["elsewhere", "on a wall"]);
        }
        // A tilted base is left to the search.
        let leaning = described(robot, [0.3 * g, 0.0, -0.95 * g]);
        let found = faults(&leaning, runs).unwrap();
        assert!(
            found.iter().all(|f| f.kind.as_str() != "gravity"),
            "{found:?}"
        );
    }
}
