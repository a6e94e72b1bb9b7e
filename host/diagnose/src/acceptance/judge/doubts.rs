//! Doubtful residuals: changes between recordings, disturbances, unknown noise, lack of fit of the named effects.

use crate::acceptance::judge::{Judge, QUARTER};
use crate::acceptance::lack_of_fit::misfit;
use crate::acceptance::residual_dependence::dependence::Dependence;
use crate::acceptance::unexplained::{RemainderCause, Unexplained};
use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::recordings::outlier_segment::Burst;
use crate::recordings::{external_load, noise_floor};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::falls_throughout;
use rig_model::robot::Joint;

/// Ratio of an effect's lack of fit to its torque above which it is doubted. No law fits a rig to the last per cent,
/// but a substitute leaves more.
const NOT_QUITE: f64 = 0.02;
/// RMS share that a free function must remove to show a missing effect, where no effect was found.
const UNNAMED: f64 = 0.15;
/// Residual-to-reading-noise ratio above which a residual without repeated runs is not accepted as noise. A drive adds
/// one or two times the reading noise.
const TIMES_READING: f64 = 3.0;
/// The same with a gear, whose law amplifies position noise at resonance, and on joints without an effect.
const TIMES_READING_WITHOUT_A_LAW: f64 = 7.0;
/// Standard deviations above which a change between recordings is certain.
const CERTAIN: f64 = 5.0;

impl Judge<'_, '_> {
    /// Detects an unexplained difference between the recordings with and without external loads on a joint.
    pub(crate) fn changed_besides(&self, fit: &Fit, joint: usize) -> Option<Unexplained> {
        let rows = self.rows;
        let runs = self.search.source.runs;
        let residual = fit.residual(joint);
        let keep = &rows.keep[joint];
        let [step, std] = external_load::step(&residual, keep, &rows.starts, rows.period, runs)?;
        let rms = fit.even_rms(joint);
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        (step.abs() > CERTAIN * std && step.abs() > QUARTER * rms).then(|| Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: 0.5 * step.abs(),
            ratio: rms
                / (rms * rms - 0.25 * step * step)
                    .max(0.0)
                    .sqrt()
                    .max(0.1 * rms),
            places: Vec::new(),
            cause: RemainderCause::ChangedBesides { step, std },
        })
    }

    /// Detects a different mean in two runs of one motion. It looks like noise, but a constant has changed in between.
    pub(crate) fn changed_between(&self, fit: &Fit, joint: usize) -> Option<Unexplained> {
        let residual = fit.residual(joint);
        let rms = fit.even_rms(joint);
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let runs = self.search.source.runs;
        (self.pairs.iter()).find_map(|&(a, b)| {
            let [step, std] = noise_floor::between(self.rows, (a, b), &residual, joint)?;
            (step.abs() > CERTAIN * std && step.abs() > QUARTER * rms).then(|| Unexplained {
                joint: name.clone(),
                unit: kind.units().1.to_owned(),
                rms: 0.5 * step.abs(),
                ratio: rms
                    / (rms * rms - 0.25 * step * step)
                        .max(0.0)
                        .sqrt()
                        .max(0.1 * rms),
                places: Vec::new(),
                cause: RemainderCause::ChangedBetween {
                    step,
                    std,
                    runs: [a, b].map(|run| runs[run].label.clone()),
                },
            })
        })
    }

    /// Returns a residual that lies mostly in the stretches of `burst`.
    pub(crate) fn knocked(
        &self,
        burst: &Burst,
        rms: f64,
        joint: usize,
        places: Vec<Dependence>,
    ) -> Unexplained {
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: rms * burst.share.sqrt(),
            ratio: 1.0 / (1.0 - burst.share).max(1e-6).sqrt(),
            places,
            cause: RemainderCause::Disturbance {
                share: burst.share,
                count: burst.count,
                label: burst.label.clone(),
                time: burst.time,
                times: burst.times,
            },
        }
    }

    /// Detects a residual far above the reading noise, if no repeated run tells how much of it is noise.
    pub(crate) fn unproven(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        joint: usize,
    ) -> Option<Unexplained> {
        if !self.pairs.is_empty() {
            return None;
        }
        let mut own = chosen
            .iter()
            .filter(|p| p.candidate.joint == joint)
            .peekable();
        let far = if own.peek().is_none() || own.any(|p| is_gear(p.candidate.kind)) {
            TIMES_READING_WITHOUT_A_LAW
        } else {
            TIMES_READING
        };
        let torque = noise_floor::sensor_noise(self.search.source.runs, joint, self.rows.period)?;
        let own = torque.hypot(self.position_reading.whole(joint));
        let rms = fit.even_rms(joint);
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        (rms > far * own).then(|| Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - own * own).sqrt(),
            ratio: rms / own,
            places: self.refitted_places(fit, joint, own),
            cause: RemainderCause::FarAboveReading { residual: rms },
        })
    }

    /// Detects friction that falls over nearly all speeds. Stribeck friction falls at lower speeds.
    pub(crate) fn falls_throughout(
        &self,
        chosen: &[FittedCandidate],
        joint: usize,
        (rms, floor): (f64, f64),
    ) -> Option<Unexplained> {
        let fastest = self.search.source.fastest(joint);
        let falls = |p: &&FittedCandidate| {
            let kind = p.candidate.kind;
            p.candidate.joint == joint && falls_throughout(kind, &p.shapes, fastest)
        };
        let own = chosen.iter().find(falls)?;
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        Some(Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - floor * floor).max(0.0).sqrt(),
            ratio: rms / floor,
            places: Vec::new(),
            cause: RemainderCause::FallsThroughout {
                velocity: own.shapes[0],
                fastest,
                position_unit: kind.units().0,
            },
        })
    }

    /// Detects a lack of fit of a joint's effects that the right effects would not have.
    pub(crate) fn doubt(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        joint: usize,
        floor: f64,
    ) -> Option<Unexplained> {
        let mut names: Vec<&str> = (chosen.iter())
            .filter(|p| p.candidate.joint == joint)
            .map(|p| p.candidate.kind.about().name)
            .collect();
        names.dedup();
        let found = misfit(&self.search.source, self.rows, fit, joint)?;
        let rms = fit.rms(joint);
        let left = found.taken(rms).sqrt();
        let shows = if names.is_empty() {
            // Friction and filters of the rig itself leave some lack of fit.
            found.gain > UNNAMED
        } else {
            let taken = (self.base.rms(joint).powi(2) - rms * rms).max(0.0).sqrt();
            let fits = left < NOT_QUITE * taken;
            !fits
        };
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        shows.then(|| Unexplained {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: left,
            ratio: rms / floor,
            places: self.refitted_places(fit, joint, floor),
            cause: RemainderCause::LackOfFit {
                names,
                misfit: found,
            },
        })
    }
}
