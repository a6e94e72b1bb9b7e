//! A zero of one joint's positions that differs between the sets, as after another homing.
//!
//! A zero error ε of a joint adds ε to all its positions. The parameters that a set shows then change along D·ε, and D is
//! found by shifting the recorded positions and solving the least-squares problem again. One set keeps its zero; the shifts
//! of the others make all sets agree as well as they can (Gauss and Newton). A zero of the first joint and a base that leans
//! about its axis are the same, unless other axes follow joints.
//!
//! Leaves out: zeros of several joints at once; the zero that all sets share; estimators other than weighted least squares,
//! whose change with the zero counts as that of weighted least squares.

use nalgebra::{DMatrix, DVector};
use rig_data::Block;
use rig_data::prepare::{Changed, Recording};
use rig_identify::{Base, IdentifyError, ModelKind, TriangularFactor};
use rig_model::robot::Robot;

use crate::basis::Basis;
use crate::causes::hypothesis;
use crate::common::{Common, without_changes};
use crate::identified_set::IdentifiedSet;
use crate::matrices::{pseudo_inverse, quadratic};
use crate::result::Hypothesis;
use crate::rows::each_row;
use crate::set::RecordingSet;

/// Step of the difference that gives D, rad or m.
const STEP: f64 = 1e-3;
/// Largest standard deviation of a shift, rad or m, with which a set tells it. About an axis along gravity none does.
const TOLD: f64 = 0.5;
/// Most steps to the shifts, and the last change over their standard deviation at which they end.
const STEPS: (usize, f64) = (6, 0.1);

/// The sets whose zeros may differ.
pub(crate) struct Zeros<'a> {
    pub robot: &'a Robot,
    pub base: &'a Base,
    pub given: &'a [RecordingSet<'a>],
    pub sets: &'a [IdentifiedSet],
    pub basis: &'a Basis,
    pub common: &'a Common,
    /// Set whose zero is kept; `None` for the one that is nearest to all others.
    pub reference: Option<usize>,
}

/// Shifts of one joint's zero by set, and what they leave.
pub(crate) struct Fitted {
    /// By set, what its positions are too large by.
    pub shifts: Vec<f64>,
    /// Variance of each by the errors of its set alone.
    pub variances: Vec<f64>,
    /// The sum of squares that is left.
    pub chi2: f64,
    /// By set, the change of its parameters by a shift, at these shifts.
    pub along: Vec<DVector<f64>>,
}

