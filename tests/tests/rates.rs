//! The firmware's logic at other control rates than the template's: what follows from the rate follows.
#![allow(clippy::unwrap_used, clippy::panic)]

use rig_firmware::config::Rates;
use rig_firmware::nameplate::one_link_at;
use rig_plant::PlantConfig;
use rig_plant::emulated::Nameplate;
use rig_shared::link::PARAMETER_NAMES;
use rig_shared::wire::message::RequestBody;
use rig_tests::{calibrated, connect, deviations, driven, excitation};

/// From calibration to the on-line estimate at half and at twice the rate: the estimate is right, the link follows as well, and
/// no check mistakes one rate for another.
#[test]
fn a_rig_at_half_and_at_twice_the_rate_is_identified_and_controlled_as_well() {
    let mut text = String::new();
    let mut tracking = Vec::new();
    for (control_hz, decimation) in [(5_000, 5), (10_000, 10), (20_000, 20)] {
        let rates = Rates {
            control_hz,
            telemetry_decimation: decimation,
            estimator_decimation: decimation,
            ..Rates::TEMPLATE
        };
        let mut plant = PlantConfig::laboratory(60);
        plant.tick = 1.0 / f64::from(control_hz);
        let (mut config, settings) = one_link_at(rates);
        config.drive.torque_constant = plant.motor.torque_constant as f32;
        let mut line = connect(&Nameplate { config, settings }, plant.clone(), 60);
        calibrated(&mut line);
        let at = plant.initial_position as f32;
        line.request(RequestBody::SetPosition(at)).unwrap();
        let run = driven(&mut line, vec![], excitation(60, 5, 4), 0.3);
        assert!(run.faults.is_empty(), "{control_hz} Hz: {:?}", run.faults);
        assert_eq!(run.losses.lost, 0);
        let per_second = run.rows.len() as f64 / (run.rows.last().unwrap().t - run.rows[0].t);
        assert!(
            (per_second - 1000.0).abs() < 1.0,
            "{per_second} rows a second"
        );
        tracking.push(run.tracking_rms(0.0, f64::MAX));
        let estimate = run.estimate();
        for (k, z) in deviations(&estimate, &plant).into_iter().enumerate() {
            text += &format!(
                "{control_hz} Hz {:<8} {:>9.5}, z {z:.2}\n",
                PARAMETER_NAMES[k], estimate.value[k]
            );
            assert!(estimate.trusted[k] && z.abs() < 3.0, "\n{text}");
        }
    }
    println!("{text}tracking {tracking:?} rad");
    let [slow, template, fast] = tracking[..] else {
        panic!()
    };
    assert!((slow / template - 1.0).abs() < 0.1 && (fast / template - 1.0).abs() < 0.1);
}
