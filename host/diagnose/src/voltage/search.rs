//! Search for the effects of a voltage-driven joint: one at a time, by the free-running motion of left-out recordings.

use rig_shared::effects::{Channel, Effect, Kind, Scale};

use crate::voltage::fit::{Problem, WINDOW, segments};
use crate::voltage::free_run::{FreeRun, travel};
use crate::voltage::halt::Cause;
use crate::voltage::log::{Log, Segment};
use crate::voltage::plant::{NOMINAL, Plant};
use crate::voltage::significance::{LEAST_GAIN, LEVEL, signed_rank};
use crate::voltage::simulation::LONGEST;
use crate::voltage::start::start;
use rig_data::prepare::each_of;
use rig_model::robot::Robot;

/// Most folds of the cross-validation; each recording is left out once if there are at most as many.
const FOLDS: usize = 8;
/// Least blocks for a significance test; fewer recordings are cut into pieces.
const BLOCKS: usize = 8;
/// Length of the pieces whose errors are compared, s.
const PIECE: f64 = 2.0;
/// Relative difference of left-out errors within which candidates are equal.
pub(crate) const EQUAL: f64 = 0.03;
/// Candidates per round in the cross-validation, those of least training error.
const SHORT_LIST: usize = 3;
/// Most refits of an accepted model.
const POLISHES: usize = 5;
/// Relative RMS reduction above which another refit follows.
const POLISHED: f64 = 1.0e-5;
/// Largest change of positions by halving the steps, as a share of the RMS residual.
const STEP_SHARE: f64 = 0.1;
/// Most halvings of the steps.
const HALVINGS: usize = 5;
/// Most effects.
const MOST: usize = 5;

/// A model and its parameters: the nominal ones, then gains and shapes of each effect.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    pub effects: Vec<Kind>,
    pub theta: Vec<f64>,
    pub bounds: Vec<[f64; 2]>,
    pub free: Vec<usize>,
}

/// A tried effect.
#[derive(Clone, Debug)]
pub(crate) struct Trial {
    pub kind: Kind,
    /// Fit to all recordings; `None` if it could not be simulated.
    pub model: Option<Model>,
    /// RMS on them.
    pub train: f64,
    /// RMS on left-out blocks; `None` if it was not cross-validated.
    pub unseen: Option<f64>,
    /// Signed-rank test; the fixed test sequence needs no correction for the number of candidates.
    pub p_value: f64,
    /// Reason for rejection; `None` if accepted.
    pub refused: Option<Refusal>,
}

/// Reason why a tried effect is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// It cannot be simulated.
    NotSimulated,
    /// Others fit better, so that it was not cross-validated.
    FitsWorse,
    /// Another one is accepted.
    Another,
    /// It helps in too few pieces of left-out recordings.
    Chance { wins: usize, pieces: usize },
    /// It reduces the error on left-out recordings by too little.
    Small,
    /// A better fitting one may be chance.
    AfterChance,
}

/// Inputs of the search.
pub(crate) struct Search<'a> {
    pub plant: &'a Plant,
    pub logs: &'a [Log],
    pub library: Vec<Kind>,
    pub threads: usize,
}

/// Returns the effects in the simulation of a voltage-driven joint; a closed loop has no late recorded voltage.
pub(crate) fn library(without: &[Kind], closed: bool) -> Vec<Kind> {
    [
        Kind::Stribeck,
        Kind::AsymmetricCoulomb,
        Kind::QuadraticDrag,
        Kind::LoadFriction,
        Kind::PreslidingDahl,
        Kind::TorqueSaturation,
        Kind::MeasurementDelay,
        Kind::DriveDeadzone,
        Kind::GravityTilt,
        Kind::Spring,
    ]
    .into_iter()
    .filter(|kind| !(without.contains(kind) || closed && *kind == Kind::MeasurementDelay))
    .collect()
}

