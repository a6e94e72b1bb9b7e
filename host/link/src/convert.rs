//! Converts samples of the wire protocol to rows of SI quantities.

use std::f64::consts::TAU;

use rig_shared::wire::message::{Greeting, StateSample};

/// Names of a row's columns, in the order of [`Row::values`].
pub const COLUMNS: [&str; 9] = [
    "t", "q1", "i1", "u1", "ref1", "qd1", "tau_cmd1", "limits", "mode",
];

/// Units of [`COLUMNS`], ASCII; empty for a plain number.
pub const UNITS: [&str; COLUMNS.len()] = ["s", "rad", "A", "V", "rad", "rad/s", "N*m", "", ""];

/// One sample in SI units, on the joint side unless stated. Position, velocity, current, voltage, reference and torque
/// command are means over the window and apply to its middle, `t`. Limits and mode are as in [`StateSample`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Middle of the averaging window, s since control tick 0.
    pub t: f64,
    /// Position, rad.
    pub q1: f64,
    /// Motor current, A.
    pub i1: f64,
    /// Motor voltage, V.
    pub u1: f64,
    /// Reference position, rad.
    pub ref1: f64,
    /// Velocity estimated by the rig, rad/s.
    pub qd1: f64,
    /// Commanded torque, N·m.
    pub tau_cmd1: f64,
    /// Active limits, the bits of [`LimitSet`](rig_shared::safety::LimitSet) as a number.
    pub limits: f64,
    /// Mode, in the order of [`Mode`](rig_shared::safety::Mode) from 0.
    pub mode: f64,
}

impl Row {
    /// Returns the values in the order of [`COLUMNS`].
    pub fn values(&self) -> [f64; COLUMNS.len()] {
        [
            self.t,
            self.q1,
            self.i1,
            self.u1,
            self.ref1,
            self.qd1,
            self.tau_cmd1,
            self.limits,
            self.mode,
        ]
    }
}

/// Converter from samples to rows, from the values in the rig's greeting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    rate: f64,
    decimation: f64,
    radians_per_summed_count: f64,
}

impl Converter {
    /// Creates a converter for the rig with this greeting ([`Session`](super::Session) has checked it).
    pub fn new(greeting: &Greeting) -> Self {
        let decimation = f64::from(greeting.telemetry_decimation);
        let counts_per_joint_turn =
            f64::from(greeting.counts_per_motor_turn) * f64::from(greeting.gear_ratio);
        Self {
            rate: f64::from(greeting.control_rate_hz),
            decimation,
            radians_per_summed_count: TAU / (counts_per_joint_turn * decimation),
        }
    }

    /// Returns the time from one sample to the next, s.
    pub fn period(&self) -> f64 {
        self.decimation / self.rate
    }

    /// Converts sample `k` of a batch whose first window started at control tick `first_tick`.
    ///
    /// The window has `decimation` readings from its first tick on, so their mean applies to tick
    /// first + (decimation − 1)/2.
    pub fn row(&self, first_tick: u64, k: usize, sample: &StateSample) -> Row {
        let tick = first_tick as f64 + (k as f64 + 0.5) * self.decimation - 0.5;
        Row {
            t: tick / self.rate,
            q1: sample.position_sum as f64 * self.radians_per_summed_count,
            i1: f64::from(sample.current),
            u1: f64::from(sample.voltage),
            ref1: f64::from(sample.reference),
            qd1: f64::from(sample.velocity),
            tau_cmd1: f64::from(sample.torque_command),
            limits: f64::from(sample.limits.0),
            mode: f64::from(sample.mode as u8),
        }
    }
}

#[cfg(test)]
mod test {
    use super::*;

    /// A joint in uniform motion, read at every tick: mean position and time must lie on its line.
    #[test]
    fn a_uniform_motion_stays_on_its_line() {
        let greeting = Greeting {
            protocol: 1,
            schema: 0,
            firmware: Default::default(),
            control_rate_hz: 10_000,
            telemetry_decimation: 7,
            estimator_decimation: 1,
            counts_per_motor_turn: 4000,
            gear_ratio: -50.0,
            torque_constant: 0.05,
        };
        let converter = Converter::new(&greeting);
        // 3 counts a tick: 3·10⁴ counts/s of −2·10⁵ counts/turn.
        let speed = 3.0e4 * TAU / -2.0e5;
        let first_tick = 1_000_003;
        for k in 0..4_usize {
            let start = first_tick + k as u64 * 7;
            let sample = StateSample {
                position_sum: (start..start + 7).map(|tick| 3 * tick as i64).sum(),
                ..StateSample::default()
            };
            let row = converter.row(first_tick, k, &sample);
            assert!((row.q1 - speed * row.t).abs() < 1e-9, "{row:?}");
            assert_eq!(row.values().len(), COLUMNS.len());
        }
    }
}
