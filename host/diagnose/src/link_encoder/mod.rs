//! Transmission analysis with a link encoder: position residuals across the transmission.
//!
//! x = q − ql = c + ε·q + δ·q̇ + (λ + φ·sgn q̇)/K − D·λ̇/K² + (gap/2)·s(λ + φ·sgn q̇) + Σ cos, sin of motor or joint
//! angle. λ is the gear torque by the model for the link's *measured* motion, so it includes the gear's effect (Spong
//! 1987; backlash: Nordin and Gutman 2002; errors of encoders and gears as orders over a turn). s is the flank in
//! contact. It changes with the sign of the torque over a fitted width, because impacts and filters blur it. ε allows
//! for a small ratio error, δ for different reading instants. x contains no motor friction and no torque sensor error:
//! presliding and Stribeck friction affect the torque alone.
//!
//! Leaves out: stiffness that grows with the twist; hysteresis of the gear; the motion inside the gap, except its mean;
//! drives that move several joints; friction in the link's bearing that winds up the gear at rest.

mod contact;
mod equation;
mod gear;
mod law;
mod tell;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use rig_shared::effects::{Kind, SHAPES};

use crate::acceptance::residual_dependence::locate;
use crate::columns::candidate::Candidate;
use crate::columns::effect_columns::Source;
use crate::columns::kinds::is_gear;
use crate::description::parameter_prior::ParameterPrior;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed, solve};
use crate::fit::systematic_uncertainty::inflated;
use crate::fit::vector::dot;
use crate::levels::SIGNIFICANT;
use crate::link_encoder::contact::contact;
use crate::link_encoder::equation::{ACROSS, Equation};
use crate::link_encoder::gear::Gear;
use crate::link_encoder::law::{Found, Law, Laws, beside, laws};
use crate::outcome::{Detectable, Map, Place, Step, Tried, Value};
use crate::recordings::context::PreparedData;
use crate::recordings::noise_floor;
use crate::result::limits::smallest;
use crate::result::pictures::map;
use crate::rows::regression::Column;
use crate::statistics::closed;
use crate::{DiagnoseError, Options};
use rig_model::robot::unit_of;

pub(crate) use crate::link_encoder::tell::tell;

/// Least reported scale difference of the encoders: in standard deviations, and relative.
const SURE: f64 = 5.0;
const SCALE_OFF: f64 = 1e-3;

/// Results from the link encoder of one joint.
pub(crate) struct Across {
    /// From 0.
    pub(crate) joint: usize,
    /// Named effects, the gear's first, with their entries in the result.
    named: Vec<Named>,
    /// Shapes of the gear, if it has backlash or elasticity.
    gear: Option<(Kind, [f64; SHAPES])>,
    places: Vec<Place>,
    tried: Vec<Tried>,
    detectable: Vec<Detectable>,
    words: Vec<String>,
}

struct Named {
    kind: Kind,
    step: Step,
    map: Map,
}

/// Analyses the link encoders, joint by joint. `after` are the coefficients of the free nominal directions, with their
/// covariance.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn across(
    source: &Source,
    anchor: &ParameterPrior,
    after: &Solution,
    prepared: &PreparedData,
    held_out: Option<(&Source, &PreparedData)>,
    options: &Options,
) -> Result<Vec<Across>, DiagnoseError> {
    let mut list = Vec::new();
    for joint in 0..source.robot.joints.len() {
        let Some(training) =
            Equation::of(source, joint, prepared, &prepared.position_filter()?, None)?
        else {
            continue;
        };
        let held = match held_out {
            Some((of, held_out)) => {
                let filter = held_out.position_filter()?;
                Equation::of(of, joint, held_out, &filter, Some(&training.sides))?
            }
            None => None,
        };
        list.extend(
            TransmissionAnalysis {
                source,
                anchor,
                after,
                joint,
                training: &training,
                held: held.as_ref(),
                options,
            }
            .said(),
        );
    }
    Ok(list)
}

/// Returns true if the analysis across a transmission excludes a candidate of the torque search.
pub(crate) fn refutes(across: &[Across], candidate: &Candidate) -> bool {
    let Some(own) = across.iter().find(|a| a.joint == candidate.joint) else {
        return false;
    };
    let named = || own.named.iter().any(|n| n.kind == candidate.kind);
    match candidate.kind {
        kind if is_gear(kind) => own.gear.is_none_or(|(gear, _)| gear != kind),
        Kind::EncoderEccentricityMotor => !named(),
        _ => false,
    }
}