impl Search<'_> {
    fn problem<'b>(&'b self, model: &'b Model, list: Vec<(usize, Segment)>) -> Problem<'b> {
        Problem {
            plant: self.plant,
            logs: self.logs,
            segments: list,
            effects: &model.effects,
            free: &model.free,
            bounds: &model.bounds,
        }
    }

    /// Returns whole recordings, or pieces if there are few.
    pub(crate) fn blocks(&self) -> Vec<(usize, Segment)> {
        let whole = segments(self.logs, |_| true, f64::INFINITY);
        if whole.len() >= BLOCKS || whole.is_empty() {
            return whole;
        }
        let all: f64 = self.logs.iter().map(Log::duration).sum();
        segments(self.logs, |_| true, all / (BLOCKS + whole.len()) as f64)
    }

    /// Returns the RMS of the free-running position over the blocks.
    pub(crate) fn rms(&self, model: &Model) -> f64 {
        self.problem(model, self.blocks()).rms(&model.theta)
    }

    /// Returns the plant with steps so fine that halving changes the nominal model's positions by less than a tenth of
    /// their residual. Near the encoder's resolution, the simulation's steps must not look like an effect.
    pub(crate) fn in_fine_steps(&self) -> Plant {
        match self.nominal() {
            Some(model) => in_fine_steps(self.plant, self.logs, &model.effects, &model.theta),
            None => *self.plant,
        }
    }

    /// Runs the model freely over whole recordings.
    pub(crate) fn freely(&self, model: &Model) -> FreeRun {
        let travel = travel(self.logs);
        let mut errors = Vec::new();
        for (k, segment) in segments(self.logs, |_| true, LONGEST) {
            let log = &self.logs[k];
            let run = match self
                .problem(model, vec![(k, segment)])
                .residual(&model.theta)
            {
                Ok(run) => run,
                Err(halt) => return FreeRun::diverged(&log.label, halt.time, halt.cause),
            };
            if let Some(row) = run.iter().position(|error| !(error.abs() <= travel)) {
                let time = log.t[segment.from + row];
                return FreeRun::diverged(&log.label, time, Cause::LeftTravel);
            }
            errors.extend(run);
        }
        FreeRun::followed(&errors)
    }

    /// Returns the simulated positions of one recording; empty if it cannot be simulated.
    pub(crate) fn simulated(&self, model: &Model, log: usize) -> Vec<f64> {
        let whole = segments(self.logs, |k| k == log, LONGEST);
        let error = self.problem(model, whole).residual(&model.theta);
        let pairs = error.iter().flatten().zip(&self.logs[log].q);
        pairs.map(|(error, q)| q + error).collect()
    }

    /// Returns standard deviations in the order of the free parameters.
    pub(crate) fn deviations(&self, model: &Model) -> Option<Vec<f64>> {
        self.problem(model, self.blocks()).deviations(&model.theta)
    }

    /// Fits to pieces of the recordings from the best of `starts`, which differ only in their parameters.
    fn fitted(&self, starts: &[&Model], list: Vec<(usize, Segment)>) -> Model {
        let thetas: Vec<&[f64]> = starts.iter().map(|model| model.theta.as_slice()).collect();
        let theta = self.problem(starts[0], list).fit(&thetas);
        Model {
            theta,
            ..starts[0].clone()
        }
    }

    /// Fits a model to whole recordings from several starts. Whole recordings have many local minima, and windows alone
    /// have other weights. So each start is used as it is and after a fit to windows.
    fn settled(&self, starts: &[Model]) -> Model {
        let windows = || segments(self.logs, |_| true, WINDOW);
        let near: Vec<Model> = starts
            .iter()
            .map(|start| self.fitted(&[start], windows()))
            .collect();
        let all: Vec<&Model> = starts.iter().chain(&near).collect();
        self.fitted(&all, self.blocks())
    }

    /// Refits a model until that improves nothing: a fit may end early where joints stick.
    fn polished(&self, mut model: Model) -> Model {
        for _ in 0..POLISHES {
            let before = self.rms(&model);
            model = self.fitted(&[&model], self.blocks());
            if !(self.rms(&model) < (1.0 - POLISHED) * before) {
                break;
            }
        }
        model
    }

    /// Fits the nominal model from several starts; `None` if the motion does not excite it.
    pub(crate) fn nominal(&self) -> Option<Model> {
        let viscous = (self.logs.iter()).any(|log| log.on.iter().any(|on| !on));
        let theta = start(self.plant, self.logs, viscous)?;
        let infinity = f64::INFINITY;
        let model = Model {
            effects: Vec::new(),
            theta,
            bounds: vec![
                [0.0, infinity],
                [1.0e-9, infinity],
                [0.0, infinity],
                [0.0, infinity],
                [0.0, infinity],
                [-infinity, infinity],
            ],
            // With the drive always on, viscous friction and back-EMF are collinear.
            free: (0..NOMINAL).filter(|p| viscous || *p != 4).collect(),
        };
        let starts = [1.0, 0.5, 2.0].map(|factor| {
            let mut one = model.clone();
            one.theta[3] *= factor;
            one
        });
        Some(self.polished(self.settled(&starts)))
    }

    /// Adds a description's effects to `nominal` and refits those that are marked; `None` if it cannot be simulated.
    pub(crate) fn with_described(
        &self,
        nominal: Model,
        parts: &[(Effect<f64>, bool)],
        robot: &Robot,
    ) -> Option<Model> {
        if parts.is_empty() {
            return Some(nominal);
        }
        let mut model = nominal;
        for (effect, fitted) in parts {
            let about = effect.kind.about();
            model.effects.push(effect.kind);
            for (gain, value) in about.gains.iter().zip(effect.gains) {
                model.free.extend(fitted.then_some(model.theta.len()));
                model.theta.push(value);
                model.bounds.push(gain.bounds);
            }
            for (shape, value) in about.shapes.iter().zip(effect.shapes) {
                let [low, high] = shape.range;
                let held = !fitted || effect.kind.optional().contains(&shape.name);
                model.free.extend((!held).then_some(model.theta.len()));
                model.theta.push(value);
                // A described value is allowed, however unusual.
                model
                    .bounds
                    .push([value.min(0.1 * low), value.max(10.0 * high)]);
            }
        }
        // Missing effects may have biased the nominal values: the described ones are a second start.
        let mut starts = vec![model.clone()];
        if let Some(own) = self.plant.described(robot) {
            model.theta[..NOMINAL].copy_from_slice(&own);
            starts.push(model);
        }
        Some(self.settled(&starts)).filter(|model| self.rms(model).is_finite())
    }

    /// Returns, for each model, sum of squares and number of rows of every piece of the recordings, fitted to other
    /// blocks. The sums are infinite if it cannot be simulated.
    fn unseen(&self, models: &[&Model]) -> Vec<Vec<[f64; 2]>> {
        let blocks = self.blocks();
        let folds = FOLDS.min(blocks.len()).max(1);
        let mut tasks: Vec<(usize, usize, Vec<(usize, Vec<[f64; 2]>)>)> = (0..models.len() * folds)
            .map(|k| (k / folds, k % folds, Vec::new()))
            .collect();
        each_of(self.threads, &mut tasks, &|_, (model, fold, found)| {
            *found = self.left_out(models[*model], &blocks, [*fold, folds]);
        });
        let mut all = vec![vec![Vec::new(); blocks.len()]; models.len()];
        for (model, _, found) in tasks {
            for (at, sums) in found {
                all[model][at] = sums;
            }
        }
        all.into_iter().map(|pieces| pieces.concat()).collect()
    }

    /// Fits a model to all blocks except one fold. Returns that fold's block numbers, each with the sums of its pieces.
    fn left_out(
        &self,
        model: &Model,
        blocks: &[(usize, Segment)],
        [fold, folds]: [usize; 2],
    ) -> Vec<(usize, Vec<[f64; 2]>)> {
        let kept = |at: &usize| at % folds == fold;
        let rest = (0..blocks.len()).filter(|at| !kept(at));
        let fitted = self.fitted(&[model], rest.map(|at| blocks[at]).collect());
        (0..blocks.len())
            .filter(kept)
            .map(|at| {
                let (log, segment) = blocks[at];
                let t = &self.logs[log].t[segment.from..segment.to];
                let residual = self
                    .problem(model, vec![blocks[at]])
                    .residual(&fitted.theta);
                let place = |k: usize| ((t[k] - t[0]) / PIECE) as usize;
                let mut sums = vec![[0.0; 2]; place(t.len() - 1) + 1];
                for k in 0..t.len() {
                    let error = residual.as_ref().map_or(f64::INFINITY, |r| r[k]);
                    let sum = &mut sums[place(k)];
                    *sum = [sum[0] + error * error, sum[1] + 1.0];
                }
                (at, sums)
            })
            .collect()
    }

    /// Fits `model` with one more effect to all recordings, from several starts.
    fn with(&self, model: &Model, kind: Kind) -> Option<Model> {
        let mut starts = Vec::new();
        for share in [0.25, 0.75] {
            let mut more = model.clone();
            more.effects.push(kind);
            let about = kind.about();
            for gain in about.gains {
                more.theta.push(self.first_gain(kind, model));
                more.bounds.push(gain.bounds);
            }
            more.free.extend(model.theta.len()..more.theta.len());
            let mut shaped = false;
            for shape in about.shapes {
                let [low, high] = shape.range;
                // Such a motion does not determine how a gear divides friction between its sides.
                if kind.optional().contains(&shape.name) {
                    more.theta.push(0.0);
                    more.bounds.push(shape.bounds);
                    continue;
                }
                shaped = true;
                more.free.push(more.theta.len());
                more.theta.push(match shape.scale {
                    Scale::Linear | Scale::Whole => low + share * (high - low),
                    Scale::Logarithmic => low * (high / low).powf(share),
                });
                // A value far outside the range of rigs is another effect.
                more.bounds.push([0.1 * low, 10.0 * high]);
            }
            starts.push(more);
            if !shaped {
                break;
            }
        }
        Some(self.settled(&starts)).filter(|found| self.rms(found).is_finite())
    }

    /// Returns a small gain of an effect for this joint.
    fn first_gain(&self, kind: Kind, model: &Model) -> f64 {
        let weight = self.plant.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        let torque = weight.max(model.theta[3]);
        match kind {
            Kind::LoadFriction => 0.1,
            Kind::MeasurementDelay => 1.0e-3,
            Kind::DriveDeadzone => 0.02 * self.largest_voltage(),
            Kind::TorqueSaturation => 0.1 / (torque * torque),
            Kind::QuadraticDrag => 0.01 * model.theta[1] * model.theta[2],
            Kind::PreslidingDahl => 0.5 * model.theta[3],
            _ => 0.02 * torque,
        }
    }

    fn largest_voltage(&self) -> f64 {
        (self.logs.iter().flat_map(|log| &log.u)).fold(0.0, |m, u| m.max(u.abs()))
    }

    /// Adds effects while they improve the model. `report` receives each round's number, the error on left-out
    /// recordings before it, and all trials.
    pub(crate) fn run(
        &self,
        nominal: &Model,
        report: &mut dyn FnMut(usize, f64, &[Trial]),
    ) -> Vec<Model> {
        let mut models = vec![nominal.clone()];
        while models.len() <= MOST {
            let Some(model) = models.last().cloned() else {
                break;
            };
            let mut trials = self.trials(&model);
            let whole = self.judge(&model, &mut trials);
            let count = SHORT_LIST.min(trials.len());
            in_sequence(&mut trials[..count]);
            let best = taken(&trials);
            for (k, trial) in trials.iter_mut().enumerate() {
                if trial.refused.is_none() && Some(k) != best {
                    trial.refused = Some(Refusal::Another);
                }
            }
            report(models.len() - 1, whole, &trials);
            match best.and_then(|k| trials.swap_remove(k).model) {
                Some(next) => models.push(self.polished(next)),
                None => break,
            }
        }
        models
    }

    /// Fits every effect that `model` lacks to all recordings; the best comes first.
    fn trials(&self, model: &Model) -> Vec<Trial> {
        let has = |kind: &Kind| {
            let same = |e: &Kind| e.about().name == kind.about().name;
            model.effects.iter().any(same)
        };
        let mut trials: Vec<Trial> = (self.library.iter())
            .filter(|kind| !has(kind))
            .map(|kind| Trial {
                kind: *kind,
                model: None,
                train: f64::INFINITY,
                unseen: None,
                p_value: 1.0,
                refused: Some(Refusal::NotSimulated),
            })
            .collect();
        each_of(self.threads, &mut trials, &|_, trial| {
            trial.model = self.with(model, trial.kind);
            if let Some(found) = &trial.model {
                trial.train = self.rms(found);
                trial.refused = Some(Refusal::FitsWorse);
            }
        });
        trials.sort_by(|a, b| a.train.total_cmp(&b.train));
        trials
    }

    /// Judges the best-fitting trials by left-out recordings; returns the error of `model` on those.
    fn judge(&self, model: &Model, trials: &mut [Trial]) -> f64 {
        let short: Vec<usize> = (0..SHORT_LIST.min(trials.len()))
            .filter(|k| trials[*k].model.is_some())
            .collect();
        let tried = short.iter().filter_map(|k| trials[*k].model.as_ref());
        let unseen = self.unseen(&std::iter::once(model).chain(tried).collect::<Vec<_>>());
        let before = &unseen[0];
        let whole = pooled(before);
        for (k, after) in short.into_iter().zip(&unseen[1..]) {
            let trial = &mut trials[k];
            let rms = pooled(after);
            let gains: Vec<f64> = (before.iter().zip(after))
                .map(|(b, a)| (b[0] / a[0]).ln())
                .collect();
            let wins = gains.iter().filter(|g| **g > 0.0).count();
            trial.unseen = Some(rms);
            trial.p_value = signed_rank(&gains);
            trial.refused = if trial.p_value > LEVEL {
                Some(Refusal::Chance {
                    wins,
                    pieces: gains.len(),
                })
            } else if !(rms <= (1.0 - LEAST_GAIN) * whole) {
                Some(Refusal::Small)
            } else {
                None
            };
        }
        whole
    }
}

