//! From power on to parameters, over the wire; and the estimates that the chip computes against those that the
//! desktop computes from the same samples.
#![allow(clippy::float_cmp)]

use rig_firmware::nameplate;
use rig_firmware::prechecked_request::precheck;
use rig_firmware::request::execute;
use rig_firmware::sample::Sample;
use rig_firmware::state::State;
use rig_firmware::step::step;
use rig_identify::{Options, identify};
use rig_link::experiment::Experiment;
use rig_mcu::board::BoardFaults;
use rig_mcu::time::from_seconds;
use rig_shared::effects::{Effect, Kind};
use rig_shared::estimation::{Learning, RowCounts};
use rig_shared::friction::Friction;
use rig_shared::link::{LinkParameters, PARAMETER_NAMES};
use rig_shared::safety::Mode;
use rig_shared::trajectory::{SlowReversals, Trajectory};
use rig_shared::units::{AdcCode, EncoderCount};
use rig_shared::wire::message::{Estimate, Request, RequestBody};
use rig_tests::{
    Recording, base_parameters_of, calibrated, deviations, driven, excitation, recorded, robot,
    wait,
};

use rig_mcu::rig::power_on;

use crate::{BoardSession, bench, board, greeted, image, plant, powered};

#[test]
fn an_excitation_recorded_over_the_wire_gives_the_rig_s_parameters() {
    let mut line = bench(50);
    let run = driven(&mut line, vec![], excitation(50, 5, 3), 0.3);
    assert!(run.faults.is_empty(), "{:?}", run.faults);
    assert_eq!(run.losses.lost, 0, "{}", run.losses);
    let plant = board(&mut line).with_board(|b| b.plant().config().clone());
    let torque_per_ampere = plant.mechanism.ratio * plant.motor.torque_constant;
    let recording = run.in_memory("emulated board", torque_per_ampere);
    let found = identify(&robot(), &[&recording], &[], &Options::default()).unwrap();
    let truth = base_parameters_of(&plant);
    let mut text = String::new();
    let mut fair = true;
    for (base, truth) in found.base_parameters.iter().zip(truth) {
        let inside = (base.interval[0]..=base.interval[1]).contains(&truth);
        text += &format!(
            "{:<12} {:>9.5} in {:>9.5}..{:<9.5} truth {truth:>9.5} {}\n",
            base.expression,
            base.value,
            base.interval[0],
            base.interval[1],
            if inside { "" } else { "OUTSIDE" }
        );
        fair &= inside;
    }
    let estimate = run.estimate();
    for (k, z) in deviations(&estimate, &plant).into_iter().enumerate() {
        text += &format!(
            "on line {:<8} {:>9.5} z {z:.2}\n",
            PARAMETER_NAMES[k], estimate.value[k]
        );
        fair &= z.abs() <= 3.0;
    }
    println!("{text}");
    assert!(fair, "\n{text}");
}

/// Raw samples as the control interrupt read them, by the converter trigger that they belong to. Without index
/// the firmware's count is the counter's own.
fn samples(line: &mut BoardSession) -> Vec<(u64, Sample)> {
    let readings = board(line).with_chip(|chip| chip.readings.take()).unwrap();
    let mut samples: Vec<(u64, Sample)> = Vec::new();
    let mut sample = Sample::default();
    let mut now = 0;
    for reading in readings {
        match reading.address {
            0x5000_0080 => sample.current = AdcCode(reading.value as u16),
            0x5000_0084 => sample.supply = AdcCode(reading.value as u16),
            0x5000_0088 => sample.temperature = AdcCode(reading.value as u16),
            0x4000_0C24 => now = reading.value,
            0x4000_0024 => sample.encoder = EncoderCount(reading.value as u16),
            _ => {
                // What was captured is read last.
                let age = now.wrapping_sub(reading.value).cast_signed();
                sample.edge_age = Some(age.max(0).cast_unsigned());
                samples.push((reading.trigger, sample));
            }
        }
    }
    samples
}

#[test]
fn on_line_estimates_equal_the_desktop_s_bit_for_bit() {
    equal_bit_for_bit(51, &[]);
}

