//! From which speed on friction is Coulomb and viscous, read from the recordings themselves.

use super::covariance::Memory;
use super::cutoff::{factors_of, kept};
use super::factor::TriangularFactor;
use super::left_out::{BETTER, Stretches};
use super::linear::{by_noise, product};
use super::model::{Plan, Rows, each_rows};
use super::{IdentifyError, ModelKind};
use rig_data::prepare::Recording;

/// Rows faster than this share of the RMS speed are believed from the start; no threshold lies higher.
const BELIEVED: f64 = 0.5;
/// Where several joints move, no threshold lies below this share of the RMS speed: slower rows are few, and their friction is seldom
/// Coulomb and viscous. Rows up to half the RMS speed are left out only where they are noisier ([`NOISIER`]), not where their friction
/// differs: the rows of a joint also say what the inertia of the others is, and friction of fast rows alone would be that of fast
/// motion alone. On the Stäubli TX40, whose friction grows less than in proportion to speed, half the RMS speed leaves 43 of 60
/// parameters within two standard deviations of the published ones, 0.1 rad/s (4 % of its RMS speed) 58.
const SHARE_OF_SEVERAL: f64 = 0.04;
/// Mean square of a bin's residuals, as a multiple of that of faster rows, from which its rows are left out: more than half of it is
/// then no noise, but friction that sticks, and what the filters carry of it into the rows around.
const NOISIER: f64 = 2.0;
/// … by more than this many standard deviations of the bin's mean square.
const SURELY: f64 = 3.0;
/// Looks at the bins: leaving out rows unbends the fit that the next look starts from.
const LOOKS: usize = 4;
/// Ratio of neighbouring bounds between bins of speed: half an octave.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Columns of a bin's own friction: braking and gathering speed.
const OWN: usize = 2;
/// A bin is refused where its own friction explains this many variances: the 99 % quantile of χ² with [`OWN`]
/// degrees of freedom. Under a true model one bin in 100 is refused by chance, which costs rows but moves no value.
const REFUSED: f64 = 9.21;
/// The threshold lies this many times above the fastest bin that was refused. What weakens with speed does not
/// end where it sinks into the noise of one bin; after doubling the speed a quarter is left of a tail that
/// falls with its square (Hess & Soom 1990), and less of an exponential one.
const MARGIN: f64 = 2.0;
/// A bin whose own Coulomb friction is independent of the other columns by less than this share tells nothing.
const INDEPENDENT: f64 = 1e-3;

/// Upper bounds of the bins below the believed speeds, fastest first; the last bin ends at `least`.
fn bounds(top: f64, least: f64) -> Vec<f64> {
    std::iter::successors(Some(top), |v| Some(v / STEP))
        .take_while(|v| *v > least)
        .collect()
}

/// Adds what is behind `bin` to `to`, with the column of the bin's own Coulomb friction or without.
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

/// The speeds from which on rows count, per joint, rad/s or m/s.
pub(super) struct Thresholds {
    /// In the fit.
    pub fitted: Vec<f64>,
    /// Where what was fitted is judged.
    pub judged: Vec<f64>,
    /// How they were found, a sentence.
    pub reason: String,
}

