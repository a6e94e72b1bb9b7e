//! Use of the rows near standstill.

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::fit::refit::Refit;
use crate::fit::solution::solve;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::regression::{Column, ILLEGIBLE, Rows, combined, take_off};
use crate::search::shapes::{falls_throughout, grid};
use rig_numerics::statistics;
use rig_shared::effects::{Kind, SHAPES};

/// Ratio of the mean squares near standstill to the expected ones above which these rows are used.
const LOUD: f64 = 1.2;

/// Selects by the training data the joints whose rows near standstill are used. Their residual there must exceed what
/// unknown dry friction at standstill explains, also beside the Stribeck friction that fits the other rows best: at
/// standstill its breakaway is as unknown.
///
/// The fits are those of `prepared`, whose rows leave all samples near standstill out. Kept, such a sample would pull the
/// Stribeck friction that is to explain it.
///
/// # Errors
/// [`DiagnoseError`] of the fit.
pub(crate) fn joints_loud_at_rest(
    context: &DiagnosisContext,
    prepared: &PreparedData,
) -> Result<Vec<usize>, DiagnoseError> {
    let judged = Judged {
        context,
        prepared,
        whole: context.rows_with_rests(prepared)?,
        refit: Refit::of(context, &prepared.rows)?,
    };
    let mut loud = Vec::new();
    for joint in 0..judged.whole.joints() {
        if judged.is_loud(joint, &judged.refit.before.values, None)
            && judged.is_loud_beside_stribeck(joint)?
        {
            loud.push(joint);
        }
    }
    Ok(loud)
}

/// A fit to rows without standstill, and what it leaves with it.
struct Judged<'j, 'a> {
    context: &'j DiagnosisContext<'a>,
    prepared: &'j PreparedData,
    /// Rows with all samples.
    whole: Rows,
    /// The fit without those near standstill.
    refit: Refit<'j>,
}

impl Judged<'_, '_> {
    /// Returns true if a joint's residual near standstill is more than unknown friction. `values` are the coefficients of the
    /// nominal columns, and of the column `breakaway` of Stribeck friction, if any.
    fn is_loud(&self, joint: usize, values: &[f64], breakaway: Option<&Column>) -> bool {
        let (rows, context) = (&self.whole, self.context);
        let free = context.anchor.columns(rows);
        let columns = free.iter().chain(breakaway);
        let known = combined(rows.joints(), columns.zip(values.iter().copied()));
        let mut residual = rows.torque.clone();
        take_off(&mut residual, &known);
        let Some([about, elsewhere]) = rows.about_rests(joint, &residual[joint]) else {
            return true;
        };
        let (values, more) = values.split_at(free.len());
        let dry = dry_friction(context, rows, &context.anchor.values(values), joint);
        let unknown = ILLEGIBLE * (dry + more.iter().sum::<f64>());
        about > LOUD * (elsewhere + unknown.powi(2))
    }

    /// Returns the same beside the Stribeck friction that leaves least without standstill.
    fn is_loud_beside_stribeck(&self, joint: usize) -> Result<bool, DiagnoseError> {
        let nominal = (self.context.anchor).values(&self.refit.before.values);
        let mut source = self.context.source(self.prepared, &nominal)?;
        let mut best: Option<(f64, Candidate, [f64; SHAPES], Column)> = None;
        for kind in [Kind::Stribeck, Kind::StribeckExponential] {
            let candidate = Candidate::on(kind, joint);
            let mut points = grid(kind);
            points.retain(|p| !falls_throughout(kind, p, source.fastest(joint)));
            let columns = source.columns_of(1, &candidate, &points)?;
            for (point, mut columns) in points.into_iter().zip(columns) {
                let beside = self.refit.base.beside(&columns);
                let explained =
                    beside.and_then(|b| self.refit.base.explained(&b, &[[0.0, f64::INFINITY]]));
                if let Some((share, _)) = explained
                    && best.as_ref().is_none_or(|(most, ..)| share > *most)
                {
                    best = Some((share, candidate, point, columns.swap_remove(0)));
                }
            }
        }
        let Some((_, candidate, point, column)) = best else {
            return Ok(true);
        };
        let columns: Vec<&Column> = self.refit.free.iter().chain([&column]).collect();
        let Some(solution) = solve(&self.refit.plain, &columns, &[]) else {
            return Ok(true);
        };
        source.left_out = &self.whole.left_out;
        let breakaway = source.columns(&candidate, &point)?;
        Ok(self.is_loud(joint, &solution.values, breakaway.first()))
    }
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
