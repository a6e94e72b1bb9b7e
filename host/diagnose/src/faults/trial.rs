//! Test of a suspected fault against the best other explanation.
//!
//! Each suspected fault is undone in the data and the whole robot is refitted: with the description as prior, with an
//! added payload, and with any masses and friction ([`crate::faults::physical`]). The same is done with the data as recorded.
//! The test compares the prediction of left-out stretches, one by one. A fault is certain if its undoing predicts
//! decisively better than every explanation without a fault: the description, a payload, or masses and friction within
//! the description's uncertainty. It is also certain if it removes most of the description's misfit, and free
//! parameters do no better with the recorded data. They can mirror every link, but one sign explains it. A certain
//! fault is undone and the search repeats, which removes its consequences. If none is certain, faults that explain as
//! well as the best are reported as open.
//!
//! Leaves out: two faults that hide each other, each without effect alone.

use crate::DiagnoseError;
use crate::faults::finding::{Beside, Explanation, Fault};
use crate::faults::fit::Measured;
use crate::faults::judge::Judge;
use crate::faults::levels::{GOOD, ODDS, WORTH};
use crate::faults::physical::{Belief, INDEPENDENT, Physical, Score};
use crate::faults::rows::{Form, Rows};
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;
use rig_model::robot::Robot;
use rig_numerics::statistics;

/// Rows in the test: over all joints, and least of each.
const ROWS: (usize, usize) = (4000, 500);
/// Standard deviations between stretches that are clear; chance reaches them once in a hundred.
const CLEAR: f64 = 2.33;
/// Variance share that counts as none: no model is closer to a real robot.
const EXACT: f64 = 1e-4;
/// Heaviest payload as a multiple of the links' mass: a tool may weigh many times a light link.
const CARRIED: f64 = 30.0;

/// Scores of a recording under each belief.
struct Reading {
    described: Option<Score>,
    prepared: Option<Score>,
    free: Option<Score>,
}

impl Reading {
    fn of(
        robot: &Robot,
        rows: &Rows,
        magnitude: Vec<bool>,
        edge: usize,
    ) -> Result<Self, DiagnoseError> {
        let form = Form::of(robot)?;
        let physical = Physical::of(robot, &form, rows, magnitude, edge)?;
        let masses = robot.joints.iter().filter_map(|j| j.inertial.as_ref());
        let most = CARRIED * masses.map(|i| i.mass).sum::<f64>();
        Ok(Self {
            described: physical.score(Belief::Described),
            prepared: (physical.score(Belief::PreparedData))
                .filter(|score| score.load.mass <= most),
            free: physical.score(Belief::Free),
        })
    }

    /// Returns the scores of the description, without and with a payload.
    fn stated(&self) -> impl Iterator<Item = &Score> {
        self.described.iter().chain(&self.prepared)
    }

    fn all(&self) -> impl Iterator<Item = &Score> {
        self.stated().chain(&self.free)
    }
}

/// Returns how much better `a` predicts than `b`: the fall of the log left-out variance, summed over joints, mean over
/// the stretches.
fn gain(a: &Score, b: &Score) -> Measured {
    let gains: Vec<f64> = (a.errors.iter().zip(&b.errors))
        .map(|(a, b)| {
            let both = a.iter().zip(b);
            both.map(|(a, b)| (b.max(EXACT) / a.max(EXACT)).ln()).sum()
        })
        .collect();
    let count = gains.len() as f64;
    let mean = statistics::mean(&gains);
    let squares = statistics::squares_about(&gains, mean);
    Measured::new(
        mean,
        (squares / (count * (count - 1.0))).sqrt(),
        count - 1.0,
    )
}

/// Returns true if `a` predicts decisively better than `b`, by stretches or by the likelihood of all data.
fn beats(a: &Score, b: &Score) -> bool {
    gain(a, b).value > WORTH && (clearly(a, b) || odds(a, b) > ODDS)
}

/// Returns the log odds of the data under `a` against `b`, each with its own noise level.
fn odds(a: &Score, b: &Score) -> f64 {
    independent(a) * (b.cost / a.cost).ln()
}

/// Returns half the number of independent rows of all joints: the expected misfit under the assumed noise.
fn independent(score: &Score) -> f64 {
    let joints = score.errors.first().map_or(0, Vec::len) as f64;
    0.5 * joints * INDEPENDENT
}

/// Returns true if `a` predicts clearly better than `b`, even if by little.
fn clearly(a: &Score, b: &Score) -> bool {
    gain(a, b).sigmas() > CLEAR
}

/// Returns true if neither predicts better by the worth of a fault or clearly; also if both are the same.
fn equals(a: &Score, b: &Score) -> bool {
    gain(a, b).value.abs() < WORTH && !clearly(a, b) && !clearly(b, a)
}

fn best<'a>(scores: impl Iterator<Item = &'a Score>) -> Option<&'a Score> {
    scores.reduce(|a, b| if gain(b, a).value > 0.0 { b } else { a })
}

/// Returns true if undoing the fault improves the description (`recorded` to `own`) decisively more than `free`
/// parameters improve it further, and predicts no worse. One fault is likelier than a wrong description of every link.
/// The noise is that of the free parameters, if they leave more than rows are assumed to have.
fn explains(own: &Score, recorded: &Score, free: &Score) -> bool {
    let (gained, beyond) = (recorded.cost - own.cost, own.cost - free.cost);
    let noise = f64::max(1.0, free.cost / independent(free));
    gained - beyond > ODDS * noise && gain(own, recorded).value > 0.0
}

/// Result of testing a suspicion.
enum Outcome {
    /// It is the only explanation with such a prediction.
    Certain(Score),
    /// Another explanation is as good.
    Open,
    /// Another explanation is better.
    Refuted,
}

