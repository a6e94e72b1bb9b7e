//! The speed above which friction is Coulomb and viscous, found from the recordings.

use super::left_out::{BETTER, Stretches};
use super::trial_rows::factors_of;
use super::trial_rows::kept;
use crate::error::IdentifyError;
use crate::estimators::linear::by_noise;
use crate::options::ModelKind;
use crate::rows::equation::Rows;
use crate::rows::factor::TriangularFactor;
use crate::rows::plan::Plan;
use crate::rows::stream::each_rows;
use rig_data::prepare::Recording;
use rig_numerics::autocorrelation::Autocorrelation;
use rig_numerics::svd::Svd;
use rig_numerics::vector::dot_in_order;

/// Share of the RMS speed above which rows are always used; no threshold is higher.
const BELIEVED: f64 = 0.5;
/// Smallest threshold with several joints, as a share of the RMS speed: slower rows are few, and their friction is
/// seldom Coulomb and viscous. Rows up to half the RMS speed are excluded only if they are noisier ([`NOISIER`]), not
/// if their friction differs: they also determine the inertia of the other joints. On the Stäubli TX40 friction grows
/// less than in proportion to speed. There half the RMS speed leaves 43 of 60 parameters within two standard deviations
/// of the published ones; 0.1 rad/s (4 % of its RMS speed) leaves 58.
const SHARE_OF_SEVERAL: f64 = 0.04;
/// Mean square of a bin's residuals, as a multiple of that of faster rows, above which the bin's rows are excluded.
/// More than half of the residual is then stiction, including its filter tails in nearby rows, instead of noise.
const NOISIER: f64 = 2.0;
/// Number of standard deviations of the bin's mean square by which it must exceed that of faster rows.
const SURELY: f64 = 3.0;
/// Number of passes over the bins. Each pass starts from a fit without the rows excluded so far.
const LOOKS: usize = 4;
/// Ratio of neighbouring bin bounds: half an octave.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Number of a bin's own friction columns: deceleration and acceleration.
const OWN: usize = 2;
/// A bin is refused if its own friction explains more than this many variances: the 99 % quantile of χ² with [`OWN`]
/// degrees of freedom. Under a true model one bin in 100 is refused by chance, which costs rows but moves no value.
const REFUSED: f64 = 9.21;
/// Ratio of the threshold to the speed of the fastest refused bin. A decaying friction term extends beyond the bin in
/// which noise hides it. At twice the speed a quarter of a tail that falls with its square remains (Hess & Soom 1990),
/// and less of an exponential one.
const MARGIN: f64 = 2.0;
/// Relative independence of a bin's own Coulomb column from the other columns, below which the bin is skipped.
const INDEPENDENT: f64 = 1e-3;

/// Returns the upper bounds of the bins below the always-used speeds, fastest first; the last bin ends at `least`.
fn bounds(top: f64, least: f64) -> Vec<f64> {
    std::iter::successors(Some(top), |v| Some(v / STEP))
        .take_while(|v| *v > least)
        .collect()
}

/// Adds the rows of `bin` to `to`, with or without the bin's own Coulomb columns.
fn add(to: &mut TriangularFactor, bin: &TriangularFactor, own: bool) {
    let r = bin.triangle();
    let width = bin.columns() + 1;
    for i in 0..width {
        let mut row: Vec<f64> = (0..width).map(|j| r[j * width + i]).collect();
        if !own {
            row[width - 1 - OWN..width - 1].fill(0.0);
        }
        to.push(&row[..width - 1], row[width - 1], 1.0);
    }
}

/// Lowest speeds at which rows count, per joint, rad/s or m/s.
pub(crate) struct Thresholds {
    /// For the fit.
    pub fitted: Vec<f64>,
    /// For the judgement of the fit.
    pub judged: Vec<f64>,
    /// Their derivation, a sentence.
    pub reason: String,
}

