//! What the controller reads: encoder counts, and the velocity of the firmware's observer.

use rig_model::robot::Robot;
use rig_shared::encoder::{Config, State, step};
use rig_shared::units::EncoderCount;

/// One encoder.
struct Encoder {
    /// rad or m of the joint in a count; 0 if it is exact.
    count: f64,
    state: State<f64>,
    /// Unwrapped counter and true count at the first reading.
    first: Option<(i64, i64)>,
}

/// The encoders of all joints, each at its joint.
pub(crate) struct Encoders {
    config: Config<f64>,
    encoders: Vec<Encoder>,
    /// Measured positions and velocities.
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
}

/// Share of the control rate at which the velocity observer has −3 dB: the largest that the observer allows.
pub(crate) const OBSERVER_SHARE: f64 = 0.1;

/// Returns the encoder step of a joint, rad or m at the joint: the described one, otherwise the default.
pub fn resolution(robot: &Robot, joint: usize, default: f64) -> f64 {
    let described = robot.joints[joint].drive.as_ref().and_then(|drive| {
        let counts = drive.encoder_counts_per_rev? * drive.gear_ratio.abs();
        (counts > 0.0).then(|| core::f64::consts::TAU / counts)
    });
    match described {
        Some(step) if default > 0.0 => step,
        _ => default,
    }
}

impl Encoders {
    pub(crate) fn new(robot: &Robot, rate: f64, default: f64) -> Self {
        let n = robot.joints.len();
        let of = |joint| Encoder {
            count: resolution(robot, joint, default),
            state: State::default(),
            first: None,
        };
        Self {
            config: Config::new(OBSERVER_SHARE * rate, rate),
            encoders: (0..n).map(of).collect(),
            q: vec![0.0; n],
            qd: vec![0.0; n],
        }
    }

    /// Reads all encoders at the true positions and velocities.
    pub(crate) fn read(&mut self, q: &[f64], qd: &[f64]) {
        for (j, encoder) in self.encoders.iter_mut().enumerate() {
            if encoder.count <= 0.0 {
                (self.q[j], self.qd[j]) = (q[j], qd[j]);
                continue;
            }
            let count = (q[j] / encoder.count).floor() as i64;
            let motion = step(
                &self.config,
                &mut encoder.state,
                EncoderCount(count as u16),
                None,
            );
            let (zero, first) = *encoder.first.get_or_insert((motion.counts, count));
            let unwrapped = (motion.counts - zero + first) as f64;
            // The middle of the count.
            self.q[j] = (unwrapped + 0.5) * encoder.count;
            self.qd[j] = motion.velocity * encoder.count;
        }
    }
}
