//! Result of a voltage-driven diagnosis in words, numbers and as a description.

use std::collections::BTreeMap;

use crate::description::described_effects::{DescribedEffects, Now};
use crate::gap::closed;
use crate::outcome::{
    Absorbed, Before, Curves, Described, Diagnosis, Remainder, Residual, Step, Tried, Value,
    Verdict, Waterfall,
};
use crate::voltage::controllers::{Driven, Shown};
use crate::voltage::free_run::FreeRun;
use crate::voltage::plant::{NAMES, NOMINAL, Plant};
use crate::voltage::search::{EQUAL, Model, Trial, on_the_voltage};
use crate::voltage::sentences;
use rig_model::robot::{Drive, JointFriction, Robot, RobotEffect, Uncertainty, title_of};
use rig_shared::effects::Effect;

/// Multiple of the noise floor above which a residual is unexplained.
const LEFT: f64 = 1.2;

/// All results.
pub(crate) struct Told<'a> {
    /// The description, and the fate of its effects.
    pub stated: &'a DescribedEffects,
    /// Curves to draw.
    pub curves: Vec<Curves>,
    /// Noise floor, rad or m.
    pub floor: f64,
    /// Free runs over the training recordings, model by model.
    pub train: Vec<FreeRun>,
    /// The same on the hold-out; empty without one.
    pub holdout: Vec<FreeRun>,
    /// Controllers of the training recordings.
    pub controllers: Vec<Shown>,
    pub deviations: Vec<Option<Vec<f64>>>,
    /// Models, the nominal one first.
    pub models: Vec<Model>,
    pub rounds: Vec<Vec<Trial>>,
    /// RMS on left-out recordings before each round.
    pub unseen: Vec<f64>,
    /// The driving voltage.
    pub driven: Driven,
}

