//! Use of the rows near standstill.

use crate::DiagnoseError;
use crate::fit::refit::Refit;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::regression::{ILLEGIBLE, combined, take_off};

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
    let source = context.source(prepared, &context.anchor.values(values))?;
    let known = combined(rows.joints(), refit.free.iter().zip(values.iter().copied()));
    let mut residual = rows.torque.clone();
    take_off(&mut residual, &known);
    let loud = |j: &usize| {
        let Some([about, elsewhere]) = rows.about_rests(*j, &residual[*j]) else {
            return true;
        };
        about > LOUD * (elsewhere + (ILLEGIBLE * source.coulomb(*j)).powi(2))
    };
    Ok((0..rows.joints()).filter(loud).collect())
}
