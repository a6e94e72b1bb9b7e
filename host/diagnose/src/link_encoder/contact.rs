//! Backlash from the torque that closed contacts transmit: λ = K·b + D·ḃ − φ·sgn q̇ − f·q̇. b = x − clamp(x, ±gap/2) is
//! the encoder difference beyond the gap (the law of [`rig_shared::effects::transmission_torque`]).
//!
//! The flank in contact follows from x itself, at the recording's rate and unfiltered. So impacts and the times between
//! them, without torque, keep their place.

use crate::fit::evidence::Evidence;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed};
use crate::levels::SIGNIFICANT;
use crate::link_encoder::equation::Equation;
use crate::link_encoder::sizes::{LEAST_SHARE, LEAST_SIGMAS, least};
use crate::recordings::noise_floor;
use crate::rows::regression::{Column, Rows, combined};
use rig_data::prepare::central_difference;
use rig_numerics::optimise::simplex::Simplex;

/// Gaps at which the search starts, from the least resolvable to the whole encoder difference.
const STARTS: usize = 12;
/// Step of the difference quotients over gap and zero, relative to the gap.
const DIFFERENCE: f64 = 0.01;

/// Columns of the law beside gap and zero: deflection and its rate, direction and velocity of the link.
const COLUMNS: usize = 4;

/// Backlash with the values of its law and their standard deviations.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) gap: [f64; 2],
    pub(crate) stiffness: [f64; 2],
    pub(crate) damping: [f64; 2],
    /// Coulomb friction of the link.
    pub(crate) friction: [f64; 2],
    pub(crate) evidence: Evidence,
    pub(crate) trials: usize,
}

/// Fits the backlash of a joint, if it has any. `nominal` are the coefficients of the equation's nominal columns.
pub(crate) fn contact(equation: &Equation, nominal: &[f64]) -> Option<Contact> {
    let transmitted = Transmitted::of(equation, nominal);
    let rows = &transmitted.rows;
    let rigid = transmitted.law(0.0, 0.0);
    let first = transmitted.fit(1.0, 0.1, &rigid);
    let scale = 1.0 / first.rms(0).max(f64::MIN_POSITIVE);
    let memory = noise_floor::memory(rows, &[first.residual(0)]);
    let plain = transmitted.fit(scale, memory, &[]);
    let [gap, zero] = transmitted.likeliest(&plain)?;
    // RMS reduction by the gap, compared with the law without a gap.
    let base = transmitted.fit(scale, memory, &rigid);
    let own = transmitted.law(gap, zero);
    let side = combined(1, [(&rigid[0], 1.0), (&own[0], -1.0)]);
    let evidence = base.evidence(
        &base.distinct(std::slice::from_ref(&side))?,
        &[[f64::NEG_INFINITY, 0.0]],
    )?;
    let told = evidence.corrected(STARTS) < SIGNIFICANT
        && evidence.gain >= LEAST_SHARE
        && evidence.gain_sigmas >= LEAST_SIGMAS
        && gap >= least(equation);
    if !told {
        return None;
    }
    let mut last = plain.clone();
    for column in &own {
        last.push(column);
    }
    let clustered = Fit::new(rows, vec![scale], memory).clustered(
        noise_floor::memory(rows, &[last.residual(0)]),
        &equation.pairs,
    );
    let solution = transmitted.solved(&clustered, &own, [gap, zero])?;
    let of = |k: usize| [solution.values[k], solution.std(k)];
    let friction = of(2);
    Some(Contact {
        gap: [gap, solution.std(COLUMNS)],
        stiffness: of(0),
        damping: of(1),
        friction: [-friction[0], friction[1]],
        evidence,
        trials: STARTS,
    })
}

/// Torque that closed contacts transmit: rows of the gear torque, explained by the encoder difference beyond a gap.
struct Transmitted<'e> {
    equation: &'e Equation,
    /// The gear torque.
    rows: Rows,
    /// q − ql without the nominal columns, run by run at its own rate, rad or m.
    apart: Vec<Vec<f64>>,
}

