//! Regression rows of runs: torque and nominal regressor, low-passed, decimated, masked.

use crate::DiagnoseError;
use crate::rows::motion::motion_of;
use crate::rows::nominal::Nominal;
use crate::rows::standstill::Doubtful;
use crate::rows::thinning::Thinning;
use rig_data::prepare::PreprocessingPlan;
use rig_data::runs::Run;

/// Share of slow or saturated samples around a row above which the row is not used. It is the low-passed indicator of
/// such samples.
const SPOILT: f64 = 0.03;
/// The same share above which a row near standstill is not usable either.
pub(crate) const ILLEGIBLE: f64 = 0.1;

/// Fewest rows near standstill that allow a comparison of their residual.
const FEWEST_ABOUT_RESTS: usize = 20;

/// Largest share of standstill or reversal around a clear row. Twice this share of dry friction is below most noise.
const CLEAR: f64 = 0.005;

/// A signal on the kept rows, joint by joint; None if it is zero throughout.
pub(crate) type Column = Vec<Option<Vec<f64>>>;

/// Σ factor·column over the `joints` of the columns.
pub(crate) fn combined<'a>(
    joints: usize,
    terms: impl IntoIterator<Item = (&'a Column, f64)>,
) -> Column {
    let mut sum: Column = vec![None; joints];
    for (column, factor) in terms {
        for (to, from) in sum.iter_mut().zip(column) {
            let Some(from) = from else { continue };
            let to = to.get_or_insert_with(|| vec![0.0; from.len()]);
            for (t, x) in to.iter_mut().zip(from) {
                *t += factor * x;
            }
        }
    }
    sum
}

/// Subtracts a column from signals, joint by joint.
pub(crate) fn take_off(signals: &mut [Vec<f64>], column: &Column) {
    for (signal, column) in signals.iter_mut().zip(column) {
        for (s, c) in signal.iter_mut().zip(column.iter().flatten()) {
            *s -= c;
        }
    }
}

/// The regression: rows over all runs, one set per joint.
pub(crate) struct Rows {
    /// Filter and decimation of the columns.
    pub(crate) thinning: Thinning,
    /// Rows per joint.
    pub(crate) count: usize,
    /// First row of each run, and the total count at the end.
    pub(crate) starts: Vec<usize>,
    /// Time between rows, s.
    pub(crate) period: f64,
    /// Torque, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
    /// True if the row is used, joint by joint.
    pub(crate) keep: Vec<Vec<bool>>,
    /// True if the row is used or usable: its torque has information, except for the error near standstill. Joint by
    /// joint; empty if no row is near standstill.
    pub(crate) legible: Vec<Vec<bool>>,
    /// True if no standstill or reversal leaks into the row through the filters, joint by joint; empty if none is near.
    pub(crate) clear: Vec<Vec<bool>>,
    /// Samples that the rows leave out, run by run and joint by joint; empty for none.
    pub(crate) left_out: Vec<Vec<Vec<bool>>>,
    /// Nominal columns, one per base parameter.
    pub(crate) nominal: Vec<Column>,
}

/// Adds the rows of a run to the columns of the base parameters. `before` rows are from earlier runs.
///
/// # Errors
/// [`DiagnoseError::Model`].
fn push_nominal(
    nominal: &Nominal,
    run: &Run,
    (thinning, left_out): (&Thinning, &[Vec<bool>]),
    before: usize,
    columns: &mut [Column],
) -> Result<(), DiagnoseError> {
    let wide = thinning.wide_motion(run);
    let motion = motion_of(run);
    nominal.columns([&motion[0], &motion[1], &motion[2]], &mut |k, j, values| {
        if wide.is_some() && !nominal.is_drive(k) {
            return;
        }
        let list = columns[k][j].get_or_insert_with(|| vec![0.0; before]);
        if nominal.is_coulomb(k) {
            thinning.push_raw(values, &left_out[j], list);
        } else {
            thinning.push(values, &left_out[j], list);
        }
    })?;
    let Some([q, qd, qdd]) = &wide else {
        return Ok(());
    };
    nominal.columns([q, qd, qdd], &mut |k, j, values| {
        if !nominal.is_drive(k) {
            let list = columns[k][j].get_or_insert_with(|| vec![0.0; before]);
            thinning.push_raw(values, &left_out[j], list);
        }
    })?;
    Ok(())
}

/// Masks of a joint's rows, as in [`Rows`].
#[derive(Clone, Default)]
struct Masks {
    keep: Vec<bool>,
    legible: Vec<bool>,
    clear: Vec<bool>,
}

impl Masks {
    /// Adds the rows of a joint in a run.
    fn push(&mut self, thinning: &Thinning, doubtful: &Doubtful, joint: usize) {
        let share_of = |samples: &[bool]| {
            let ones: Vec<f64> = samples.iter().map(|s| f64::from(u8::from(*s))).collect();
            let mut share = Vec::new();
            thinning.push_raw(&ones, &[], &mut share);
            share
        };
        let share = share_of(&doubtful.spoilt[joint]);
        // The low-pass rings, so a share below 0 counts like one above.
        self.keep.extend(share.iter().map(|s| s.abs() < SPOILT));
        self.legible.extend(share.iter().map(|s| *s < ILLEGIBLE));
        let share = share_of(&doubtful.blurred[joint]);
        self.clear.extend(share.iter().map(|s| s.abs() < CLEAR));
    }

