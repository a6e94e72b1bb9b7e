//! A torque whose gain changes within a recording: a range of the current sensor or a torque constant that is switched.
//!
//! The torque of a joint is fitted with one factor from some row on, and without it. Beside either, a load on any link
//! and the friction of the joint may change at any row, and friction and gain may change slowly, up to three of them.
//! The factor is named if its best explanation is a thousand times likelier than the best one without (Schwarz 1978,
//! each with its own number of unknowns). What no model holds comes back with the motion, so its rows are not
//! independent: their number is that with which the factor's usual variance equals its variance by leaving out one
//! stretch of time at a time.
//!
//! Leaves out: a factor that changes more than once, or slowly; one that a change of load or friction explains as well, as at a
//! joint with nothing but friction.

mod alternative;
mod design;

use nalgebra::{DMatrix, DVector};

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::fit::{EXCITED, jackknife};
use crate::faults::levels::GOOD;
use crate::faults::misfit::Misfit;
use crate::faults::rows::{Form, Rows};
use alternative::Alternative;
use design::{Design, Fitted, Gain};
use rig_data::runs::Run;
use rig_identify::{independent_columns, preference};
use rig_model::robot::{JointKind, Robot};
use rig_numerics::statistics::squares_about_mean;

/// Least log odds of a change, as its prior odds are one to a thousand.
const ODDS: f64 = 6.9;
/// Number of blocks at which something may change.
const BLOCKS: usize = 240;
/// Least share of the rows on either side of a change.
const SIDE: f64 = 0.05;
/// Most other changes beside the factor.
const OTHERS: usize = 3;
/// Share of the largest velocity below which dry friction is not that of sliding.
const SLIDING: f64 = 0.02;
/// Least rows per column.
const ROWS_PER_COLUMN: usize = 8;
/// Standard deviations by which a factor must differ from one: odds are no reason if its own size is not known.
const SHOWN: f64 = 3.0;
/// Log odds that the time of the change is not known better than.
const TIMES: f64 = 3.0;

/// An explanation of a torque.
struct Explanation {
    squares: f64,
    unknowns: usize,
    /// The factor, with its place among the designs.
    gain: Option<(Gain, usize)>,
}

impl Explanation {
    /// Returns twice the negative log likelihood with `rows` independent rows, and the price of the unknowns.
    fn cost(&self, rows: f64) -> f64 {
        cost(self.squares, self.unknowns, rows)
    }
}

fn cost(squares: f64, unknowns: usize, rows: f64) -> f64 {
    rows * squares.max(f64::MIN_POSITIVE).ln() + unknowns as f64 * rows.ln()
}

/// A joint's torque with the columns of its model.
struct Torque {
    /// Rows of the recording.
    usable: Vec<usize>,
    t: Vec<f64>,
    torque: DVector<f64>,
    design: Design,
    alternatives: Vec<Alternative>,
}

/// Returns the joints' torques of one recording whose gain changes.
pub(super) fn changes(robot: &Robot, runs: &[&Run]) -> Result<Vec<Fault>, DiagnoseError> {
    let form = Form::of(robot)?;
    let rows = Rows::over_all(runs, robot.joints.len());
    let kinds: Vec<JointKind> = robot.joints.iter().map(|j| j.kind).collect();
    let mut order = preference(&kinds);
    order.extend(order.len()..form.width());
    let matrices = rows.regressors(&form)?;
    let found = matrices.iter().enumerate().filter_map(|(j, matrix)| {
        let of = |changed| Torque::of(&form, &rows, (j, matrix), &order, changed);
        // A row in which the gain changes belongs to neither part.
        let torque = of(Some(of(None)?.suspected()?))?;
        Some(Fault::of_joint(j, torque.change()?))
    });
    Ok(found.collect())
}

