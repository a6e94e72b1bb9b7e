//! Names of the laws of a joint, and sizes of those that would have been found.

use rig_shared::effects::Kind;

use crate::columns::kinds::is_gear;
use crate::fit::systematic_uncertainty::inflated;
use crate::gap::closed;
use crate::link_encoder::analysis::{Fitted, Solved, Term, TransmissionAnalysis, term_of};
use crate::link_encoder::equation::{ACROSS, MOTOR_ANGLE};
use crate::link_encoder::gear::Gear;
use crate::link_encoder::law::{Law, beside};
use crate::link_encoder::result::Named;
use crate::link_encoder::sizes;
use crate::outcome::{Detectable, Map, Step, Value};
use crate::result::limits::smallest;
use crate::result::pictures::map;
use crate::rows::regression::Column;
use rig_model::robot::unit_of;
use rig_numerics::statistics;

impl TransmissionAnalysis<'_, '_> {
    /// Returns the laws that have a name of their own, with their entries in the result.
    pub(crate) fn named(&self, fitted: &Fitted, gear: Option<&Gear>) -> Vec<Named> {
        let named = |k: usize| {
            let values = self.values(fitted.laws.found[k].law, fitted.solved, gear)?;
            Some(self.named_law(fitted, k, values))
        };
        (0..fitted.laws.found.len()).filter_map(named).collect()
    }

    /// Returns the values of a law's parameters with their standard deviations; `None` if the law has no name of its own.
    fn values(&self, law: Law, solved: &Solved, gear: Option<&Gear>) -> Option<Vec<[f64; 2]>> {
        let equation = self.training;
        match (law, gear) {
            (Law::Twist, Some(gear)) if gear.kind == Kind::JointElasticity => Some(gear.values()),
            // Without values it is the contact's own elasticity.
            (Law::Twist, Some(gear)) => gear.gives.map(|values| values.to_vec()),
            (Law::Play(_), Some(gear)) => Some(gear.values()),
            (Law::Wave(w), _) if law.kind(equation) == Kind::EncoderEccentricityMotor => {
                let part = |side| solved.of(equation, &|t| *t == Term::Wave(w, side));
                Some(vec![part(0)?, part(1)?, [equation.waves[w].order, 0.0]])
            }
            // A wave over the joint's turn may be an error of the second encoder.
            _ => None,
        }
    }

    /// Returns the `k`-th law with the values of its parameters as entries in the result.
    fn named_law(&self, fitted: &Fitted, k: usize, values: Vec<[f64; 2]>) -> Named {
        let equation = self.training;
        let joint = &self.source.robot.joints[self.joint];
        let found = &fitted.laws.found[k];
        let kind = found.law.kind(equation);
        let about = kind.about();
        let parameters = (about.gains.iter().chain(about.shapes).zip(values))
            .map(|(p, [value, std])| {
                let unit = unit_of(p, joint.kind);
                let std = inflated(kind, p, value, std, 0.0);
                (p.name.to_owned(), Value { value, std, unit })
            })
            .collect();
        // RMS reduction beside all others.
        let without = beside(equation, fitted.base, &fitted.laws.found, Some(k));
        let with = beside(equation, fitted.base, &fitted.laws.found, None);
        let train = [without.rms(0), with.rms(0)];
        let unseen = self.unseen(found.law, fitted.solved);
        let mut set = vec![about.name.to_owned()];
        if kind == Kind::EncoderEccentricityMotor {
            set.push(Kind::GearEccentricity.about().name.to_owned());
        }
        let coordinate = if is_gear(kind) { ACROSS } else { MOTOR_ANGLE };
        Named {
            kind,
            step: Step {
                effect: about.name.to_owned(),
                law: about.law.map(str::to_owned),
                joint: joint.name.clone(),
                set,
                parameters,
                p_value: found.evidence.corrected(fitted.laws.trials),
                name_probability: f64::NAN,
                runner_up: None,
                runner_up_gap_closed: None,
                rms_unit: joint.kind.units().0.to_owned(),
                train_rms: train,
                holdout_rms: unseen,
                motion_rms: None,
                gap_closed: closed(unseen.unwrap_or(train), fitted.floor),
                why: String::new(),
            },
            law: found.law,
            floor: fitted.floor,
            map: Map {
                joint: joint.name.clone(),
                residual_unit: joint.kind.units().0.to_owned(),
                ..map(
                    &equation.rows,
                    &equation.coordinates()[coordinate],
                    [&without, &with],
                    0,
                )
            },
        }
    }

    /// Returns the RMS of the hold-out without a law and with all; `None` without a hold-out.
    fn unseen(&self, law: Law, solved: &Solved) -> Option<[f64; 2]> {
        let equation = self.training;
        self.held.map(|held| {
            let own = |t: &Term| term_of(law, t);
            [
                held.rms(&solved.terms_on(equation, held, &|t| !own(t))),
                held.rms(&solved.terms_on(equation, held, &|_| true)),
            ]
        })
    }

    /// Returns the smallest detectable backlash and compliance, of those that were not found.
    pub(crate) fn detectable(&self, fitted: &Fitted) -> Vec<Detectable> {
        let (last, laws) = (fitted.last, fitted.laws);
        let equation = self.training;
        let joint = &self.source.robot.joints[self.joint];
        let least = sizes::least(equation);
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
            let gap = statistics::median(equation.levels.iter().filter_map(size).collect());
            list.extend(gap.and_then(|gap| of(Kind::Backlash, "gap", gap.max(least))));
        }
        if !has(Kind::JointElasticity) && !has(Kind::Backlash) {
            let swing = sizes::swing(equation);
            let softest = size(&equation.load).map(|a| 1.0 / a.max(least / swing));
            list.extend(softest.and_then(|k| of(Kind::JointElasticity, "stiffness", k)));
        }
        list
    }
}