impl Zeros<'_> {
    /// Returns the hypothesis that the zero of a joint differs, for each joint whose zero all sets tell; the most likely one
    /// is refined.
    ///
    /// # Errors
    /// Recordings that cannot be read.
    pub(crate) fn hypotheses(&self) -> Result<Vec<Hypothesis>, IdentifyError> {
        let recorded = self.as_recorded();
        let none = DMatrix::zeros(self.common.parameters.len(), 0);
        let mut found: Vec<(usize, Fitted)> = Vec::new();
        for joint in 0..self.robot.joints.len() {
            let own = self.fitted(joint, &recorded, 1, &none)?;
            found.extend(own.map(|own| (joint, own)));
        }
        let best = found
            .iter_mut()
            .min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
        if let Some((joint, own)) = best
            && let Some(refined) = self.fitted(*joint, &recorded, STEPS.0, &none)?
        {
            *own = refined;
        }
        Ok(found
            .iter()
            .map(|(j, own)| self.hypothesis(*j, own))
            .collect())
    }

    /// Returns what least squares of each set's rows give, as recorded.
    pub(crate) fn as_recorded(&self) -> Vec<DVector<f64>> {
        let sets = 0..self.sets.len();
        sets.map(|s| self.solved(s, &self.recorded(s))).collect()
    }

    fn hypothesis(&self, joint: usize, own: &Fitted) -> Hypothesis {
        let relative = |s: usize| match s {
            0 => [0.0; 2],
            _ => [
                own.shifts[s] - own.shifts[0],
                (own.variances[s] + own.variances[0]).sqrt(),
            ],
        };
        // The first joint's axis does not move, and no axis beyond it turns with it.
        let or = match joint {
            0 if !self.robot.has_followers() => ", or a base that leans about its axis",
            _ => "",
        };
        let what = format!(
            "the zero of joint \"{}\"{or}",
            self.robot.joints[joint].name
        );
        Hypothesis {
            shifts: (0..self.sets.len()).map(relative).collect(),
            joint: Some(joint),
            ..hypothesis(self.common, "zero", what, self.sets.len() - 1, own.chi2)
        }
    }

    /// Fits the shifts of a joint's zero; `None` if a set does not tell it. `recorded`: what each set's rows give as recorded.
    /// The parameters may differ between the sets along `beside`, too.
    pub(crate) fn fitted(
        &self,
        joint: usize,
        recorded: &[DVector<f64>],
        steps: usize,
        beside: &DMatrix<f64>,
    ) -> Result<Option<Fitted>, IdentifyError> {
        let n = self.sets.len();
        let reference = self.reference();
        let mut found = Fitted {
            shifts: vec![0.0; n],
            variances: vec![0.0; n],
            chi2: f64::INFINITY,
            along: Vec::new(),
        };
        let weights =
            (self.common.weights.iter().enumerate()).map(|(s, weight)| match s == reference {
                true => weight.clone(),
                false => without_changes(weight, beside).0,
            });
        let weights: Vec<DMatrix<f64>> = weights.collect();
        for _ in 0..steps {
            let mut values = Vec::with_capacity(n);
            let mut along = Vec::with_capacity(n);
            for s in 0..n {
                let [at, beside] = self.values(s, joint, &recorded[s], found.shifts[s])?;
                let d = (beside - &at) / STEP;
                found.variances[s] = 1.0 / quadratic(&weights[s], &d);
                values.push(at);
                along.push(d);
            }
            if !found.variances.iter().all(|v| v.sqrt() < TOLD) {
                return Ok(None);
            }
            let Some((changes, chi2)) = self.step(&weights, &values, &along, reference) else {
                return Ok(None);
            };
            let mut largest = 0.0f64;
            for s in 0..n {
                found.shifts[s] += changes[s];
                largest = largest.max(changes[s].abs() / found.variances[s].sqrt());
            }
            (found.chi2, found.along) = (chi2, along);
            if largest < STEPS.1 {
                break;
            }
        }
        Ok(Some(found))
    }

    /// Returns the set that is nearest to all others in one metric: of several sets one of those that are alike, whatever
    /// their errors. Of two sets it is the one with narrow errors, because a wrong zero makes them wide.
    pub(crate) fn alike(&self) -> usize {
        let Common {
            values, weights, ..
        } = self.common;
        if values.len() < 3 {
            return self.reference();
        }
        let c = self.common.parameters.len();
        let all = (weights.iter()).fold(DMatrix::zeros(c, c), |sum, weight| sum + weight);
        let distance = |r: usize| -> f64 {
            (values.iter())
                .map(|y| quadratic(&all, &(y - &values[r])))
                .sum()
        };
        let nearest = (0..values.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        nearest.unwrap_or(0)
    }

    /// Returns, with the weights `told`, the changes of the shifts that make the values agree best, and the sum of squares that is left then.
    fn step(
        &self,
        told: &[DMatrix<f64>],
        values: &[DVector<f64>],
        along: &[DVector<f64>],
        reference: usize,
    ) -> Option<(Vec<f64>, f64)> {
        let weights: Vec<DMatrix<f64>> = (told.iter().zip(along).enumerate())
            .map(|(s, (weight, d))| match s == reference {
                true => weight.clone(),
                false => {
                    let seen = weight * d;
                    weight - &seen * seen.transpose() / d.dot(&seen)
                }
            })
            .collect();
        let shifted = Common {
            parameters: self.common.parameters.clone(),
            values: values.to_vec(),
            weights,
            spent: 0,
        };
        let (mean, chi2) = shifted.about_mean(&shifted.weights)?;
        let change = |s: usize| match s == reference {
            true => 0.0,
            false => {
                let seen = &told[s] * &along[s];
                seen.dot(&(&values[s] - &mean)) / along[s].dot(&seen)
            }
        };
        Some(((0..values.len()).map(change).collect(), chi2))
    }

    /// Returns the set that is nearest to all others: a set apart is best described against them.
    pub(crate) fn reference(&self) -> usize {
        if let Some(given) = self.reference {
            return given;
        }
        let Common {
            values, weights, ..
        } = self.common;
        let distance = |r: usize| -> f64 {
            (values.iter().zip(weights))
                .map(|(y, weight)| quadratic(weight, &(y - &values[r])))
                .sum()
        };
        let nearest = (0..values.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        nearest.unwrap_or(0)
    }

    /// Returns the common parameters that a set shows if the zero of a joint is `shift` too large in its recordings, and if it
    /// is one step less than that.
    fn values(
        &self,
        s: usize,
        joint: usize,
        recorded: &DVector<f64>,
        shift: f64,
    ) -> Result<[DVector<f64>; 2], IdentifyError> {
        let from = self.basis.from_set[s].select_rows(&self.common.parameters);
        let at = |by: f64| -> Result<DVector<f64>, IdentifyError> {
            let values = match by == 0.0 {
                true => recorded.clone(),
                false => self.solved(s, &self.shifted(s, joint, by)?),
            };
            Ok(&self.common.values[s] + &from * (values - recorded))
        };
        Ok([at(-shift)?, at(STEP - shift)?])
    }

    /// Returns the factor of a set's rows as recorded, those of each joint in units of its residual.
    fn recorded(&self, s: usize) -> TriangularFactor {
        let set = &self.sets[s];
        let mut all = TriangularFactor::new(self.base.len());
        for (own, noise) in set.rows.factors.iter().zip(self.noise(s)) {
            all.merge(own, 1.0 / noise);
        }
        all
    }

    /// The same with positions of a joint that are shifted.
    fn shifted(&self, s: usize, joint: usize, by: f64) -> Result<TriangularFactor, IdentifyError> {
        let shift = |block: &mut Block| {
            if let Some(joint) = block.joints.get_mut(joint) {
                joint.q.iter_mut().for_each(|q| *q += by);
            }
        };
        let shifted: Vec<Changed<'_>> = (self.given[s].recordings.iter())
            .map(|inner| Changed {
                inner: *inner,
                change: &shift,
            })
            .collect();
        let recordings: Vec<&dyn Recording> = shifted.iter().map(|r| r as _).collect();
        let p = self.base.len();
        let noise = self.noise(s);
        let mut all = TriangularFactor::new(p);
        let found = &self.sets[s].found;
        let model = ModelKind::Differential;
        let mut take = |_: usize, rows: &rig_identify::Rows| {
            for (equation, noise) in rows.equations.iter().zip(&noise) {
                for k in (0..rows.t.len()).filter(|k| equation.keep[*k]) {
                    all.push(&equation.x[k * p..(k + 1) * p], equation.y[k], 1.0 / noise);
                }
            }
        };
        each_row(self.robot, self.base, &recordings, found, model, &mut take)?;
        Ok(all)
    }

    /// Returns the residual of each joint of a set; infinite, so that the joint does not count, if it has none.
    fn noise(&self, s: usize) -> Vec<f64> {
        let joints = self.sets[s].found.joints.iter();
        let of = |rms: f64| if rms > 0.0 { rms } else { f64::INFINITY };
        joints.map(|joint| of(joint.train_residual_rms)).collect()
    }

    /// Returns the identified values of a set that its rows give by least squares.
    fn solved(&self, s: usize, factor: &TriangularFactor) -> DVector<f64> {
        let (r, z) = factor.system();
        pseudo_inverse(&(r * pseudo_inverse(&self.sets[s].of_base))) * z
    }
}