impl Torque {
    /// Returns the torque of joint `j` over the rows in which it slides, without the row `changed` and those beside it;
    /// `None` if there are too few.
    fn of(
        form: &Form,
        rows: &Rows,
        (j, matrix): (usize, &DMatrix<f64>),
        order: &[usize],
        changed: Option<usize>,
    ) -> Option<Self> {
        let fastest = rows.qd[j]
            .iter()
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        let usable: Vec<usize> = (0..rows.len())
            .filter(|k| {
                let sliding = rows.qd[j][*k].abs() > SLIDING * fastest;
                let mixed = changed.is_some_and(|row| k.abs_diff(row) <= 1);
                sliding && !mixed && !rows.off[*k] && rows.cut[j][*k] == 0.0
            })
            .collect();
        let matrix = matrix.select_rows(&usable);
        let kept = independent_columns(&matrix, order, EXCITED).kept;
        if kept.is_empty() || usable.len() < (ROWS_PER_COLUMN * kept.len()).max(BLOCKS) {
            return None;
        }
        let tau = usable.iter().map(|k| rows.tau[j][*k]);
        let torque = DVector::from_iterator(usable.len(), tau);
        let qr = matrix.select_columns(&kept).qr();
        let (basis, r) = (qr.q(), qr.r());
        let values = r.solve_upper_triangular(&basis.tr_mul(&torque))?;
        let mut starts: Vec<usize> = (0..BLOCKS).map(|k| k * usable.len() / BLOCKS).collect();
        starts.extend(changed.map(|row| usable.partition_point(|k| *k < row)));
        starts.sort_unstable();
        starts.dedup();
        starts.retain(|k| *k < usable.len());
        Some(Self {
            t: usable.iter().map(|k| rows.t[*k]).collect(),
            torque,
            design: Design::new(basis, starts),
            alternatives: Alternative::all((form, j), &matrix, (&kept, &values)),
            usable,
        })
    }

    /// Returns the explanations by one set of values throughout, without and with a factor, and the number of
    /// independent rows.
    fn simple(&self) -> Option<([Explanation; 2], f64)> {
        let plain = self.design.fitted(self.torque.clone());
        let gain = best_gain(&plain)?;
        let rows = effective(&self.design, &self.torque, &gain).0;
        let without = Explanation {
            squares: plain.squares(),
            unknowns: 0,
            gain: None,
        };
        let with = Explanation {
            squares: gain.squares,
            unknowns: 2,
            gain: Some((gain, 0)),
        };
        Some(([without, with], rows))
    }

    /// Returns the row of the recording at which the gain may change; `None` if one set of values throughout is as good,
    /// as in most recordings.
    fn suspected(&self) -> Option<usize> {
        let ([without, with], rows) = self.simple()?;
        if 0.5 * (without.cost(rows) - with.cost(rows)) < ODDS {
            return None;
        }
        let (gain, _) = with.gain?;
        let errors = errors(&self.design, &self.torque, &gain);
        let near = self
            .design
            .fitted(self.torque.clone())
            .around(&gain, &errors);
        let best = near.iter().min_by(|a, b| a.squares.total_cmp(&b.squares))?;
        Some(self.usable[best.row])
    }

    /// Returns the change of the gain, if nothing else explains the torque as well.
    fn change(&self) -> Option<Misfit> {
        let ([without, with], rows) = self.simple()?;
        let (first, _) = with.gain?;
        let mut designs = vec![self.design.clone()];
        let mut all = vec![without, with];
        self.others(&mut designs, &mut all, rows, None);
        self.others(&mut designs, &mut all, rows, Some(first));
        self.decided(&designs, &all, rows)
    }

    /// Adds explanations with other changes, one after the other, to the torque as recorded or with a factor undone.
    fn others(
        &self,
        designs: &mut Vec<Design>,
        all: &mut Vec<Explanation>,
        rows: f64,
        mut undone: Option<Gain>,
    ) {
        let mut design = self.design.clone();
        let mut unknowns = 0;
        for _ in 0..OTHERS {
            let torque = match &undone {
                Some(gain) => gain.undone(&self.torque),
                None => self.torque.clone(),
            };
            let fitted = design.fitted(torque);
            let price = |squares: f64, more: usize| cost(squares, more, rows);
            let next = Alternative::best_of(&self.alternatives, &fitted, SIDE, &price);
            let Some(next) =
                next.filter(|n| price(n.squares, n.unknowns) < price(fitted.squares(), 0))
            else {
                break;
            };
            unknowns += next.unknowns;
            design = next.added(&design);
            let recorded = design.fitted(self.torque.clone());
            if undone.is_none() {
                all.push(Explanation {
                    squares: recorded.squares(),
                    unknowns,
                    gain: None,
                });
            }
            if let Some(gain) = best_gain(&recorded) {
                all.push(Explanation {
                    squares: gain.squares,
                    unknowns: unknowns + 2,
                    gain: Some((gain, designs.len())),
                });
                undone = undone.and(Some(gain));
            }
            designs.push(design.clone());
        }
    }

