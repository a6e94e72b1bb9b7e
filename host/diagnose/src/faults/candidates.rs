//! Transformations of a recording that make the description explain it: another order of columns, a reversed sense,
//! another zero or factor, and another direction of gravity.
//!
//! Each transformation is undone in turn and the torques of all joints are fitted again. The ones that make the data by
//! far the likeliest are suspected; the trial ([`crate::faults::trial`]) decides.

use nalgebra::Vector3;

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::judge::Judge;
use crate::faults::levels::{EXACT, GOOD, MUCH_BETTER, POOR, POOR_ALONE, TRIAL, WORTH};
use crate::faults::misfit::{Misfit, Reversal};
use crate::faults::names;
use crate::faults::rows::Rows;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::{Columns, Side, Undo};

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
    /// True if it is a factor of positions that has a name.
    named: bool,
    /// Largest residual share of a moving joint without it.
    worst: f64,
    /// True if it is suspected without another suspicion beside it.
    pub(crate) alone: bool,
}

/// Residuals of the recording as it is, for comparison with transformations.
pub(crate) struct Before {
    /// Rows of the trial.
    rows: Rows,
    /// True if a drive whose inertia is not described may have any.
    free_drives: bool,
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

    /// Returns the largest residual share of a moving joint.
    fn worst(&self, left: &[f64]) -> f64 {
        self.moving.iter().map(|j| left[*j]).fold(0.0, f64::max)
    }

    /// Returns the joints with a residual share above `level` whose residual variance the transformation at least halves.
    fn mended(&self, after: &[f64], level: f64) -> Vec<usize> {
        let mends = |j: &usize| self.left[*j] > level && after[*j] < 0.5 * self.left[*j];
        self.moving.iter().copied().filter(mends).collect()
    }
}

