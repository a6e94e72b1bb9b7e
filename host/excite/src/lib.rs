//! Excitation motions: motions that make the parameters of a robot identifiable.
//!
//! [`design`] finds Fourier series (Swevers et al. 1997) that are optimal for the base parameters within the limits on
//! position, velocity, acceleration and torque, and within the regions of the base frame that points of the links must
//! not leave. [`staged`] makes chirps, staircases, slow reversals and friction sweeps from the same limits of the
//! joints. [`TrajectoryFile`] stores both; [`replay`] runs one through the simulated closed loop.
//!
//! # Scaling
//! The columns of the regressor have different units, so its condition number alone has no meaning. With
//! [`Scaling::Sizes`] each column is divided by its own size: its root mean square over uniformly drawn states within
//! the limits. A singular value then tells how well a combination of parameters is excited, relative to the largest
//! possible excitation of one column. No prior value of a parameter enters, so an offset expected to be zero counts as
//! much as any other.
//!
//! Each joint's rows are divided by the standard deviation of its torque ([`Options::torque_noise`]). If that is not
//! given, they are divided by its torque limit, if several joints all have one.
//!
//! ```
//! use rig_excite::{Options, design};
//! use rig_model::robot::{ONE_LINK_TEMPLATE, Robot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(ONE_LINK_TEMPLATE, "one-link.toml".as_ref())?;
//! let design = design(&robot, &Options::default(), |_, _| ())?;
//! println!("{}", design.file.to_toml(&robot));
//! # Ok(())
//! # }
//! ```
//!
//! Limits: no collisions; no [`rig_model::robot::Robot::effects`]; no controller errors (the limits hold for the
//! reference). [`staged`] does not check the regions of the workspace and says so.

mod certificate;
mod criterion;
mod drives;
mod error;
mod fit;
mod frame;
mod interval;
mod optimise;
mod problem;
mod replay;
mod schedule;
mod search;
mod stages;
mod trajectory_file;
mod workspace;

#[cfg(test)]
mod tests;

use rig_model::robot::Robot;

pub use certificate::Reach;
pub use criterion::{Criterion, Values};
pub use error::ExciteError;
pub use frame::default_period;
pub use replay::STEP as REPLAY_STEP;
pub use replay::{Noise, Replay, SETTLING, drawn, replay};
pub use stages::{StagedKind, StagedOptions, staged};
pub use trajectory_file::{
    COASTING, DesignRecord, JointTrajectory, SampledReference, TrajectoryFile, load_reference,
};

use frame::frame_of;
use search::search;

/// The parameters that a motion should make identifiable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parameters {
    /// All parameters of an identification: links, drive inertias, friction and offsets.
    #[default]
    All,
    /// Inertial parameters of the links alone, as in papers without friction.
    Links,
}

/// The scaling of the regressor's columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scaling {
    /// Divided by their sizes, see [`self`].
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
    /// Harmonics per joint, 1 to [`HARMONICS`](rig_shared::trajectory::HARMONICS).
    pub harmonics: usize,
    /// Period of the fundamental, s; if absent, chosen from the limits, see [`default_period`].
    pub period: Option<f64>,
    /// Whole periods at full amplitude.
    pub periods: u16,
    /// Length of the ramp before and after them, s; one period if absent.
    pub ramp: Option<f64>,
    /// Start positions of the joints, rad or m; free if absent.
    pub start: Option<Vec<f64>>,
    /// Free share of the position range, half of it at each end. It must contain the controller's error at a turning
    /// point. Limits of cranks and regions of the workspace have no margin.
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

/// Distance of a point to the edge of its region.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearance {
    /// Name of the joint whose link carries the point.
    pub joint: String,
    /// Unit normal of the edge towards the inside, in the base frame.
    pub normal: [f64; 3],
    /// Lower bound of the distance, m.
    pub distance: f64,
}

/// An optimal motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    /// The motion, ready to be saved and run.
    pub file: TrajectoryFile,
    /// Its quality.
    pub values: Values,
    /// The base parameters for which it is optimal, in the notation of the literature.
    pub base_parameters: Vec<String>,
    /// Upper bounds of each joint's motion.
    pub reach: Vec<Reach>,
    /// Lower bounds of the points' distances to the edges of their regions.
    pub clearances: Vec<Clearance>,
    /// Criterion of each start that was fully refined and is within the limits, in order of the starts.
    pub reached: Vec<f64>,
    /// Notes for the user, one sentence each.
    pub notes: Vec<String>,
}

/// Finds the motion with the best criterion within the robot's limits.
///
/// Exact gradients improve random starts in parallel threads. The most promising are refined on a finer grid, proved to
/// stay within the limits at every instant, and compared by their criterion; the best is returned. The result depends
/// on robot and options only, not on the number of threads. `progress` receives the completed and the total number of
/// units of work.
///
/// # Errors
/// [`ExciteError`]: missing limits, options out of range, a robot without a model, or no motion within the limits (the
/// joint and the limit at fault are named).
pub fn design(
    robot: &Robot,
    options: &Options,
    progress: impl FnMut(u64, u64),
) -> Result<Design, ExciteError> {
    let (frame, base, notes) = frame_of(robot, options)?;
    let (best, reached) = search(robot, &frame, options, progress)?;
    Ok(Design {
        file: TrajectoryFile {
            robot: robot.name.clone(),
            design: Some(DesignRecord {
                criterion: options.criterion,
                value: options.criterion.of(&best.values),
                condition_number: best.values.condition_number,
                seed: options.seed,
            }),
            drive_off: None,
            joints: robot
                .joints
                .iter()
                .zip(&best.motions)
                .map(|(joint, motion)| JointTrajectory {
                    name: joint.name.clone(),
                    start: motion.base,
                    trajectory: frame.schedule.trajectory(&motion.coefficients),
                })
                .collect(),
        },
        values: best.values,
        base_parameters: (0..base.len()).map(|k| base.expression(k)).collect(),
        clearances: frame
            .planes
            .iter()
            .zip(&best.reached.heights)
            .map(|(plane, height)| Clearance {
                joint: robot.joints[plane.link].name.clone(),
                normal: plane.normal,
                distance: height - plane.least,
            })
            .collect(),
        reach: best.reached.joints,
        reached,
        notes,
    })
}
