//! The whole circle on the image: recorded over the board's serial port, diagnosed, uploaded, and following better.

use rig_mcu::rig::power_on;
use rig_tests::circle::{go_round, with_cogging};

use crate::{board, calibrated, greeted, image, place, plant};

#[test]
fn hidden_cogging_is_named_uploaded_and_compensated() {
    let rig = with_cogging(plant(60));
    let mut line = greeted(power_on(image(), rig, 60).unwrap());
    calibrated(&mut line);
    place(&mut line);
    let folder = tempfile::tempdir().unwrap();
    let circle = go_round(&mut line, folder.path());
    assert_eq!(board(&mut line).resets, []);
    circle.assert_closed();
}
