//! Observer-based gears: the final fit of gear shapes.
//!
//! An observer that uses the measured torque fits almost any gear model. So effects are selected and judged open-loop,
//! with the link driven by the measured motor motion alone. Once a gear is accepted, an observer estimates its link,
//! and its shapes are refitted to the prediction residual. The result is kept if it reduces the RMS. A misfit of the
//! open-loop gear law is no reason to doubt other effects of the joint.

use std::cell::RefCell;
use std::sync::Arc;

use rig_shared::effects::{Kind, SHAPES};

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::fit::refit::Refit;
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::noise_floor;
use crate::search::chosen::with;
use crate::search::fitted_candidate::{FittedCandidate, Followed};
use crate::search::shape_fit::left_as_known;
use crate::search::stepwise::Search;

/// Rounds in which the gear shapes and all other parameters are fitted alternately.
const ROUNDS: usize = 2;
/// Initial tooth stiffness (N·m/rad) and damping (N·m·s/rad) of this fit. The search leaves softer values, because the
/// motor motion alone does not show the whole contact.
const TEETH: [f64; 2] = [2000.0, 8.0];
/// Number of ratios between the gaps from which it may start, from that of the search on, and the whole ratio. Beside too
/// soft teeth the search left a gap of 7.6 mrad for 12.3 mrad.
const WIDTHS: usize = 4;
const WIDEST: f64 = 2.0;
/// Number of ratios between the stiffnesses of an elastic gear from which this fit may start, over the whole range: its
/// simplex walks the half of one, 1.2, in a step …
const STIFFNESSES: usize = 12;
/// … and the damping ratio of the link on it there: a resonance that shows, as those of gears do.
const DAMPED: f64 = 0.05;
/// Largest RMS ratio, with the observer-based backlash over without it, at which the observer supports a near miss.
const HEARD: f64 = 0.75;

/// Estimates links behind gears on the training data.
pub(crate) struct ObserverModels<'a, 'r> {
    /// Robot and treatment.
    context: &'a DiagnosisContext<'a>,
    /// The training data.
    prepared: &'a PreparedData,
    /// The refitted nominal model on them.
    refit: &'a Refit<'r>,
    /// The library on them.
    search: &'a Search<'r>,
    /// Last input and result: a fit takes seconds.
    last: RefCell<Option<(Vec<Driven>, Vec<FittedCandidate>)>>,
}

/// An effect and its shapes.
type Driven = (Candidate, [f64; SHAPES]);

impl<'a, 'r> ObserverModels<'a, 'r> {
    /// Creates a follower for these recordings.
    pub(crate) fn new(
        context: &'a DiagnosisContext<'a>,
        prepared: &'a PreparedData,
        refit: &'a Refit<'r>,
        search: &'a Search<'r>,
    ) -> Self {
        Self {
            context,
            prepared,
            refit,
            search,
            last: RefCell::new(None),
        }
    }

    /// Returns true if an observer estimates the link behind this gear.
    fn follows(&self, profile: &FittedCandidate) -> bool {
        self.search.is_gear_by_torque(&profile.candidate)
    }

