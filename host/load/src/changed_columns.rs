//! Position columns that are exchanged or reversed, or have another zero or scale; forces that are exchanged with moments;
//! and readings in the axes of the base, as the controllers of arms give them.
//!
//! Each change is undone and the load fitted again. It is believed by the criterion of the other causes: it leaves about the
//! noise, and decisively less than what was found without it. A change that explains the readings as well as a leaning base
//! or a turned sensor is named beside that. Leaves out: several changes at once.

use nalgebra::Vector3;
use rig_data::{Block, WRENCH_COLUMNS};
use rig_model::robot::{JointKind, WristSensor};
use rig_output::{capital, format_significant};
use rig_shared::multibody::Chain;

use crate::axes::SensorAxes;
use crate::causes::{Cause, Compared, Tried, explains, is_beyond_scatter, leaves_less, score};
use crate::channels::KINDS_EXCHANGED;
use crate::error::LoadError;
use crate::faulty_rows::FaultyRows;
use crate::intake::{Intake, Sampled};
use crate::motion_sample::JointState;
use crate::rows::base_axes;
use crate::selection::selected;
use crate::settle::DECISIVE;
use crate::statistics::Recorded;
use crate::system::{Fit, Nuisance, Sensed, Unknowns};

/// Zeros that are tried over a turn. The wrench has two harmonics of a joint's position and its square four, so there are
/// four between two minima of the residual.
const ZEROS: i32 = 16;
/// Halvings of the step from the best of them, to 0.1 mrad.
const HALVINGS: i32 = 12;
/// Changes that are fitted with everything that the readings show beside them.
const KEPT: usize = 3;
/// Most times that the readings are shifted by a delay found beside a change.
const MOST_SHIFTS: usize = 3;
/// Half of the change over which the residual is taken for a parabola: of a zero, rad, or of a scale.
const PARABOLA: f64 = 2e-3;
/// Step of the scales that are tried, and their number on either side of 1. Over a range of 2 rad the outermost ones move
/// the end by 0.5 rad, so that there is one minimum of the residual between them. Counts or a ratio that are further off
/// are another unit, which the check of the limits names.
const SCALE_STEP: f64 = 0.0625;
const SCALES: i32 = 4;

/// A change of the position columns.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    /// The positions of two joints are exchanged.
    Exchanged(usize, usize),
    /// The position of a joint has the opposite sign.
    Reversed(usize),
    /// The position of a joint is counted from another zero: the angle to add, rad.
    Zero(usize, f64),
    /// The position of a joint has another scale: the factor to apply.
    Scale(usize, f64),
    /// Forces and moments are in the axes of the base.
    Base,
    /// Two channels of the sensor are exchanged, a force and a moment.
    Channels(usize, usize),
    /// All forces are exchanged with the moments.
    Kinds,
}

impl Change {
    fn words(&self) -> [String; 2] {
        match *self {
            Self::Exchanged(a, b) => [
                format!("q{} and q{} are exchanged", a + 1, b + 1),
                "exchange these columns".to_owned(),
            ],
            Self::Reversed(j) => [
                format!("q{} has the opposite sign", j + 1),
                format!("reverse the column q{}", j + 1),
            ],
            Self::Zero(j, angle) => [
                format!(
                    "q{} is counted from another zero ({} rad to be added)",
                    j + 1,
                    format_significant(angle, 3)
                ),
                format!("check the zero of q{}", j + 1),
            ],
            Self::Scale(j, factor) => [
                format!(
                    "q{} has another scale ({} times it fits)",
                    j + 1,
                    format_significant(factor, 4)
                ),
                format!("check the gear ratio and the counts of the encoder of q{}", j + 1),
            ],
            Self::Base => [
                "forces and moments are in the axes of the base, not in those of the sensor"
                    .to_owned(),
                "record them in the axes of the sensor, or turn them there by the rotation of the sensor in each row"
                    .to_owned(),
            ],
            Self::Channels(a, b) => {
                let [a, b] = [a, b].map(|c| WRENCH_COLUMNS[c]);
                [
                    format!("{a} and {b} are exchanged"),
                    "exchange these columns".to_owned(),
                ]
            }
            Self::Kinds => [
                KINDS_EXCHANGED.to_owned(),
                "exchange these columns".to_owned(),
            ],
        }
    }

