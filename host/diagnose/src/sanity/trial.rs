//! A suspected fault against the best other explanation.
//!
//! Each suspicion is taken back on the data, and the whole robot is fitted anew: with the description as prior, with a payload
//! beside it, and by any masses and friction that there can be ([`super::physical`]). The same is done with the data as recorded.
//! What is compared is how well stretches of time are predicted that were left out, stretch by stretch. A fault is certain where
//! without it the data are predicted decisively better than by every explanation that needs no fault: the description, a payload,
//! and masses and friction as far from the description as it is worth. It is certain, too, where the description without the fault
//! closes most of its own misfit, and free parameters do no better with the data as recorded: they can mirror every link, but one
//! sign explains it. What is certain is taken back, and what is left is looked through again: consequences fall. Where nothing is
//! certain, what explains as well as the best is told as open.
//!
//! Leaves out: two faults that hide each other, each without effect alone.

use super::super::DiagnoseError;
use super::super::outcome::DataFault;
use super::fit::Measured;
use super::model::{GOOD, Judge};
use super::physical::{Belief, INDEPENDENT, Load, Physical, Score};
use super::rows::{Form, Rows};
use super::undo::Undo;
use rig_model::robot::Robot;
use rig_output::format_significant;

/// Rows that are looked at, over all joints, and of each at least.
const ROWS: (usize, usize) = (4000, 500);
/// Fall of the logarithm of the left-out variance, summed over the joints, that is worth a fault: one joint's falls to a half.
const WORTH: f64 = core::f64::consts::LN_2;
/// Standard deviations by which stretches have to show it: by chance one in a hundred does.
const CLEAR: f64 = 2.33;
/// Logarithm of the odds that a fault has to have: as rare as a thousand to one.
const ODDS: f64 = 6.9;
/// Shares of a torque's variance below this are as good as none: no model is closer to a real robot.
const EXACT: f64 = 1e-4;
/// Heaviest payload as a multiple of the links' mass: a tool weighs many times what a light link does.
const CARRIED: f64 = 30.0;

/// Something that may be wrong.
#[derive(Clone, Debug)]
pub(super) struct Suspicion {
    pub(super) fault: DataFault,
    /// How it is taken back; none where it is shown by columns alone, without a model.
    pub(super) undo: Option<Undo>,
}

impl Suspicion {
    pub(super) fn new(fault: DataFault, undo: Undo) -> Self {
        Self {
            fault,
            undo: Some(undo),
        }
    }

    /// Whether both take back the same.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let both = self.undo.as_ref().zip(other.undo.as_ref());
        both.is_some_and(|(own, other)| own.is_like(other))
    }
}

/// What one reading of a recording is worth under each belief.
struct Reading {
    described: Option<Score>,
    loaded: Option<Score>,
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
            loaded: (physical.score(Belief::Loaded)).filter(|score| score.load.mass <= most),
            free: physical.score(Belief::Free),
        })
    }

    /// By the description, with or without a payload.
    fn stated(&self) -> impl Iterator<Item = &Score> {
        self.described.iter().chain(&self.loaded)
    }

    fn all(&self) -> impl Iterator<Item = &Score> {
        self.stated().chain(&self.free)
    }
}

/// How much better `a` predicts than `b`: the fall of the logarithm of the left-out variance, summed over the joints, mean over
/// the stretches.
fn gain(a: &Score, b: &Score) -> Measured {
    let gains: Vec<f64> = (a.errors.iter().zip(&b.errors))
        .map(|(a, b)| {
            let both = a.iter().zip(b);
            both.map(|(a, b)| (b.max(EXACT) / a.max(EXACT)).ln()).sum()
        })
        .collect();
    let count = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let squares: f64 = gains.iter().map(|g| (g - mean).powi(2)).sum();
    Measured::new(
        mean,
        (squares / (count * (count - 1.0))).sqrt(),
        count - 1.0,
    )
}

/// Whether `a` predicts decisively better than `b`: stretch by stretch, or where few of them are alike, by the likelihood of all.
fn beats(a: &Score, b: &Score) -> bool {
    gain(a, b).value > WORTH && (clearly(a, b) || odds(a, b) > ODDS)
}

/// Logarithm of how much likelier the data are under `a`, at the noise that each leaves.
fn odds(a: &Score, b: &Score) -> f64 {
    let joints = a.errors.first().map_or(0, Vec::len) as f64;
    0.5 * joints * INDEPENDENT * (b.cost / a.cost).ln()
}

/// Whether `a` predicts better than `b`, be it by little.
fn clearly(a: &Score, b: &Score) -> bool {
    gain(a, b).sigmas() > CLEAR
}