/// Returns the found gears, with their shapes.
pub(crate) fn gears(across: &[Across]) -> Vec<(Candidate, [f64; SHAPES])> {
    let of = |a: &Across| {
        let (kind, shapes) = a.gear?;
        let candidate = Candidate::on(kind, a.joint);
        Some((candidate, shapes))
    };
    across.iter().filter_map(of).collect()
}

/// Returns true if any named effect is not in the description.
pub(crate) fn names_something(across: &[Across], stated: &dyn Fn(&Candidate) -> bool) -> bool {
    across
        .iter()
        .any(|a| (a.named.iter()).any(|n| !stated(&Candidate::on(n.kind, a.joint))))
}

/// Analysis of one joint's transmission.
struct TransmissionAnalysis<'a, 's> {
    source: &'a Source<'s>,
    anchor: &'a ParameterPrior,
    after: &'a Solution,
    joint: usize,
    training: &'a Equation,
    held: Option<&'a Equation>,
    options: &'a Options,
}

/// All coefficients, those of the laws after the nominal ones.
struct Solved {
    solution: Solution,
    /// Columns fitted beside the nominal ones, in their order.
    terms: Vec<Term>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Term {
    Load,
    Change,
    Direction,
    Level(usize),
    Wave(usize, usize),
}

impl TransmissionAnalysis<'_, '_> {
    fn said(&self) -> Option<Across> {
        let equation = self.training;
        let rows = &equation.rows;
        let name = &self.source.robot.joints[self.joint].name;
        let nominal: Vec<&Column> = rows.nominal.iter().collect();
        let first = Fit::new(rows, vec![1.0], 0.1).taking(nominal.iter().copied());
        let weight = 1.0 / first.rms(0).max(f64::MIN_POSITIVE);
        let memory = noise_floor::memory(rows, &[first.residual(0)]);
        let plain = Fit::new(rows, vec![weight], memory);
        let base = plain.clone().taking(nominal.iter().copied());
        let mut laws = laws(equation, &base, name, &self.options.without);
        let (mut touch, mut settled) = (None, false);
        let (last, floor, solved) = loop {
            let last = beside(equation, &base, &laws.found, None);
            let residual = last.residual(0);
            let floor = noise_floor::from_repeats(rows, &equation.pairs, &residual, None, 0)
                .map(|repeated| repeated.noise)
                .unwrap_or_else(|| equation.short_time(&residual));
            let memory = noise_floor::memory(rows, &[residual]);
            let solved = self.solved(&plain.clustered(memory, &equation.pairs), &base, &laws)?;
            if settled {
                break (last, floor, solved);
            }
            // Gear torque separates backlash from elasticity better than its sign does.
            settled = true;
            let is_gear = |f: &Found| matches!(f.law, Law::Twist | Law::Play(_));
            if laws.found.iter().any(is_gear) {
                let excluded = self.options.without.contains(&Kind::Backlash);
                touch = contact(equation, &solved.solution.values).filter(|_| !excluded);
                laws.play_is(equation, &base, touch.as_ref());
            }
        };
        let gear = self.gear(&solved, &base, &laws, touch.as_ref());
        let mut named = self.named(&base, &laws, &solved, gear.as_ref(), floor);
        // Effects between motor and link come first.
        named.sort_by_key(|n| !is_gear(n.kind));
        let coordinates = equation.coordinates();
        let places = locate(
            rows,
            &coordinates,
            &base.residual(0),
            None,
            base.block_of_rows(),
            0,
            name,
            floor,
            self.options.seed,
        );
        let words = self.words(&base, &last, &laws, &solved, gear.as_ref(), floor);
        Some(Across {
            joint: self.joint,
            gear: gear.map(|g| (g.kind, g.shapes)),
            places: (places.into_iter())
                .filter(|p| p.p_value < SIGNIFICANT && !named.is_empty())
                .take(1)
                .map(|p| Place {
                    text: format!("Of what the two encoders read apart: {}", p.text),
                    ..p
                })
                .collect(),
            named,
            detectable: self.detectable(&last, &laws),
            tried: laws.tried,
            words,
        })
    }

