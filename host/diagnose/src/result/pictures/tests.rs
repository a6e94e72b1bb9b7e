//! Pictures of a known gap.

#![allow(clippy::unwrap_used)]

use crate::Options;
use crate::outcome::Detectable;
use crate::tests::made::Diagnosed as _;
use rig_scenario::{Effect, Hidden, Scenario};

/// Weakening friction shows over the speed: only before the step does the residual leave its band. With the effect, the
/// hold-out's curves are closer.
#[test]
fn weakening_friction_is_drawn_over_the_speed() {
    let effect = Effect::Stribeck {
        ratio: 1.7,
        velocity: 0.1,
    };
    let made = Scenario {
        seconds: [40.0, 20.0],
        ..Scenario::new(vec![Hidden { joint: 0, effect }], 3)
    }
    .make()
    .unwrap();
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    assert_eq!(found.steps[0].effect, "stribeck");
    let map = found.maps.iter().find(|m| m.step == Some(0)).unwrap();
    assert_eq!(map.coordinate, "velocity");
    assert!(map.at.windows(2).all(|w| w[0] <= w[1]));
    let off = |list: &[[f64; 2]]| list.iter().filter(|v| v[0].abs() > v[1]).count();
    assert!(off(&map.before) > map.at.len() / 2, "{:?}", map.before);
    let size = |list: &[[f64; 2]]| list.iter().map(|v| v[0] * v[0]).sum::<f64>();
    assert!(size(&map.after) < 0.3 * size(&map.before), "{map:?}");
    assert!(found.maps.iter().any(|m| m.step.is_none()));

    let curves = &found.curves[0];
    assert_eq!(curves.recording, "holdout");
    assert!((3.0..=4.1).contains(&(curves.t[curves.t.len() - 1] - curves.t[0])));
    let error = |k: usize| -> f64 {
        let pairs = curves.torque[0].iter().zip(&curves.torque[k]);
        pairs
            .filter(|(_, b)| b.is_finite())
            .map(|(a, b)| (a - b).powi(2))
            .sum()
    };
    assert!(error(2) < 0.5 * error(1), "{} {}", error(1), error(2));

    // Sentences with figures, and limits of the data.
    assert!(found.words.iter().any(|w| w.contains("stribeck at joint")));
    assert!(found.steps[0].why.contains("hold-out"));
    assert!(found.noise_floor_how.contains("train and repeat"));
    let untestable = |name: &str| found.not_testable.iter().any(|t| t.effect == name);
    // The emulated rig records its voltage, which shows a dead zone.
    assert!(!untestable("drive_deadzone"));
    let volts = |d: &Detectable| d.effect == "drive_deadzone" && d.unit == "V";
    assert!(found.detectable.iter().any(volts));
    assert!(
        found
            .detectable
            .iter()
            .all(|d| d.size > 0.0 && d.effect != "stribeck")
    );
    let cogging = found
        .detectable
        .iter()
        .find(|d| d.effect == "cogging")
        .unwrap();
    // The noise floor is about 0.05 N·m: a hundredth of it cannot show, and thirty times it cannot hide.
    assert!((5e-4..1.5).contains(&cogging.size), "{}", cogging.size);
    println!(
        "{:#?}\n{:#?}\n{:#?}",
        found.words, found.steps, found.detectable
    );
    println!("{:#?}\n{:#?}", found.not_testable, found.next_experiment);
}

/// Friction that varies with the position has opposite signs in the two directions: over the position alone the means of its
/// residual cancel, and the picture would show nothing.
#[test]
fn friction_that_varies_with_the_position_is_drawn_by_direction() {
    let effect = Effect::PositionFriction {
        amplitude: 0.2,
        order: 2.0,
        phase: 0.4,
    };
    let made = Scenario {
        seconds: [40.0, 20.0],
        ..Scenario::new(vec![Hidden { joint: 0, effect }], 5)
    }
    .make()
    .unwrap();
    let (found, _) = made.diagnosed(&made.robot, &Options::default());
    assert_eq!(found.steps[0].effect, "position_friction");
    let map = found.maps.iter().find(|m| m.step == Some(0)).unwrap();
    let size = |list: &[[f64; 2]]| list.iter().map(|v| v[0] * v[0]).sum::<f64>();
    assert!(size(&map.after) < 0.1 * size(&map.before), "{map:?}");
    assert!(map.at[0] < 0.0 && map.at[map.at.len() - 1] > 0.0);
}

/// Bins by equal numbers of rows, for a joint that runs at 0.05 rad/s for long. Those within the noise of that speed
/// are drawn as one; those near rest and far out stay separate.
#[test]
fn bins_within_the_noise_of_one_speed_are_drawn_as_one() {
    let edges = [
        -1.0, -0.5, 0.0, 1e-4, 1e-3, 0.02, 0.049, 0.05, 0.051, 0.052, 0.3, 1.0,
    ];
    let group = crate::result::pictures::told_apart(&edges);
    assert_eq!(group, [0, 1, 2, 3, 4, 5, 6, 6, 6, 7, 8]);
    // Equal edges, as of a mostly zero quantity, give no width.
    assert_eq!(
        crate::result::pictures::told_apart(&[0.0, 0.0, 0.0, 1.0]),
        [0, 1, 2]
    );
}
