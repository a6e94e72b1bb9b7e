//! Columns of two joints that stand in each other's place, columns counted the other way round, and gravity of another
//! direction.
//!
//! Each such fault is undone in turn and the torques of all joints are explained anew; what makes the data by far the most
//! likely is suspected.

use nalgebra::DMatrix;

use super::super::DiagnoseError;
use super::super::outcome::About;
use super::fit::{Fit, about_mean};
use super::model::{GOOD, Judge, POOR, TRIAL};
use super::rows::Rows;
use super::senses::{Described, friction};
use super::trial::Suspicion;
use super::undo::Undo;

/// Rise of the logarithm of the residuals' variances, summed over the joints, from which on an undone fault is believed: as
/// if one joint's variance fell to a tenth. A description may be far off, and a fault undone may by chance bring it nearer.
const CONVINCING_TO_DESCRIPTION: f64 = 2.3;
/// The same where all parameters are fitted, so that only the model's form speaks: a fall to less than a quarter.
const CONVINCING_TO_FIT: f64 = 1.5;
/// How many are tried.
const SUSPECTS: usize = 4;
/// Joints that move less than this share of the widest do not count, rad or m.
const STILL: f64 = 1e-4;

/// A fault, and shares of the torques' variance that are left of the joints it concerns, as recorded and without it.
pub(super) struct Found {
    pub(super) undo: Undo,
    gain: f64,
    left: [f64; 2],
    /// Whether the other columns of the same joints would explain it, too.
    twin: bool,
}

impl Judge<'_> {
    /// Those that would explain the recording, the likeliest first.
    pub(super) fn mixed(&self) -> Result<Vec<Found>, DiagnoseError> {
        let rows = self.rows.thinned(TRIAL);
        let ranges: Vec<f64> = rows.q.iter().map(|q| range(q)).collect();
        let widest = ranges.iter().copied().fold(0.0, f64::max);
        let moving: Vec<usize> = (0..ranges.len())
            .filter(|j| ranges[*j] > STILL * widest)
            .collect();
        if self.robot.joints.len() < 2 {
            return Ok(Vec::new());
        }
        let before = self.left(&rows)?;
        if moving.iter().all(|j| before[*j] <= POOR) {
            return Ok(Vec::new());
        }
        let mut all: Vec<Found> = Vec::new();
        let gravity = match self.states_from(0) {
            true => self.gravity_shown(&rows)?.map(Undo::Gravity),
            false => None,
        };
        for undo in candidates(&moving).into_iter().chain(gravity) {
            let after = match undo {
                Undo::Gravity(other) => self.left_of_description(&rows, other)?,
                _ => self.left(&undo.applied(self.robot, &rows))?,
            };
            let concerned: Vec<usize> = match undo {
                Undo::Gravity(_) => (moving.iter().copied())
                    .filter(|j| before[*j] > POOR && after[*j] < 0.5 * before[*j])
                    .collect(),
                Undo::Torques(pair) | Undo::Positions(pair) | Undo::Joints(pair) => pair.to_vec(),
                Undo::Torque(Some(j), _) | Undo::Position(Some(j), _) => vec![j],
                _ => Vec::new(),
            };
            // One joint's gravity is turned by its own columns as well.
            if concerned.len() < 2 && matches!(undo, Undo::Gravity(_)) {
                continue;
            }
            let mean = |left: &[f64]| {
                concerned.iter().map(|j| left[*j]).sum::<f64>() / concerned.len() as f64
            };
            let gain = moving
                .iter()
                .map(|j| (before[*j].max(EXACT) / after[*j].max(EXACT)).ln())
                .sum();
            all.push(Found {
                undo,
                gain,
                left: [mean(&before), mean(&after)],
                twin: false,
            });
        }
        let enough = if self.states_from(0) {
            CONVINCING_TO_DESCRIPTION
        } else {
            CONVINCING_TO_FIT
        };
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

    /// As a fault of the recording.
    pub(super) fn said(&self, found: &Found) -> Option<Suspicion> {
        let [recorded, without] = found.left.map(|share| 100.0 * share);
        let model = format!(
            "the model leaves {without:.1} % of the torque's variance, as recorded {recorded:.1} %"
        );
        let swapped = |about: About, column: &str, other: &str, [i, j]: [usize; 2]| {
            let (a, b) = (i + 1, j + 1);
            let or = match found.twin {
                true => format!(" (or {other}{a} and {other}{b})"),
                false => String::new(),
            };
            self.say(
                "swap",
                about,
                i,
                format!("{column}{a} and {column}{b}{or} stand in each other's columns: swapped, {model}; give each its own."),
            )
        };
        let turned = |about: About, column: &str, other: &str, j: usize| {
            let n = j + 1;
            let or = match found.twin {
                _ if column == "q" && self.reference_against(j) => {
                    format!(", against which ref{n} runs as well,")
                }
                true => format!(" (or {other}{n})"),
                false => String::new(),
            };
            self.say(
                "sign",
                about,
                j,
                format!(
                    "{column}{n}{or} is counted the other way round: reversed, {model}; reverse it."
                ),
            )
        };
        let fault = match found.undo.clone() {
            Undo::Torques(pair) => swapped(About::Torque, "tau", "q", pair),
            Undo::Positions(pair) => swapped(About::Motion, "q", "tau", pair),
            Undo::Joints([i, j]) => self.say(
                "swap",
                About::Motion,
                i,
                format!(
                    "The columns of joint {} ({}) and joint {} ({}) stand in each other's place, all of them: exchanged, {model}; number them in the order of the description.",
                    i + 1,
                    self.robot.joints[i].name,
                    j + 1,
                    self.robot.joints[j].name
                ),
            ),
            Undo::Torque(Some(j), _) => turned(About::Torque, "tau", "q", j),
            Undo::Position(Some(j), _) => turned(About::Motion, "q", "tau", j),
            Undo::Gravity(other) => self.gravity_said(other, found.left),
            _ => return None,
        };
        Some(Suspicion::new(fault, found.undo.clone()))
    }

    /// Share of each torque's variance that is left: by the description as it stands where it states every link, which has few
    /// numbers to fit, else by one set of parameters for all joints.
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
            .map(|tau| {
                about_mean(tau.iter().copied())
                    .sqrt()
                    .max(f64::MIN_POSITIVE)
            })
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
            let total = about_mean(rows.tau[j].iter().copied()).max(f64::MIN_POSITIVE);
            let squares = Fit::of(&friction, &rest, &order).map_or_else(
                || about_mean(rest.iter().copied()),
                |fit| fit.residual.norm_squared(),
            );
            squares / total
        };
        Ok((0..n).map(share).collect())
    }
}