/// Returns a plant whose positions change by less than [`STEP_SHARE`] of their residual when its steps are halved.
pub(crate) fn in_fine_steps(plant: &Plant, logs: &[Log], effects: &[Kind], theta: &[f64]) -> Plant {
    let run = |plant: &Plant| {
        let problem = Problem {
            plant,
            logs,
            segments: segments(logs, |_| true, LONGEST),
            effects,
            free: &[],
            bounds: &[],
        };
        problem.residual(theta)
    };
    let squares = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>();
    let mut plant = *plant;
    let Ok(mut coarse) = run(&plant) else {
        return plant;
    };
    for _ in 0..HALVINGS {
        let finer = plant.finer();
        let Ok(fine) = run(&finer) else { break };
        let change = squares(&mut fine.iter().zip(&coarse).map(|(a, b)| a - b));
        if change <= STEP_SHARE.powi(2) * squares(&mut fine.iter().copied()) {
            break;
        }
        (plant, coarse) = (finer, fine);
    }
    plant
}

/// Tests each candidate at the full level while all better-fitting ones before it pass. The probability of any false
/// one then stays at that level (fixed sequence; Maurer, Hothorn and Lehmacher 1995). The order is that of the training
/// error, which hardly depends on the left-out pieces.
pub(crate) fn in_sequence(trials: &mut [Trial]) {
    let chance = trials.iter().position(|trial| trial.p_value > LEVEL);
    for trial in trials.iter_mut().skip(chance.map_or(usize::MAX, |k| k + 1)) {
        if trial.refused.is_none() {
            trial.refused = Some(Refusal::AfterChance);
        }
    }
}

/// Returns the accepted candidate: the best fit among those that are about equal on left-out data.
pub(crate) fn taken(trials: &[Trial]) -> Option<usize> {
    let passed = || (trials.iter().enumerate()).filter(|(_, t)| t.refused.is_none());
    let of = |t: &Trial| t.unseen.unwrap_or(f64::INFINITY);
    let least = passed().map(|(_, t)| of(t)).fold(f64::INFINITY, f64::min);
    let near = passed().filter(|(_, t)| of(t) <= (1.0 + EQUAL) * least);
    near.min_by(|(_, a), (_, b)| a.train.total_cmp(&b.train))
        .map(|(k, _)| k)
}

/// Returns the RMS over pieces.
fn pooled(pieces: &[[f64; 2]]) -> f64 {
    let [sum, rows] = (pieces.iter()).fold([0.0; 2], |a, p| [a[0] + p[0], a[1] + p[1]]);
    (sum / f64::max(rows, 1.0)).sqrt()
}

/// Returns true if the effect acts on the voltage.
pub(crate) fn on_the_voltage(kind: Kind) -> bool {
    kind.about().channel == Channel::Voltage || kind == Kind::MeasurementDelay
}