    /// Fits everything together; beside backlash too, gear torque and link friction are fitted.
    fn solved(&self, plain: &Fit, base: &Fit, laws: &Laws) -> Option<Solved> {
        let equation = self.training;
        let mut fit = base.clone();
        let mut terms = Vec::new();
        let mut take = |term: Term, fit: &mut Fit| {
            let column = column(equation, term);
            if fit.distinct(std::slice::from_ref(column)).is_some() && fit.push(column) {
                terms.push(term);
            }
        };
        for found in &laws.found {
            match found.law {
                Law::Twist => take(Term::Load, &mut fit),
                Law::Play(k) => take(Term::Level(k), &mut fit),
                Law::Wave(k) => {
                    take(Term::Wave(k, 0), &mut fit);
                    take(Term::Wave(k, 1), &mut fit);
                }
            }
        }
        if (laws.found.iter()).any(|f| matches!(f.law, Law::Twist | Law::Play(_))) {
            take(Term::Load, &mut fit);
            take(Term::Direction, &mut fit);
            take(Term::Change, &mut fit);
        }
        let columns: Vec<&Column> = (equation.rows.nominal.iter())
            .chain(terms.iter().map(|t| column(equation, *t)))
            .collect();
        let slopes: Vec<Column> = (terms.iter())
            .filter_map(|term| match term {
                Term::Level(k) => {
                    let [less, more] = equation.around(*k)?;
                    Some(crate::rows::regression::combined(
                        1,
                        [(less, -1.0), (more, 1.0)],
                    ))
                }
                _ => None,
            })
            .collect();
        let solution =
            jackknifed(plain, &[], &columns, &slopes).or_else(|| solve(plain, &columns, &[]))?;
        Some(Solved { solution, terms })
    }

    /// Returns the relative standard deviation of the gear torque along q − ql, from the parameters that determine it.
    fn of_the_load(&self, base: &Fit, solved: &Solved) -> f64 {
        let equation = self.training;
        let mut fit = base.clone();
        for term in solved.terms.iter().filter(|t| **t != Term::Load) {
            fit.push(column(equation, *term));
        }
        let along = |c: &Column| fit.projected(fit.weighted(c));
        let load = along(&equation.load);
        let length = dot(&load, &load);
        if length == 0.0 {
            return 0.0;
        }
        let shares: BTreeMap<usize, f64> = (equation.parts.iter())
            .map(|(b, part)| (*b, dot(&load, &along(part)) / length))
            .collect();
        let free: Vec<f64> = (self.anchor.free.iter())
            .map(|direction| {
                let share = |b: &usize| shares.get(b).copied().unwrap_or(0.0);
                direction.iter().map(|(b, f)| f * share(b)).sum()
            })
            .collect();
        let mut variance = 0.0;
        for (a, x) in free.iter().enumerate() {
            for (b, y) in free.iter().enumerate() {
                variance += x * y * self.after.covariance[(a, b)];
            }
        }
        variance.max(0.0).sqrt()
    }

    fn named(
        &self,
        base: &Fit,
        laws: &Laws,
        solved: &Solved,
        gear: Option<&Gear>,
        floor: f64,
    ) -> Vec<Named> {
        let equation = self.training;
        let joint = &self.source.robot.joints[self.joint];
        let mut list = Vec::new();
        for (k, found) in laws.found.iter().enumerate() {
            let kind = found.law.kind(equation);
            let about = kind.about();
            let values: Vec<[f64; 2]> = match (found.law, gear) {
                (Law::Twist, Some(gear)) if gear.kind == Kind::JointElasticity => gear.values(),
                (Law::Twist, Some(gear)) => match gear.gives {
                    Some(values) => values.to_vec(),
                    // It is the contact's own elasticity.
                    None => continue,
                },
                (Law::Play(_), Some(gear)) => gear.values(),
                (Law::Wave(w), _) if kind == Kind::EncoderEccentricityMotor => {
                    let part = |side| solved.of(equation, &|t| *t == Term::Wave(w, side));
                    let (Some(cosine), Some(sine)) = (part(0), part(1)) else {
                        continue;
                    };
                    vec![cosine, sine, [equation.waves[w].order, 0.0]]
                }
                // A wave over the joint's turn may be an error of the second encoder.
                _ => continue,
            };
            let parameters = (about.gains.iter().chain(about.shapes).zip(values))
                .map(|(p, [value, std])| {
                    let unit = unit_of(p, joint.kind);
                    let std = inflated(kind, p, value, std, 0.0);
                    (p.name.to_owned(), Value { value, std, unit })
                })
                .collect();
            // RMS reduction beside all others.
            let without = beside(equation, base, &laws.found, Some(k));
            let with = beside(equation, base, &laws.found, None);
            let train = [without.rms(0), with.rms(0)];
            let unseen = self.held.map(|held| {
                let own = |t: &Term| term_of(found.law, t);
                [
                    held.rms(&solved.terms_on(equation, held, &|t| !own(t))),
                    held.rms(&solved.terms_on(equation, held, &|_| true)),
                ]
            });
            let mut set = vec![about.name.to_owned()];
            if kind == Kind::EncoderEccentricityMotor {
                set.push(Kind::GearEccentricity.about().name.to_owned());
            }
            list.push(Named {
                kind,
                step: Step {
                    effect: about.name.to_owned(),
                    law: about.law.map(str::to_owned),
                    joint: joint.name.clone(),
                    set,
                    parameters,
                    p_value: found.evidence.corrected(laws.trials),
                    name_probability: f64::NAN,
                    runner_up: None,
                    runner_up_gap_closed: None,
                    rms_unit: joint.kind.units().0.to_owned(),
                    train_rms: train,
                    holdout_rms: unseen,
                    motion_rms: None,
                    gap_closed: closed(unseen.unwrap_or(train), floor),
                    why: self.why(found, train, unseen, floor),
                },
                map: Map {
                    joint: joint.name.clone(),
                    residual_unit: joint.kind.units().0.to_owned(),
                    ..map(
                        &equation.rows,
                        &equation.coordinates()[if is_gear(kind) { ACROSS } else { 3 }],
                        [&without, &with],
                        0,
                    )
                },
            });
        }
        list
    }

