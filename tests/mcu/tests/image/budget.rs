//! What the image costs: instructions and cycles of the control tick, flash, RAM, stack.

use heapless::Vec;
use rig_mcu::chip::CONTROL_EXCEPTION;
use rig_shared::compensation::EFFECTS;
use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::{Chirp, FrictionSweep, SlowReversals, Sweep, Trajectory};
use rig_shared::wire::message::RequestBody;
use rig_tests::{driven, excitation};
use serde::Deserialize;

use crate::{bench, board};

/// The figures that may not grow: `tests/mcu/budget.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Budget {
    tick_instructions_mean: f64,
    tick_instructions_worst: u64,
    tick_cycles_mean: f64,
    tick_cycles_worst: u64,
    flash_bytes: usize,
    ram_bytes: usize,
    stack_bytes: u32,
}

/// Cycles between two control ticks.
const PERIOD: f64 = 17_000.0;

/// As many effects as a rig can compensate, of the dear sort: dry friction is asked twice a tick.
fn dear_effects() -> Vec<Effect<f32>, EFFECTS> {
    let stribeck = |excess, velocity| Effect {
        kind: Kind::Stribeck,
        gains: [excess, 0.0, 0.0, 0.0],
        shapes: [velocity, 0.0, 0.0, 0.0],
    };
    (1..=EFFECTS)
        .map(|k| stribeck(0.01 * k as f32, 0.1 * k as f32))
        .collect()
}

/// Precompensation with as many effects as there can be.
fn all_on() -> std::vec::Vec<RequestBody> {
    let (_, settings) = rig_firmware::nameplate::one_link();
    let mut precompensation = settings.precompensation;
    precompensation.enabled = true;
    vec![
        RequestBody::SetPrecompensation(precompensation),
        RequestBody::SetEffects(dear_effects()),
    ]
}

#[test]
fn the_image_keeps_to_its_budget() {
    let text = include_str!("../../budget.toml");
    let budget: Budget = toml::from_str(text).unwrap();
    let mut line = bench(40);
    board(&mut line).clear_costs();
    let run = driven(&mut line, all_on(), excitation(40, 5, 1), 0.2);
    assert!(run.faults.is_empty(), "{:?}", run.faults);
    let cost = board(&mut line).cost(CONTROL_EXCEPTION);
    let (stack, room) = board(&mut line).stack();
    let image = board(&mut line).image();
    let mean = cost.instructions as f64 / cost.count as f64;
    let cycles = cost.cycles as f64 / cost.count as f64;
    let found = format!(
        "{} ticks\ntick_instructions_mean = {mean:.1}\ntick_instructions_worst = {}\n\
         tick_cycles_mean = {cycles:.1} # {:.1} % of the period\n\
         tick_cycles_worst = {} # {:.1} %\nflash_bytes = {}\nram_bytes = {}\n\
         stack_bytes = {stack} # of {room}\n",
        cost.count,
        cost.worst_instructions,
        100.0 * cycles / PERIOD,
        cost.worst_cycles,
        100.0 * cost.worst_cycles as f64 / PERIOD,
        image.flash_used,
        image.ram_used,
    );
    println!("{found}");
    let kept = mean <= budget.tick_instructions_mean
        && cost.worst_instructions <= budget.tick_instructions_worst
        && cycles <= budget.tick_cycles_mean
        && cost.worst_cycles <= budget.tick_cycles_worst
        && image.flash_used <= budget.flash_bytes
        && image.ram_used <= budget.ram_bytes
        && stack <= budget.stack_bytes;
    // What the project promises, however the budget is raised.
    assert!(
        cycles <= 0.25 * PERIOD && cost.worst_cycles as f64 <= 0.5 * PERIOD,
        "the tick takes too much of its period:\n{found}"
    );
    assert!(kept, "more than tests/mcu/budget.toml allows:\n{found}");
}

/// Motions other than the excitation, whose references are computed in the tick too. A chirp's phase takes twice the
/// digits and runs from flash: more than the project's aim, and within the period.
#[test]
fn every_motion_keeps_to_the_period() {
    let chirp = |sweep| {
        Trajectory::Chirp(Chirp {
            start_hz: 0.5,
            end_hz: 4.0,
            sweep,
            duration_us: 1_500_000,
            ramp_us: 300_000,
            amplitude: 0.05,
            velocity: 0.5,
            acceleration: 10.0,
        })
    };
    // Most of the period, mean and worst.
    let motions = [
        ("linear chirp", chirp(Sweep::Linear), [0.31, 0.54]),
        ("logarithmic chirp", chirp(Sweep::Logarithmic), [0.45, 0.70]),
        (
            "slow reversals",
            Trajectory::SlowReversals(SlowReversals::new(0.1, 0.2, &[0.05], 1).unwrap()),
            [0.25, 0.5],
        ),
        (
            "friction sweep",
            Trajectory::FrictionSweep(FrictionSweep::new(&[0.3], 0.1, 0.1, 0.1, 3.0).unwrap()),
            [0.25, 0.5],
        ),
    ];
    let mut line = bench(41);
    let mut text = String::new();
    let mut kept = true;
    for (name, motion, most) in motions {
        board(&mut line).clear_costs();
        let run = driven(&mut line, all_on(), motion, 0.05);
        assert!(run.faults.is_empty(), "{name}: {:?}", run.faults);
        let cost = board(&mut line).cost(CONTROL_EXCEPTION);
        let mean = cost.cycles as f64 / cost.count as f64 / PERIOD;
        let worst = cost.worst_cycles as f64 / PERIOD;
        text += &format!(
            "{name}: {:.1} % of the period, {:.1} % at worst\n",
            100.0 * mean,
            100.0 * worst
        );
        kept &= mean <= most[0] && worst <= most[1];
    }
    println!("{text}");
    assert!(kept, "\n{text}");
}
