//! What the image costs: instructions and cycles of the control tick, flash, RAM, stack.

use heapless::Vec;
use rig_mcu::chip::CONTROL_EXCEPTION;
use rig_shared::compensation::EFFECTS;
use rig_shared::control::ControlKind;
use rig_shared::effects::{Effect, Kind};
use rig_shared::trajectory::{
    Chirp, FrictionSweep, HARMONICS, LEVELS, SPEEDS, SlowReversals, Staircase, Sweep, Trajectory,
};
use rig_shared::wire::message::RequestBody;
use rig_tests::{driven, excitation};
use serde::Deserialize;

use crate::{bench, board};

/// The figures that may not grow: `tests/mcu/budget.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Budget {
    tick_instructions_mean: f64,
    tick_instructions_worst: u64,
    tick_cycles_mean: f64,
    tick_cycles_worst: u64,
    flash_bytes: usize,
    /// Of the CCM SRAM, by code: below its size by the reserve.
    code_bytes: usize,
    ram_bytes: usize,
    stack_bytes: u32,
    /// Without the start's.
    pub(crate) running_stack_bytes: u32,
    pub(crate) any: Most,
}

impl Budget {
    pub(crate) fn read() -> Self {
        toml::from_str(include_str!("../../budget.toml")).unwrap()
    }
}

/// Of any motion under any law with any effects.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Most {
    cycles_mean: f64,
    cycles_worst: f64,
    /// Of ticks in which a request is served.
    pub(crate) request_cycles_worst: f64,
}

/// Bytes of the CCM SRAM (RM0440, "Embedded SRAM"), and how many of them are kept free for what is still to come.
const CCM_BYTES: usize = 32 * 1024;
const CODE_RESERVE: usize = 4 * 1024;

/// Cycles between two control ticks.
pub(crate) const PERIOD: f64 = 17_000.0;

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
    let budget = Budget::read();
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
         tick_cycles_worst = {} # {:.1} %\nflash_bytes = {}\ncode_bytes = {}\nram_bytes = {}\n\
         stack_bytes = {stack} # of {room}\n",
        cost.count,
        cost.worst_instructions,
        100.0 * cycles / PERIOD,
        cost.worst_cycles,
        100.0 * cost.worst_cycles as f64 / PERIOD,
        image.flash_used,
        image.code_used,
        image.ram_used,
    );
    println!("{found}");
    let kept = mean <= budget.tick_instructions_mean
        && cost.worst_instructions <= budget.tick_instructions_worst
        && cycles <= budget.tick_cycles_mean
        && cost.worst_cycles <= budget.tick_cycles_worst
        && image.flash_used <= budget.flash_bytes
        && image.code_used <= budget.code_bytes
        && image.ram_used <= budget.ram_bytes
        && stack <= budget.stack_bytes;
    // What the project promises, however the budget is raised.
    assert!(
        cycles <= 0.25 * PERIOD && cost.worst_cycles as f64 <= 0.5 * PERIOD,
        "the tick takes too much of its period:\n{found}"
    );
    assert!(
        budget.code_bytes <= CCM_BYTES - CODE_RESERVE,
        "code_bytes leaves less than {CODE_RESERVE} of {CCM_BYTES} bytes free"
    );
    assert!(kept, "more than tests/mcu/budget.toml allows:\n{found}");
}

const LUGRE: Effect<f32> = Effect {
    kind: Kind::PreslidingLugre,
    gains: [0.05, 0.1, 0.0, 0.0],
    shapes: [0.01, 0.2, 0.05, 0.0],
};

/// One effect of each sort.
pub(crate) fn mixed_effects() -> [Effect<f32>; EFFECTS] {
    [
        Effect::new(Kind::Stribeck, &[0.05], &[0.1]),
        Effect::new(Kind::PositionFriction, &[0.02, 0.02], &[12.0]),
        Effect::new(Kind::TorqueRipple, &[0.01, 0.01], &[7.0]),
        Effect::new(Kind::DriveDeadzone, &[0.1], &[]),
        Effect::new(Kind::EncoderEccentricityMotor, &[1e-5, 1e-5], &[1.0]),
        LUGRE,
        Effect::new(Kind::ViscousWarmupTime, &[0.02], &[600.0]),
        Effect::new(Kind::CurrentOffset, &[0.01], &[]),
    ]
}