/// With effects that are given, explained and taken off the reading. One that turns with the motor at a time, as whose turn it is
/// to be set right depends on when they were told.
#[test]
fn so_they_do_with_effects() {
    let mut precompensation = nameplate::one_link().1.precompensation;
    precompensation.enabled = true;
    let cogging = Effect::new(Kind::Cogging, &[0.03, -0.02], &[12.0]);
    let eccentric = Effect::new(Kind::EncoderEccentricityMotor, &[2e-4, 1e-4], &[1.0]);
    for (seed, turning) in [(52, cogging), (54, eccentric)] {
        let effects = [
            turning,
            Effect::new(Kind::Stribeck, &[0.05], &[0.1]),
            Effect::new(Kind::CurrentOffset, &[0.02], &[]),
        ];
        let told = [
            RequestBody::SetPosition(0.25),
            RequestBody::SetPrecompensation(precompensation),
            RequestBody::SetEffects(effects.into_iter().collect()),
        ];
        equal_bit_for_bit(seed, &told);
    }
}

/// Tells the rig, moves it, and does the same on the desktop with the samples that the chip had.
fn equal_bit_for_bit(seed: u64, told: &[RequestBody]) {
    let mut emulated = powered(seed);
    emulated.with_chip(|chip| {
        chip.readings = Some(Vec::new());
        chip.board.faults = BoardFaults {
            index_cut: true,
            ..BoardFaults::default()
        };
    });
    let mut line = greeted(emulated);
    // The position stays what it was at power on: where the origin is put depends on the very tick.
    wait(&mut line, 0.7);
    // The triggers between which each is carried out.
    let told: Vec<(RequestBody, [u64; 2])> = told
        .iter()
        .map(|body| {
            let from = board(&mut line).with_chip(|chip| chip.triggers);
            line.request(body.clone()).unwrap();
            let to = board(&mut line).with_chip(|chip| chip.triggers);
            (body.clone(), [from, to])
        })
        .collect();
    wait(&mut line, 0.1);
    let motion = excitation(seed, 5, 1);
    let run = recorded(
        &mut line,
        &Experiment {
            settings: vec![],
            trajectory: Some(motion.clone()),
            rest: 0.2,
            ..Experiment::default()
        },
    );
    assert!(run.faults.is_empty());
    let (armed, disarmed) = board(&mut line).with_board(|b| {
        let edges = &b.enable_edges;
        assert_eq!(edges.len(), 2, "{edges:?}");
        (edges[0].0, edges[1].0)
    });
    let samples = samples(&mut line);
    // Tick of the first sample is 0; a tick lasts 0.1 ms from its trigger on.
    let period = from_seconds(1e-4);
    let last = board(&mut line).with_chip(|chip| (chip.work.now, chip.triggers));
    let tick_at = |instant: u64| {
        let back = (last.0 - instant) / period;
        last.1 - back - samples[0].0
    };
    // Estimates that were sent while the bridge was on.
    let sent: Vec<&Estimate> = run.estimates.iter().collect();
    assert!(sent.len() > 80, "{} estimates", sent.len());

    // The outputs come when the bridge is awake, a time after the request to arm; the start waits for that too, and comes later
    // where the line took longer; and in the tick in which the rig was told where it stands its link may have stood some counts
    // from where it stands at the end of the request. Which ticks and counts these are, is tried.
    let wake = u64::from(nameplate::one_link().0.wake_ticks);
    let later = core::iter::once(0).chain(wake..).take(21);
    let crept = counts_crept(&samples, &told);
    let tried = later.flat_map(|later| {
        let ticks = move |back| (tick_at(armed) - wake - back, later);
        (0..3_u64).map(ticks)
    });
    let mut best = 0;
    'found: for (armed, later) in tried {
        for &crept in &crept {
            let ticks = [armed, armed + later, tick_at(disarmed)];
            best = best.max(replay(&samples, ticks, (&told, crept), &motion, &sent));
            if best == sent.len() {
                break 'found;
            }
        }
    }
    println!("{best} of {} estimates equal bit for bit", sent.len());
    assert_eq!(best, sent.len());
}

/// By how many counts the link may have crept from the tick in which a position was told to the end of that request.
fn counts_crept(samples: &[(u64, Sample)], told: &[(RequestBody, [u64; 2])]) -> Vec<i64> {
    let Some((_, [from, to])) = told
        .iter()
        .find(|(body, _)| matches!(body, RequestBody::SetPosition(_)))
    else {
        return vec![0];
    };
    let during = samples
        .iter()
        .filter(|(trigger, _)| (from..=to).contains(&trigger));
    let counts: Vec<u16> = during.map(|(_, sample)| sample.encoder.0).collect();
    let end = *counts.last().unwrap();
    let mut crept: Vec<i64> = counts
        .iter()
        .map(|count| i64::from(end.wrapping_sub(*count).cast_signed()))
        .collect();
    crept.sort_unstable();
    crept.dedup();
    crept
}