    /// Returns true for a change of the columns of the sensor.
    fn is_of_sensor(self) -> bool {
        matches!(self, Self::Channels(..) | Self::Kinds | Self::Base)
    }

    /// Returns the channel that is recorded in the column of another.
    fn channel(self, column: usize) -> usize {
        match self {
            Self::Channels(a, b) if column == a => b,
            Self::Channels(a, b) if column == b => a,
            Self::Kinds => (column + 3) % 6,
            _ => column,
        }
    }

    /// Takes the change out of a block.
    fn undo(self, block: &mut Block, axes: &SensorAxes, chain: &Chain<f64>) {
        let mut multiply = |j: usize, factor: f64| {
            let joint = &mut block.joints[j];
            let rates = [&mut joint.qd, &mut joint.qdd].into_iter().flatten();
            let columns = std::iter::once(&mut joint.q).chain(rates);
            columns.flatten().for_each(|value| *value *= factor);
        };
        match self {
            Self::Exchanged(a, b) => block.joints.swap(a, b),
            Self::Reversed(j) => multiply(j, -1.0),
            Self::Scale(j, factor) => multiply(j, factor),
            Self::Zero(j, angle) => block.joints[j].q.iter_mut().for_each(|q| *q += angle),
            Self::Base => turn_block(block, axes, chain),
            Self::Channels(..) | Self::Kinds => {
                for (name, _) in &mut block.extra {
                    if let Some(column) = WRENCH_COLUMNS.iter().position(|own| own == name) {
                        *name = WRENCH_COLUMNS[self.channel(column)].to_owned();
                    }
                }
            }
        }
    }

    /// Takes the change out of the states of the joints and the readings at one instant.
    fn undo_state(
        self,
        joints: &mut [JointState],
        readings: &mut [f64; 6],
        (axes, chain): (&SensorAxes, &Chain<f64>),
    ) {
        match self {
            Self::Channels(..) | Self::Kinds => {
                let own = *readings;
                *readings = std::array::from_fn(|c| own[self.channel(c)]);
            }
            Self::Base => {
                let q: Vec<f64> = joints.iter().map(|own| own[0]).collect();
                *readings = turned_to_sensor(*readings, &q, axes, chain);
            }
            Self::Exchanged(a, b) => joints.swap(a, b),
            Self::Reversed(j) => joints[j] = joints[j].map(|value| -value),
            Self::Scale(j, factor) => joints[j] = joints[j].map(|value| value * factor),
            Self::Zero(j, angle) => joints[j][0] += angle,
        }
    }
}

/// Turns the readings of a block from the axes of the base to those of the sensor.
fn turn_block(block: &mut Block, axes: &SensorAxes, chain: &Chain<f64>) {
    let place = |name: &str| block.extra.iter().position(|(own, _)| own == name);
    let places: Option<Vec<usize>> = WRENCH_COLUMNS.iter().map(|name| place(name)).collect();
    let Some(places) = places else {
        return;
    };
    for k in 0..block.t.len() {
        let q: Vec<f64> = block.joints.iter().map(|own| own.q[k]).collect();
        let readings = std::array::from_fn(|c| block.extra[places[c]].1[k]);
        let turned = turned_to_sensor(readings, &q, axes, chain);
        for (at, value) in places.iter().zip(turned) {
            block.extra[*at].1[k] = value;
        }
    }
}