impl Told<'_> {
    fn joint(&self) -> String {
        self.stated.robot.joints[0].name.clone()
    }

    /// Returns the number of described effects, which every model has.
    fn described(&self) -> usize {
        self.models.first().map_or(0, |model| model.effects.len())
    }

    /// Returns the fate of the described effects in the last model.
    fn told(&self) -> Vec<Described> {
        let last = self.models.len() - 1;
        let effects = &self.models[last].effects[..self.described()];
        // Effects with one name in their order.
        let mut next = vec![true; effects.len()];
        let now = self.stated.fitted().map(|kind| {
            let place = (0..effects.len()).find(|k| next[*k] && Some(effects[*k]) == kind)?;
            next[place] = false;
            Some(Now {
                kind: effects[place],
                parameters: self.parameters(last, place),
            })
        });
        self.stated.told(now.collect())
    }

    /// Returns the unit of the position, ASCII.
    fn unit(&self) -> &'static str {
        self.stated.robot.joints[0].kind.units().0
    }

    fn judged(&self) -> &[FreeRun] {
        if self.holdout.is_empty() {
            &self.train
        } else {
            &self.holdout
        }
    }

    /// Returns the standard deviation of parameter `p` of model `k`; 0 if it was not fitted.
    fn std(&self, k: usize, p: usize) -> f64 {
        let place = self.models[k].free.iter().position(|f| *f == p);
        let list = self.deviations[k].as_ref();
        place.and_then(|c| list?.get(c).copied()).unwrap_or(0.0)
    }

    /// Returns the content of `diagnosis.json`.
    pub(crate) fn diagnosis(&self) -> Diagnosis {
        let judged = self.judged();
        let (first, last) = (&judged[0], &judged[judged.len() - 1]);
        let steps: Vec<Step> = (1..self.models.len()).map(|k| self.step(k)).collect();
        let left = last.rms().is_none_or(|rms| rms > LEFT * self.floor);
        let verdict = match (left, steps.is_empty()) {
            (true, _) => Verdict::Remainder,
            (false, true) => Verdict::NothingMissing,
            (false, false) => Verdict::Explained,
        };
        let described = self.told();
        Diagnosis {
            schema: "rig-diagnosis/1".into(),
            robot: self.stated.robot.name.clone(),
            verdict,
            residual: Residual::Position,
            words: self.words(&described),
            noise_floor_rms: vec![self.floor],
            noise_floor_from: Vec::new(),
            left: Vec::new(),
            noise_floor_how: sentences::FLOOR.to_owned(),
            motion_how: sentences::motion(self.driven),
            treatment: None,
            torque_lead: Vec::new(),
            places: Vec::new(),
            gap_closed: (first.rms().zip(last.rms()).filter(|_| !steps.is_empty()))
                .map(|(first, last)| closed([first, last], self.floor)),
            described,
            steps,
            absorbed: self.absorbed(),
            absorbed_before: Before::WithoutEffects,
            by_motion: None,
            not_testable: Vec::new(),
            detectable: Vec::new(),
            next_experiment: None,
            remainder: left.then(|| self.remainder()),
            data_faults: Vec::new(),
            waterfall: vec![self.waterfall()],
            tried: self.tried(),
            maps: Vec::new(),
            curves: self.curves.clone(),
        }
    }

    /// Returns the sentences of the result.
    fn words(&self, described: &[Described]) -> Vec<String> {
        let judged = self.judged();
        let runs = [&judged[0], &judged[judged.len() - 1]];
        let mut words = vec![sentences::summary(
            self.driven,
            runs,
            !self.holdout.is_empty(),
            !self.controllers.is_empty(),
            self.unit(),
        )];
        words.extend(sentences::controllers(&self.controllers, self.unit()));
        let mut effects = self.models.iter().flat_map(|m| &m.effects);
        if effects.any(|k| on_the_voltage(*k)) {
            words.push(sentences::VOLTAGE_OR_FRICTION.to_owned());
        }
        words.extend(self.rotor_remark());
        words.extend(described.iter().map(|d| d.text.clone()));
        words
    }

    /// Returns the RMS of the position error from model to model.
    fn waterfall(&self) -> Waterfall {
        let numbers = |runs: &[FreeRun]| runs.iter().map(FreeRun::number).collect::<Vec<f64>>();
        let last = self.models.last().into_iter();
        let effects = last.flat_map(|m| m.effects[self.described()..].iter().map(|k| title_of(*k)));
        Waterfall {
            joint: self.joint(),
            unit: self.unit().into(),
            models: std::iter::once("refitted".to_owned())
                .chain(effects)
                .collect(),
            train: numbers(&self.train),
            holdout: numbers(&self.holdout),
            floor: self.floor,
            holdout_floor: self.floor,
        }
    }

    /// Returns the remainder of the last model; a diverged run has no number.
    fn remainder(&self) -> Remainder {
        let last = &self.judged()[self.judged().len() - 1];
        let excess = |rms: f64| (rms * rms - self.floor * self.floor).max(0.0).sqrt();
        Remainder {
            joint: self.joint(),
            rms: last.rms().map_or(f64::NAN, excess),
            unit: self.unit().to_owned(),
            ratio: last.number() / self.floor.max(f64::MIN_POSITIVE),
            places: Vec::new(),
            text: sentences::left_over(last, self.floor, !self.controllers.is_empty(), self.unit()),
            doubt: false,
        }
    }

    /// Returns a sentence if the drive's inertia is less than the described rotor's.
    fn rotor_remark(&self) -> Option<String> {
        let drive = self.stated.robot.joints[0].drive.as_ref()?;
        let found = self.models.last()?.theta[0] / drive.gear_ratio.powi(2);
        (found < drive.rotor_inertia).then(|| sentences::rotor(drive.rotor_inertia, found))
    }

    fn step(&self, k: usize) -> Step {
        let model = &self.models[k];
        let place = self.described() + k - 1;
        let kind = model.effects[place];
        let round = &self.rounds[k - 1];
        let own = round.iter().find(|t| t.kind == kind);
        let best = own.and_then(|t| t.unseen).unwrap_or(self.train[k].number());
        let rival =
            |t: &&Trial| t.kind != kind && t.p_value <= own.map_or(0.0, |o| o.p_value.max(0.05));
        let near = |t: &&Trial| t.unseen.is_some_and(|rms| rms <= (1.0 + EQUAL) * best);
        let mut set = vec![kind.about().name.to_owned()];
        set.extend(
            round
                .iter()
                .filter(rival)
                .filter(near)
                .map(|t| t.kind.about().name.to_owned()),
        );
        let other = (round.iter().filter(|t| t.kind != kind && !near(t)))
            .filter_map(|t| Some((t, t.unseen?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let pair = |list: &[FreeRun]| [list[k - 1].number(), list[k].number()];
        let holdout = (!self.holdout.is_empty()).then(|| pair(&self.holdout));
        let judged = pair(self.judged());
        let last = self.models.len() - 1;
        Step {
            effect: kind.about().name.into(),
            law: kind.about().law.map(str::to_owned),
            joint: self.joint(),
            set,
            parameters: self.parameters(last, place),
            p_value: own.map_or(1.0, |t| t.p_value),
            name_probability: f64::NAN,
            runner_up: other.map(|(t, _)| title_of(t.kind)),
            runner_up_gap_closed: other
                .map(|(_, rms)| closed([self.train[k - 1].number(), rms], self.floor)),
            rms_unit: self.unit().to_owned(),
            train_rms: pair(&self.train),
            holdout_rms: holdout,
            motion_rms: Some(judged),
            gap_closed: closed(judged, self.floor),
            why: sentences::why(best, self.unseen[k - 1], self.unit()),
        }
    }

    /// Returns the parameters of the `effect`-th effect of model `k`.
    fn parameters(&self, k: usize, effect: usize) -> BTreeMap<String, Value> {
        let model = &self.models[k];
        let count =
            |kind: &rig_shared::effects::Kind| kind.about().gains.len() + kind.about().shapes.len();
        let at = NOMINAL + model.effects[..effect].iter().map(count).sum::<usize>();
        let about = model.effects[effect].about();
        (about.gains.iter().chain(about.shapes).enumerate())
            .map(|(p, parameter)| {
                let value = Value {
                    value: model.theta[at + p],
                    std: self.std(k, at + p),
                    unit: parameter.unit.into(),
                };
                (parameter.name.to_owned(), value)
            })
            .collect()
    }

    fn absorbed(&self) -> Vec<Absorbed> {
        let last = self.models.len() - 1;
        if last == 0 {
            return Vec::new();
        }
        let mut list: Vec<Absorbed> = (self.models[last].free.iter().filter(|p| **p < NOMINAL))
            .map(|p| {
                let [before, after] = [0, last].map(|k| self.models[k].theta[*p]);
                Absorbed {
                    parameter: NAMES[*p].0.into(),
                    unit: NAMES[*p].1.into(),
                    before,
                    after,
                    sigmas: (after - before).abs() / self.std(last, *p).max(f64::MIN_POSITIVE),
                }
            })
            .collect();
        list.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        list
    }

    fn tried(&self) -> Vec<Tried> {
        let of = |(step, round): (usize, &Vec<Trial>)| {
            let before = self.unseen[step];
            let one = |t: &Trial| Tried {
                effect: title_of(t.kind),
                joint: self.joint(),
                step,
                gain: 1.0 - t.unseen.unwrap_or(before) / before,
                gain_sigmas: 0.0,
                p_value: t.p_value,
                refused: t.refused.map_or_else(String::new, sentences::refusal),
            };
            round.iter().map(one).collect::<Vec<_>>()
        };
        self.rounds.iter().enumerate().flat_map(of).collect()
    }

    /// Returns the description with the found values.
    pub(crate) fn robot(&self, plant: &Plant) -> Robot {
        let mut robot = self.stated.robot.clone();
        robot.effects = self.stated.undriven();
        // The identification record describes the old values.
        robot.identified = None;
        robot.uncertainty = Uncertainty::default();
        let (Some(model), Some(joint)) = (self.models.last(), robot.joints.first_mut()) else {
            return robot;
        };
        let t = &model.theta;
        joint.friction = Some(JointFriction {
            coulomb: t[3],
            viscous: t[4],
            offset: t[5],
        });
        let drive = joint.drive.get_or_insert_with(|| Drive {
            gear_ratio: 1.0,
            ..Drive::default()
        });
        let square = plant.ratio * plant.ratio;
        // No part of a drive has negative inertia.
        drive.rotor_inertia = drive.rotor_inertia.min(t[0] / square);
        drive.joint_inertia = (t[0] - square * drive.rotor_inertia).max(0.0);
        // A motor's torque and voltage constants are equal in SI units.
        drive.torque_constant = t[2] / plant.ratio.abs();
        drive.resistance = Some(t[2] / t[1]);
        joint.voltage_controller = (self.controllers.first())
            .map(|shown| shown.controller)
            .or(joint.voltage_controller);
        let mut at = NOMINAL;
        for kind in &model.effects {
            let about = kind.about();
            let gains = &t[at..at + about.gains.len()];
            at += about.gains.len();
            let shapes = &t[at..at + about.shapes.len()];
            at += about.shapes.len();
            robot.effects.push(RobotEffect {
                joint: Some(self.joint()),
                other: None,
                effect: Effect::new(*kind, gains, shapes),
            });
        }
        robot
    }
}
