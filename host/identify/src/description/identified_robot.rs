//! The identified robot as a description for other commands.

use super::combinations::Combinations;
use super::redistributed::redistributed;
use super::written::written;
use crate::bodies::prior::described;
use crate::identification::Identification;
use crate::unmodelled::beyond::with_beyond;
use rig_model::robot::{Robot, Uncertainty};

/// Returns `robot` with the identified values and the dynamics of the base parameters, and a list of remarks.
///
/// Only combinations are identified, so their split is a choice. The first choice is the physically consistent full set
/// ([`crate::StandardSet`]). Otherwise a robot of one link becomes a possible body: positive mass, inertia at least as
/// large as its centre of mass requires, the drive's share unchanged. Otherwise the prior description changes by the
/// smallest step that gives the identified combinations (K⁺·(β − K·π₀)).
pub fn identified_robot(robot: &Robot, identification: &Identification) -> (Robot, Vec<String>) {
    let details = &identification.details;
    let mut robot = with_beyond(
        robot,
        &identification.position_torques,
        identification.base_tilt.as_ref(),
    );
    robot.identified = Some(details.treatment.band());
    let parameters = identification.base_parameters.iter();
    robot.uncertainty = Uncertainty::of(
        parameters.map(|parameter| parameter.expression.clone()),
        &details.estimate.covariance,
    );
    let robot = &robot;
    if let Some(set) = &identification.standard_parameters {
        let mut pi = described(robot, details.combination.ncols());
        for (entry, value) in pi.iter_mut().zip(set.values()) {
            *entry = value;
        }
        return written(robot, &pi, set.prior.to_vec());
    }
    let base = Combinations {
        combination: &details.combination,
        columns: &details.columns,
        values: &details.estimate.values,
    };
    let (result, mut remarks) = redistributed(robot, &base, None);
    if robot.link_count() > 1 {
        remarks.insert(0, "No physically consistent set of standard parameters was found for these values: the split of the combinations over the links is the smallest change of the description, and single masses and inertias need not be those of a body. Use the combinations, not single parameters.".into());
    }
    (result, remarks)
}
