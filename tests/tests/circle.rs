//! From a hidden effect to a rig that follows better, on the emulated rig of the desktop; the emulated board goes the same
//! way in `tests/mcu`.
#![allow(clippy::unwrap_used)]

use rig_plant::PlantConfig;
use rig_shared::wire::message::RequestBody;
use rig_tests::circle::{go_round, with_cogging};
use rig_tests::{calibrated, connect, in_parallel, nameplate};

#[test]
fn hidden_cogging_is_named_uploaded_and_compensated() {
    in_parallel(2, |seed| {
        let plant = with_cogging(PlantConfig::laboratory(60 + seed));
        let mut line = connect(&nameplate(&plant), plant.clone(), seed);
        calibrated(&mut line);
        line.request(RequestBody::SetPosition(plant.initial_position as f32))
            .unwrap();
        let folder = tempfile::tempdir().unwrap();
        go_round(&mut line, folder.path()).assert_closed();
    });
}
