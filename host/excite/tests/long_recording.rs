//! Identification of a long recording that a simulated arm made of a designed motion.
#![allow(clippy::unwrap_used)]

use rig_data::Block;
use rig_data::prepare::InMemory;
use rig_excite::{Noise, SampledReference, replay};
use rig_identify::{Estimator, Options, identify};
use rig_model::robot::Robot;

/// What friction leaves at reversals grows into evidence for anything when the recording is long enough; what is too small to
/// matter is not taken for it.
#[test]
fn a_long_recording_has_no_terms_that_do_not_matter() {
    let robot = Robot::from_toml(
        rig_model::robot::template("irp6").unwrap(),
        std::path::Path::new("irp6.toml"),
    )
    .unwrap();
    let period = 2e-3;
    let phase = |j: usize, h: u32| ((5 * j) as f64 + 3.0 * f64::from(h)) * 0.71;
    let sines = (5, 0.07, 7.5);
    let reference = SampledReference::eased_sines(&robot, [period, 600.0], sines, phase);
    let noise = Noise {
        position: 1e-5,
        velocity: 0.0,
        torque: 0.5,
    };
    let made = replay(&robot, &reference, noise, 1, |_, _| ()).unwrap();
    let recording = InMemory {
        label: "long".into(),
        blocks: vec![Block::of_motion(made.motion, period, &[])],
    };
    let options = Options {
        estimator: Estimator::Consistent,
        look_beyond: true,
        ..Default::default()
    };
    let found = identify(&robot, &[&recording], &[], &options).unwrap();
    assert!(found.base_tilt.is_none(), "{:?}", found.base_tilt);
    assert!(
        found.position_torques.is_empty(),
        "{:?}",
        found.position_torques
    );
}
