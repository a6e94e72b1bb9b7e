//! Rows of a trial of treatments: the beginnings of long recordings.

use crate::error::IdentifyError;
use crate::options::ModelKind;
use crate::rows::equation::Rows;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use rig_data::prepare::Beginning;
use rig_data::prepare::PreprocessingPlan;
use rig_data::prepare::Recording;
use rig_data::prepare::each_of;
use rig_data::prepare::threads;

/// Total length of the recordings in a trial, s: five periods of a usual motion of 10 s. Limits the cost for long
/// recordings.
const TRIAL_SECONDS: f64 = 50.0;

/// Returns the beginnings of `recordings` that a trial uses.
pub(crate) fn beginnings<'a>(
    recordings: &[&'a dyn Recording],
    treatment: &PreprocessingPlan,
) -> Vec<Beginning<'a>> {
    let rows = (TRIAL_SECONDS * treatment.sample_rate) as usize / recordings.len().max(1);
    (recordings.iter())
        .map(|&recording| Beginning { recording, rows })
        .collect()
}

/// Factorises the rows of each joint's equation for which `used` (arguments: rows, joint, row) is true.
///
/// # Errors
/// [`IdentifyError`]: recordings that cannot be read.
pub(crate) fn factors_of(
    recordings: &[&dyn Recording],
    plan: &Plan,
    used: &(dyn Fn(&Rows, usize, usize) -> bool + Sync),
) -> Result<Vec<TriangularFactor>, IdentifyError> {
    let p = plan.columns.len();
    let mut factors = vec![TriangularFactor::new(p); plan.loudness.len()];
    for recording in recordings {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            each_of(
                threads(plan.treatment.threads),
                &mut factors,
                &|k, factor| {
                    let Some(equation) = rows.equations.get(k) else {
                        return;
                    };
                    for i in (0..equation.y.len()).filter(|&i| used(rows, k, i)) {
                        factor.push(&equation.x[i * p..(i + 1) * p], equation.y[i], 1.0);
                    }
                },
            );
            Ok(())
        })?;
    }
    Ok(factors)
}

/// Returns true if a row is usable.
pub(crate) fn kept(rows: &Rows, joint: usize, row: usize) -> bool {
    rows.equations[joint].keep[row]
}
