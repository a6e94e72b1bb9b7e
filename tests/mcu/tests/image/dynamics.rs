//! Dynamics of the IRp-6 in f32 on the chip: equal to the desktop's bit for bit, and how many cycles they take.
//!
//! The image is that of `firmware/build dynamics`: from RIG_DYNAMICS_ELF or, without it, from where the build puts it.

use rig_dynamics::{Arm, JOINTS, STATES, states};
use rig_mcu::rig::{EmulatedBoard, power_on};

use crate::{image_of, plant};

/// Functions of the image in the order of its `RESULTS`.
const FUNCTIONS: [&str; 4] = [
    "torques of the motors for a motion",
    "motion under torques of the motors",
    "torques of the joints for a motion, without motors",
    "motion under torques of the joints, without motors",
];
/// Words of a function at a state: its results, then its cycles.
const WORDS: usize = JOINTS + 1;
/// The word behind all states if everything was computed.
const COMPLETE: u32 = 0x1DEA_5EED;
/// The chip's clock, Hz.
const CLOCK: f64 = 170e6;
/// Most cycles of the torques of the motors, at any state and by any supported compiler: half of the processor at 3 kHz, as
/// `docs/firmware.md` says.
const MOST: u32 = 28_333;

/// Runs the image to its end, and returns its words.
fn measured() -> Vec<u32> {
    let image = image_of("RIG_DYNAMICS_ELF", "rig-dynamics");
    let (address, size) = image.symbol_with("RESULTS").unwrap();
    let count = STATES * FUNCTIONS.len() * WORDS + 1;
    assert_eq!(size as usize, 4 * count);
    let mut board: EmulatedBoard = power_on(image, plant(1), 1).unwrap();
    let end = address + size - 4;
    for _ in 0..200 {
        board.run_for(0.005).unwrap();
        if board.word(end) == COMPLETE {
            break;
        }
    }
    let words: Vec<u32> = (0..count as u32)
        .map(|k| board.word(address + 4 * k))
        .collect();
    assert_eq!(words.last(), Some(&COMPLETE), "the image did not finish");
    words
}

#[test]
fn dynamics_on_the_chip_are_the_desktops_bit_for_bit_within_a_control_period() {
    let arm = Arm::<f32>::irp6().unwrap();
    let words = measured();
    let mut cycles = vec![Vec::new(); FUNCTIONS.len()];
    for (state, words) in states().zip(words.chunks_exact(FUNCTIONS.len() * WORDS)) {
        let (q, qd, qdd) = (&state.q, &state.qd, &state.qdd);
        let motor = arm.motor_torque(q, qd, qdd).unwrap();
        let joint = arm.joint_torque(q, qd, qdd).unwrap();
        let expected = [
            motor,
            arm.acceleration(q, qd, &motor).unwrap(),
            joint,
            arm.articulated(q, qd, &joint).unwrap(),
        ];
        for (k, (words, expected)) in words.chunks_exact(WORDS).zip(expected).enumerate() {
            assert_eq!(
                words[..JOINTS],
                expected.map(f32::to_bits),
                "{}",
                FUNCTIONS[k]
            );
            cycles[k].push(words[JOINTS]);
        }
    }
    for (name, cycles) in FUNCTIONS.iter().zip(&cycles) {
        let mean = cycles.iter().map(|c| f64::from(*c)).sum::<f64>() / cycles.len() as f64;
        let most = *cycles.iter().max().unwrap();
        println!(
            "{name}: {mean:.0} cycles on average, {most} at most; {:.1} us, {:.1} kHz at 170 MHz",
            1e6 * f64::from(most) / CLOCK,
            1e-3 * CLOCK / f64::from(most)
        );
    }
    let most = cycles[0].iter().max().unwrap();
    assert!(*most < MOST, "{most} cycles");
}
