//! RMS of the torque residual, model by model.

use crate::DiagnoseError;
use crate::columns::effect_columns::Source;
use crate::fit::refit::Refit;
use crate::models::bodies::ModelCache;
use crate::outcome::Waterfall;
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::recordings::position_reading::PositionReading;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::{Robot, title_of};

/// RMS on one set of recordings, joint by joint.
pub(crate) struct RmsByModel {
    /// RMS of the description without a refit.
    pub(crate) frozen: Vec<f64>,
    /// RMS of the refitted description, then of each model with one more effect.
    pub(crate) models: Vec<Vec<f64>>,
}

impl RmsByModel {
    /// Adds the RMS of one more model.
    fn push(&mut self, found: Vec<f64>) {
        for (list, rms) in self.models.iter_mut().zip(found) {
            list.push(rms);
        }
    }

    /// Returns the RMS before and after the `k`-th found effect.
    pub(crate) fn step(&self, joint: usize, k: usize) -> [f64; 2] {
        [self.models[joint][k], self.models[joint][k + 1]]
    }

    /// Returns the RMS of the last model, joint by joint.
    pub(crate) fn last(&self) -> Vec<f64> {
        (0..self.models.len()).map(|j| self.whole(j)[1]).collect()
    }

    /// Returns the RMS of the refitted description and of the last model.
    pub(crate) fn whole(&self, joint: usize) -> [f64; 2] {
        let list = &self.models[joint];
        [list[0], list[list.len() - 1]]
    }
}

/// RMS on the training data and on the hold-out.
pub(crate) struct RmsPath {
    /// Training RMS, each model refitted jointly.
    pub(crate) train: RmsByModel,
    /// Hold-out RMS with the coefficients of the training data; `None` without a hold-out.
    pub(crate) holdout: Option<RmsByModel>,
    /// Noise of hold-out rows divided by that of training rows. At a lower sample rate fewer samples form a row.
    louder: f64,
    /// Part of the training noise floor from position readings, joint by joint. It depends on the inertia of the poses.
    added: Vec<f64>,
    /// Torque error of the hold-out from its position readings.
    position_reading: PositionReading,
    /// Hold-out noise from two of its runs of one motion, joint by joint.
    repeated: Vec<Option<f64>>,
}

