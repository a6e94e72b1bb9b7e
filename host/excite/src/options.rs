//! Settings of a design.

use crate::Criterion;

/// The parameters that a motion should make identifiable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parameters {
    /// All parameters of an identification: links, drive inertias, friction and offsets.
    #[default]
    All,
    /// Inertial parameters of the links alone, as in papers without friction.
    Links,
    /// The ten inertial parameters of a load at the flange. If the robot has a wrist sensor: by its readings with unknown
    /// constant biases, in the axes of the last joint about the sensor's origin. Otherwise by the joint torques of the
    /// known robot, as additional parameters of the last link.
    Load,
}

/// The scaling of the regressor's columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scaling {
    /// Divided by their sizes, see [`crate`].
    #[default]
    Sizes,
    /// Not scaled: the regressor in SI units, as often in the literature.
    None,
}

/// Settings of a design. The default uses the full limits; `rig excite` keeps a margin.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Optimised criterion.
    pub criterion: Criterion,
    /// Parameters that count.
    pub parameters: Parameters,
    /// Scaling of the columns.
    pub scaling: Scaling,
    /// Standard deviation of each joint's torque, N·m or N: the rows are divided by it.
    pub torque_noise: Option<Vec<f64>>,
    /// Standard deviations of a wrist sensor's forces, N, and moments, N·m: its rows are divided by them. If absent, they
    /// are in proportion to its ranges; without ranges 1 N and 0.05 N·m.
    pub sensor_noise: Option<[f64; 2]>,
    /// Harmonics per joint, 1 to [`HARMONICS`](rig_shared::trajectory::HARMONICS).
    pub harmonics: usize,
    /// Period of the fundamental, s; if absent, chosen from the limits, see [`default_period`](crate::default_period).
    pub period: Option<f64>,
    /// Whole periods at full amplitude.
    pub periods: u16,
    /// Length of the ramp before and after them, s; one period if absent.
    pub ramp: Option<f64>,
    /// Start positions of the joints, rad or m; free if absent.
    pub start: Option<Vec<f64>>,
    /// Free share of the position range, half of it at each end. It must contain the controller's error at a turning
    /// point. Limits of cranks and motors, and regions of the workspace have no margin.
    pub margin: f64,
    /// Used share of the velocity limits, and its square of the acceleration limits, as if time ran slower.
    pub speed_share: f64,
    /// Number of random starts of the optimiser.
    pub starts: u32,
    /// Seed of the starts.
    pub seed: u64,
    /// Number of threads; all of the machine's if absent. The result does not depend on it.
    pub threads: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            criterion: Criterion::default(),
            parameters: Parameters::default(),
            scaling: Scaling::default(),
            torque_noise: None,
            sensor_noise: None,
            harmonics: 5,
            period: None,
            periods: 5,
            ramp: None,
            start: None,
            margin: 0.0,
            speed_share: 1.0,
            starts: 24,
            seed: 1,
            threads: None,
        }
    }
}