/// Judges a suspicion by the data without it and as recorded.
fn outcome(undo: &Undo, without: &Reading, recorded: &Reading) -> Outcome {
    let (Some(own), Some(other)) = (best(without.all()), best(recorded.all())) else {
        return Outcome::Open;
    };
    let alone = recorded.all().all(|other| beats(own, other));
    let stated = best(without.stated()).filter(|own| {
        let free =
            (without.free.iter().chain(&recorded.free)).min_by(|a, b| a.cost.total_cmp(&b.cost));
        let explained = |other| free.is_some_and(|free| explains(own, other, free));
        let contradicted = recorded
            .free
            .iter()
            .any(|as_recorded| (without.free.iter()).all(|without| beats(as_recorded, without)));
        !contradicted && recorded.stated().all(explained)
    });
    // Senses that were guessed row by row also fit noise.
    let shown = |own: &&Score| undo.guessed().is_none_or(|j| own.left(j) < GOOD);
    match (
        Some(own).filter(|_| alone).filter(shown),
        stated.filter(shown),
    ) {
        (Some(own), _) | (_, Some(own)) => Outcome::Certain(own.clone()),
        // A suspicion that predicts worse and is less likely is refuted, by however little.
        _ if gain(own, other).value < 0.0 && odds(own, other) < 0.0 => Outcome::Refuted,
        _ if beats(other, own) => Outcome::Refuted,
        _ => Outcome::Open,
    }
}

impl Judge<'_> {
    /// Returns the certain suspicion and how it is undone, or, if none is certain, the open ones.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn tried(
        &self,
        suspicions: Vec<Suspicion>,
    ) -> Result<(Vec<Fault>, Option<Undo>), DiagnoseError> {
        let (mut left, mut rivals, mut found) = (Vec::new(), Vec::new(), Vec::new());
        for suspicion in suspicions {
            match suspicion.undo {
                Some(undo) => {
                    left.push((suspicion.fault, undo));
                    rivals.push(suspicion.is_rival);
                }
                None => found.push(suspicion.fault),
            }
        }
        if left.is_empty() {
            return Ok((found, None));
        }
        let edge = left.iter().map(|(_, undo)| undo.edge()).max().unwrap_or(0);
        let recorded = self.reading(None, edge)?;
        let (mut certain, mut open) = (Vec::new(), Vec::new());
        for (k, (_, undo)) in left.iter().enumerate() {
            match outcome(undo, &self.reading(Some(undo), edge)?, &recorded) {
                Outcome::Certain(own) => certain.push((k, own)),
                Outcome::Open if !rivals[k] => open.push(k),
                Outcome::Open | Outcome::Refuted => {}
            }
        }
        let better =
            |a: &(usize, Score), b: &(usize, Score)| gain(&a.1, &b.1).value.total_cmp(&0.0);
        if let Some(best) = certain.iter().max_by(|a, b| better(a, b)) {
            let mut equal: Vec<_> = (certain.iter())
                .filter(|one| equals(&one.1, &best.1))
                .collect();
            // Among equals the one that predicts best counts; senses and zeros come last, as others are likelier.
            let late = |one: &(usize, Score)| {
                let undo = &left[one.0].1;
                undo.is_of_sense() || undo.is_of_zero()
            };
            equal.sort_by(|a, b| match (late(a), late(b)) {
                (false, false) => better(b, a),
                (a, b) => a.cmp(&b),
            });
            let first = equal.first().map_or(best.0, |one| one.0);
            let (mut fault, undo) = left[first].clone();
            if let Some((other, _)) = equal.get(1) {
                fault.beside = Beside::Fault(Box::new(left[*other].0.clone()));
            }
            // What other evidence shows of this joint is judged again without the fault.
            found.retain(|other| undo.is_of_robot() || other.joint != fault.joint);
            found.push(fault);
            return Ok((found, Some(undo)));
        }
        if found.is_empty() {
            let beside = Beside::NoFault(explanation(&recorded));
            found.extend(open.into_iter().map(|k| Fault {
                beside: beside.clone(),
                ..left[k].0.clone()
            }));
        }
        Ok((found, None))
    }

    fn reading(&self, undo: Option<&Undo>, edge: usize) -> Result<Reading, DiagnoseError> {
        let (robot, rows, magnitude) = self.without(undo);
        let (all, least) = ROWS;
        let most = (all / robot.joints.len()).max(least);
        let step = rows.len().div_ceil(most).max(1);
        Reading::of(&robot, &rows.thinned(most), magnitude, edge.div_ceil(step))
    }

    /// Returns robot and data without a fault, and the joints whose torques have no sign.
    fn without(&self, undo: Option<&Undo>) -> (Robot, Rows, Vec<bool>) {
        let lost = |j: usize| matches!(undo, Some(Undo::Magnitude(k, _)) if *k == j);
        let magnitude = (0..self.robot.joints.len()).map(lost).collect();
        match undo {
            Some(undo) => (
                undo.robot(self.robot),
                undo.applied(self.robot, &self.rows),
                magnitude,
            ),
            None => (self.robot.clone(), self.rows.clone(), magnitude),
        }
    }
}

/// Returns the best explanation of the data as recorded.
fn explanation(recorded: &Reading) -> Explanation {
    let best = best(recorded.all());
    let is = |score: &&Score| best.is_some_and(|best| std::ptr::eq(best, *score));
    if recorded.described.as_ref().is_some_and(|own| is(&own)) {
        return Explanation::Description;
    }
    let prepared = recorded.prepared.as_ref().filter(is);
    prepared.map_or(Explanation::OtherMasses, |own| {
        Explanation::Payload(own.load)
    })
}