/// Finds, per joint, the speed above which one Coulomb and one viscous coefficient describe its friction. `plan` brings
/// the lowest sensible thresholds, set by noise.
///
/// One joint: every bin of speed, from fast to slow, gets its own Coulomb friction beside the full model (test of Chow
/// 1960). The first bin with a significant difference ends the range; the test allows for correlated residuals.
/// Deceleration and acceleration have separate values: friction that lags behind a reversal is too high before it and
/// too low after it, and would cancel in a common value. No friction law is assumed below the range.
pub(crate) fn speed_thresholds(
    training: &[&dyn Recording],
    plan: &Plan,
) -> Result<Thresholds, IdentifyError> {
    let spectra = &plan.treatment.spectra;
    let joints = spectra.len();
    if joints > 1 {
        return of_several(training, plan);
    }
    let bins = Bins(
        spectra
            .iter()
            .zip(&plan.treatment.speed_threshold)
            .map(|(s, least)| bounds(BELIEVED * s.velocity_rms(), *least))
            .collect(),
    );
    let factors = bins.factors(training, plan)?;
    let memories = bins.believed_memories(training, plan, &factors)?;
    let thresholds: Vec<f64> = (0..joints)
        .map(|j| {
            let refused = first_refused(&factors[j], memories[j].correlation_time());
            let least = plan.treatment.speed_threshold[j];
            match (refused, bins.0[j].first()) {
                (Some(bin), Some(top)) => (MARGIN * bins.0[j][bin - 1]).min(*top).max(least),
                _ => least,
            }
        })
        .collect();
    Ok(Thresholds {
        judged: thresholds.clone(),
        fitted: thresholds,
        reason: "Read from the data: below it, within a factor of two, the joint's friction differs from the Coulomb and viscous friction of faster rows by more than chance; never below five standard deviations of the velocity's noise or 1 % of its RMS.".into(),
    })
}

/// Bounds of the bins of speed, per joint, fastest first.
struct Bins(Vec<Vec<f64>>);

impl Bins {
    /// Returns the bin of a speed of joint `j`; 0 for the always-used speeds.
    fn of(&self, j: usize, speed: f64) -> usize {
        let slower = self.0[j].iter().take_while(|bound| speed < **bound);
        slower.count()
    }

    /// Returns the rows of each joint by bin, with the friction columns of the bin.
    fn factors(
        &self,
        training: &[&dyn Recording],
        plan: &Plan,
    ) -> Result<Vec<Vec<TriangularFactor>>, IdentifyError> {
        let p = plan.columns.len();
        let mut factors: Vec<Vec<TriangularFactor>> = (self.0.iter())
            .map(|b| vec![TriangularFactor::new(p + OWN); b.len() + 1])
            .collect();
        let mut row = vec![0.0; p + OWN];
        for recording in training {
            each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
                for (j, factors) in factors.iter_mut().enumerate() {
                    let equation = &rows.equations[j];
                    for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                        let qd = rows.qd[j][i];
                        row[..p].copy_from_slice(&equation.x[i * p..(i + 1) * p]);
                        let ahead = rows.qd[j].get(i + 1).copied().unwrap_or(qd);
                        let behind = rows.qd[j][i.saturating_sub(1)];
                        let brakes = (ahead - behind) * qd < 0.0;
                        row[p..].copy_from_slice(&if brakes {
                            [qd.signum(), 0.0]
                        } else {
                            [0.0, qd.signum()]
                        });
                        factors[self.of(j, qd.abs())].push(&row, equation.y[i], 1.0);
                    }
                }
                Ok(())
            })?;
        }
        Ok(factors)
    }

    /// Returns the residuals' memory of each joint over the always-used rows, under a fit of these rows.
    fn believed_memories(
        &self,
        training: &[&dyn Recording],
        plan: &Plan,
        factors: &[Vec<TriangularFactor>],
    ) -> Result<Vec<Autocorrelation>, IdentifyError> {
        let p = plan.columns.len();
        let beta: Vec<Vec<f64>> = factors.iter().map(|list| believed(&list[0], p)).collect();
        let mut memories = vec![Autocorrelation::default(); beta.len()];
        for recording in training {
            each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
                for (j, (memory, beta)) in memories.iter_mut().zip(&beta).enumerate() {
                    let equation = &rows.equations[j];
                    for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                        if self.of(j, rows.qd[j][i].abs()) == 0 {
                            let x = &equation.x[i * p..(i + 1) * p];
                            memory.push(equation.y[i] - dot_in_order(x, beta));
                        }
                    }
                }
                Ok(())
            })?;
        }
        Ok(memories)
    }
}