/// Effects of each sort at their dearest, as many as there can be: what runs beside every motion and law below.
fn effects() -> [(&'static str, std::vec::Vec<Effect<f32>>); 5] {
    let fill = |kinds: &[Effect<f32>]| kinds.iter().cycle().take(EFFECTS).copied().collect();
    let mixed = mixed_effects();
    let maxwell = Effect::new(Kind::PreslidingMaxwell, &[0.05, 0.05, 0.05, 0.05], &[0.1]);
    let carried = [
        maxwell,
        Effect::new(Kind::LoadFriction, &[0.1], &[0.5]),
        Effect::new(Kind::PositionFriction, &[0.02, 0.02], &[12.0]),
        Effect::new(Kind::ViscousWarmupHeat, &[0.02], &[600.0]),
        Effect::new(Kind::Spring, &[0.1, 0.2], &[]),
        Effect::new(Kind::TorqueOffset, &[0.01], &[]),
    ];
    [
        ("none", vec![]),
        ("carried by a gear and a contact", carried.to_vec()),
        ("dry with memory", fill(&[LUGRE])),
        ("encoder and ripple", fill(&[mixed[4], mixed[2]])),
        ("one of each sort", mixed.to_vec()),
    ]
}

fn motions() -> [(&'static str, Trajectory<f32>); 7] {
    let chirp = |sweep| {
        Trajectory::Chirp(Chirp {
            start_hz: 0.5,
            end_hz: 4.0,
            sweep,
            duration_us: 700_000,
            ramp_us: 300_000,
            amplitude: 0.05,
            velocity: 0.5,
            acceleration: 10.0,
            again: 0.5,
        })
    };
    let mut harmonics = excitation(41, 5, 1);
    if let Trajectory::Fourier(motion) = &mut harmonics {
        // As many as there can be, short.
        motion.sine = [0.01; HARMONICS].into_iter().collect();
        motion.cosine = motion.sine.clone();
        (motion.period_us, motion.ramp_us) = (1_000_000, 300_000);
        for part in motion.sine.iter_mut().chain(&mut motion.cosine) {
            *part *= 0.1;
        }
    }
    let levels = [0.001_f32; LEVELS].into_iter().collect();
    [
        ("hold", Trajectory::Hold(200_000)),
        ("Fourier", harmonics),
        ("linear chirp", chirp(Sweep::Linear)),
        ("logarithmic chirp", chirp(Sweep::Logarithmic)),
        (
            "staircase",
            Trajectory::Staircase(Staircase {
                levels,
                move_us: 20_000,
                dwell_us: 20_000,
            }),
        ),
        (
            "slow reversals",
            Trajectory::SlowReversals(SlowReversals::new(0.2, 0.1, &[0.05], 2).unwrap()),
        ),
        (
            "friction sweep",
            Trajectory::FrictionSweep(
                FrictionSweep::new(&[0.3; SPEEDS / 4], 0.02, 0.05, 0.01, 0.3).unwrap(),
            ),
        ),
    ]
}

/// Every motion under every law with every sort of effects keeps to what the project promises.
#[test]
fn every_motion_law_and_effect_keeps_to_the_budget() {
    let most = Budget::read().any;
    let mut line = bench(41);
    let (mut text, mut worst_of_all) = (String::new(), [0.0_f64; 2]);
    for (law_name, law) in [
        ("PD", ControlKind::ProportionalDerivative),
        ("computed torque", ControlKind::ComputedTorque),
        ("adaptive", ControlKind::Adaptive),
    ] {
        for (effects_name, effects) in effects() {
            for (name, motion) in motions() {
                let mut told = all_on();
                told.retain(|body| !matches!(body, RequestBody::SetEffects(_)));
                told.push(RequestBody::SetControl(law));
                told.push(RequestBody::SetEffects(effects.iter().copied().collect()));
                board(&mut line).clear_costs();
                let run = driven(&mut line, told, motion, 0.02);
                assert!(run.faults.is_empty(), "{name}: {:?}", run.faults);
                let cost = board(&mut line).cost(CONTROL_EXCEPTION);
                let found = [
                    cost.cycles as f64 / cost.count as f64 / PERIOD,
                    cost.worst_cycles as f64 / PERIOD,
                ];
                let [mean, worst] = found.map(|share| 100.0 * share);
                text += &format!("{law_name}, {effects_name}, {name}: {mean:.1} % {worst:.1} %\n");
                for (most, found) in worst_of_all.iter_mut().zip(found) {
                    *most = most.max(found);
                }
            }
        }
    }
    println!(
        "{text}any_cycles_mean = {:.0}\nany_cycles_worst = {:.0}",
        worst_of_all[0] * PERIOD,
        worst_of_all[1] * PERIOD
    );
    let [mean, worst] = worst_of_all;
    assert!(
        mean <= 0.25 && worst <= 0.5,
        "the tick takes too much of its period:\n{text}"
    );
    assert!(
        mean * PERIOD <= most.cycles_mean && worst * PERIOD <= most.cycles_worst,
        "more than tests/mcu/budget.toml allows:\n{text}"
    );
}
