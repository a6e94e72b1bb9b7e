//! The rows of identified recordings.

use rig_data::Compensated;
use rig_data::prepare::{Recording, as_recordings, surveyed};
use rig_identify::{
    Base, Identification, IdentifyError, ModelKind, Plan, RowCache, Rows, chain_of, each_rows,
    identified_robot, transmission_of,
};
use rig_model::effects::Effects;
use rig_model::robot::Robot;

/// Streams the rows of recordings over the base parameters, with the treatment of an identification and without the
/// torque of the described effects. `take` gets the place of the recording, too. `model` tells which equations; those of
/// the integral model have the windows of `found`, which must then be of that model.
///
/// # Errors
/// Recordings that cannot be read; a robot without a model.
pub(crate) fn each_row(
    robot: &Robot,
    base: &Base,
    recordings: &[&dyn Recording],
    found: &Identification,
    model: ModelKind,
    take: &mut dyn FnMut(usize, &Rows),
) -> Result<(), IdentifyError> {
    let joints = robot.joints.len();
    let (_, usable) = surveyed(recordings, joints)?;
    let (chain, transmission) = (chain_of(robot)?, transmission_of(robot)?);
    let treatment = &found.details.treatment;
    let seconds = found.details.window.as_ref().map(|(seconds, _)| *seconds);
    let window = seconds.map_or(1, |s| (s / treatment.dt()).round().max(1.0) as usize);
    let plan = Plan {
        chain: &chain,
        transmission: &transmission,
        columns: &base.columns,
        treatment,
        window,
        stride: (window / 4).max(1),
        loudness: vec![1.0; joints],
        one_way: Vec::new(),
        cache: RowCache::default(),
    };
    let (identified, _) = identified_robot(robot, found);
    let effects = Effects::of(&identified).map_err(|e| IdentifyError::Model(e.to_string()))?;
    for (place, recording) in as_recordings(&usable).into_iter().enumerate() {
        let freed = Compensated::new(recording, &effects, &chain, treatment, true)?;
        each_rows(&freed, &plan, model, &mut |rows| {
            take(place, rows);
            Ok(())
        })?;
    }
    Ok(())
}