    /// Returns the effects with observer-based gears and refitted shapes, or None if no such gear exists. `noise` is
    /// the unexplained RMS per joint; it replaces the torque noise where the reading does not show it.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn followed(
        &self,
        driven: &[FittedCandidate],
        noise: &[f64],
    ) -> Result<Option<Vec<FittedCandidate>>, DiagnoseError> {
        if !driven.iter().any(|profile| self.follows(profile)) {
            return Ok(None);
        }
        let given: Vec<Driven> = driven.iter().map(|p| (p.candidate, p.shapes)).collect();
        if let Some((_, known)) = self
            .last
            .borrow()
            .as_ref()
            .filter(|(last, _)| *last == given)
        {
            return Ok(Some(known.clone()));
        }
        let mut chosen = driven.to_vec();
        for k in (0..driven.len()).filter(|k| self.follows(&driven[*k])) {
            self.follow(&mut chosen, k, noise)?;
        }
        // Compute the columns with all effects in their final state.
        let source = self.source(&chosen)?.smoothed();
        for profile in chosen.iter_mut().filter(|p| p.followed.is_some()) {
            profile.columns = Arc::new(source.columns(&profile.candidate, &profile.shapes)?);
        }
        *self.last.borrow_mut() = Some((given, chosen.clone()));
        Ok(Some(chosen))
    }

    /// Returns true if the recorded torque supports a backlash beside the effects `found`. The open-loop gain of a wide
    /// backlash is small, because its link is seldom where the motor motion puts it. On a rig without backlash the
    /// observer reduces the RMS by less than 2 %.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn observer_supports(
        &self,
        found: &[FittedCandidate],
        play: FittedCandidate,
    ) -> Result<bool, DiagnoseError> {
        let joint = play.candidate.joint;
        let of = |chosen: &[FittedCandidate]| with(self.refit.even(), chosen, None);
        let before = of(found);
        let noise: Vec<f64> = (0..self.context.robot.joints.len())
            .map(|j| before.rms(j))
            .collect();
        let mut chosen = found.to_vec();
        chosen.push(play);
        let followed = self.followed(&chosen, &noise)?;
        Ok(followed.is_some_and(|followed| of(&followed).rms(joint) < HEARD * noise[joint]))
    }

    fn follow(
        &self,
        chosen: &mut [FittedCandidate],
        k: usize,
        noise: &[f64],
    ) -> Result<(), DiagnoseError> {
        let Self {
            prepared,
            refit,
            search,
            ..
        } = self;
        let joint = chosen[k].candidate.joint;
        let rms = |chosen: &[FittedCandidate]| with(refit.even(), chosen, None).rms(joint);
        let driven = chosen[k].clone();
        let before = rms(chosen);
        let reading = noise_floor::sensor_noise(&prepared.runs, joint, prepared.rows.period);
        let own = &mut chosen[k];
        own.followed = Some(Followed {
            noise: reading.unwrap_or(noise[joint]),
        });
        own.otherwise = Some(driven.shapes);
        chosen[k].shapes = self.begun(chosen, k)?;
        for _ in 0..ROUNDS {
            let source = self.source(chosen)?;
            let beside = with(refit.even(), chosen, Some(k));
            let FittedCandidate {
                candidate, shapes, ..
            } = &chosen[k];
            let (shapes, columns) = search.fitted_as_known(&source, &beside, candidate, shapes)?;
            chosen[k].shapes = shapes;
            chosen[k].columns = Arc::new(columns);
        }
        // Compare the final form, with smoothed initial states of the observer segments.
        let source = self.source(chosen)?.smoothed();
        let own = &mut chosen[k];
        own.columns = Arc::new(source.columns(&own.candidate, &own.shapes)?);
        if rms(chosen) >= before {
            let otherwise = Some(chosen[k].shapes);
            chosen[k] = FittedCandidate {
                otherwise,
                ..driven
            };
        }
        Ok(())
    }

    /// Returns the initial shapes of the observer-based fit: the best of a grid by the observer. The motor's motion alone
    /// may lead the search to another resonance of an elastic gear, or to a softer and narrower backlash.
    fn begun(&self, chosen: &[FittedCandidate], k: usize) -> Result<[f64; SHAPES], DiagnoseError> {
        let FittedCandidate {
            candidate, shapes, ..
        } = &chosen[k];
        let mut starts = vec![*shapes];
        if candidate.kind == Kind::Backlash {
            starts[0][1..3].copy_from_slice(&TEETH);
            let first = starts[0];
            starts.extend((1..=WIDTHS).map(|n| {
                let mut start = first;
                start[0] *= WIDEST.powf(n as f64 / WIDTHS as f64);
                start
            }));
        } else {
            let [soft, stiff] = candidate.kind.about().shapes[0].range;
            let mass = self.search.source.mass(candidate.joint, 0)?.max(0.0);
            starts.extend((0..=STIFFNESSES).map(|n| {
                let stiffness = soft * (stiff / soft).powf(n as f64 / STIFFNESSES as f64);
                let damping = 2.0 * DAMPED * (stiffness * mass).sqrt();
                let mut start = *shapes;
                start[..2].copy_from_slice(&[stiffness, damping]);
                start
            }));
        }
        let source = self.source(chosen)?;
        let beside = with(self.refit.even(), chosen, Some(k));
        let mut best = (f64::INFINITY, starts[0]);
        for start in starts {
            let left = left_as_known(&beside, &source.columns(candidate, &start)?);
            if left < best.0 {
                best = (left, start);
            }
        }
        Ok(best.1)
    }

    /// Returns the source of columns with these effects in the model.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn source(&self, chosen: &[FittedCandidate]) -> Result<Source<'a>, DiagnoseError> {
        let solution = self.refit.solution(chosen)?;
        let (nominal, gains) = solution.values.split_at(self.refit.free.len());
        self.context
            .source(self.prepared, &self.context.anchor.values(nominal))?
            .loaded_by(chosen, gains)?
            .following(&self.prepared.rows, chosen, gains)
    }
}

#[cfg(test)]
mod tests;
