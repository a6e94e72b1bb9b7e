//! The optimal motion of a robot.

use crate::certificate::{MotorReach, Reach};
use crate::effort::Effort;
use crate::search::search;
use crate::setup::frame_of;
use crate::{DesignRecord, ExciteError, JointTrajectory, Options, TrajectoryFile, Values};
use rig_model::robot::Robot;

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
    /// The parameters for which it is optimal: base parameters in the notation of the literature, or those of a load.
    pub base_parameters: Vec<String>,
    /// Upper bounds of each joint's motion.
    pub reach: Vec<Reach>,
    /// Upper bounds of each motor's motion; empty if no motor of coupled drives has limits.
    pub motors: Vec<MotorReach>,
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
    design_measured(robot, options, progress).map(|(design, _)| design)
}

/// Same as [`design`], with the work of the search's threads and the time that it took. These differ from run to run.
///
/// # Errors
/// Same as [`design`].
pub fn design_measured(
    robot: &Robot,
    options: &Options,
    progress: impl FnMut(u64, u64),
) -> Result<(Design, Effort), ExciteError> {
    let (frame, names, notes) = frame_of(robot, options)?;
    let (best, reached, effort) = search(robot, &frame, options, progress)?;
    let design = Design {
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
        base_parameters: names,
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
        motors: best.reached.motors,
        reached,
        notes,
    };
    Ok((design, effort))
}