/// Returns the readings in the axes of the sensor, of readings in those of the base; as they are without a pose.
fn turned_to_sensor(
    readings: [f64; 6],
    q: &[f64],
    axes: &SensorAxes,
    chain: &Chain<f64>,
) -> [f64; 6] {
    let Ok(base) = base_axes(chain, q) else {
        return readings;
    };
    let of = |first: usize| -> Vector3<f64> {
        let own = base.iter().enumerate();
        own.map(|(k, axis)| axes.seen(axis) * readings[first + k])
            .sum()
    };
    let (force, moment) = (of(0), of(3));
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

/// What the readings say of the columns.
pub(crate) enum Columns {
    /// Nothing.
    Silent,
    /// A change of them explains the readings, and no property or cause does as well. It stands beside the score.
    Wrong(String, f64),
    /// A change of them explains the readings as well as a property that was found.
    AsGood(String),
}

/// Looks for a change of the position columns, if nothing else explains the readings, or a leaning base or a turned sensor
/// does. `faulty` are rows that are left out.
///
/// # Errors
/// [`LoadError`].
pub(crate) fn changed_columns(
    intake: &Intake,
    faulty: &FaultyRows,
    sensor: &WristSensor,
    (sensed, compared): (&Sensed, &Compared),
) -> Result<Columns, LoadError> {
    if !is_asked(sensed, compared) {
        return Ok(Columns::Silent);
    }
    let search = Search {
        intake,
        faulty,
        like: sensed,
        described: &compared.described,
        unknowns: compared.described.selected.fit.unknowns.plain(),
        axes: intake.axes(),
        has_sign: sensor.reads.is_some(),
        samples: intake.samples()?,
    };
    let mut found = Vec::new();
    for change in search.nearest()? {
        let own = search.explained(change)?;
        let sensed = search.sensed(&own.recordings);
        let weighs = search.weighs(&own.fit);
        if weighs && explains(&sensed, &own.fit) && !is_beyond_scatter(&sensed, &own.fit) {
            found.push(own);
        }
    }
    found.sort_by(|a, b| a.score.total_cmp(&b.score));
    Ok(search.verdict(&found, compared))
}

/// Returns the explanation that is believed without a change of the positions.
fn believed(compared: &Compared) -> &Tried {
    compared.causes.first().unwrap_or(&compared.described)
}

/// Returns true if a change of the positions may be meant: nothing explains the readings, or a turned sensor or a leaning base
/// does.
fn is_asked(sensed: &Sensed, compared: &Compared) -> bool {
    let own = believed(compared);
    let fit = &own.selected.fit;
    match own.cause {
        Cause::Described => {
            !sensed.is_exact(fit)
                && (!explains(sensed, fit) || is_beyond_scatter(sensed, fit) || turns(fit))
        }
        Cause::Turned => true,
        _ => false,
    }
}

/// Returns true if a fit has a turned sensor or a leaning base.
fn turns(fit: &Fit) -> bool {
    fit.unknowns.has(Nuisance::Lean) || fit.unknowns.has(Nuisance::Rotation)
}

/// A change with everything that the readings show beside it.
struct Explained {
    change: Change,
    recordings: Vec<Recorded>,
    fit: Fit,
    score: f64,
}

/// What changes are tried on.
struct Search<'a> {
    intake: &'a Intake<'a>,
    faulty: &'a FaultyRows,
    like: &'a Sensed<'a>,
    described: &'a Tried,
    /// Load and bias alone.
    unknowns: Unknowns,
    axes: SensorAxes,
    /// True if the sign of the readings is stated.
    has_sign: bool,
    /// Samples of the motions; `None` if there are poses, which are read again for each change.
    samples: Option<Vec<Sampled>>,
}