/// Per joint, the speed from which on one Coulomb and one viscous coefficient describe its friction. `plan` brings the lowest thresholds that make sense, those of noise.
///
/// Of one joint: from the believed speeds downwards each bin of speed in turn is given a Coulomb friction of its own beside the
/// full model (the test of Chow 1960 for a changed parameter); the first bin where it differs significantly,
/// memory of the residuals allowed for, ends the range. Braking and gathering speed have one each: friction that
/// lags behind a reversal is too high before and too low after it, and would cancel in a common one. No friction
/// law is assumed for what lies below.
pub(super) fn speed_thresholds(
    training: &[&dyn Recording],
    plan: &Plan,
) -> Result<Thresholds, IdentifyError> {
    let spectra = &plan.treatment.spectra;
    let joints = spectra.len();
    if joints > 1 {
        return of_several(training, plan);
    }
    let p = plan.columns.len();
    let bins: Vec<Vec<f64>> = spectra
        .iter()
        .zip(&plan.treatment.speed_threshold)
        .map(|(s, least)| bounds(BELIEVED * s.velocity_rms(), *least))
        .collect();
    let bin_of = |j: usize, speed: f64| bins[j].iter().take_while(|bound| speed < **bound).count();
    let mut factors: Vec<Vec<TriangularFactor>> = bins
        .iter()
        .map(|b| vec![TriangularFactor::new(p + OWN); b.len() + 1])
        .collect();
    let mut row = vec![0.0; p + OWN];
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for j in 0..joints {
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
                    factors[j][bin_of(j, qd.abs())].push(&row, equation.y[i], 1.0);
                }
            }
            Ok(())
        })?;
    }
    // The believed rows alone, each joint for itself: a pseudo-inverse, as one joint need not show every parameter.
    let beta: Vec<Vec<f64>> = factors
        .iter()
        .map(|list| {
            let mut believed = TriangularFactor::new(p + OWN);
            add(&mut believed, &list[0], false);
            let (r, z) = believed.system();
            let svd = r.svd(true, true);
            let smallest = 1e-10 * svd.singular_values.max();
            svd.solve(&z, smallest)
                .map_or(vec![0.0; p], |x| x.as_slice()[..p].to_vec())
        })
        .collect();
    let mut memories = vec![Memory::default(); joints];
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for j in 0..joints {
                let equation = &rows.equations[j];
                for i in (0..equation.y.len()).filter(|&i| equation.keep[i]) {
                    if bin_of(j, rows.qd[j][i].abs()) == 0 {
                        memories[j].push(
                            equation.y[i] - product(&equation.x[i * p..(i + 1) * p], &beta[j]),
                        );
                    }
                }
            }
            Ok(())
        })?;
    }
    let thresholds: Vec<f64> = (0..joints)
        .map(|j| {
            let refused = first_refused(&factors[j], memories[j].length());
            let least = plan.treatment.speed_threshold[j];
            match (refused, bins[j].first()) {
                (Some(bin), Some(top)) => (MARGIN * bins[j][bin - 1]).min(*top).max(least),
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

/// Thresholds of several joints: from the believed speeds downwards the first bin of speed whose residuals are [`NOISIER`] than
/// those of all faster rows ends the range, where the faster rows are then predicted better from others of their kind alone. Slow
/// rows that are noisy for another reason, such as noise of the position in the acceleration, bend nothing and stay.
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

/// Thresholds without the slow rows that bend the fit; `lowest` where none do.
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
    // The rows of a joint that bend nothing come back.
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

/// Thresholds above every bin of speed that is noisier than faster ones, from `lowest` on.
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

/// Whether a row (of the rows, joint, row) is usable and no slower than the joint's threshold.
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

/// Number of the fastest bin whose residuals are noisier than those of all faster bins.
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

/// Per joint, the residuals in each bin of speed of a fit to all rows above `thresholds`, and their memory in rows.
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
    let mut found: Vec<(Vec<Bin>, Memory)> = (bins.iter())
        .map(|b| (vec![Bin::default(); b.len() + 1], Memory::default()))
        .collect();
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for (j, ((list, memory), equation)) in found.iter_mut().zip(&rows.equations).enumerate()
            {
                for i in (0..equation.y.len()).filter(|&i| used(rows, j, i)) {
                    let e = equation.y[i] - product(&equation.x[i * p..(i + 1) * p], &beta);
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
        .map(|(bins, memory)| (bins, memory.length()))
        .collect())
}

/// Number of the fastest bin whose own Coulomb friction differs.
fn first_refused(bins: &[TriangularFactor], memory: f64) -> Option<usize> {
    let columns = bins.first()?.columns();
    let width = columns + 1;
    let mut faster = TriangularFactor::new(columns);
    add(&mut faster, &bins[0], false);
    let mut rows = bins[0].rows();
    for (k, bin) in bins.iter().enumerate().skip(1) {
        let mut tried = faster.clone();
        add(&mut tried, bin, true);
        // The bin's own columns come last, so their entries of R and Qᵀy belong to what the others leave of them.
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
