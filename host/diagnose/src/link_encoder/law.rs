//! Selection of the laws of q − ql, one after the other.

use rig_shared::effects::Kind;

use crate::fit::evidence::Evidence;
use crate::fit::least_squares::Fit;
use crate::levels::SIGNIFICANT;
use crate::link_encoder::contact::Contact;
use crate::link_encoder::equation::Equation;
use crate::link_encoder::sizes::{
    LEAST_SHARE, LEAST_SHARE_OF_THE_JOINT, LEAST_SIGMAS, least, swing,
};
use crate::outcome::Tried;
use crate::rows::regression::Column;
use rig_model::robot::title_of;

/// Share of a law's reduction below which another law beside it only corrects its error.
const SHADOW: f64 = 0.05;
/// Most accepted laws, including those removed again.
const MOST: usize = 6;

/// A law of q − ql.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// Proportional to the gear torque.
    Twist,
    /// Change of flanks with the sign of the gear torque: index in [`Equation::levels`].
    Play(usize),
    /// Index in [`Equation::waves`].
    Wave(usize),
}

impl Law {
    pub(crate) fn columns<'e>(&self, equation: &'e Equation) -> &'e [Column] {
        match self {
            Self::Twist => std::slice::from_ref(&equation.load),
            Self::Play(k) => std::slice::from_ref(&equation.levels[*k]),
            Self::Wave(k) => &equation.waves[*k].columns,
        }
    }

    pub(crate) fn kind(&self, equation: &Equation) -> Kind {
        match self {
            Self::Twist => Kind::JointElasticity,
            Self::Play(_) => Kind::Backlash,
            Self::Wave(k) => equation.waves[*k].kind,
        }
    }

    /// Returns true if both exclude each other.
    fn excludes(&self, other: &Self) -> bool {
        matches!((self, other), (Self::Play(_), Self::Play(_))) || self == other
    }

    fn bounds(&self) -> &'static [[f64; 2]] {
        const UP: [[f64; 2]; 1] = [[0.0, f64::INFINITY]];
        const OPEN: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
        match self {
            Self::Wave(_) => &OPEN,
            _ => &UP,
        }
    }
}

/// A law with its evidence.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) law: Law,
    pub(crate) evidence: Evidence,
}

/// Reason why a law is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Refusal {
    /// It may be chance.
    Chance {
        /// Corrected for the trials.
        p_value: f64,
        trials: usize,
    },
    /// It takes a share of the residual, less than the least.
    LittleGain { gain: f64, least: f64 },
    /// Its gain is small against its standard deviation.
    Uncertain { sigmas: f64 },
    /// It is as small as the error of another law.
    Shadow,
    /// It is smaller than the encoders resolve, rad or m.
    Unresolved { size: f64, least: f64 },
    /// Another law is accepted.
    Another,
}

/// A tried law.
#[derive(Clone, Debug)]
pub(crate) struct TriedLaw {
    /// Its entry in the result, without the reason for its refusal.
    pub(crate) tried: Tried,
    pub(crate) refused: Option<Refusal>,
}

/// Tried and found laws.
#[derive(Clone, Debug, Default)]
pub(crate) struct Laws {
    pub(crate) found: Vec<Found>,
    pub(crate) tried: Vec<TriedLaw>,
    pub(crate) trials: usize,
}

/// Finds the laws of q − ql of the joint `name`; `base` holds the nominal columns.
pub(crate) fn laws(equation: &Equation, base: &Fit, name: &str, without: &[Kind]) -> Laws {
    let all: Vec<Law> = (std::iter::once(Law::Twist))
        .chain((0..equation.levels.len()).map(Law::Play))
        .chain((0..equation.waves.len()).map(Law::Wave))
        .filter(|law| !without.contains(&law.kind(equation)))
        .collect();
    let trials = all.len();
    let mut laws = Laws {
        trials,
        ..Laws::default()
    };
    for step in 0..MOST {
        let fit = beside(equation, base, &laws.found, None);
        let mut best: Vec<(Found, Option<Refusal>)> = Vec::new();
        for law in &all {
            if laws.found.iter().any(|f| f.law.excludes(law)) {
                continue;
            }
            let Some(evidence) = evidence(equation, &fit, *law) else {
                continue;
            };
            let found = Found {
                law: *law,
                evidence,
            };
            let why = refused(equation, &laws.found, &found, trials);
            // The best of each kind represents it.
            let like =
                |(other, _): &&mut (Found, _)| other.law.kind(equation) == law.kind(equation);
            match best.iter_mut().find(like) {
                Some(own) if own.0.evidence.explained >= found.evidence.explained => {}
                Some(own) => *own = (found, why),
                None => best.push((found, why)),
            }
        }
        best.sort_by(|a, b| b.0.evidence.explained.total_cmp(&a.0.evidence.explained));
        let taken = best.iter().position(|(_, why)| why.is_none());
        for (k, (found, why)) in best.iter().enumerate() {
            let tried = Tried {
                effect: title_of(found.law.kind(equation)),
                joint: name.to_owned(),
                step,
                gain: found.evidence.gain,
                gain_sigmas: found.evidence.gain_sigmas,
                p_value: found.evidence.corrected(trials),
                refused: String::new(),
            };
            let refused = why.or((Some(k) != taken).then_some(Refusal::Another));
            laws.tried.push(TriedLaw { tried, refused });
        }
        let Some(taken) = taken else { break };
        laws.found.push(best.swap_remove(taken).0);
        settle(equation, base, &mut laws, &all);
    }
    laws
}

