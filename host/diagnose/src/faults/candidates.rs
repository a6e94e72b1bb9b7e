//! Transformations of a recording that make the description explain it: another order of columns, a reversed sense,
//! another zero or factor, and another direction of gravity.
//!
//! Each transformation is undone in turn and the torques of all joints are fitted again. The ones that make the data by
//! far the likeliest are suspected; the trial ([`crate::faults::trial`]) decides.

use nalgebra::{DMatrix, Vector3};

use crate::DiagnoseError;
use crate::faults::described::{Described, friction};
use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::levels::{EXACT, GOOD, MUCH_BETTER, POOR, TRIAL};
use crate::faults::misfit::{Misfit, Reversal};
use crate::faults::rows::Rows;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::{Columns, Undo};
use rig_numerics::statistics::squares_about_mean;

/// Least fall of the log residual variances, summed over joints, to believe a transformation: one joint's falls to a
/// tenth. A description may be far off, and a transformation may improve it by chance.
const CONVINCING_TO_DESCRIPTION: f64 = 2.3;
/// The same if all parameters are fitted, so that only the model's form counts: a fall to less than a quarter.
const CONVINCING_TO_FIT: f64 = 1.5;
/// Most transformations that are suspected.
const SUSPECTS: usize = 4;
/// Share of the widest motion, rad or m, below which a joint does not count.
const STILL: f64 = 1e-4;

/// A transformation, and the residual variance shares of its joints, as recorded and without it.
pub(crate) struct Found {
    pub(crate) undo: Undo,
    gain: f64,
    left: [f64; 2],
    /// True if the other columns of the same joints explain it too.
    twin: bool,
}

/// Residuals of the recording as it is, for comparison with transformations.
pub(crate) struct Before {
    /// Rows of the trial.
    rows: Rows,
    /// Joints that move.
    pub(crate) moving: Vec<usize>,
    /// Residual share of each torque's variance.
    left: Vec<f64>,
    /// Least gain to believe a transformation.
    pub(crate) enough: f64,
}

impl Before {
    /// Returns the fall of the log residual variances, summed over the moving joints.
    fn gain(&self, after: &[f64]) -> f64 {
        let of = |j: &usize| (self.left[*j].max(EXACT) / after[*j].max(EXACT)).ln();
        self.moving.iter().map(of).sum()
    }

    /// Returns the poorly explained joints whose residual variance the transformation at least halves.
    fn mended(&self, after: &[f64]) -> Vec<usize> {
        let mends = |j: &usize| self.left[*j] > POOR && after[*j] < 0.5 * self.left[*j];
        self.moving.iter().copied().filter(mends).collect()
    }
}

