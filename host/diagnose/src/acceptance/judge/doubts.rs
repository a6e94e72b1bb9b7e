//! Doubtful residuals: changes between recordings, disturbances, unknown noise, lack of fit of the named effects.

use crate::acceptance::judge::{Judge, QUARTER};
use crate::acceptance::lack_of_fit::misfit;
use crate::columns::kinds::is_gear;
use crate::fit::least_squares::Fit;
use crate::outcome::{Place, Remainder};
use crate::recordings::outlier_segment::Burst;
use crate::recordings::{external_load, noise_floor};
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::shapes::falls_throughout;
use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit, format_value};

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
    pub(crate) fn changed_besides(&self, fit: &Fit, joint: usize) -> Option<Remainder> {
        let rows = self.rows;
        let runs = self.search.source.runs;
        let residual = fit.residual(joint);
        let keep = &rows.keep[joint];
        let [step, std] = external_load::step(&residual, keep, &rows.starts, rows.period, runs)?;
        let rms = fit.even_rms(joint);
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        (step.abs() > CERTAIN * std && step.abs() > QUARTER * rms).then(|| Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: 0.5 * step.abs(),
            ratio: rms / (rms * rms - 0.25 * step * step).max(0.0).sqrt().max(0.1 * rms),
            text: format!(
                "Of joint {name} {} {} more are left on average in the recordings with everything taken off that pulls on it than in the others, and no effect explains that: more than that has changed in between, or the recordings stand in each other's place.",
                format_value(step, std),
                format_unit(kind.units().1),
            ),
            places: Vec::new(),
            doubt: true,
        })
    }

    /// Detects a different mean in two runs of one motion. It looks like noise, but a constant has changed in between.
    pub(crate) fn changed_between(&self, fit: &Fit, joint: usize) -> Option<Remainder> {
        let residual = fit.residual(joint);
        let rms = fit.even_rms(joint);
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let runs = self.search.source.runs;
        (self.pairs.iter()).find_map(|&(a, b)| {
            let [step, std] = noise_floor::between(self.rows, (a, b), &residual, joint)?;
            (step.abs() > CERTAIN * std && step.abs() > QUARTER * rms).then(|| Remainder {
                joint: name.clone(),
                unit: kind.units().1.to_owned(),
                rms: 0.5 * step.abs(),
                ratio: rms / (rms * rms - 0.25 * step * step).max(0.0).sqrt().max(0.1 * rms),
                text: format!(
                    "Of joint {name} {} {} more are left on average in {} than in {}, the same motion: a constant has changed in between (a sensor's zero, something that pulls). It counts as noise here and hides what is smaller; record the motion twice without a change.",
                    format_value(step, std),
                    format_unit(kind.units().1),
                    runs[b].label,
                    runs[a].label,
                ),
                places: Vec::new(),
                doubt: true,
            })
        })
    }

    pub(crate) fn knocked(
        &self,
        burst: &Burst,
        rms: f64,
        joint: usize,
        places: Vec<Place>,
    ) -> Remainder {
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let Burst {
            share,
            count,
            label,
            time: [from, to],
            times,
            ..
        } = burst;
        Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: rms * share.sqrt(),
            ratio: 1.0 / (1.0 - share).max(1e-6).sqrt(),
            text: format!(
                "{:.0} % of the squares that are left of joint {name} lie in {count} stretch{} of half a second, the loudest from {from:.1} to {to:.1} s of {label} with {} times the RMS of the others: something touched the joint or held it there, or that piece of the recording is damaged. Look at it, or record the motion again.",
                100.0 * share,
                if *count == 1 { "" } else { "es" },
                format_significant(*times, 2),
            ),
            places,
            doubt: true,
        }
    }

    /// Detects a residual far above the reading noise, if no repeated run tells how much of it is noise.
    pub(crate) fn unproven(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        joint: usize,
    ) -> Option<Remainder> {
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
        (rms > far * own).then(|| Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - own * own).sqrt(),
            ratio: rms / own,
            text: format!(
                "Of joint {name} {} {} are left, {} times what torque and positions vary by from sample to sample. No motion was recorded twice, so nobody knows how much of that is noise: record the training motion again and give both.",
                format_significant(rms, 3),
                format_unit(kind.units().1),
                format_significant(rms / own, 2)
            ),
            places: self.refitted_places(fit, joint, own),
            doubt: true,
        })
    }

    /// Detects friction that falls over nearly all speeds. Stribeck friction falls at lower speeds.
    pub(crate) fn falls_throughout(
        &self,
        chosen: &[FittedCandidate],
        joint: usize,
        (rms, floor): (f64, f64),
    ) -> Option<Remainder> {
        let fastest = self.search.source.fastest(joint);
        let falls = |p: &&FittedCandidate| {
            let kind = p.candidate.kind;
            p.candidate.joint == joint && falls_throughout(kind, &p.shapes, fastest)
        };
        let own = chosen.iter().find(falls)?;
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let speed = format_unit(&format!("{}/s", kind.units().0));
        Some(Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: (rms * rms - floor * floor).max(0.0).sqrt(),
            ratio: rms / floor,
            text: format!(
                "The friction of joint {name} falls with the speed up to {} {speed} or beyond, of {} {speed} that it goes at most. Stribeck friction has fallen long before, unless the motion is too slow to show where it ends (record a faster one): something else that falls with the speed, such as a magnetic brake, has no name here. Coulomb and viscous friction beside it are not told either way.",
                format_significant(own.shapes[0], 3),
                format_significant(fastest, 3),
            ),
            places: Vec::new(),
            doubt: true,
        })
    }

    /// Detects a lack of fit of a joint's effects that the right effects would not have.
    pub(crate) fn doubt(
        &self,
        fit: &Fit,
        chosen: &[FittedCandidate],
        joint: usize,
        floor: f64,
    ) -> Option<Remainder> {
        let mut names: Vec<&str> = (chosen.iter())
            .filter(|p| p.candidate.joint == joint)
            .map(|p| p.candidate.kind.about().name)
            .collect();
        names.dedup();
        let found = misfit(&self.search.source, self.rows, fit, joint)?;
        let rms = fit.rms(joint);
        let what = format!(
            "a free function of the {}{}",
            found.coordinate,
            found.times.said()
        );
        let Joint { name, kind, .. } = &self.robot.joints[joint];
        let percent = format_significant(100.0 * found.gain, 2);
        let left = found.taken(rms).sqrt();
        if names.is_empty() {
            // Friction and filters of the rig itself leave some lack of fit.
            return (found.gain > UNNAMED).then(|| Remainder {
                joint: name.clone(),
                unit: kind.units().1.to_owned(),
                rms: left,
                ratio: rms / floor,
                text: format!(
                    "No effect of the library explains what is left of joint {name}, but {what} takes {percent} % off it, on stretches that it was not fitted to: something is missing that has no name here."
                ),
                places: self.refitted_places(fit, joint, floor),
                doubt: true,
            });
        }
        let taken = (self.base.rms(joint).powi(2) - rms * rms).max(0.0).sqrt();
        if left < NOT_QUITE * taken {
            return None;
        }
        let text = format!(
            "With {} in the model {what} still takes {percent} % off what is left of joint {name}, on stretches that it was not fitted to. The right name would leave it nothing: {} may stand for an effect that the library does not hold.",
            names.join(" and "),
            if names.len() == 1 {
                "this one"
            } else {
                "one of these"
            },
        );
        Some(Remainder {
            joint: name.clone(),
            unit: kind.units().1.to_owned(),
            rms: left,
            ratio: rms / floor,
            text,
            places: self.refitted_places(fit, joint, floor),
            doubt: true,
        })
    }
}
