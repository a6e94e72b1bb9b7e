//! Results of the demonstration, prepared for the page and the terminal.

use core::f64::consts::FRAC_PI_2;

use rig_shared::link::{PARAMETER_COUNT, PARAMETER_NAMES};
use rig_shared::multibody::{COLUMNS, column, gravity_vector};

use super::error::DemoError;
use super::result::Demo;
use crate::pages;
use crate::pages::{
    Context, DemoFigures, DemoParameter, Interval, OnlineEstimates, Tracking, Wire,
};
use rig_identify::Identification;
use rig_link::RecordedRun;
use rig_model::simulate::Model;
use rig_output::{format_significant, format_value};
use rig_report::{Document, Plot};

/// Meanings and units, in the order of [`PARAMETER_NAMES`].
const MEANINGS: [(&str, &str); PARAMETER_COUNT] = [
    ("inertia with the reflected rotor", "kg·m²"),
    ("gravity at q = 0", "N·m"),
    ("gravity at q = 90°", "N·m"),
    ("viscous friction", "N·m·s/rad"),
    ("Coulomb friction", "N·m"),
    ("constant torque", "N·m"),
];

/// Standard parameter columns of the six parameters, in the same order. [`gravity_factors`] converts the second and
/// third, first moments, to gravity torques.
const STANDARD: [usize; PARAMETER_COUNT] = [
    column::INERTIA + 5,
    column::FIRST_MOMENT,
    column::FIRST_MOMENT + 1,
    column::VISCOUS,
    column::COULOMB,
    column::OFFSET,
];

/// Joint torque of a unit first moment along x at q = 0, and of one along y at q = π/2, m/s².
fn gravity_factors(demo: &Demo) -> Result<[f64; 2], DemoError> {
    let model = Model::from_robot(&demo.robot)?;
    let mut factors = [0.0; 2];
    for (k, angle) in [0.0, FRAC_PI_2].into_iter().enumerate() {
        let mut unit = [0.0; COLUMNS];
        unit[column::FIRST_MOMENT + k] = 1.0;
        let mut torque = [0.0];
        gravity_vector(&model.chain, &[unit], &[angle], &mut torque)
            .map_err(rig_model::simulate::SimulateError::Multibody)?;
        factors[k] = torque[0];
    }
    Ok(factors)
}

/// Returns the six one-link parameters of an identification.
fn found(
    result: &Identification,
    factors: [f64; 2],
) -> Result<[Interval; PARAMETER_COUNT], DemoError> {
    let scale = [1.0, factors[0], factors[1], 1.0, 1.0, 1.0];
    let mut list = [Interval {
        value: 0.0,
        std: 0.0,
        low: 0.0,
        high: 0.0,
    }; PARAMETER_COUNT];
    for k in 0..PARAMETER_COUNT {
        let row = result
            .details
            .columns
            .iter()
            .position(|c| *c == STANDARD[k]);
        let parameter = row
            .and_then(|row| result.base_parameters.get(row))
            .ok_or_else(|| {
                DemoError::Sentence(format!(
                    "The motion of the demonstration did not identify {}.",
                    PARAMETER_NAMES[k]
                ))
            })?;
        let [a, b] = parameter.interval.map(|bound| bound * scale[k]);
        list[k] = Interval {
            value: parameter.value * scale[k],
            std: parameter.std * scale[k].abs(),
            low: a.min(b),
            high: a.max(b),
        };
    }
    Ok(list)
}

impl Demo {
    /// Composes the page of the demonstration.
    ///
    /// # Errors
    /// A parameter was not identified.
    pub fn page(&self, command: &str) -> Result<Document, DemoError> {
        Ok(pages::demo(&self.figures(command)?))
    }

    /// Composes the page of the diagnosis.
    ///
    /// # Errors
    /// The description cannot be written.
    pub fn diagnosis_page(&self, command: &str) -> Result<Document, DemoError> {
        let context = Context {
            command: command.to_owned(),
            identified: Some(("model.toml".into(), self.model.to_toml()?)),
            remarks: Vec::new(),
            warnings: Vec::new(),
        };
        Ok(pages::diagnosis(&self.diagnosis, &context))
    }

