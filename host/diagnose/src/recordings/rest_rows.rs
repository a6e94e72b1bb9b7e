//! Use of the rows near standstill.

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::fit::refit::Refit;
use crate::fit::solution::{Solution, solve};
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::rows::regression::{Column, ILLEGIBLE, Rows};
use crate::search::shapes::{falls_throughout, grid};
use rig_numerics::statistics;
use rig_numerics::vector::axpy;
use rig_shared::effects::{Kind, SHAPES};

/// Ratio of the mean squares near standstill to the expected ones above which these rows are used.
const LOUD: f64 = 1.2;
/// Standard deviations of a breakaway from which the rows away from standstill show it.
const SHOWN: f64 = 3.0;

/// Selects by the training data the joints whose rows near standstill are used. Their residual there must exceed what
/// unknown dry friction at standstill explains.
///
/// At standstill the breakaway of Stribeck friction is as unknown. So a joint whose other rows show Stribeck friction is not
/// selected if this explains what is left near standstill, unless presliding does: its torque is known there.
///
/// The Stribeck friction is fitted to the rows of `prepared`, which leave all samples near standstill out. Kept, such a sample
/// would pull the friction that is to explain it.
///
/// # Errors
/// [`DiagnoseError`] of the fit.
pub(crate) fn joints_loud_at_rest(
    context: &DiagnosisContext,
    prepared: &PreparedData,
) -> Result<Vec<usize>, DiagnoseError> {
    let whole = context.rows_with_rests(prepared, None)?;
    let refit = Refit::of(context, &prepared.rows)?;
    let judged = Judged {
        context,
        prepared,
        free: context.anchor.columns(&whole),
        whole,
    };
    let mut loud = Vec::new();
    for joint in 0..judged.whole.joints() {
        if judged.is_loud(joint, &refit.before.values, None, 0.0)
            && (judged.is_loud_beside_stribeck(joint, &refit)?
                || judged.is_quiet_beside_presliding(joint)?)
        {
            loud.push(joint);
        }
    }
    Ok(loud)
}

/// A law that explains most of the residual of a fit, alone.
struct Law {
    candidate: Candidate,
    shapes: [f64; SHAPES],
    column: Column,
}

/// What fits leave near standstill.
struct Judged<'j, 'a> {
    context: &'j DiagnosisContext<'a>,
    prepared: &'j PreparedData,
    /// Rows with all samples.
    whole: Rows,
    /// Columns of the free nominal directions on these rows.
    free: Vec<Column>,
}

impl Judged<'_, '_> {
    /// Returns true if a joint's residual near standstill is more than unknown friction. `values` are the coefficients of the
    /// nominal columns, and of the column of a `law`, if any; `breakaway` is the friction of that law that is unknown at standstill.
    fn is_loud(&self, joint: usize, values: &[f64], law: Option<&Column>, breakaway: f64) -> bool {
        let rows = &self.whole;
        let mut residual = rows.torque[joint].clone();
        for (column, value) in self.free.iter().chain(law).zip(values) {
            if let Some(own) = &column[joint] {
                axpy(-value, own, &mut residual);
            }
        }
        let Some([about, elsewhere]) = rows.about_rests(joint, &residual) else {
            return true;
        };
        let nominal = self.context.anchor.values(&values[..self.free.len()]);
        let dry = dry_friction(self.context, rows, &nominal, joint);
        let unknown = ILLEGIBLE * (dry + breakaway);
        about > LOUD * (elsewhere + unknown.powi(2))
    }

    /// Returns true if a joint's used rows show no Stribeck friction, or what is left near standstill is more than it explains.
    fn is_loud_beside_stribeck(&self, joint: usize, refit: &Refit) -> Result<bool, DiagnoseError> {
        let mut source = self.source(refit, &self.prepared.rows)?;
        let kinds = [Kind::Stribeck, Kind::StribeckExponential];
        // Below it the velocity of a sample is noise.
        let slow = self.prepared.treatment.speed_threshold.get(joint);
        let least = slow.copied().unwrap_or(0.0);
        let Some(law) = best(&source, refit, &kinds, (joint, least))? else {
            return Ok(true);
        };
        let Some(solution) = with_law(refit, &law) else {
            return Ok(true);
        };
        let last = solution.values.len() - 1;
        let breakaway = solution.values[last];
        if breakaway < SHOWN * solution.std(last) {
            return Ok(true);
        }
        source.left_out = &self.whole.left_out;
        let columns = source.columns(&law.candidate, &law.shapes)?;
        Ok(self.is_loud(joint, &solution.values, columns.first(), breakaway))
    }

    /// Returns true if presliding explains what is left near standstill, fitted to these rows too.
    fn is_quiet_beside_presliding(&self, joint: usize) -> Result<bool, DiagnoseError> {
        let rows = (self.context).rows_with_rests(self.prepared, Some(joint))?;
        let refit = Refit::of(self.context, &rows)?;
        let source = self.source(&refit, &rows)?;
        let Some(law) = best(&source, &refit, &[Kind::PreslidingDahl], (joint, 0.0))? else {
            return Ok(false);
        };
        let is_quiet = |s: Solution| !self.is_loud(joint, &s.values, Some(&law.column), 0.0);
        Ok(with_law(&refit, &law).is_some_and(is_quiet))
    }

    fn source<'s>(&'s self, refit: &Refit, rows: &'s Rows) -> Result<Source<'s>, DiagnoseError> {
        let nominal = self.context.anchor.values(&refit.before.values);
        let mut source = self.context.source(self.prepared, &nominal)?;
        source.left_out = &rows.left_out;
        Ok(source)
    }
}

/// Returns the law of these kinds on a joint that leaves least on the used rows, on the grid of its shapes. The first shape is
/// at least `least`.
fn best(
    source: &Source,
    refit: &Refit,
    kinds: &[Kind],
    (joint, least): (usize, f64),
) -> Result<Option<Law>, DiagnoseError> {
    let mut best: Option<(f64, Law)> = None;
    for kind in kinds {
        let candidate = Candidate::on(*kind, joint);
        let mut points = grid(*kind);
        let fastest = source.fastest(joint);
        points.retain(|p| p[0] >= least && !falls_throughout(*kind, p, fastest));
        let columns = source.columns_of(1, &candidate, &points)?;
        for (shapes, mut columns) in points.into_iter().zip(columns) {
            let beside = refit.base.beside(&columns);
            let explained = beside.and_then(|b| refit.base.explained(&b, &[[0.0, f64::INFINITY]]));
            if let Some((share, _)) = explained
                && best.as_ref().is_none_or(|(most, _)| share > *most)
            {
                let column = columns.swap_remove(0);
                best = Some((
                    share,
                    Law {
                        candidate,
                        shapes,
                        column,
                    },
                ));
            }
        }
    }
    Ok(best.map(|(_, law)| law))
}

/// Fits the nominal model with a law.
fn with_law(refit: &Refit, law: &Law) -> Option<Solution> {
    let columns: Vec<&Column> = refit.free.iter().chain([&law.column]).collect();
    solve(&refit.plain, &columns, &[])
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