impl Judge<'_> {
    /// Returns the transformations that explain the recording, the likeliest first; none for a single joint.
    pub(crate) fn transformed(&self) -> Result<Vec<Found>, DiagnoseError> {
        let rows = self.rows.thinned(TRIAL);
        if self.robot.joints.len() < 2 {
            return Ok(Vec::new());
        }
        // The inertia of a drive that is not described could adapt to a wrong sense or order.
        let stated = self.before(rows, false)?;
        let mut all = match stated.worst(&stated.left) > POOR {
            true => self.convincing(self.of_sense_and_order(&stated)?, &stated)?,
            false => Vec::new(),
        };
        if self.states_from(0) {
            let free = self.before(stated.rows, true)?;
            all.extend(self.convincing(self.of_values(&free)?, &free)?);
        }
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let twins: Vec<bool> = (all.iter())
            .map(|own| all.iter().any(|other| other.is_twin(own)))
            .collect();
        for (found, twin) in all.iter_mut().zip(twins) {
            found.twin = twin;
        }
        Ok(all)
    }

    /// Returns the residuals of the recording as it is. `free_drives`: a drive whose inertia is not described may have any.
    fn before(&self, rows: Rows, free_drives: bool) -> Result<Before, DiagnoseError> {
        let ranges: Vec<f64> = rows.q.iter().map(|q| range(q)).collect();
        let widest = ranges.iter().copied().fold(0.0, f64::max);
        let moving = (0..ranges.len())
            .filter(|j| ranges[*j] > STILL * widest)
            .collect();
        let left = self.left(&rows, free_drives)?;
        Ok(Before {
            rows,
            free_drives,
            moving,
            left,
            enough: match self.states_from(0) {
                true => CONVINCING_TO_DESCRIPTION,
                false => CONVINCING_TO_FIT,
            },
        })
    }

    /// Returns the transformations that explain the recording, the likeliest first.
    fn convincing(
        &self,
        candidates: Vec<Undo>,
        before: &Before,
    ) -> Result<Vec<Found>, DiagnoseError> {
        let mut all: Vec<Found> = Vec::new();
        for undo in candidates {
            let after = self.left_without(&undo, before)?;
            let concerned = concerned(&undo, before, &after);
            // One joint's own columns explain turned gravity as well.
            if concerned.is_empty() || concerned.len() < 2 && matches!(undo, Undo::Gravity(_)) {
                continue;
            }
            let mean = |left: &[f64]| {
                concerned.iter().map(|j| left[*j]).sum::<f64>() / concerned.len() as f64
            };
            let named = self.is_named(&undo);
            all.push(Found {
                undo,
                gain: before.gain(&after),
                left: [mean(&before.left), mean(&after)],
                twin: false,
                named,
                worst: before.worst(&after),
                alone: false,
            });
        }
        for found in &mut all {
            found.alone = found.convinces(before.enough);
        }
        all.retain(|found| found.alone || found.named && found.gain > WORTH);
        all.sort_by(|a, b| b.alone.cmp(&a.alone).then(b.gain.total_cmp(&a.gain)));
        let mut once: Vec<Found> = Vec::new();
        for own in all {
            if once.iter().all(|other| !other.undo.is_like(&own.undo)) {
                once.push(own);
            }
        }
        once.truncate(SUSPECTS);
        Ok(once)
    }

    /// Returns the senses and orders of columns to try.
    fn of_sense_and_order(&self, before: &Before) -> Result<Vec<Undo>, DiagnoseError> {
        let mut all = Vec::new();
        let ratio = |j: &usize| self.robot.joints[*j].gear_ratio();
        let first = before.moving.first().map_or(1.0, ratio);
        let sides: &[Side] = match before.moving.iter().all(|j| ratio(j) == first) {
            true => &[Side::Joint],
            false => &[Side::Motor, Side::Joint],
        };
        for which in [Columns::Torques, Columns::Positions, Columns::Joints] {
            for side in sides {
                all.extend(self.orders((which, *side), before)?);
            }
        }
        for &j in &before.moving {
            all.extend([
                Undo::Torque(Some(j), -1.0),
                Undo::Position(Some(j), -1.0),
                Undo::Both(j),
            ]);
            if self.states_from(0) {
                all.extend(self.factor(Some(j), -1.0, before)?);
            }
        }
        Ok(all)
    }

    /// Returns the values of the description to try: factors of all gears, of all positions and of each joint's, and in
    /// a poor recording zeros and the direction of gravity.
    fn of_values(&self, before: &Before) -> Result<Vec<Undo>, DiagnoseError> {
        let mut all = self.through_gears();
        all.extend(self.factor(None, 1.0, before)?);
        for &j in &before.moving {
            all.extend(self.factor(Some(j), 1.0, before)?);
        }
        if before.worst(&before.left) > POOR {
            all.extend(self.gravity_shown(&before.rows)?.map(Undo::Gravity));
            for &j in &before.moving {
                all.extend(self.zero(j, before)?);
            }
        }
        Ok(all)
    }

    /// Returns torques and positions of all joints times, or by, the ratio of their own gears; nothing without two gears.
    fn through_gears(&self) -> Vec<Undo> {
        let joints = &self.robot.joints;
        if joints
            .iter()
            .filter(|joint| names::ratio(joint).is_some())
            .count()
            < 2
        {
            return Vec::new();
        }
        let ratios: Vec<f64> = joints
            .iter()
            .map(|joint| joint.gear_ratio().abs())
            .collect();
        let inverse: Vec<f64> = ratios.iter().map(|ratio| 1.0 / ratio).collect();
        vec![
            Undo::Torques(ratios.clone()),
            Undo::Torques(inverse.clone()),
            Undo::Positions(ratios),
            Undo::Positions(inverse),
        ]
    }

    /// Returns the fall of the log residual variances when a transformation is undone.
    pub(crate) fn gain_without(&self, undo: &Undo, before: &Before) -> Result<f64, DiagnoseError> {
        Ok(before.gain(&self.left_without(undo, before)?))
    }

    fn left_without(&self, undo: &Undo, before: &Before) -> Result<Vec<f64>, DiagnoseError> {
        match undo {
            Undo::Gravity(other) => {
                self.left_of_description(&before.rows, *other, before.free_drives)
            }
            _ => self.left(&undo.applied(self.robot, &before.rows), before.free_drives),
        }
    }

    /// Returns the transformation as a fault of the recording.
    pub(crate) fn said(&self, found: &Found) -> Option<Suspicion> {
        let left = found.left;
        let fault = match &found.undo {
            Undo::Order(which, _, order) => {
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
            Undo::Position(Some(j), factor) => match self.shown_by_limits(*j) {
                // Limits show a unit better than a rough description does.
                Some(unit) => unit.clone(),
                None => self.scaled(*j, &[*factor], left).fault,
            },
            Undo::Position(None, factor) => Fault::of_recording(Misfit::AllScaled {
                factor: *factor,
                left,
            }),
            Undo::Torques(factors) | Undo::Positions(factors) => {
                let torque = matches!(found.undo, Undo::Torques(_));
                let larger = factors.iter().zip(&self.robot.joints);
                let larger = larger.map(|(f, joint)| f.ln() * joint.gear_ratio().abs().ln());
                Fault::of_recording(Misfit::ThroughGears {
                    torque,
                    twice: (larger.sum::<f64>() > 0.0) != torque,
                    left,
                })
            }
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
}

impl Found {
    /// Returns true if the recording is poor as it is, good without the fault, and much better. A transformation with a
    /// fitted value must be better by more.
    fn convinces(&self, enough: f64) -> bool {
        let [recorded, without] = self.left;
        // A factor that has a name is likelier than any other value; it must explain more where the description is far off.
        let far_off = f64::max(1.0, self.worst / POOR_ALONE);
        if self.named && self.gain > WORTH * far_off {
            return true;
        }
        let (fitted, poor) = match self.undo {
            Undo::Position(_, factor) if factor != -1.0 => (MUCH_BETTER, POOR_ALONE),
            Undo::Zero(..) => (MUCH_BETTER, POOR),
            _ => (1.0, POOR),
        };
        recorded > poor
            && without < GOOD.max(0.2 * recorded).min(0.5)
            && without < fitted * recorded
            && self.gain > enough
    }

    /// Returns true if both mean the same for torque and position of the same joints.
    fn is_twin(&self, other: &Self) -> bool {
        match (&self.undo, &other.undo) {
            (Undo::Order(own, _, a), Undo::Order(other, _, b)) => {
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
        Undo::Gravity(_) | Undo::Zero(..) => before.mended(after, POOR),
        Undo::Position(None, _) | Undo::Torques(_) | Undo::Positions(_) => {
            before.mended(after, 0.0)
        }
        Undo::Order(_, _, order) => (0..order.len()).filter(|j| order[*j] != *j).collect(),
        Undo::Torque(Some(j), _) | Undo::Position(Some(j), _) | Undo::Both(j) => vec![*j],
        _ => Vec::new(),
    }
}