impl<'e> Transmitted<'e> {
    fn of(equation: &'e Equation, nominal: &[f64]) -> Self {
        Self {
            equation,
            rows: Rows {
                torque: equation.load.iter().flatten().cloned().collect(),
                nominal: Vec::new(),
                legible: Vec::new(),
                clear: Vec::new(),
                left_out: Vec::new(),
                thinning: equation.rows.thinning.clone(),
                starts: equation.rows.starts.clone(),
                keep: equation.rows.keep.clone(),
                ..equation.rows
            },
            apart: equation.apart_of(nominal),
        }
    }

    /// Returns direction and velocity of the link, whose friction the torque contains.
    fn beside(&self) -> [&'e Column; 2] {
        [
            &self.equation.direction,
            &self.equation.rows.nominal[self.equation.constants + 1],
        ]
    }

    /// Returns the encoder difference beyond a gap about its zero, and its rate of change.
    fn law(&self, gap: f64, zero: f64) -> [Column; 2] {
        let equation = self.equation;
        let [mut bend, mut rate] = [const { Vec::new() }; 2];
        for (x, rows_rate) in self.apart.iter().zip(&equation.rates) {
            let beyond: Vec<f64> = (x.iter())
                .map(|x| x - zero - (x - zero).clamp(-0.5 * gap, 0.5 * gap))
                .collect();
            let [position, band] = &equation.filters;
            let smooth = band.zero_phase(&position.zero_phase(&beyond));
            equation.rows.thinning.push(&smooth, &[], &mut bend);
            let change = central_difference(&smooth, 1.0 / rows_rate);
            equation.rows.thinning.push(&change, &[], &mut rate);
        }
        [vec![Some(bend)], vec![Some(rate)]]
    }

    /// Returns the fit of the link's friction and of `more` columns.
    fn fit(&self, scale: f64, memory: f64, more: &[Column]) -> Fit<'_> {
        let mut fit = Fit::new(&self.rows, vec![scale], memory);
        for column in self.beside().into_iter().chain(more) {
            fit.push(column);
        }
        fit
    }

    /// Returns the gap, and its zero, that explain most of the torque; `None` if no gap is resolvable. `plain` is the fit
    /// without a contact.
    fn likeliest(&self, plain: &Fit) -> Option<[f64; 2]> {
        let bounds = [[0.0, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]];
        let share = |gap: f64, zero: f64| -> f64 {
            let columns = self.law(gap, zero);
            let explained = plain
                .beside(&columns)
                .and_then(|b| plain.explained(&b, &bounds));
            explained.map_or(0.0, |(share, _)| share)
        };
        // From the least resolvable gap to the whole range of x.
        let mut all: Vec<f64> = self.apart.iter().flatten().map(|x| x.abs()).collect();
        all.sort_by(f64::total_cmp);
        let most = 2.0 * all.get(all.len() * 99 / 100)?;
        let least = least(self.equation);
        if most <= least {
            return None;
        }
        let start = (0..STARTS)
            .map(|k| least * (most / least).powf(k as f64 / (STARTS - 1) as f64))
            .map(|gap| (gap, share(gap, 0.0)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut simplex = Simplex::new(&[start.0.ln(), 0.0], &[0.2, 0.1]);
        let mut best = (start.1, start.0, 0.0);
        while let Some(at) = simplex.next_point() {
            let (gap, zero) = (at[0].exp(), at[1] * start.0);
            let explained = share(gap, zero);
            if explained > best.0 {
                best = (explained, gap, zero);
            }
            simplex.report(-explained);
        }
        let (_, gap, zero) = best;
        Some([gap, zero])
    }

    /// Returns the coefficients of the law's columns `own` and of the link's friction, then gap and zero.
    fn solved(
        &self,
        clustered: &Fit,
        own: &[Column; 2],
        [gap, zero]: [f64; 2],
    ) -> Option<Solution> {
        let columns: Vec<&Column> = own.iter().chain(self.beside()).collect();
        let step = DIFFERENCE * gap;
        let stiffness = jackknifed(clustered, &[], &columns, &[], &[])?.values[0];
        let slope = |up: [Column; 2], down: [Column; 2]| {
            let factor = 0.5 * stiffness / step;
            combined(1, [(&up[0], factor), (&down[0], -factor)])
        };
        let slopes = [
            slope(self.law(gap + step, zero), self.law(gap - step, zero)),
            slope(self.law(gap, zero + step), self.law(gap, zero - step)),
        ];
        jackknifed(clustered, &[], &columns, &[], &slopes)
    }
}
