//! What no law of the library is, and names that stand for several things.

use crate::tests::pendulum::*;

/// Each is near a law of the library over most of the motion.
#[test]
fn what_no_law_is_is_left_whatever_is_named() {
    let brake = Pendulum {
        brake: [0.3, 2.0],
        ..PLAIN
    };
    let crank = Pendulum {
        swinging: 0.08,
        ..PLAIN
    };
    for pendulum in [brake, crank] {
        let (found, _) = pendulum.diagnosed(&described(50.0));
        println!("{:?} {:?}", found.words, found.remainder);
        assert_eq!(found.verdict, Verdict::Remainder, "{:?}", found.words);
    }
}

/// A tilt, a first moment that points elsewhere and another zero are one function of the position of a single joint.
#[test]
fn a_tilt_of_a_single_joint_is_no_certain_name() {
    let mut robot = described(50.0);
    let link = robot.joints[0].inertial.as_mut().unwrap();
    link.first_moment[1] = -0.05 * link.first_moment[0];
    let (found, _) = PLAIN.diagnosed(&robot);
    println!("{:?}", found.words);
    assert_eq!(found.steps[0].effect, "gravity_tilt", "{:?}", found.words);
    let said = |w: &&String| w.contains("a first_moment that points elsewhere");
    assert_eq!(found.words.iter().filter(said).count(), 2);
}