/// Fits the always-used rows of one joint alone. Pseudo-inverse: one joint may not excite every parameter.
fn believed(rows: &TriangularFactor, p: usize) -> Vec<f64> {
    let mut believed = TriangularFactor::new(p + OWN);
    add(&mut believed, rows, false);
    let (r, z) = believed.system();
    let svd = Svd::of(r);
    let smallest = 1e-10 * svd.singular_values.max();
    svd.solve(&z, smallest).as_slice()[..p].to_vec()
}

/// Finds the thresholds of several joints. From fast to slow, the first bin that is [`NOISIER`] than all faster rows
/// ends the range, provided that fast rows alone then predict other fast rows better. Rows that are noisy for another
/// reason, such as position noise in the acceleration, do not bias the fit and stay.
fn of_several(training: &[&dyn Recording], plan: &Plan) -> Result<Thresholds, IdentifyError> {
    let spectra = &plan.treatment.spectra;
    let lowest: Vec<f64> = (spectra.iter().zip(&plan.treatment.speed_threshold))
        .map(|(s, least)| least.max(SHARE_OF_SEVERAL * s.velocity_rms()))
        .collect();
    let share = 100.0 * SHARE_OF_SEVERAL;
    let fitted = unbent(training, plan, &lowest)?;
    let reason = if fitted == lowest {
        format!(
            "{share} % of the RMS speed, or five standard deviations of the velocity's noise where that is more: slower rows are few, and their friction is seldom Coulomb and viscous."
        )
    } else {
        format!(
            "Read from the data: slower rows leave more than {NOISIER} times the mean square of faster ones, as friction that sticks does, and with them the faster rows are predicted worse; never below {share} % of the RMS speed, from which on the rows of the hold-out count."
        )
    };
    Ok(Thresholds {
        fitted,
        judged: lowest,
        reason,
    })
}

/// Returns thresholds that exclude the slow rows that bias the fit; `lowest` if no rows do.
fn unbent(
    training: &[&dyn Recording],
    plan: &Plan,
    lowest: &[f64],
) -> Result<Vec<f64>, IdentifyError> {
    let mut thresholds = raised(training, plan, lowest)?;
    if thresholds == lowest {
        return Ok(thresholds);
    }
    let sorted = |thresholds: &[f64]| Stretches::of(training, plan, &faster(thresholds));
    let judge = sorted(&thresholds)?;
    let mut least = judge.error(&judge);
    if least >= sorted(lowest)?.error(&judge) - BETTER {
        return Ok(lowest.to_vec());
    }
    // Restore the rows of joints that do not bias the fit.
    for (j, lowest_one) in lowest.iter().enumerate() {
        if thresholds[j] == *lowest_one {
            continue;
        }
        let mut fewer = thresholds.clone();
        fewer[j] = *lowest_one;
        let error = sorted(&fewer)?.error(&judge);
        if error <= least + BETTER / lowest.len() as f64 {
            (thresholds, least) = (fewer, error);
        }
    }
    Ok(thresholds)
}

/// Raises the thresholds from `lowest` above every bin of speed that is noisier than faster ones.
fn raised(
    training: &[&dyn Recording],
    plan: &Plan,
    lowest: &[f64],
) -> Result<Vec<f64>, IdentifyError> {
    let mut thresholds = lowest.to_vec();
    for _ in 0..LOOKS {
        let bins: Vec<Vec<f64>> = (plan.treatment.spectra.iter().zip(&thresholds))
            .map(|(s, least)| bounds(BELIEVED * s.velocity_rms(), *least))
            .collect();
        let squares = squares_by_speed(training, plan, &thresholds, &bins)?;
        let mut risen = false;
        for ((squares, bins), threshold) in squares.iter().zip(&bins).zip(&mut thresholds) {
            if let Some(bin) = first_noisier(squares) {
                (*threshold, risen) = (bins[bin - 1], true);
            }
        }
        if !risen {
            break;
        }
    }
    Ok(thresholds)
}