impl Search<'_> {
    fn sensed<'r>(&self, recordings: &'r [Recorded]) -> Sensed<'r>
    where
        Self: 'r,
    {
        Sensed {
            recordings,
            to_axes: self.like.to_axes,
            gravity: self.like.gravity,
            lever: self.like.lever,
        }
    }

    /// Reads the recordings without a change, the readings `delay` seconds later than the positions.
    fn read(&self, change: Change, delay: f64) -> Result<Vec<Recorded>, LoadError> {
        let undo = |block: &mut Block| change.undo(block, &self.axes, self.intake.chain());
        (self.faulty).left_out_changed(self.intake, delay, &mut Vec::new(), &undo)
    }

    /// Returns the misfit of load and bias without a change, by the sample if there is one.
    fn misfit(&self, change: Change) -> Result<f64, LoadError> {
        let recordings = match &self.samples {
            None => self.read(change, 0.0)?,
            Some(samples) => {
                let undo = |joints: &mut [JointState], readings: &mut [f64; 6]| {
                    change.undo_state(joints, readings, (&self.axes, self.intake.chain()));
                };
                let read = |(sample, label, loaded): &Sampled| {
                    let own = (label.clone(), *loaded);
                    sample.recorded(self.intake.chain(), &self.axes, own, &undo)
                };
                samples.iter().map(read).collect::<Result<_, _>>()?
            }
        };
        let sensed = self.sensed(&recordings);
        let fit = sensed.fit(&self.described.start, &self.unknowns);
        Ok(match self.weighs(&fit) {
            true => fit.misfit(),
            false => f64::INFINITY,
        })
    }

    /// Returns true unless the load would have a negative mass by readings of a stated sign: the opposite reading of another
    /// change.
    fn weighs(&self, fit: &Fit) -> bool {
        !self.has_sign || fit.values[0] > 0.0
    }

    /// Returns the changes that leave least beside load and bias.
    fn nearest(&self) -> Result<Vec<Change>, LoadError> {
        let joints = &self.intake.robot().joints;
        let mut found: Vec<(f64, Change)> = Vec::new();
        for (a, joint) in joints.iter().enumerate() {
            let mut all = vec![Change::Reversed(a)];
            all.extend((a + 1..joints.len()).map(|b| Change::Exchanged(a, b)));
            for change in all {
                found.push((self.misfit(change)?, change));
            }
            if joint.kind == JointKind::Revolute {
                found.push(self.zero(a)?);
            }
            found.push(self.scale(a)?);
        }
        let pairs = (0..9).map(|k| Change::Channels(k / 3, 3 + k % 3));
        for change in pairs.chain([Change::Kinds, Change::Base]) {
            found.push((self.misfit(change)?, change));
        }
        found.retain(|own| own.0.is_finite());
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(KEPT);
        Ok(found.into_iter().map(|own| own.1).collect())
    }

    /// Returns the zero of a joint that leaves least beside load and bias, before its misfit.
    fn zero(&self, joint: usize) -> Result<(f64, Change), LoadError> {
        let step = std::f64::consts::TAU / f64::from(ZEROS);
        // Half a turn further the load is that of the opposite reading.
        let reach = if self.has_sign { ZEROS / 2 } else { ZEROS / 4 };
        let angles = (1 - reach..=reach).map(|k| step * f64::from(k));
        self.least((angles, step), &|angle| Change::Zero(joint, angle))
    }

    /// Returns the scale of a joint's position that leaves least beside load and bias, before its misfit.
    fn scale(&self, joint: usize) -> Result<(f64, Change), LoadError> {
        let factors = (-SCALES..=SCALES).map(|k| 1.0 + SCALE_STEP * f64::from(k));
        self.least((factors, SCALE_STEP), &|factor| {
            Change::Scale(joint, factor)
        })
    }

    /// Returns the change with one value that leaves least beside load and bias, before its misfit: the best of the starts,
    /// which lie a step apart, and from there by halving the step.
    fn least(
        &self,
        (starts, mut step): (impl Iterator<Item = f64>, f64),
        change: &dyn Fn(f64) -> Change,
    ) -> Result<(f64, Change), LoadError> {
        let at = |value: f64| -> Result<(f64, f64), LoadError> {
            Ok((self.misfit(change(value))?, value))
        };
        let nearer = |a: (f64, f64), b: (f64, f64)| if b.0 < a.0 { b } else { a };
        let mut best = (f64::INFINITY, 0.0);
        for start in starts {
            best = nearer(best, at(start)?);
        }
        for _ in 0..HALVINGS {
            step *= 0.5;
            let middle = best.1;
            for value in [middle - step, middle + step] {
                best = nearer(best, at(value)?);
            }
        }
        Ok((best.0, change(best.1)))
    }

    /// Fits everything that the readings show beside a change.
    fn explained(&self, change: Change) -> Result<Explained, LoadError> {
        let (mut delay, mut shifts) = (0.0, 0);
        let change = self.refined(change)?;
        loop {
            let recordings = self.read(change, delay)?;
            let sensed = self.sensed(&recordings);
            let start = &self.described.start;
            let fit = selected(&sensed, sensed.fit(start, &self.unknowns), start).fit;
            match sensed.delay(&fit).filter(|_| shifts < MOST_SHIFTS) {
                Some(further) => {
                    delay += further;
                    shifts += 1;
                }
                None => {
                    let score = score(&sensed, &fit);
                    return Ok(Explained {
                        change,
                        recordings,
                        fit,
                        score,
                    });
                }
            }
        }
    }

    /// Returns a zero or scale that was found by samples as all rows show it: at the least of a parabola through three misfits.
    fn refined(&self, change: Change) -> Result<Change, LoadError> {
        let moved = |by: f64| match change {
            Change::Zero(joint, angle) => Some(Change::Zero(joint, angle + by)),
            Change::Scale(joint, factor) => Some(Change::Scale(joint, factor + by)),
            _ => None,
        };
        if self.samples.is_none() || moved(0.0).is_none() {
            return Ok(change);
        }
        let squares = |by: f64| -> Result<[f64; 2], LoadError> {
            let recordings = self.read(moved(by).unwrap_or(change), 0.0)?;
            Ok(self
                .sensed(&recordings)
                .fit(&self.described.start, &self.unknowns)
                .squares)
        };
        let [before, here, after] = [squares(-PARABOLA)?, squares(0.0)?, squares(PARABOLA)?];
        let over = |own: [f64; 2]| own[0] / here[0] + own[1] / here[1];
        let bend = over(before) - 2.0 * over(here) + over(after);
        let slope = over(after) - over(before);
        let step = -0.5 * PARABOLA * slope / bend;
        let is_near = step.abs() < 2.0 * PARABOLA;
        Ok(moved(step).filter(|_| is_near).unwrap_or(change))
    }

    /// Decides between the changes that explain the readings, best first, and what was found without one.
    fn verdict(&self, found: &[Explained], compared: &Compared) -> Columns {
        let Some(best) = found.first() else {
            return Columns::Silent;
        };
        let (own, described) = (self.sensed(&best.recordings), &compared.described);
        let other = believed(compared);
        let is_better = |than: &Tried| best.score < than.score - DECISIVE;
        let without = (self.like, &described.selected.fit);
        if is_better(other) && is_better(described) && leaves_less((&own, &best.fit), without) {
            let text = wrong_words(found, &described.selected.fit);
            return Columns::Wrong(text, best.score);
        }
        let is_turned = turns(&other.selected.fit);
        if !is_turned || turns(&best.fit) || best.score > other.score + DECISIVE {
            return Columns::Silent;
        }
        // A reading of the opposite wrench is a second error.
        if self.has_sign && other.selected.fit.values[0] < 0.0 {
            let text = wrong_words(found, &described.selected.fit);
            return Columns::Wrong(text, best.score);
        }
        let [what, remedy] = as_good_words(found);
        Columns::AsGood(format!(
            "{} explain the readings as well: {what}. {}.",
            match other.selected.fit.unknowns.has(Nuisance::Lean) {
                true => "Positions with an error and a base that stands as described",
                false => "Positions with an error and a sensor that is not turned",
            },
            capital(&remedy)
        ))
    }
}

