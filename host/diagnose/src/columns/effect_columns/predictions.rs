//! Gear load, drive torque and contact deflection that the effects of a model add to its predictions.

use rig_shared::effects::{Effect, Instant, Kind, Memory};

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::{DELAY, Source, add};
use crate::search::fitted_candidate::FittedCandidate;
use rig_data::runs::{JointRun, travel};
use rig_model::effects::over_coulomb;

/// Effects whose drive torque is predicted with all effects in the model. For a ripple the nominal torque is enough:
/// products of its wave with those of other effects fit almost anything.
const OF_THE_DRIVE: [Kind; 2] = [Kind::TorqueSaturation, Kind::MeasurementDelay];

/// Iterations of a saturation with its own torque. Each at least halves the error.
const OWN_ROUNDS: usize = 6;
/// Local loss of torque per current, as a share, up to which the predicted torque is used.
const MOST_LOST: f64 = 0.5;

/// Returns the contact deflection of a presliding effect along a run. `beside` is other friction there.
fn bent(effect: &Effect<f64>, joint: &JointRun, beside: &[f64], period: f64) -> Vec<f64> {
    let mut memory = Memory::default();
    let along = |(k, &beside): (usize, &f64)| {
        let at = Instant {
            velocity: joint.qd[k],
            period,
            travel: travel([&joint.q, &joint.qd], k, period),
            extra_friction_ratio: beside,
            ..Instant::default()
        };
        effect.torque(&mut memory, &at);
        effect.contact_deflection(&memory, beside)
    };
    beside.iter().enumerate().map(along).collect()
}

impl Source<'_> {
    /// Adds the effects of the model to the predicted gear load and drive torque. `gains` are those of their columns,
    /// one effect after the other.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn loaded_by(
        mut self,
        chosen: &[FittedCandidate],
        gains: &[f64],
    ) -> Result<Self, DiagnoseError> {
        let mut at = 0;
        for profile in chosen {
            let Candidate { kind, joint, .. } = profile.candidate;
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            if kind == Kind::MeasurementDelay {
                self.delays[joint] = own[0].max(DELAY);
            }
            if kind.is_presliding() {
                let effect = Effect::new(kind, own, &profile.shapes);
                for (r, run) in self.runs.iter().enumerate() {
                    let beside = self.beside(joint, r, chosen, gains);
                    let bent = bent(&effect, &run.joints[joint], &beside, 1.0 / run.rate);
                    self.bent.insert((r, joint), bent);
                    self.beside.insert((r, joint), beside);
                }
            }
        }
        let asked = (chosen.iter()).any(|p| OF_THE_DRIVE.contains(&p.candidate.kind));
        for r in 0..self.runs.len() {
            let load = self.sum(r, chosen, gains, &Kind::acts_on_link)?;
            add(&mut self.predicted[r].load, &load);
            if !asked {
                continue;
            }
            // A delay changes the reading, not the torque.
            let others = self.sum(r, chosen, gains, &|kind| !OF_THE_DRIVE.contains(&kind))?;
            add(&mut self.predicted[r].torque, &others);
            self.saturate(r, chosen, gains)?;
        }
        Ok(self)
    }

    /// Iterates the saturation with its predicted torque. Above a local loss of one half, the error of the prediction
    /// is more than twice that of the model, so the recorded torque replaces it. Elsewhere the recorded torque would
    /// add noise that the model then explains.
    fn saturate(
        &mut self,
        r: usize,
        chosen: &[FittedCandidate],
        gains: &[f64],
    ) -> Result<(), DiagnoseError> {
        let mut at = 0;
        let mut saturated: Vec<(usize, f64)> = Vec::new();
        for profile in chosen {
            if profile.candidate.kind == Kind::TorqueSaturation && gains[at] > 0.0 {
                saturated.push((profile.candidate.joint, gains[at]));
            }
            at += profile.columns.len();
        }
        if saturated.is_empty() {
            return Ok(());
        }
        let rest = self.predicted[r].torque.clone();
        for _ in 0..OWN_ROUNDS {
            let own = self.sum(r, chosen, gains, &|kind| kind == Kind::TorqueSaturation)?;
            self.predicted[r].torque.clone_from(&rest);
            add(&mut self.predicted[r].torque, &own);
        }
        for (joint, coefficient) in saturated {
            // d(τ − c·τ³)/dτ is one half here.
            let most = (MOST_LOST / (3.0 * coefficient)).sqrt();
            let recorded = (self.thinning).calm(&self.runs[r].joints[joint].recorded());
            for (to, recorded) in self.predicted[r].torque[joint].iter_mut().zip(recorded) {
                if recorded.abs() > most {
                    *to = recorded;
                }
            }
        }
        Ok(())
    }

    /// Returns the torque of the effects of some kinds over a run, joint by joint.
    pub(crate) fn sum(
        &self,
        r: usize,
        chosen: &[FittedCandidate],
        gains: &[f64],
        counts: &dyn Fn(Kind) -> bool,
    ) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        let mut sum = vec![vec![0.0; self.runs[r].len()]; self.nominal.joints()];
        let mut at = 0;
        for profile in chosen {
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            if !counts(profile.candidate.kind) {
                continue;
            }
            let shapes = std::slice::from_ref(&profile.shapes);
            let columns = self.at_full_rate(&profile.candidate, shapes, r)?;
            for (column, gain) in columns.into_iter().flatten().zip(own) {
                for (to, signal) in sum.iter_mut().zip(column) {
                    for (to, x) in to.iter_mut().zip(signal.iter().flatten()) {
                        *to += gain * x;
                    }
                }
            }
        }
        Ok(sum)
    }

    /// Returns the effects' contact friction over the model's Coulomb friction, sample by sample.
    fn beside(
        &self,
        joint: usize,
        r: usize,
        chosen: &[FittedCandidate],
        gains: &[f64],
    ) -> Vec<f64> {
        let mut sum = vec![0.0; self.runs[r].len()];
        let [_, coulomb] = self.friction(joint);
        let mut at = 0;
        for profile in chosen {
            let own = &gains[at..at + profile.columns.len()];
            at += own.len();
            let candidate = &profile.candidate;
            if candidate.joint != joint || !candidate.kind.acts_through_contact() {
                continue;
            }
            let terms = self.along(candidate, &profile.shapes, r, true);
            for (term, gain) in terms.iter().zip(own) {
                for (to, term) in sum.iter_mut().zip(term) {
                    *to += gain * term;
                }
            }
        }
        for value in &mut sum {
            *value = over_coulomb(*value, coulomb);
        }
        sum
    }
}