/// Refits each law beside all others; removes those that are no longer significant.
fn settle(equation: &Equation, base: &Fit, laws: &mut Laws, all: &[Law]) {
    let mut i = 0;
    while i < laws.found.len() {
        let fit = beside(equation, base, &laws.found, Some(i));
        let own = laws.found[i].law;
        let best = (all.iter())
            .filter(|law| **law == own || law.excludes(&own))
            .filter_map(|law| {
                Some(Found {
                    law: *law,
                    evidence: evidence(equation, &fit, *law)?,
                })
            })
            .max_by(|a, b| a.evidence.explained.total_cmp(&b.evidence.explained));
        let others: Vec<Found> = (laws.found.iter().enumerate())
            .filter(|(k, _)| *k != i)
            .map(|(_, f)| f.clone())
            .collect();
        match best {
            Some(found) if refused(equation, &others, &found, laws.trials).is_none() => {
                laws.found[i] = found;
                i += 1;
            }
            // The last law was just accepted beside the others, so this ends.
            _ if i + 1 < laws.found.len() => {
                laws.found.remove(i);
                i = 0;
            }
            _ => i += 1,
        }
    }
}

/// Returns the nominal columns with those of the laws, except one.
pub(crate) fn beside<'f>(
    equation: &Equation,
    base: &Fit<'f>,
    found: &[Found],
    but: Option<usize>,
) -> Fit<'f> {
    let mut fit = base.clone();
    for (k, found) in found.iter().enumerate() {
        if Some(k) != but {
            for column in found.law.columns(equation) {
                fit.push(column);
            }
        }
    }
    fit
}

fn evidence(equation: &Equation, fit: &Fit, law: Law) -> Option<Evidence> {
    fit.evidence(&fit.distinct(law.columns(equation))?, law.bounds())
}

/// Returns the reason why a law is rejected beside others.
fn refused(equation: &Equation, others: &[Found], found: &Found, trials: usize) -> Option<Refusal> {
    let e = &found.evidence;
    let p = e.corrected(trials);
    if p > SIGNIFICANT {
        return Some(Refusal::Chance { p_value: p, trials });
    }
    // Gravity has the same waves over the joint's turn.
    let least_share = match found.law {
        Law::Wave(k) if equation.waves[k].kind == Kind::EncoderEccentricityJoint => {
            LEAST_SHARE_OF_THE_JOINT
        }
        _ => LEAST_SHARE,
    };
    if e.gain < least_share {
        return Some(Refusal::LittleGain {
            gain: e.gain,
            least: least_share,
        });
    }
    if e.gain_sigmas < LEAST_SIGMAS {
        return Some(Refusal::Uncertain {
            sigmas: e.gain_sigmas,
        });
    }
    let squares = |e: &Evidence| -> f64 { e.taken().sum() };
    if (others.iter()).any(|o| squares(e) < SHADOW * SHADOW * squares(&o.evidence)) {
        return Some(Refusal::Shadow);
    }
    let size = match found.law {
        Law::Play(_) => e.gains[0],
        Law::Twist => e.gains[0] * swing(equation),
        // A wave of many turns is identifiable below one step.
        Law::Wave(_) => return None,
    };
    let least = least(equation);
    (size < least).then_some(Refusal::Unresolved { size, least })
}

impl Laws {
    /// Adds backlash to the laws or removes it, by the result from the transmitted torque.
    pub(crate) fn play_is(&mut self, equation: &Equation, base: &Fit, touch: Option<&Contact>) {
        let is_play = |f: &Found| matches!(f.law, Law::Play(_));
        let Some(touch) = touch else {
            self.found.retain(|f| !is_play(f));
            // Apparent backlash is then twist.
            if !self.found.iter().any(|f| f.law == Law::Twist)
                && let Some(evidence) = evidence(equation, base, Law::Twist)
            {
                self.found.push(Found {
                    law: Law::Twist,
                    evidence,
                });
            }
            return;
        };
        if !self.found.iter().any(is_play) {
            let fit = beside(equation, base, &self.found, None);
            let best = (0..equation.levels.len())
                .filter_map(|k| {
                    let own = fit.beside(Law::Play(k).columns(equation))?;
                    Some((k, fit.explained(&own, Law::Play(k).bounds())?.0))
                })
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let level = best.map_or(0, |(k, _)| k);
            self.found.push(Found {
                law: Law::Play(level),
                evidence: touch.evidence.clone(),
            });
            self.trials = self.trials.max(touch.trials);
        }
    }
}