impl Judge<'_> {
    /// Returns the transformations that explain the recording, the likeliest first; none for a single joint.
    pub(crate) fn transformed(&self) -> Result<Vec<Found>, DiagnoseError> {
        let rows = self.rows.thinned(TRIAL);
        let ranges: Vec<f64> = rows.q.iter().map(|q| range(q)).collect();
        let widest = ranges.iter().copied().fold(0.0, f64::max);
        let moving: Vec<usize> = (0..ranges.len())
            .filter(|j| ranges[*j] > STILL * widest)
            .collect();
        let described = self.states_from(0);
        if self.robot.joints.len() < 2 {
            return Ok(Vec::new());
        }
        let left = self.left(&rows)?;
        let enough = match described {
            true => CONVINCING_TO_DESCRIPTION,
            false => CONVINCING_TO_FIT,
        };
        let before = Before {
            rows,
            moving,
            left,
            enough,
        };
        if before.moving.iter().all(|j| before.left[*j] <= POOR) {
            return Ok(Vec::new());
        }
        let mut all: Vec<Found> = Vec::new();
        for undo in self.candidates(&before)? {
            let after = self.left_without(&undo, &before.rows)?;
            let concerned = concerned(&undo, &before, &after);
            // One joint's own columns explain turned gravity as well.
            if concerned.is_empty() || concerned.len() < 2 && matches!(undo, Undo::Gravity(_)) {
                continue;
            }
            let mean = |left: &[f64]| {
                concerned.iter().map(|j| left[*j]).sum::<f64>() / concerned.len() as f64
            };
            all.push(Found {
                undo,
                gain: before.gain(&after),
                left: [mean(&before.left), mean(&after)],
                twin: false,
            });
        }
        all.retain(|found| found.convinces(enough));
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let twins: Vec<bool> = (all.iter())
            .map(|own| all.iter().any(|other| other.is_twin(own)))
            .collect();
        for (found, twin) in all.iter_mut().zip(twins) {
            found.twin = twin;
        }
        all.truncate(SUSPECTS);
        Ok(all)
    }

    /// Returns the transformations to try.
    fn candidates(&self, before: &Before) -> Result<Vec<Undo>, DiagnoseError> {
        let mut all = Vec::new();
        for which in [Columns::Torques, Columns::Positions, Columns::Joints] {
            all.extend(self.orders(which, before)?);
        }
        for &j in &before.moving {
            all.extend([
                Undo::Torque(Some(j), -1.0),
                Undo::Position(Some(j), -1.0),
                Undo::Both(j),
            ]);
        }
        if !self.states_from(0) {
            return Ok(all);
        }
        all.extend(self.gravity_shown(&before.rows)?.map(Undo::Gravity));
        for &j in &before.moving {
            all.extend(self.zero(j, before)?);
            all.extend(self.factor(Some(j), before)?);
        }
        all.extend(self.factor(None, before)?);
        Ok(all)
    }

    /// Returns the fall of the log residual variances when a transformation is undone.
    pub(crate) fn gain_without(&self, undo: &Undo, before: &Before) -> Result<f64, DiagnoseError> {
        Ok(before.gain(&self.left_without(undo, &before.rows)?))
    }

    fn left_without(&self, undo: &Undo, rows: &Rows) -> Result<Vec<f64>, DiagnoseError> {
        match undo {
            Undo::Gravity(other) => self.left_of_description(rows, *other),
            _ => self.left(&undo.applied(self.robot, rows)),
        }
    }

    /// Returns the transformation as a fault of the recording.
    pub(crate) fn said(&self, found: &Found) -> Option<Suspicion> {
        let left = found.left;
        let fault = match &found.undo {
            Undo::Order(which, order) => {
                let first = (0..order.len()).find(|j| order[*j] != *j).unwrap_or(0);
                let order = Misfit::Order {
                    which: *which,
                    order: order.clone(),
                    twin: found.twin,
                    left,
                };
                Fault::of_joint(first, order)
            }
            Undo::Torque(Some(j), _) => self.reversed(true, *j, found),
            Undo::Position(Some(j), -1.0) => self.reversed(false, *j, found),
            Undo::Position(Some(j), factor) => self.scaled(*j, &[*factor], left).fault,
            Undo::Position(None, factor) => Fault::of_recording(Misfit::AllScaled {
                factor: *factor,
                left,
            }),
            Undo::Both(j) => Fault::of_joint(*j, Misfit::AxisReversed { left }),
            Undo::Zero(j, angle) => Fault::of_joint(
                *j,
                Misfit::Zero {
                    angle: *angle,
                    left,
                },
            ),
            Undo::Gravity(other) => {
                let stated = Vector3::from(self.robot.gravity);
                let angle = stated.angle(&Vector3::from(*other)).to_degrees();
                Fault::of_recording(Misfit::GravityTurned { angle, left })
            }
            _ => return None,
        };
        Some(Suspicion::new(fault, found.undo.clone()))
    }

    fn reversed(&self, torque: bool, j: usize, found: &Found) -> Fault {
        let other = match found.twin {
            _ if !torque && self.reference_against(j) => Reversal::AgainstReference,
            true => Reversal::OrOther,
            false => Reversal::Alone,
        };
        let left = found.left;
        let reversed = Misfit::Reversed {
            torque,
            other,
            left,
        };
        Fault::of_joint(j, reversed)
    }

    /// Returns the residual share of each torque's variance: by the description, which has few free numbers, if it
    /// states every link; else by one set of parameters for all joints.
    fn left(&self, rows: &Rows) -> Result<Vec<f64>, DiagnoseError> {
        if self.states_from(0) {
            self.left_of_description(rows, self.robot.gravity)
        } else {
            self.left_of_parameters(rows)
        }
    }

    fn left_of_parameters(&self, rows: &Rows) -> Result<Vec<f64>, DiagnoseError> {
        let (n, count) = (rows.tau.len(), rows.len());
        let matrices = rows.regressors(&self.form)?;
        // A still torque has no variance to explain.
        let size: Vec<f64> = (rows.tau.iter())
            .map(|tau| squares_about_mean(tau).sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let width = matrices.first().map_or(0, DMatrix::ncols);
        let whole = DMatrix::from_fn(n * count, width, |k, c| {
            matrices[k / count][(k % count, c)] / size[k / count]
        });
        let torque: Vec<f64> = (rows.tau.iter().zip(&size))
            .flat_map(|(tau, size)| tau.iter().map(move |v| v / size))
            .collect();
        let Some(fit) = Fit::of(&whole, &torque, &self.order) else {
            return Ok(vec![1.0; n]);
        };
        let own = |j: usize| fit.residual.rows(j * count, count).norm_squared();
        Ok((0..n).map(own).collect())
    }

    fn left_of_description(
        &self,
        rows: &Rows,
        gravity: [f64; 3],
    ) -> Result<Vec<f64>, DiagnoseError> {
        let n = self.robot.joints.len();
        let Described { all, motors, .. } = self.described_under(rows, gravity)?;
        let share = |j: usize| {
            let friction = friction(&rows.qd[j], motors.get(j));
            let order: Vec<usize> = (0..friction.ncols()).collect();
            let rest: Vec<f64> = (rows.tau[j].iter().zip(&all[j]))
                .map(|(tau, own)| tau - own)
                .collect();
            let total = squares_about_mean(&rows.tau[j]).max(f64::MIN_POSITIVE);
            let squares = Fit::of(&friction, &rest, &order).map_or_else(
                || squares_about_mean(&rest),
                |fit| fit.residual.norm_squared(),
            );
            squares / total
        };
        Ok((0..n).map(share).collect())
    }
}