/// Lists the changes that explain the readings as well as the best one, and what mends them. A change that needs a turned
/// sensor or a leaning base beside it, where the best one needs neither, stands for none of them.
fn as_good_words(found: &[Explained]) -> [String; 2] {
    let least = found.first().map_or(0.0, |own| own.score);
    let needs_none = found.first().is_some_and(|own| !turns(&own.fit));
    let as_good = found
        .iter()
        .filter(|own| own.score < least + DECISIVE && !(needs_none && turns(&own.fit)));
    let words: Vec<[String; 2]> = as_good.take(KEPT).map(|own| own.change.words()).collect();
    [0, 1].map(|k| {
        let all: Vec<&str> = words.iter().map(|own| own[k].as_str()).collect();
        all.join(", or ")
    })
}

/// Says which change explains the readings. `described` is what was found without one.
fn wrong_words(found: &[Explained], described: &Fit) -> String {
    let [what, remedy] = as_good_words(found);
    let rms = |fit: &Fit| {
        let [force, moment] = fit.noise.map(|noise| format_significant(noise, 3));
        format!("{force} N and {moment} N·m RMS")
    };
    let begin = match found.first() {
        Some(own) if own.change.is_of_sensor() => "The sensor's channels look wrong",
        _ => "The positions look wrong",
    };
    format!(
        "{}: {what}. As recorded a rigid load leaves {}, otherwise {}. {}.",
        begin,
        rms(described),
        found.first().map_or_else(String::new, |own| rms(&own.fit)),
        capital(&remedy)
    )
}
