//! What recordings lack to show an effect.

/// What recordings of a joint lack; lengths in rad or m, speeds per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Missing {
    /// Torque or current.
    Torque,
    /// A motion: the joint moves over a range only.
    Motion { range: f64 },
    /// A range for the shortest wave along the position.
    Span { span: f64, shortest: f64 },
    /// Reversals.
    Reversals { found: u32, least: u32 },
    /// Seconds in slow motion below `speed`, and in fast motion above three times that.
    SlowMotion { speed: f64, slow: f64, fast: f64 },
    /// A highest speed that is `least` times the typical one.
    SpeedRange {
        typical: f64,
        highest: f64,
        least: f64,
    },
    /// A range for an effect over turns, rad.
    Travel { range: f64, least: f64 },
    /// A description of the gear ratio.
    GearRatio,
    /// Turns of the motor below a speed of it, rad/s.
    SlowTurns { turns: f64, speed: f64, ratio: f64 },
    /// A range of the transmitted torque, N·m or N.
    LoadRange { range: f64, mean: f64, least: f64 },
    /// A long recording, s.
    Duration { longest: f64, least: f64 },
    /// The motor's voltage.
    Voltage,
    /// A temperature.
    Temperature,
    /// A rise of the temperature, K.
    Warming { rise: f64 },
    /// A motion of another joint; `alone` if the robot has none.
    OtherJoint { alone: bool },
    /// Described inertial values.
    Prior,
}