impl RmsPath {
    /// Computes the RMS for effects in the order found; the first `described` are from the description. `added` is the
    /// part of the training floor that comes from position readings, joint by joint.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn of(
        fitting: &ModelCache,
        refit: &Refit,
        chosen: &[FittedCandidate],
        described: usize,
        prepared: &PreparedData,
        held_out: Option<&PreparedData>,
        source: &Source,
        added: Vec<f64>,
    ) -> Result<Self, DiagnoseError> {
        let context = fitting.context;
        let n = context.robot.joints.len();
        let frozen = |prepared| -> Result<RmsByModel, DiagnoseError> {
            Ok(RmsByModel {
                frozen: context.frozen(prepared)?,
                models: vec![Vec::new(); n],
            })
        };
        let mut train = frozen(prepared)?;
        for count in described..=chosen.len() {
            let part = &chosen[..count];
            // A single link keeps its free fit.
            let found = if n == 1 {
                let fit = with(refit.footing(part)[1], part, None);
                vec![fit.even_rms(0)]
            } else {
                fitting.unseen(part, prepared)?
            };
            train.push(found);
        }
        let mut holdout = None;
        if let Some(held_out) = held_out {
            let mut fall = frozen(held_out)?;
            for count in described..=chosen.len() {
                fall.push(fitting.unseen(&chosen[..count], held_out)?);
            }
            holdout = Some(fall);
        }
        let position_reading = match held_out {
            Some(held_out) => PositionReading::of(
                &context.source(held_out, &source.values)?,
                &held_out.rows,
                &held_out.position_filter()?,
            )?,
            None => PositionReading::of_noise(added.clone()),
        };
        let mut repeated = vec![None; n];
        if let Some(held_out) = held_out {
            let stands = fitting.of(chosen)?;
            let left = context.remaining(held_out, stands.fitted(), chosen)?;
            let pairs = noise_floor::repeats(&held_out.runs);
            for (j, own) in repeated.iter_mut().enumerate() {
                *own = noise_floor::from_repeats(&held_out.rows, &pairs, &left[j], None, j)
                    .map(|repeated| repeated.noise);
            }
        }
        let slower = held_out.map_or(1.0, |held_out| {
            context.rate() / held_out.treatment.sample_rate
        });
        Ok(Self {
            train,
            holdout,
            louder: slower.max(1.0).sqrt(),
            added,
            position_reading,
            repeated,
        })
    }

    /// Returns true if two hold-out runs of one motion give the noise of a joint.
    pub(crate) fn is_held_twice(&self, joint: usize) -> bool {
        self.repeated[joint].is_some()
    }

    /// Returns the hold-out noise from two of its runs of one motion, else the training noise scaled to the hold-out's
    /// rate.
    fn noise(&self, floors: &[f64]) -> impl Iterator<Item = f64> {
        (floors.iter().zip(&self.repeated)).map(|(floor, own)| own.unwrap_or(self.louder * floor))
    }

    /// Returns the noise floors of the data that determine the closed share of the gap, from the training floors.
    pub(crate) fn floors(&self, floors: &[f64]) -> Vec<f64> {
        // Encoder steps do not replace an unknown floor.
        self.with_positions(floors, |floor, steps| match floor.is_nan() {
            true => floor,
            false => steps.max(floor),
        })
    }

    /// Returns the hold-out noise including position readings; a smaller effect is not a finding.
    pub(crate) fn noise_held(&self, floors: &[f64]) -> Vec<f64> {
        self.with_positions(floors, f64::hypot)
    }

    /// Returns the hold-out noise including position readings. They replace those in the training floor, if it has any.
    /// Else `both` combines the noise with the encoder steps.
    fn with_positions(&self, floors: &[f64], both: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (added, held) = (&self.added, &self.position_reading);
        (self.noise(floors).enumerate())
            .map(|(j, floor)| {
                let added = self.louder * added[j];
                match self.repeated[j].is_none() && floor > added && added > 0.0 {
                    true => (floor * floor - added * added).sqrt().hypot(held.whole(j)),
                    false => both(floor, held.steps[j]),
                }
            })
            .collect()
    }

    /// Returns the share of the gap that all steps close, each joint in units of its floor. `changed` counts the
    /// nominal parameters as a step. The share is at most 1: nothing below the floor needs an explanation. `None` if
    /// there is no gap, it has grown, or no floor is known.
    pub(crate) fn gap_closed(&self, floors: &[f64], changed: bool) -> Option<f64> {
        let fall = self.holdout.as_ref().unwrap_or(&self.train);
        let (mut gap, mut closed) = (0.0, 0.0);
        for (j, floor) in self.floors(floors).iter().enumerate() {
            if floor.is_nan() {
                continue;
            }
            let [refitted, last] = fall.whole(j);
            let first = if changed {
                fall.frozen[j].max(refitted)
            } else {
                refitted
            };
            gap += (first - floor) / floor;
            closed += (first - last) / floor;
        }
        (gap > 0.0 && closed >= 0.0).then(|| (closed / gap).min(1.0))
    }

    /// Returns the waterfall of a result; `found` are the effects that the description does not state.
    pub(crate) fn waterfall(
        &self,
        robot: &Robot,
        found: &[FittedCandidate],
        floors: &[f64],
    ) -> Vec<Waterfall> {
        let models: Vec<String> = (["frozen description", "refitted"].map(str::to_owned))
            .into_iter()
            .chain(found.iter().map(|p| title_of(p.candidate.kind)))
            .collect();
        let list = |fall: &RmsByModel, j: usize| {
            let mut list = vec![fall.frozen[j]];
            list.extend(&fall.models[j]);
            list
        };
        (robot.joints.iter().enumerate())
            .map(|(j, joint)| Waterfall {
                joint: joint.name.clone(),
                unit: joint.kind.units().1.to_owned(),
                models: models.clone(),
                train: list(&self.train, j),
                holdout: (self.holdout.as_ref()).map_or_else(Vec::new, |fall| list(fall, j)),
                floor: floors[j],
                holdout_floor: self.floors(floors)[j],
            })
            .collect()
    }
}
