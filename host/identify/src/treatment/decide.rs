//! Treatment of recordings without an identification.

use super::cutoff::Equations;
use super::cutoff::decided;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use crate::options::Options;
use crate::structure::base::Base;
use crate::structure::chain::chain_of;
use crate::structure::chain::transmission_of;
use rig_data::prepare::PrepareOptions;
use rig_data::prepare::PreprocessingPlan;
use rig_data::prepare::Recording;
use rig_data::prepare::Survey;
use rig_model::robot::Robot;

/// Decides the treatment of the `recordings` of `robot` without an identification.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be prepared; an invalid geometry.
pub fn treatment_for(
    robot: &Robot,
    recordings: &[&dyn Recording],
    surveys: Vec<Survey>,
    options: &PrepareOptions,
) -> Result<(Vec<Survey>, PreprocessingPlan), IdentifyError> {
    let (chain, transmission) = (chain_of(robot)?, transmission_of(robot)?);
    let base = Base::structural(robot, ModelKind::Differential, Options::default().seed)?;
    let equations = Equations {
        chain: &chain,
        transmission: &transmission,
        columns: &base.columns,
        complete: robot.effects.is_empty(),
    };
    decided(
        equations,
        recordings,
        surveys,
        options,
        &robot.torque_limits(),
    )
}