    /// Draws the tracking error with and without precompensation.
    pub fn picture(&self) -> Plot {
        pages::tracking_plot(&tracking(&self.without, &self.with))
    }

    fn parameters(&self) -> Result<Vec<DemoParameter>, DemoError> {
        let factors = gravity_factors(self)?;
        let (differential, integral) = (
            found(&self.differential, factors)?,
            found(&self.integral, factors)?,
        );
        let online = self
            .training
            .estimates
            .last()
            .map(|(_, estimate)| *estimate)
            .ok_or_else(|| DemoError::Sentence("The rig sent no on-line estimate.".into()))?;
        let truth = self.truth.to_array();
        Ok((0..PARAMETER_COUNT)
            .map(|k| {
                let (value, std) = (f64::from(online.value[k]), f64::from(online.std[k]));
                DemoParameter {
                    name: PARAMETER_NAMES[k].into(),
                    meaning: MEANINGS[k].0.into(),
                    unit: MEANINGS[k].1.into(),
                    truth: truth[k],
                    differential: differential[k],
                    integral: integral[k],
                    online: Interval {
                        value,
                        std,
                        low: value - 1.96 * std,
                        high: value + 1.96 * std,
                    },
                }
            })
            .collect())
    }

    fn figures(&self, command: &str) -> Result<DemoFigures, DemoError> {
        let estimates = &self.training.estimates;
        let each = |pick: fn(&rig_shared::wire::message::Estimate) -> [f32; PARAMETER_COUNT]| {
            (0..PARAMETER_COUNT)
                .map(|k| {
                    estimates
                        .iter()
                        .map(|(_, estimate)| f64::from(pick(estimate)[k]))
                        .collect()
                })
                .collect()
        };
        let received = self.losses.iter().map(|l| l.received).sum();
        let lost = self.losses.iter().map(|l| l.lost).sum();
        Ok(DemoFigures {
            robot: self.robot.clone(),
            command: command.into(),
            seconds: self.losses.iter().map(|l| l.taken as f64).sum::<f64>() / self.sample_rate,
            parameters: self.parameters()?,
            online: OnlineEstimates {
                t: estimates.iter().map(|(t, _)| *t).collect(),
                values: each(|estimate| estimate.value),
                std: each(|estimate| estimate.std),
            },
            tracking: vec![tracking(&self.without, &self.with)],
            friction: Some(self.friction_map.clone()),
            friction_text: String::new(),
            wire: Wire {
                received,
                lost,
                text: format!(
                    "In {} runs the rig took {} samples; {received} arrived and {lost} were lost.",
                    self.losses.len(),
                    self.losses.iter().map(|l| l.taken).sum::<u64>(),
                ),
            },
            holdout: self
                .differential
                .details
                .holdout_residuals
                .clone()
                .unwrap_or_default(),
            diagnosis: Some(self.diagnosis.clone()),
            beyond_model: BEYOND_MODEL.map(Into::into).into(),
            warnings: self.differential.sentences(),
            files: FILES
                .map(|(name, holds)| (name.into(), holds.into()))
                .into(),
        })
    }

    /// Short result for the terminal.
    ///
    /// # Errors
    /// A parameter was not identified.
    pub fn summary(&self) -> Result<Vec<String>, DemoError> {
        let mut lines = vec![format!(
            "{:4} {:>10}  {:>20}  {:>20}  {:>20}",
            "", "truth", "by torque", "by energy", "on-line"
        )];
        for p in self.parameters()? {
            let text = |i: Interval| format_value(i.value, i.std);
            lines.push(format!(
                "{:4} {:>10}  {:>20}  {:>20}  {:>20}  {}",
                p.name,
                format_significant(p.truth, 5),
                text(p.differential),
                text(p.integral),
                text(p.online),
                p.unit
            ));
        }
        let (without, with) = (self.without.tracking_rms(), self.with.tracking_rms());
        lines.push(format!(
            "slow reversals: {:.3} mrad rms without precompensation, {:.3} mrad with it, {:.1} times smaller",
            1e3 * without,
            1e3 * with,
            without / with,
        ));
        lines.push(format!(
            "diagnosis of the identified model: {}",
            pages::verdict(self.diagnosis.verdict)
        ));
        lines.extend(self.diagnosis.words.iter().cloned());
        Ok(lines)
    }