/// Whether two estimates are equal bit for bit. The tick of a request is not known exactly, so one row with the bridge off may lie
/// before the restart that it causes, or behind it.
fn is_same(sent: &Estimate, own: &Estimate) -> bool {
    let mut own = *own;
    if own.rows.masked.abs_diff(sent.rows.masked) <= 1 {
        own.rows.masked = sent.rows.masked;
    }
    own == *sent
}

/// Runs the desktop's library over the samples; gives how many of the estimates sent it equals bit for bit.
fn replay(
    samples: &[(u64, Sample)],
    [armed, started, disarmed]: [u64; 3],
    (told, crept): (&[(RequestBody, [u64; 2])], i64),
    motion: &Trajectory<f32>,
    sent: &[&Estimate],
) -> usize {
    let (mut config, settings) = nameplate::one_link();
    // The samples answer to the board's own duty, not to the one that is worked out here.
    config.monitor.voltage.floor = f32::INFINITY;
    // The motion is slow enough that the board marks no current as not settled.
    config.settled_duty = f32::INFINITY;
    let mut state = State::new(&config, settings).unwrap();
    let ask = |state: &mut State, body: RequestBody| {
        execute(&config, state, &precheck(&config, Request { id: 0, body })).unwrap();
    };
    let mut next = sent.iter().peekable();
    let mut equal = 0;
    for (trigger, sample) in samples {
        let tick = trigger - samples[0].0;
        state.last_contact_tick = state.tick;
        let output = step(&config, &mut state, *sample);
        if let Some(estimate) = output.estimate {
            while next.peek().is_some_and(|e| e.tick < estimate.tick) {
                next.next();
            }
            if next.peek().is_some_and(|e| is_same(e, &estimate)) {
                equal += 1;
                next.next();
            }
        }
        // One after the other, as over the wire: each may cost the estimator a window.
        if let Some((body, _)) = told.iter().find(|(_, [_, to])| to == trigger) {
            let counts = config.encoder.counts_per_motor_turn as f32 * config.drive.gear_ratio;
            let shift = crept as f32 * core::f32::consts::TAU / counts;
            ask(
                &mut state,
                match body {
                    RequestBody::SetPosition(at) => RequestBody::SetPosition(at + shift),
                    other => other.clone(),
                },
            );
        }
        if state.mode == Mode::Disarmed && tick + 1 == armed {
            ask(&mut state, RequestBody::SetTrajectory(motion.clone()));
            ask(&mut state, RequestBody::Arm);
        }
        if state.mode == Mode::Holding && tick + 1 == started {
            ask(&mut state, RequestBody::Start);
        }
        if tick + 1 == disarmed {
            ask(&mut state, RequestBody::Disarm);
        }
    }
    equal
}

#[test]
fn what_was_learnt_and_uploaded_makes_slow_reversals_follow_better() {
    let mut line = bench(52);
    let run = driven(&mut line, vec![], excitation(52, 5, 3), 0.3);
    let estimate = run.estimate();
    assert_eq!(estimate.trusted, [true; 6]);
    let reversals =
        Trajectory::SlowReversals(SlowReversals::new(0.05_f32, 0.1, &[0.1], 1).unwrap());
    let model = LinkParameters::from_array(estimate.value);
    let learnt = vec![
        RequestBody::SetModel(model),
        RequestBody::SetFriction(Friction {
            coulomb: model.coulomb,
            viscous: model.viscous,
            ..Friction::default()
        }),
    ];
    let without = driven(&mut line, learnt, reversals.clone(), 0.2);
    let (_, settings) = nameplate::one_link();
    let mut precompensation = settings.precompensation;
    precompensation.enabled = true;
    let on = vec![RequestBody::SetPrecompensation(precompensation)];
    let with = driven(&mut line, on, reversals, 0.2);
    assert!(without.faults.is_empty() && with.faults.is_empty());
    let rms = |run: &Recording| run.tracking_rms(0.0, f64::MAX);
    let (before, after) = (rms(&without), rms(&with));
    println!(
        "RMS {:.3} mrad without, {:.3} with",
        1e3 * before,
        1e3 * after
    );
    assert!(after < before / 2.0, "{before} to {after} rad");
}

