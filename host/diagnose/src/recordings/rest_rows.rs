//! Use of the rows near standstill.

use crate::DiagnoseError;
use crate::fit::refit::Refit;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::regression::{ILLEGIBLE, Rows, combined, take_off};
use rig_numerics::statistics;

/// Ratio of the mean squares near standstill to the expected ones above which these rows are used.
const LOUD: f64 = 1.2;

/// Selects by the training data the joints whose rows near standstill are used. Their residual there must exceed what
/// unknown dry friction at standstill explains.
///
/// # Errors
/// [`DiagnoseError`] of the fit.
pub(crate) fn joints_loud_at_rest(
    context: &DiagnosisContext,
    prepared: &PreparedData,
) -> Result<Vec<usize>, DiagnoseError> {
    let rows = &prepared.rows;
    let refit = Refit::of(context, rows)?;
    let values = &refit.before.values;
    let all = context.anchor.values(values);
    let known = combined(rows.joints(), refit.free.iter().zip(values.iter().copied()));
    let mut residual = rows.torque.clone();
    take_off(&mut residual, &known);
    let loud = |j: &usize| {
        let Some([about, elsewhere]) = rows.about_rests(*j, &residual[*j]) else {
            return true;
        };
        let unknown = ILLEGIBLE * dry_friction(context, rows, &all, *j);
        about > LOUD * (elsewhere + unknown.powi(2))
    };
    Ok((0..rows.joints()).filter(loud).collect())
}

/// Returns the dry friction in the torque of a joint, also that of motors which move several joints.
fn dry_friction(context: &DiagnosisContext, rows: &Rows, values: &[f64], joint: usize) -> f64 {
    (rows.nominal.iter().zip(values).enumerate())
        .filter(|(k, _)| context.nominal.is_coulomb(*k))
        .filter_map(|(_, (column, value))| {
            let own = column[joint].as_ref()?;
            // Away from standstill; near it the column is smaller.
            let used = own.iter().zip(&rows.keep[joint]).filter(|(_, keep)| **keep);
            let size = statistics::median(used.map(|(x, _)| x.abs()).collect())?;
            Some(value.max(0.0) * size)
        })
        .sum()
}