    /// Compares the best explanations with and without a factor.
    fn decided(&self, designs: &[Design], all: &[Explanation], rows: f64) -> Option<Misfit> {
        let best = |gain: bool, rows: f64| {
            (all.iter().filter(|own| own.gain.is_some() == gain))
                .min_by(|a, b| a.cost(rows).total_cmp(&b.cost(rows)))
        };
        // The best explanation may be another one with fewer independent rows.
        let mut rows = rows;
        let (mut gain, mut at) = best(true, rows)?.gain?;
        let mut std = f64::INFINITY;
        for _ in 0..designs.len() {
            let (count, own) = effective(&designs[at], &self.torque, &gain);
            (rows, std) = (rows.min(count), own);
            let (next, place) = best(true, rows)?.gain?;
            if place == at {
                break;
            }
            (gain, at) = (next, place);
        }
        let (with, without) = (best(true, rows)?, best(false, rows)?);
        if 0.5 * (without.cost(rows) - with.cost(rows)) < ODDS {
            return None;
        }
        let design = &designs[at];
        let fitted = design.fitted(self.torque.clone());
        let errors = errors(design, &self.torque, &gain);
        let near = fitted.around(&gain, &errors);
        let least = near.iter().map(|g| g.squares).fold(f64::INFINITY, f64::min);
        let mut likely = (near.iter())
            .filter(|g| 0.5 * rows * (g.squares / least).ln() < TIMES)
            .map(|g| g.row);
        let from = likely.next()?;
        let to = likely.next_back().unwrap_or(from);
        let total = squares_about_mean(self.torque.as_slice());
        let deviation = gain.factor().abs() * std;
        let is_explained = gain.squares < GOOD * total;
        if !is_explained || !((gain.factor() - 1.0).abs() > SHOWN * deviation) {
            return None;
        }
        Some(Misfit::GainChanged {
            between: [self.t[from - 1], self.t[to]],
            factor: [gain.factor(), deviation],
            left: [fitted.squares() / total, gain.squares / total],
        })
    }
}

/// Returns the errors of the torque as recorded, with a factor in its model.
fn errors(design: &Design, torque: &DVector<f64>, gain: &Gain) -> DVector<f64> {
    let mut errors = design.fitted(gain.undone(torque)).residual;
    for (k, error) in errors.iter_mut().enumerate() {
        *error /= gain.undo[usize::from(k >= gain.row)];
    }
    errors
}

/// Returns the best factor, with the errors of both parts as they are without it.
fn best_gain(fitted: &Fitted) -> Option<Gain> {
    let first = fitted.gain(SIDE, &fitted.residual)?;
    let errors = errors(fitted.design, &fitted.torque, &first);
    fitted.gain(SIDE, &errors)
}

/// Returns the number of rows that count as independent for a factor, and its relative standard deviation.
fn effective(design: &Design, torque: &DVector<f64>, gain: &Gain) -> (f64, f64) {
    let fitted = design.fitted(gain.undone(torque));
    let mut later = &fitted.torque - &fitted.residual;
    later.rows_mut(0, gain.row).fill(0.0);
    let beside = design.beside(&DMatrix::from_columns(&[later]));
    let norm = beside.norm().max(f64::MIN_POSITIVE);
    let at = design.basis.ncols();
    let mut basis = design.basis.clone().insert_column(at, 0.0);
    basis.set_column(at, &(beside.column(0) / norm));
    let rows = torque.len() as f64;
    let usual = fitted.squares() / (rows - at as f64 - 1.0);
    let spread = jackknife(&basis, &fitted.residual).0[(at, at)];
    let count = rows * (usual / spread).min(1.0);
    (count, spread.max(usual).sqrt() / norm)
}
