//! Reasons why a trajectory cannot run.

use core::fmt;

use crate::scalar::Scalar;

/// Reason why a trajectory cannot run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrajectoryError<T> {
    /// A value is not finite or describes no motion; the field's name.
    BadValue(&'static str),
    /// Below the lowest position.
    PositionLow {
        /// Time of the first violation, s.
        time: T,
        /// Position there, rad.
        value: T,
        /// The limit, rad.
        limit: T,
    },
    /// Above the highest position.
    PositionHigh {
        /// Time of the first violation, s.
        time: T,
        /// Position there, rad.
        value: T,
        /// The limit, rad.
        limit: T,
    },
    /// Faster than allowed.
    Velocity {
        /// Time of the first violation, s.
        time: T,
        /// Speed there, rad/s.
        value: T,
        /// The limit, rad/s.
        limit: T,
    },
    /// Accelerates harder than allowed.
    Acceleration {
        /// Time of the first violation, s.
        time: T,
        /// Acceleration there, rad/s².
        value: T,
        /// The limit, rad/s².
        limit: T,
    },
}

impl<T: Scalar> fmt::Display for TrajectoryError<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, unit, time, value, limit) = match *self {
            Self::BadValue(name) => {
                return write!(f, "trajectory value {name} is out of its range");
            }
            Self::PositionLow { time, value, limit } => {
                ("falls below its lowest position", "rad", time, value, limit)
            }
            Self::PositionHigh { time, value, limit } => (
                "rises above its highest position",
                "rad",
                time,
                value,
                limit,
            ),
            Self::Velocity { time, value, limit } => {
                ("exceeds its highest speed", "rad/s", time, value, limit)
            }
            Self::Acceleration { time, value, limit } => (
                "exceeds its highest acceleration",
                "rad/s^2",
                time,
                value,
                limit,
            ),
        };
        write!(
            f,
            "the trajectory {what} at {:.3} s: {:.4} {unit} where {:.4} is allowed",
            time.to_f64(),
            value.to_f64(),
            limit.to_f64()
        )
    }
}

impl<T: Scalar> core::error::Error for TrajectoryError<T> {}
