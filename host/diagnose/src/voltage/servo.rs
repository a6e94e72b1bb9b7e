//! A servo with a pendulum for tests: its own physics and discrete controller, independent of the tested simulation.
#![allow(clippy::unwrap_used)]

use rig_data::prepare::InMemory;
use rig_data::{Block, JointColumns};

/// A pendulum on a motor; its controller's output is a share of the supply.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Servo {
    /// Link and drive, kg·m².
    pub inertia: f64,
    /// N·m
    pub weight: f64,
    /// N·m/V
    pub gain: f64,
    /// V·s/rad
    pub emf: f64,
    /// N·m
    pub coulomb: f64,
    /// Encoder counts per turn.
    pub counts: f64,
    /// Proportional, integral, derivative gain, feed-forward of velocity and acceleration.
    pub gains: [f64; 5],
    /// Largest share.
    pub limit: f64,
    /// V without load, V per share.
    pub supply: [f64; 2],
}

impl Default for Servo {
    fn default() -> Self {
        Self {
            inertia: 0.0065,
            weight: 0.4805,
            gain: 0.1,
            emf: 0.35,
            coulomb: 0.02,
            counts: 4096.0,
            gains: [4.0, 0.0, 0.0, 0.0, 0.0],
            limit: 1.0,
            supply: [7.4, -0.3],
        }
    }
}

/// Step of the integration, s.
const DT: f64 = 2.0e-5;
/// Period of the controller, s.
const CONTROL: f64 = 1.0e-3;
/// Period of the recording, s.
const PERIOD: f64 = 5.0e-3;
/// Length of a recording, s.
const LENGTH: f64 = 6.0;

/// Returns reference position, velocity and acceleration: two sinusoids that start at rest.
fn reference(number: usize, t: f64) -> [f64; 3] {
    let pace = 1.0 + 0.4 * number as f64;
    let wave = |amplitude: f64, omega: f64| {
        let (sin, cos) = (omega * t).sin_cos();
        let a = amplitude;
        [a * (1.0 - cos), a * omega * sin, a * omega * omega * cos]
    };
    let [a, b] = [wave(0.5, 2.0 * pace), wave(-0.2, 5.1 * pace)];
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl Servo {
    fn read(&self, q: f64) -> f64 {
        let count = std::f64::consts::TAU / self.counts;
        (q / count).round() * count
    }

    /// Returns the `number`-th recorded motion, about `offset`, rad: encoder positions, voltage, supply, reference.
    pub(crate) fn recorded(&self, number: usize, offset: f64) -> InMemory {
        let [kp, ki, kd, kv, ka] = self.gains;
        let (mut q, mut v, mut share, mut integral) = (offset, 0.0_f64, 0.0_f64, 0.0);
        let (mut before, mut speed) = (offset, 0.0);
        let [control, record] = [CONTROL, PERIOD].map(|period| (period / DT).round() as usize);
        let mut columns: [Vec<f64>; 5] = Default::default();
        for step in 0..(LENGTH / DT) as usize {
            let now = step as f64 * DT;
            let [wanted, wanted_v, wanted_a] = reference(number, now);
            let wanted = wanted + offset;
            if step % control == 0 {
                let measured = self.read(q);
                // A filter of 10 ms on the encoder's difference.
                speed += 0.1 * ((measured - before) / CONTROL - speed);
                before = measured;
                let error = wanted - measured;
                let wish = kp * error + ki * integral - kd * speed + kv * wanted_v + ka * wanted_a;
                share = wish.clamp(-self.limit, self.limit);
                // The integral stops while it drives further into the limit.
                if wish == share || wish * error < 0.0 {
                    integral += CONTROL * error;
                }
            }
            let supply = self.supply[0] + self.supply[1] * share.abs();
            if step % record == 0 {
                let row = [now, self.read(q), share * supply, supply, wanted];
                columns
                    .iter_mut()
                    .zip(row)
                    .for_each(|(column, x)| column.push(x));
            }
            let driving = self.gain * (share * supply - self.emf * v) - self.weight * q.sin();
            let stop = self.inertia * v / DT + driving;
            v = match stop.abs() <= self.coulomb {
                true => 0.0,
                false => v + DT * (driving - self.coulomb * stop.signum()) / self.inertia,
            };
            q += DT * v;
        }
        let [t, q, voltage, supply, reference] = columns;
        InMemory {
            label: format!("motion {number}"),
            blocks: vec![Block {
                t,
                joints: vec![JointColumns {
                    q,
                    voltage: Some(voltage),
                    reference: Some(reference),
                    ..JointColumns::default()
                }],
                extra: vec![("supply".into(), supply)],
                first_line: 2,
                ..Block::default()
            }],
        }
    }
}