/// Shares below this count as this: data without noise have no scale.
const EXACT: f64 = 1e-6;

impl Found {
    /// Whether the recording is poor as it stands, good without the fault, and by far the better.
    fn convinces(&self, enough: f64) -> bool {
        let [recorded, without] = self.left;
        recorded > POOR && without < GOOD.max(0.2 * recorded).min(0.5) && self.gain > enough
    }

    /// Whether it is about more than one joint.
    pub(super) fn is_of_two(&self) -> bool {
        !matches!(self.undo, Undo::Torque(..) | Undo::Position(..))
    }

    /// Whether both say the same of torque and position of the same joints.
    fn is_twin(&self, other: &Self) -> bool {
        match (&self.undo, &other.undo) {
            (Undo::Torques(a), Undo::Positions(b)) | (Undo::Positions(a), Undo::Torques(b)) => {
                a == b
            }
            (Undo::Torque(a, _), Undo::Position(b, _))
            | (Undo::Position(a, _), Undo::Torque(b, _)) => a == b,
            _ => false,
        }
    }
}

fn range(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most - values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// All faults of these joints.
fn candidates(moving: &[usize]) -> Vec<Undo> {
    let mut all = Vec::new();
    for (k, &i) in moving.iter().enumerate() {
        all.extend([Undo::Torque(Some(i), -1.0), Undo::Position(Some(i), -1.0)]);
        for &j in &moving[k + 1..] {
            let pair = [i, j];
            all.extend([
                Undo::Torques(pair),
                Undo::Positions(pair),
                Undo::Joints(pair),
            ]);
        }
    }
    all
}