/// The current's samples lie about the middle of the braking interval, where it equals its mean: what is read differs from
/// the truth by noise, and not by (R·i + Kₑ·ω)/L times a delay.
#[test]
fn the_ripple_of_the_current_leaves_its_mean_alone() {
    let mut rig = plant(53);
    rig.sensors.current.gain_error = 0.0;
    rig.sensors.current.lag = None;
    let motor = rig.motor;
    let mut line = greeted(power_on(image(), rig, 53).unwrap());
    calibrated(&mut line);
    line.request(RequestBody::SetTrajectory(excitation(53, 5, 1)))
        .unwrap();
    line.request(RequestBody::Arm).unwrap();
    line.request(RequestBody::Start).unwrap();
    let per_code = f64::from(nameplate::one_link().0.scaling.current_per_code);
    // Slope of braking, A/s, and error of the reading, A, of one tick each.
    let mut pairs = Vec::new();
    while pairs.len() < 4000 {
        board(&mut line).with_chip(|chip| chip.readings = Some(Vec::new()));
        wait(&mut line, 7.3e-4);
        // A host waits in whole milliseconds, and would look at one place of the period all along.
        board(&mut line).run_for(3.7e-5).unwrap();
        board(&mut line).with_chip(|chip| {
            let readings = chip.readings.take().unwrap_or_default();
            let last = readings.iter().rev().find(|r| r.address == 0x5000_0080);
            // The rig moves on with each trigger: a reading belongs to the truth until the next.
            let Some(last) = last.filter(|r| r.trigger == chip.triggers) else {
                return;
            };
            let truth = chip.board.plant().truth();
            let drop =
                motor.resistance * truth.current + motor.torque_constant * truth.motor_velocity;
            let read = per_code * (f64::from(last.value) - 2048.0);
            pairs.push((drop / motor.inductance, read - truth.current));
        });
    }
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / 4000.0;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let spread = mean(&|p| (p.0 - x).powi(2));
    let delay = -mean(&|p| (p.0 - x) * (p.1 - y)) / spread;
    println!(
        "slope {:.1} A/ms RMS, as if read {:.3} µs after the middle",
        1e-3 * spread.sqrt(),
        1e6 * delay
    );
    // Noise alone makes some 0.1 µs of it.
    assert!(spread.sqrt() > 4e3 && delay.abs() < 0.4e-6, "{delay} s");
}

/// Rows of two reports, and what they say between.
fn grown(before: &Estimate, after: &Estimate) -> RowCounts {
    RowCounts {
        used: after.rows.used - before.rows.used,
        masked: after.rows.masked - before.rows.masked,
        uninformative: after.rows.uninformative - before.rows.uninformative,
    }
}

/// Every window of the estimator counts once. While the rig creeps below the slip velocity of 0.2 rad/s it says so, with the
/// bridge off it says that, and in an excitation it learns.
#[test]
fn the_estimate_says_what_it_has_used_and_why_it_learns_nothing() {
    let mut line = bench(61);
    let estimates = |line: &mut BoardSession, motion| driven(line, vec![], motion, 0.3).estimates;
    let creep = SlowReversals::new(0.2, 0.1, &[0.05], 2).unwrap();
    let slow = estimates(&mut line, Trajectory::SlowReversals(creep));
    let (config, _) = nameplate::one_link();
    for pair in slow.windows(2) {
        let RowCounts {
            used,
            masked,
            uninformative,
        } = grown(&pair[0], &pair[1]);
        let ticks = (pair[1].tick - pair[0].tick) as u32;
        let windows = ticks / u32::from(config.rates.estimator_decimation);
        assert_eq!(used + masked + uninformative, windows, "{pair:?}");
        assert_eq!(used == 0, pair[1].learning != Learning::Active, "{pair:?}");
    }
    let said = |list: &[Estimate], learning| list.iter().filter(|e| e.learning == learning).count();
    let creeping = said(&slow, Learning::TooSlow);
    println!(
        "{creeping} of {} reports say that the rig creeps",
        slow.len()
    );
    // At this speed friction sticks and slips, and for moments the joint is faster than 0.2 rad/s.
    assert!(
        creeping > 2 * slow.len() / 3,
        "{creeping} of {}",
        slow.len()
    );
    let RowCounts {
        used,
        masked,
        uninformative,
    } = grown(&slow[0], slow.last().unwrap());
    println!(
        "creeping: {used} of {} rows used",
        used + masked + uninformative
    );
    assert!(20 * used < used + masked + uninformative);
    wait(&mut line, 0.5);
    let off = crate::awaited(&mut line, |report| match report {
        rig_shared::wire::message::Report::Estimate(estimate) => Some(*estimate),
        _ => None,
    });
    assert_eq!(off.learning, Learning::BridgeOff);
    let fast = estimates(&mut line, excitation(61, 5, 1));
    let all = grown(&fast[0], fast.last().unwrap());
    println!("excitation: {all:?}");
    assert!(said(&fast, Learning::Active) > fast.len() / 2);
    assert!(all.used > all.masked + all.uninformative, "{all:?}");
}
