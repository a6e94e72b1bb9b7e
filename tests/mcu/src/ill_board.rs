//! Boards with the errors of real parts, drawn at random.
//!
//! Ranges marked "estimate" are not from a data sheet. Not drawn: edges of the encoder that are lost, which are a fault
//! ([`BoardFaults`](crate::board::BoardFaults)).

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};
use rig_plant::PlantConfig;
use rig_plant::effect::dead_time::DeadTime;
use rig_plant::effect::unequal_lines::UnequalLines;

use crate::amplifier::{Amplifier, PULSES, Shunt};
use crate::board::{BRIDGE_DELAY, Board};

/// Errors of one board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IllBoard {
    /// Open-circuit supply, V, and its resistance, Ω.
    pub supply: [f64; 2],
    /// Dead time of the half bridges, s.
    pub dead_time: f64,
    /// Amplifier of the motor current.
    pub amplifier: Amplifier,
    /// Lag of that amplifier by its bandwidth, s.
    pub amplifier_lag: f64,
    /// Noise of one reading of the current, A.
    pub current_noise: f64,
    /// Offsets of the encoder's four edges of a line, counts.
    pub edges: [f64; 4],
    /// Largest error of the place at which the encoder makes an edge, counts: another one each time.
    pub edge_jitter: f64,
    /// Time from the shunt to the output of a comparator, s.
    pub comparator_delay: f64,
    /// Share of bytes from the host with an error.
    pub line_errors: f64,
}

/// Numbers drawn one after the other.
struct Draw(Pcg64Mcg);

impl Draw {
    fn within(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / 2_f64.powi(32)
    }

    fn is_heads(&mut self) -> bool {
        self.0.next_u32() >= 1 << 31
    }
}

impl IllBoard {
    /// Draws a board.
    pub fn drawn(seed: u64) -> Self {
        let mut draw = Draw(Pcg64Mcg::seed_from_u64(0x0111_B0A2 ^ seed << 16));
        let shunt = match draw.is_heads() {
            true => Shunt::First,
            false => Shunt::Second,
        };
        let sign = if draw.is_heads() { 1.0 } else { -1.0 };
        Self {
            // A 24 V supply at the lower end of a long cable (estimate).
            supply: [draw.within([19.5, 22.0]), draw.within([0.1, 0.5])],
            // Estimate; a measurement of a DRV8874 found twice the typical propagation.
            dead_time: draw.within([0.2e-6, 0.6e-6]),
            amplifier: Amplifier {
                shunt,
                // The nameplate's sense delay was measured on this board to about 0.1 µs.
                delay: draw.within([BRIDGE_DELAY - 0.07e-6, BRIDGE_DELAY + 0.07e-6]),
                // 0.1 to 0.25 V of the output at an edge of 24 V and 0.1 V/A (estimate). A larger one would reach the
                // thresholds of the comparators.
                error: sign * draw.within([1.0, 2.5]) / 24.0,
                // INA240: 9.6 µs to 0.5 %.
                settling: draw.within([7.0e-6, 9.6e-6]),
            },
            // 360 to 440 kHz (INA240: 400 kHz).
            amplifier_lag: 1.0 / (core::f64::consts::TAU * draw.within([360e3, 440e3])),
            // Four to eight codes of the converter with amplifier and wires.
            current_noise: draw.within([0.03, 0.065]),
            // 9° of a line: an encoder of the better sort states 7 to 15° of phase error.
            edges: core::array::from_fn(|_| draw.within([-0.1, 0.1])),
            line_errors: draw.within([0.0, 2e-3]),
            // 4 to 9° of a line (estimate).
            edge_jitter: draw.within([0.05, 0.1]),
            // Amplifier and comparator (estimate).
            comparator_delay: draw.within([0.3e-6, 0.6e-6]),
        }
    }

    /// Applies the errors of supply, bridge and sensors to a rig.
    pub fn apply(&self, plant: &mut PlantConfig) {
        let [supply, resistance] = self.supply;
        plant.bridge.supply = supply;
        plant.bridge.supply_resistance = resistance;
        plant.bridge.dead_time = Some(DeadTime {
            voltage: self.dead_time * PULSES * supply,
            // About the ripple's amplitude.
            fade_current: 0.2,
        });
        plant.sensors.current.noise = Some(self.current_noise);
        plant.sensors.encoder.unequal_lines = Some(UnequalLines {
            offsets: self.edges,
        });
    }

    /// Applies the errors within a pulse to a board.
    pub fn apply_to_board(&self, board: &mut Board) {
        board.sense_delay = self.amplifier.delay + self.amplifier_lag;
        board.amplifier = Some(self.amplifier);
        board.comparator_delay = self.comparator_delay;
        board.edge_jitter = self.edge_jitter;
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn boards_are_drawn_from_their_seeds() {
        for seed in 0..50 {
            let board = IllBoard::drawn(seed);
            assert_eq!(board, IllBoard::drawn(seed));
            assert_ne!(board, IllBoard::drawn(seed + 1));
            let delay = board.amplifier.delay + board.amplifier_lag;
            assert!((delay - 1e-6).abs() < 0.13e-6, "{delay}");
        }
        let first = |seed| IllBoard::drawn(seed).amplifier.shunt == Shunt::First;
        let firsts = (0..50).filter(|seed| first(*seed)).count();
        assert!((15..=35).contains(&firsts), "{firsts}");
    }
}
