//! One joint's transmission: its equation, and all coefficients fitted together.

use std::collections::BTreeMap;

use crate::Options;
use crate::columns::effect_columns::Source;
use crate::description::parameter_prior::ParameterPrior;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed, solve};
use crate::link_encoder::equation::Equation;
use crate::link_encoder::law::{Law, Laws};
use crate::rows::regression::{Column, combined};
use rig_numerics::vector::dot;

/// Analysis of one joint's transmission.
pub(crate) struct TransmissionAnalysis<'a, 's> {
    pub(crate) source: &'a Source<'s>,
    pub(crate) anchor: &'a ParameterPrior,
    pub(crate) after: &'a Solution,
    pub(crate) joint: usize,
    pub(crate) training: &'a Equation,
    pub(crate) held: Option<&'a Equation>,
    pub(crate) options: &'a Options,
}

/// All coefficients, those of the laws after the nominal ones.
pub(crate) struct Solved {
    pub(crate) solution: Solution,
    /// Columns fitted beside the nominal ones, in their order.
    pub(crate) terms: Vec<Term>,
}

/// A column of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Term {
    /// Torque on the gear.
    Load,
    /// Its rate of change.
    Change,
    /// Direction of the link's motion.
    Direction,
    /// Flank in contact: index in [`Equation::levels`].
    Level(usize),
    /// Index in [`Equation::waves`], and of cosine or sine.
    Wave(usize, usize),
}

/// The laws of a joint, with their fits.
pub(crate) struct Fitted<'a, 'f> {
    /// Nominal columns alone.
    pub(crate) base: &'a Fit<'f>,
    /// Nominal columns with those of all laws.
    pub(crate) last: &'a Fit<'f>,
    /// Tried and found laws.
    pub(crate) laws: &'a Laws,
    /// Coefficients of all columns.
    pub(crate) solved: &'a Solved,
    /// Noise floor of q − ql, rad or m.
    pub(crate) floor: f64,
}

impl TransmissionAnalysis<'_, '_> {
    /// Fits everything together; beside backlash too, gear torque and link friction are fitted.
    pub(crate) fn solved(&self, plain: &Fit, base: &Fit, laws: &Laws) -> Option<Solved> {
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
                    Some(combined(1, [(less, -1.0), (more, 1.0)]))
                }
                _ => None,
            })
            .collect();
        let solution = jackknifed(plain, &[], &columns, &[], &slopes)
            .or_else(|| solve(plain, &columns, &[]))?;
        Some(Solved { solution, terms })
    }

    /// Returns the relative standard deviation of the gear torque along q − ql, from the parameters that determine it.
    pub(crate) fn of_the_load(&self, base: &Fit, solved: &Solved) -> f64 {
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
}

impl Solved {
    /// Returns coefficient and standard deviation of the first wanted term.
    pub(crate) fn of(
        &self,
        equation: &Equation,
        wanted: &dyn Fn(&Term) -> bool,
    ) -> Option<[f64; 2]> {
        let at = equation.rows.nominal.len() + self.terms.iter().position(wanted)?;
        Some([self.solution.values[at], self.solution.std(at)])
    }

    /// Returns the columns of other recordings with these coefficients, for the `wanted` terms of the laws.
    pub(crate) fn terms_on<'h>(
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

/// Returns the column of a term.
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
pub(crate) fn term_of(law: Law, term: &Term) -> bool {
    match law {
        Law::Twist => matches!(term, Term::Load | Term::Change | Term::Direction),
        Law::Play(_) => matches!(term, Term::Level(_)),
        Law::Wave(k) => matches!(term, Term::Wave(w, _) if *w == k),
    }
}