    /// Says whether the link moved at rest, with and without precompensation.
    pub fn at_rest(&self) -> String {
        rest_note(self.without.rest_span(), self.with.rest_span())
    }
}

/// Movement at rest that does not count as a limit cycle, rad: three counts of an encoder with 8192 counts a turn
/// behind a gear of 50. Flicker at a quantisation step is no motion.
const FLICKER: f64 = 3.0 * core::f64::consts::TAU / (8192.0 * 50.0);

/// Effects of the emulated rig that the six parameters cannot represent.
const BEYOND_MODEL: [&str; 6] = [
    "friction with memory: presliding of elastic asperities that stick and slip (generalised Maxwell slip), at rotor and link",
    "friction that decreases with speed, by another law than the fitted one",
    "a motor winding with inductance, driven by a bridge with a delay of one period",
    "12-bit converters with noise and an offset, an encoder that counts in steps",
    "a random torque at the joint, correlated over 50 ms",
    "masses and centres of mass that differ from the description by up to 30 %",
];

const FILES: [(&str, &str); 11] = [
    (
        "train.csv",
        "the excitation from which the parameters were identified",
    ),
    (
        "train-again.csv",
        "the same motion again: the difference is noise",
    ),
    ("holdout.csv", "another excitation, used only as hold-out"),
    ("sweep.csv", "constant speeds, for the friction map"),
    ("slow-without.csv", "slow reversals without precompensation"),
    ("slow-with.csv", "slow reversals with precompensation"),
    (
        "tracking.svg",
        "the tracking error with and without precompensation",
    ),
    (
        "identified.toml",
        "the description with the identified values",
    ),
    (
        "model.toml",
        "the identified description with the effects that were found",
    ),
    ("diagnosis.html", "the diagnosis of the identified model"),
    ("diagnosis.json", "the diagnosis for programs"),
];

/// Tracking errors of two runs of the same motion.
fn tracking(without: &RecordedRun, with: &RecordedRun) -> Tracking {
    let begin = without.rows.first().map_or(0.0, |row| row.t);
    let error = |run: &RecordedRun| {
        run.rows
            .iter()
            .map(|row| row.ref1 - row.q1)
            .collect::<Vec<_>>()
    };
    let (mut error_without, mut error_with) = (error(without), error(with));
    let n = without.rows.len();
    error_without.resize(n, f64::NAN);
    error_with.resize(n, f64::NAN);
    Tracking {
        motion: "slow reversals, then rest".into(),
        unit: "rad".into(),
        t: without.rows.iter().map(|row| row.t - begin).collect(),
        reference: without.rows.iter().map(|row| row.ref1).collect(),
        error_without,
        error_with,
        rms_without: without.tracking_rms(),
        rms_with: with.tracking_rms(),
        note: rest_note(without.rest_span(), with.rest_span()),
    }
}

/// Describes the motion during the rest. The random torque on the joint moves the link within its presliding range in
/// both runs. A limit cycle would move it much further than the run without precompensation does.
fn rest_note(without: f64, with: f64) -> String {
    let verdict = if with <= 2.0 * without + FLICKER {
        "no limit cycle"
    } else {
        "a limit cycle"
    };
    format!(
        "During the second half of the rest the link moves by {:.3} mrad in all with precompensation and by {:.3} mrad without it: {verdict}.",
        1e3 * with,
        1e3 * without
    )
}