    /// Returns the masks for kept, legible and clear rows, joint by joint.
    fn by_kind(joints: Vec<Self>) -> [Vec<Vec<bool>>; 3] {
        let mut all = [(); 3].map(|()| Vec::with_capacity(joints.len()));
        for joint in joints {
            for (list, own) in all.iter_mut().zip([joint.keep, joint.legible, joint.clear]) {
                list.push(own);
            }
        }
        all
    }
}

impl Rows {
    /// Computes torque, masks and nominal columns of all runs. `rests_count` is as in [`Doubtful::left_out`].
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        runs: &[Run],
        nominal: &Nominal,
        treatment: &PreprocessingPlan,
        rests_count: &dyn Fn(usize) -> bool,
    ) -> Result<Self, DiagnoseError> {
        let thinning = Thinning::of(treatment)?;
        let n = nominal.joints();
        let mut starts = vec![0];
        let mut torque = vec![Vec::new(); n];
        let mut masks = vec![Masks::default(); n];
        let mut columns: Vec<Column> = vec![vec![None; n]; nominal.base.len()];
        let mut left_out = Vec::with_capacity(runs.len());
        for run in runs {
            let doubtful = Doubtful::of(run, nominal, treatment, thinning.smear())?;
            let before = starts.last().copied().unwrap_or(0);
            let rows = thinning.kept(run.len()).count();
            for (j, masks) in masks.iter_mut().enumerate() {
                masks.push(&thinning, &doubtful, j);
            }
            let out = doubtful.left_out(rests_count);
            for (j, joint) in run.joints.iter().enumerate() {
                thinning.push_raw(&joint.tau, &out[j], &mut torque[j]);
            }
            push_nominal(nominal, run, (&thinning, &out), before, &mut columns)?;
            left_out.push(out);
            starts.push(before + rows);
        }
        let [keep, legible, clear] = Masks::by_kind(masks);
        Ok(Self {
            thinning,
            count: starts.last().copied().unwrap_or(0),
            starts,
            period: treatment.decimation.max(1) as f64 / treatment.sample_rate,
            torque,
            keep,
            legible,
            clear,
            left_out,
            nominal: columns,
        })
    }

    /// Returns the number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.torque.len()
    }

    /// Returns, for each sample, true if the nearest row is usable by the observer of a link behind a gear. False
    /// outside the rows.
    pub(crate) fn torque_valid(&self, run: usize, joint: usize, samples: usize) -> Vec<bool> {
        let all = self.legible.get(joint).map_or(&[][..], Vec::as_slice);
        let legible = all
            .get(self.starts[run]..self.starts[run + 1])
            .unwrap_or_default();
        (0..samples)
            .map(|k| {
                let row = self.thinning.row_near(k);
                row.is_some_and(|row| legible.get(row).copied().unwrap_or(false))
            })
            .collect()
    }

    /// Returns the mean squared residual of a joint: on usable rows near standstill, and on the used rows. `residual`
    /// covers all rows. None if too few rows are near standstill.
    pub(crate) fn about_rests(&self, joint: usize, residual: &[f64]) -> Option<[f64; 2]> {
        let keep = &self.keep[joint];
        let legible = self.legible.get(joint)?;
        let mean = |near: bool| {
            let own = |(keep, legible): (&bool, &bool)| *legible && (*keep != near);
            let rows = || residual.iter().zip(keep.iter().zip(legible));
            let own = || rows().filter(|(_, about)| own(*about)).map(|(r, _)| r * r);
            let count = own().count();
            (count >= FEWEST_ABOUT_RESTS).then(|| own().sum::<f64>() / count as f64)
        };
        Some([mean(true)?, mean(false)?])
    }

    /// Also uses the rows near a joint's standstill.
    pub(crate) fn use_rests(&mut self, joint: usize) {
        if let Some(legible) = self.legible.get(joint) {
            self.keep[joint].clone_from(legible);
        }
    }

    /// Returns true for the rows of a joint that are used and clear of standstill and reversals.
    pub(crate) fn away(&self, joint: usize) -> Vec<bool> {
        let clear = self.clear.get(joint);
        let clear = |row: usize| clear.is_none_or(|clear| clear[row]);
        (self.keep[joint].iter().enumerate())
            .map(|(row, keep)| *keep && clear(row))
            .collect()
    }

    /// Returns the number of used rows of a joint.
    pub(crate) fn used(&self, joint: usize) -> usize {
        self.keep[joint].iter().filter(|k| **k).count()
    }
}

#[cfg(test)]
impl Rows {
    /// Creates the rows of one joint in one run with these nominal columns.
    pub(crate) fn of_columns(nominal: Vec<Column>, count: usize) -> Self {
        Self {
            thinning: Thinning::of_rows(),
            count,
            starts: vec![0, count],
            period: 1.0,
            torque: vec![vec![0.0; count]],
            keep: vec![vec![true; count]],
            legible: vec![vec![true; count]],
            clear: vec![vec![true; count]],
            left_out: vec![vec![Vec::new()]],
            nominal,
        }
    }
}