    fn detectable(&self, last: &Fit, laws: &Laws) -> Vec<Detectable> {
        let equation = self.training;
        let joint = &self.source.robot.joints[self.joint];
        let least = law::least(equation);
        let size = |column: &Column| {
            let own = last.distinct(std::slice::from_ref(column))?;
            smallest(last, own.first()?, 1, laws.trials)
        };
        let mut list = Vec::new();
        let of = |kind: Kind, name: &str, size: f64| {
            let p = kind.about().shapes.iter().find(|p| p.name == name)?;
            Some(Detectable {
                effect: kind.about().name.to_owned(),
                joint: joint.name.clone(),
                parameter: p.name.to_owned(),
                size,
                size_at_worst: None,
                unit: unit_of(p, joint.kind),
            })
        };
        let has = |kind: Kind| laws.found.iter().any(|f| f.law.kind(equation) == kind);
        if !has(Kind::Backlash) {
            let mut sizes: Vec<f64> = equation.levels.iter().filter_map(size).collect();
            sizes.sort_by(f64::total_cmp);
            let gap = sizes.get(sizes.len() / 2);
            list.extend(gap.and_then(|gap| of(Kind::Backlash, "gap", gap.max(least))));
        }
        if !has(Kind::JointElasticity) && !has(Kind::Backlash) {
            let swing = law::swing(equation);
            let softest = size(&equation.load).map(|a| 1.0 / a.max(least / swing));
            list.extend(softest.and_then(|k| of(Kind::JointElasticity, "stiffness", k)));
        }
        list
    }
}

impl Solved {
    /// Returns coefficient and standard deviation of the first wanted term.
    fn of(&self, equation: &Equation, wanted: &dyn Fn(&Term) -> bool) -> Option<[f64; 2]> {
        let at = equation.rows.nominal.len() + self.terms.iter().position(wanted)?;
        Some([self.solution.values[at], self.solution.std(at)])
    }

    /// Returns the columns of other recordings with these coefficients, for the `wanted` terms of the laws.
    fn terms_on<'h>(
        &self,
        equation: &Equation,
        held: &'h Equation,
        wanted: &dyn Fn(&Term) -> bool,
    ) -> Vec<(&'h Column, f64)> {
        let nominal = (held.rows.nominal[held.constants..].iter())
            .zip(&self.solution.values[equation.constants..])
            .map(|(c, v)| (c, *v));
        let from = equation.rows.nominal.len();
        nominal
            .chain(
                (self.terms.iter().zip(&self.solution.values[from..]))
                    .filter(|(t, _)| wanted(t))
                    .map(|(t, v)| (column(held, *t), *v)),
            )
            .collect()
    }
}

fn column(equation: &Equation, term: Term) -> &Column {
    match term {
        Term::Load => &equation.load,
        Term::Change => &equation.change,
        Term::Direction => &equation.direction,
        Term::Level(k) => &equation.levels[k],
        Term::Wave(k, side) => &equation.waves[k].columns[side],
    }
}

/// Returns true if a term belongs to a law.
fn term_of(law: Law, term: &Term) -> bool {
    match law {
        Law::Twist => matches!(term, Term::Load | Term::Change | Term::Direction),
        Law::Play(_) => matches!(term, Term::Level(_)),
        Law::Wave(k) => matches!(term, Term::Wave(w, _) if *w == k),
    }
}