/// Whether neither predicts better than the other by what a fault is worth, nor clearly; also of one and the same.
fn equals(a: &Score, b: &Score) -> bool {
    gain(a, b).value.abs() < WORTH && !clearly(a, b) && !clearly(b, a)
}

fn best<'a>(scores: impl Iterator<Item = &'a Score>) -> Option<&'a Score> {
    scores.reduce(|a, b| if gain(b, a).value > 0.0 { b } else { a })
}

/// Whether the description without the fault, `own`, explains decisively more of what the description as `recorded` does not than
/// free parameters explain beyond it, and predicts no worse: one fault is likelier than that every link is other than described.
fn explains(own: &Score, recorded: &Score, free: &Score) -> bool {
    let (gained, beyond) = (recorded.cost - own.cost, own.cost - free.cost);
    gained - beyond > ODDS && gain(own, recorded).value > 0.0
}

/// What came of a suspicion.
enum Outcome {
    /// It is the only explanation, which predicts so well.
    Certain(Score),
    /// Something else explains as well.
    Open,
    /// Something else explains better.
    Refuted,
}

/// A suspicion without which the data read so, against the data as recorded.
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
    // Senses that were guessed row by row fit noise, too.
    let shown = |own: &&Score| undo.guessed().is_none_or(|j| own.left(j) < GOOD);
    match (
        Some(own).filter(|_| alone).filter(shown),
        stated.filter(shown),
    ) {
        (Some(own), _) | (_, Some(own)) => Outcome::Certain(own.clone()),
        // What predicts worse and is less likely tells nobody anything, by however little.
        _ if gain(own, other).value < 0.0 && odds(own, other) < 0.0 => Outcome::Refuted,
        _ if beats(other, own) => Outcome::Refuted,
        _ => Outcome::Open,
    }
}

impl Judge<'_> {
    /// Of suspicions the one that is certain, or where there is none those that are open; and how the certain one is taken back.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] where the description is no chain.
    pub(super) fn tried(
        &self,
        suspicions: Vec<Suspicion>,
    ) -> Result<(Vec<DataFault>, Option<Undo>), DiagnoseError> {
        let (mut left, mut found) = (Vec::new(), Vec::new());
        for suspicion in suspicions {
            match suspicion.undo {
                Some(undo) => left.push((suspicion.fault, undo)),
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
                Outcome::Open => open.push(k),
                Outcome::Refuted => {}
            }
        }
        let better =
            |a: &(usize, Score), b: &(usize, Score)| gain(&a.1, &b.1).value.total_cmp(&0.0);
        if let Some(best) = certain.iter().max_by(|a, b| better(a, b)) {
            let mut equal = certain.iter().filter(|one| equals(&one.1, &best.1));
            // Of equals the one that is suspected first.
            let first = equal.next().unwrap_or(best);
            let (mut fault, undo) = left[first.0].clone();
            if let Some((other, _)) = equal.next() {
                let other = &left[*other].0.text;
                fault.text = format!("{} Another explanation fits as well: {other}", fault.text);
            }
            found.push(fault);
            return Ok((found, Some(undo)));
        }
        if found.is_empty() {
            let other = self.other(&recorded);
            found.extend(open.into_iter().map(|k| opened(left[k].0.clone(), &other)));
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

    /// The robot and the data without a fault, and the joints whose torques have no sign.
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

    /// What explains the data as recorded best, a clause.
    fn other(&self, recorded: &Reading) -> String {
        let best = best(recorded.all());
        let is = |score: &Option<Score>| {
            let pair = best.zip(score.as_ref());
            pair.is_some_and(|(a, b)| std::ptr::eq(a, b))
        };
        if is(&recorded.described) {
            "the description, with friction of its own, explains these data as well".to_owned()
        } else if is(&recorded.loaded) {
            let load = recorded.loaded.as_ref().map(|score| score.load);
            load.map_or_else(String::new, |load| loaded(load, self.robot))
        } else {
            "other masses and friction than described explain these data as well".to_owned()
        }
    }
}

fn loaded(load: Load, robot: &Robot) -> String {
    let last = robot.joints.last().map_or("", |joint| joint.name.as_str());
    let place = robot.last_link.inverse_transform_point(&load.place.into());
    let [x, y, z] =
        [place.x, place.y, place.z].map(|p| format!("{:.2}", 0.0 + (100.0 * p).round() / 100.0));
    format!(
        "a payload of about {} kg at ({x}, {y}, {z}) m in the frame of joint {last} explains these data as well",
        format_significant(load.mass, 2)
    )
}

/// A fault that something else explains as well.
fn opened(mut fault: DataFault, other: &str) -> DataFault {
    fault.certain = false;
    fault.text = format!("{} This is not certain: {other}.", fault.text);
    fault
}
