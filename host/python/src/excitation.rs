//! Design of motions.

use std::sync::Arc;

use pyo3::prelude::*;
use rig::commands::CommandError;
use rig_excite::{Criterion, Options, design};

use crate::error::{Error, warn};
use crate::robot::Robot;
use crate::trajectory::Trajectory;
use crate::watch::run;

/// Design a Fourier motion within the robot's limits that makes its parameters identifiable, as ``rig excite``.
///
/// Not checked: collisions of any kind, cables. The limits hold for the reference only. Watch a first run on a robot at
/// low speed (``speed_share=0.2``) and keep the emergency stop at hand.
///
/// ``period``: of the slowest harmonic, s. ``periods``: whole periods at full amplitude. ``ramp``: s.
/// ``margin``: free share of each position range. ``speed_share``: used share of the velocity limits.
/// ``starts``: random starts of the optimiser. ``progress``: called with the share of the work, 0 to 1.
#[pyfunction]
#[pyo3(signature = (
    robot, *, criterion = "cond", harmonics = 5, period = None, periods = 5, ramp = None, start = None,
    torque_noise = None, margin = 0.1, speed_share = 0.9, starts = 24, seed = 1, even_if_wrong = false,
    progress = None,
))]
pub(crate) fn excite(
    py: Python<'_>,
    robot: &Robot,
    criterion: &str,
    harmonics: usize,
    period: Option<f64>,
    periods: u16,
    ramp: Option<f64>,
    start: Option<Vec<f64>>,
    torque_noise: Option<Vec<f64>>,
    margin: f64,
    speed_share: f64,
    starts: u32,
    seed: u64,
    even_if_wrong: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Trajectory> {
    let Some(criterion) = Criterion::from_name(criterion) else {
        return Err(Error::new_err(format!(
            "criterion is \"{criterion}\"; give \"cond\", \"min-singular\" or \"d-optimal\"."
        )));
    };
    let options = Options {
        criterion,
        harmonics,
        period,
        periods,
        ramp,
        start,
        torque_noise,
        margin,
        speed_share,
        starts,
        seed,
        ..Options::default()
    };
    let description = robot.description();
    let kept = Arc::clone(&description);
    let found = run(py, progress.as_ref(), &|text| text, move |watch| {
        if !even_if_wrong && !description.robot.limits_in_degrees().is_empty() {
            return Err(CommandError::Implausible(
                "A motion sized by limits that look like degrees may break the robot, so none was designed; correct the limits, or give even_if_wrong=True if they are right.".to_owned(),
            ));
        }
        let share = |done: u64, total: u64| done as f64 / total.max(1) as f64;
        Ok(design(&description.robot, &options, |done, total| {
            watch.at_or_unwind(share(done, total));
        })?)
    })?;
    warn(py, &found.notes)?;
    Ok(Trajectory::of(found, kept))
}