/// Tests (rows, joint, row): true if the row is usable and at least as fast as the joint's threshold.
fn faster(thresholds: &[f64]) -> impl Fn(&Rows, usize, usize) -> bool + Sync {
    |rows, j, i| kept(rows, j, i) && rows.qd[j][i].abs() >= thresholds[j]
}

/// Sums over the rows of one bin of speed.
#[derive(Clone, Debug, Default)]
struct Bin {
    rows: u64,
    squares: f64,
    fourths: f64,
}

/// Returns the index of the fastest bin whose residuals are noisier than those of all faster bins.
fn first_noisier((bins, memory): &(Vec<Bin>, f64)) -> Option<usize> {
    let mut faster = bins.first()?.clone();
    for (k, bin) in bins.iter().enumerate().skip(1) {
        if bin.rows > 0 && faster.rows > 0 {
            let rows = bin.rows as f64;
            let (own, other) = (bin.squares / rows, faster.squares / faster.rows as f64);
            let variance = (bin.fourths / rows - own * own).max(0.0) * memory / rows;
            if own > NOISIER * other && own - other > SURELY * variance.sqrt() {
                return Some(k);
            }
        }
        faster.rows += bin.rows;
        faster.squares += bin.squares;
    }
    None
}

/// Fits all rows above `thresholds`. Returns, per joint, the residuals in each bin and their correlation time in rows.
fn squares_by_speed(
    training: &[&dyn Recording],
    plan: &Plan,
    thresholds: &[f64],
    bins: &[Vec<f64>],
) -> Result<Vec<(Vec<Bin>, f64)>, IdentifyError> {
    let p = plan.columns.len();
    let used = faster(thresholds);
    let factors = factors_of(training, plan, &used)?;
    let Some(beta) = by_noise(&factors) else {
        return Ok(Vec::new());
    };
    let mut found: Vec<(Vec<Bin>, Autocorrelation)> = (bins.iter())
        .map(|b| {
            (
                vec![Bin::default(); b.len() + 1],
                Autocorrelation::default(),
            )
        })
        .collect();
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for (j, ((list, memory), equation)) in found.iter_mut().zip(&rows.equations).enumerate()
            {
                for i in (0..equation.y.len()).filter(|&i| used(rows, j, i)) {
                    let e = equation.y[i] - dot_in_order(&equation.x[i * p..(i + 1) * p], &beta);
                    let speed = rows.qd[j][i].abs();
                    let bin = &mut list[bins[j].iter().take_while(|b| speed < **b).count()];
                    (bin.rows, bin.squares) = (bin.rows + 1, bin.squares + e * e);
                    bin.fourths += e.powi(4);
                    memory.push(e);
                }
            }
            Ok(())
        })?;
    }
    Ok((found.into_iter())
        .map(|(bins, memory)| (bins, memory.correlation_time()))
        .collect())
}

/// Returns the index of the fastest bin whose own Coulomb friction differs significantly.
fn first_refused(bins: &[TriangularFactor], memory: f64) -> Option<usize> {
    let columns = bins.first()?.columns();
    let width = columns + 1;
    let mut faster = TriangularFactor::new(columns);
    add(&mut faster, &bins[0], false);
    let mut rows = bins[0].rows();
    for (k, bin) in bins.iter().enumerate().skip(1) {
        let mut tried = faster.clone();
        add(&mut tried, bin, true);
        // The bin's own columns come last, so their entries of R and Qᵀy belong to the part independent of the others.
        let r = tried.triangle();
        let residual = r[columns * width + columns];
        rows += bin.rows();
        let freedom = rows.saturating_sub(columns as u64).max(1) as f64;
        let variance = residual * residual * memory / freedom;
        let explained: f64 = (columns - OWN..columns)
            .filter(|&c| r[c * width + c].powi(2) > INDEPENDENT * bin.rows() as f64)
            .map(|c| r[columns * width + c].powi(2))
            .sum();
        if explained > REFUSED * variance {
            return Some(k);
        }
        add(&mut faster, bin, false);
    }
    None
}
