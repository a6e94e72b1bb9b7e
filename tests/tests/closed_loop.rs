//! The firmware's logic closed around the emulated rig, over the real wire.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
use rig_plant::PlantConfig;
use rig_plant::emulated::{EmulatedRig, Nameplate};
use rig_shared::safety::Mode;

fn robot() -> Robot {
    Robot::from_toml(ONE_LINK_TEMPLATE, Path::new("one-link.toml")).unwrap()
}

#[test]
fn boots_calibrates_and_waits_disarmed() {
    let nameplate = Nameplate::from_robot(&robot()).unwrap();
    let mut rig = EmulatedRig::new(&nameplate, PlantConfig::default(), 1).unwrap();
    for _ in 0..20_000 {
        let output = rig.tick();
        assert!(
            !output.command.bridge,
            "nothing moves without an arm command"
        );
        assert_eq!(output.fault, None);
    }
    assert_eq!(rig.state().mode, Mode::Disarmed);
}
