//! Settings that survive a power cycle, and flash that does not.

use rig_link::LinkError;
use rig_mcu::cpu::Memory;
use rig_mcu::map;
use rig_mcu::peripheral::rcc::Cause;
use rig_plant::PlantConfig;
use rig_plant::effect::cogging::Cogging;
use rig_shared::trajectory::{SlowReversals, Trajectory};
use rig_shared::wire::message::{Bounded, Refusal, RequestBody, ResetCause, SettingsOrigin};
use rig_tests::{calibrated, cogging_of, driven, truth_of, wait};

use crate::{BoardSession, bench, board, greeted, health, image, place, plant};
use rig_mcu::rig::power_on;

/// Resets the board and waits until it has calibrated itself.
fn again(mut line: BoardSession, cause: Cause) -> BoardSession {
    board(&mut line).reset(cause);
    wait(&mut line, 0.05);
    calibrated(&mut line);
    line
}

/// First address at which settings are stored, two pages in all.
const STORE: u32 = 0x0807_F000;

fn damage(line: &mut BoardSession, page: u32) {
    let address = STORE + 0x800 * page + 40;
    let cpu = board(line).cpu();
    let mut byte = [0];
    assert!(map::FLASH.contains(&address) && cpu.load(address, &mut byte));
    assert!(cpu.store(address, &[byte[0] ^ 0x10]));
}

#[test]
fn stored_settings_come_back_and_damaged_ones_do_not() {
    let mut line = bench(5);
    let (_, settings) = rig_firmware::nameplate::one_link();
    let mut limits = settings.limits;
    limits.velocity = 1.0;
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::Store).unwrap();
    // Page erase and programming took place, the tick went on meanwhile.
    let (pages, words) = board(&mut line).with_chip(|chip| chip.flash.work);
    assert!(
        pages == 1 && words > 10,
        "{pages} pages, {words} double words"
    );
    assert_eq!(board(&mut line).with_chip(|chip| chip.adc.missed), 0);

    let mut line = again(line, Cause::PowerOn);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Power);
    assert_eq!(report.settings, SettingsOrigin::Stored);
    // A trajectory of 3 rad/s fits the firmware's own limit of 6 rad/s, not the stored one of 1 rad/s.
    let fast = RequestBody::SetTrajectory(rig_tests::excitation(5, 5, 1));
    assert!(matches!(
        line.request(fast.clone()),
        Err(LinkError::Refused {
            refusal: Refusal::OutOfBounds {
                quantity: Bounded::MotionSpeed,
                bound: 1.0,
                ..
            },
            ..
        })
    ));

    // A second copy, then the newer one damaged: the older stands.
    limits.velocity = 0.9;
    line.request(RequestBody::SetLimits(limits)).unwrap();
    line.request(RequestBody::Store).unwrap();
    damage(&mut line, 1);
    let mut line = again(line, Cause::Pin);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Pin);
    assert_eq!(report.settings, SettingsOrigin::OlderCopy);

    // Both damaged: the firmware's own.
    damage(&mut line, 0);
    let mut line = again(line, Cause::Software);
    let report = health(&mut line);
    assert_eq!(report.reset, ResetCause::Software);
    assert_eq!(report.settings, SettingsOrigin::Damaged);
    line.request(fast).unwrap();
}

/// RMS tracking error of slow reversals, mrad.
fn tracking(line: &mut BoardSession) -> f64 {
    let motion = SlowReversals::new(0.05_f32, 0.1, &[0.1], 1).unwrap();
    let run = driven(line, vec![], Trajectory::SlowReversals(motion), 0.2);
    assert!(run.faults.is_empty(), "{:?}", run.faults);
    1e3 * run.tracking_rms(0.0, f64::MAX)
}

/// Cogging in the plant, named over the wire and stored: compensated, again after a power cycle, and not where what was
/// stored is damaged.
#[test]
fn effects_survive_a_power_cycle_and_damaged_ones_are_not_used() {
    let rig = PlantConfig {
        motor: rig_plant::Motor {
            cogging: Some(Cogging {
                amplitude: 0.006,
                order: 12.0,
                phase: 0.7,
            }),
            ..plant(1).motor
        },
        ..plant(1)
    };
    let mut line = greeted(power_on(image(), rig.clone(), 1).unwrap());
    calibrated(&mut line);
    place(&mut line);
    let (_, settings) = rig_firmware::nameplate::one_link();
    let mut precompensation = settings.precompensation;
    precompensation.enabled = true;
    let mut told = truth_of(&rig);
    told.push(RequestBody::SetPrecompensation(precompensation));
    for body in told.clone() {
        line.request(body).unwrap();
    }
    let without = tracking(&mut line);
    let effects = std::iter::once(cogging_of(&rig)).collect();
    line.request(RequestBody::SetEffects(effects)).unwrap();
    let with = tracking(&mut line);
    line.request(RequestBody::Store).unwrap();

    let mut line = again(line, Cause::PowerOn);
    assert_eq!(health(&mut line).settings, SettingsOrigin::Stored);
    place(&mut line);
    let after = tracking(&mut line);

    damage(&mut line, 0);
    let mut line = again(line, Cause::PowerOn);
    assert_eq!(health(&mut line).settings, SettingsOrigin::Damaged);
    place(&mut line);
    for body in told {
        line.request(body).unwrap();
    }
    let fallen = tracking(&mut line);
    println!(
        "RMS {without:.3} mrad without, {with:.3} with, {after:.3} after a power cycle, {fallen:.3} with damaged flash"
    );
    assert!(with < without / 2.0 && after < without / 2.0);
    assert!(fallen > 0.8 * without);
}