impl Found {
    /// Returns true if the recording is poor as it is, good without the fault, and much better. A transformation with a
    /// fitted value must be better by more.
    fn convinces(&self, enough: f64) -> bool {
        let [recorded, without] = self.left;
        let fitted = match self.undo {
            Undo::Position(_, factor) if factor != -1.0 => MUCH_BETTER,
            Undo::Zero(..) => MUCH_BETTER,
            _ => 1.0,
        };
        recorded > POOR
            && without < GOOD.max(0.2 * recorded).min(0.5)
            && without < fitted * recorded
            && self.gain > enough
    }

    /// Returns true if it concerns one joint's sense alone.
    pub(crate) fn is_sense(&self) -> bool {
        matches!(
            self.undo,
            Undo::Torque(..) | Undo::Position(_, -1.0) | Undo::Both(_)
        )
    }

    /// Returns true if both scale the position of the same joint.
    pub(crate) fn is_of(&self, other: &Undo) -> bool {
        match (&self.undo, other) {
            (Undo::Position(Some(a), _), Undo::Position(Some(b), _)) => a == b,
            _ => false,
        }
    }

    /// Returns true if it is a joint's zero.
    pub(crate) fn is_zero(&self) -> bool {
        matches!(self.undo, Undo::Zero(..))
    }

    /// Returns true if both mean the same for torque and position of the same joints.
    fn is_twin(&self, other: &Self) -> bool {
        match (&self.undo, &other.undo) {
            (Undo::Order(own, a), Undo::Order(other, b)) => {
                // The positions' order is the inverse of the torques'.
                let columns = [own, other];
                let both =
                    columns.contains(&&Columns::Torques) && columns.contains(&&Columns::Positions);
                both && (0..a.len()).all(|j| b[a[j]] == j)
            }
            (Undo::Torque(a, _), Undo::Position(b, -1.0))
            | (Undo::Position(a, -1.0), Undo::Torque(b, _)) => a == b,
            _ => false,
        }
    }
}

fn range(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most - values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Returns the joints whose torques show a transformation.
fn concerned(undo: &Undo, before: &Before, after: &[f64]) -> Vec<usize> {
    match undo {
        Undo::Gravity(_) | Undo::Zero(..) | Undo::Position(None, _) => before.mended(after),
        Undo::Order(_, order) => (0..order.len()).filter(|j| order[*j] != *j).collect(),
        Undo::Torque(Some(j), _) | Undo::Position(Some(j), _) | Undo::Both(j) => vec![*j],
        _ => Vec::new(),
    }
}
