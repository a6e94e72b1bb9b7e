//! Signs by friction, inertia and gravity, and scales by the description's values.

use nalgebra::{DMatrix, DVector};
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::{MOTOR_COLUMNS, motor_column};

use crate::DiagnoseError;
use crate::faults::columns::fault;
use crate::faults::fit::{Fit, Measured, about_mean};
use crate::faults::model::{Judge, model_error};
use crate::faults::names;
use crate::faults::rows::Rows;
use crate::faults::trial::Suspicion;
use crate::faults::undo::Undo;
use crate::outcome::About;
use rig_data::reference_scale;
use rig_identify::chain_of;
use rig_model::batch::ModelBatch;
use rig_model::robot::Joint;
use rig_output::{format_significant, format_unit};

/// Largest factor of a parameter change; units and ratios change more.
const CHANGE: f64 = 5.0;
/// Factors within this ratio of a thousand, or a thousandth, count as that: stand-in masses are wrong by as much.
const THOUSAND_APART: f64 = 2.5;
/// Least distance of a sign from zero, standard deviations.
const CLEAR: f64 = 4.0;

/// Measured over described gravity and inertia, if identifiable.
pub(crate) type Scales = (Option<Measured>, Option<Measured>);

/// Described torques of rows, joint by joint, without friction.
pub(crate) struct Described {
    pub(crate) weight: Vec<Vec<f64>>,
    /// Weight and all other torques of links and rotors.
    pub(crate) all: Vec<Vec<f64>>,
    /// The motors' columns, see [`Rows::of_motors`].
    pub(crate) motors: Vec<DMatrix<f64>>,
}

/// Returns the friction columns of a joint: its own offset, dry and viscous friction, then those of motors that move it
/// together with others.
pub(crate) fn friction(qd: &[f64], motors: Option<&DMatrix<f64>>) -> DMatrix<f64> {
    let of_motors: Vec<(&DMatrix<f64>, usize)> = motors
        .iter()
        .flat_map(|own| {
            (0..own.ncols())
                .filter(|c| c % MOTOR_COLUMNS != motor_column::INERTIA)
                .map(move |c| (*own, c))
        })
        .collect();
    DMatrix::from_fn(qd.len(), 3 + of_motors.len(), |k, c| match c {
        0 => 1.0,
        1 if qd[k] == 0.0 => 0.0,
        1 => qd[k].signum(),
        2 => qd[k],
        _ => {
            let (own, column) = of_motors[c - 3];
            own[(k, column)]
        }
    })
}

/// Returns the columns of [`friction`], then the described weight and the described inertial torque, so that their
/// coefficients are shares of the described.
pub(crate) fn columns(data: &Rows, j: usize, described: &Described) -> DMatrix<f64> {
    let (weight, all) = (&described.weight[j], &described.all[j]);
    let lost = friction(&data.qd[j], described.motors.get(j));
    let first = lost.ncols();
    DMatrix::from_fn(data.len(), first + 2, |k, c| match c.checked_sub(first) {
        None => lost[(k, c)],
        Some(0) => weight[k],
        Some(_) => all[k] - weight[k],
    })
}

impl Judge<'_> {
    /// Returns the joint's mean own inertia over its motion, as weights of the parameters.
    pub(crate) fn inertia(&self, j: usize) -> Result<DVector<f64>, DiagnoseError> {
        let mut still = self.rows.thinned(200);
        for column in still.qd.iter_mut().chain(&mut still.qdd) {
            column.fill(0.0);
        }
        let without = still.regressors(&self.form)?;
        still.qdd[j].fill(1.0);
        let with = still.regressors(&self.form)?;
        let difference = &with[j] - &without[j];
        Ok(DVector::from_fn(self.form.width(), |c, _| {
            difference.column(c).mean()
        }))
    }

    /// Returns the friction power, W, its share of the variation of torque and speed, and the joint's own inertia.
    fn senses(&self, j: usize, fit: &Fit) -> Result<(Measured, f64, Measured), DiagnoseError> {
        let qd = &self.rows.qd[j];
        let count = qd.len().max(1) as f64;
        let squares = qd.iter().map(|v| v * v).sum::<f64>() / count;
        let mut friction = DVector::zeros(self.form.width());
        friction[j * COLUMNS + column::VISCOUS] = squares;
        friction[j * COLUMNS + column::COULOMB] = qd.iter().map(|v| v.abs()).sum::<f64>() / count;
        // A coupled motor's dry friction takes power from all its joints; its column in this joint's torque stands for
        // all of it. Its viscous part is in the joints' own, but for an exchange between them, of either sign.
        let motors = self.robot.joints.len() * COLUMNS..self.form.width();
        for c in motors.skip(motor_column::COULOMB).step_by(MOTOR_COLUMNS) {
            let power = (self.matrices.iter().zip(&self.rows.qd))
                .flat_map(|(own, qd)| qd.iter().enumerate().map(move |(k, v)| own[(k, c)] * v))
                .sum::<f64>();
            friction[c] = power / count;
        }
        let loss = fit.functional(&friction);
        let varied = (about_mean(self.rows.tau[j].iter().copied()) / count).sqrt();
        let share = loss.value / (varied * squares.sqrt()).max(f64::MIN_POSITIVE);
        Ok((loss, share, fit.functional(&self.inertia(j)?)))
    }

    /// Suspects opposite senses of torque and motion if friction drives and inertia is negative.
    pub(crate) fn sign(
        &self,
        j: usize,
        described: Option<&Described>,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let Some(fit) = self.fits[j].as_ref() else {
            return Ok(None);
        };
        let (loss, share, inertia) = self.senses(j, fit)?;
        let (l, i) = (loss.sigmas(), inertia.sigmas());
        // The motion may hide one of them; the other must then be clearer.
        let both = l < -1.5 && i < -1.5 && (l + i) / core::f64::consts::SQRT_2 < -CLEAR;
        let by_friction = l < -CLEAR && share < -0.1 && i < 3.0;
        let by_inertia = i < -1.5 * CLEAR && share < -0.02 && l < 3.0;
        if !(both || by_friction || by_inertia) || fit.unexplained() > 0.5 {
            return Ok(None);
        }
        let n = j + 1;
        let (torque, position) = (Undo::Torque(Some(j), -1.0), Undo::Position(Some(j), -1.0));
        let (undo, which) = match self.scales(&self.rows, j, described).0 {
            // The reference is evidence without a description.
            _ if self.reference_against(j) => (
                position,
                format!("ref{n} runs against q{n} as well, so reverse q{n}"),
            ),
            Some(gravity) if gravity.value > 0.0 => (
                position,
                format!("gravity has the right sense, so reverse q{n}"),
            ),
            Some(_) => (
                torque,
                format!(
                    "gravity has the wrong sense too, so reverse tau{n} (where a current was recorded: i{n}, or the sign of gear_ratio)"
                ),
            ),
            None => (torque, "reverse one of them".to_owned()),
        };
        let fault = self.say(
            "sign",
            About::Torque,
            j,
            format!(
                "tau{n} and q{n} are counted in opposite senses, so one has the wrong sign: as recorded friction gives {} W and the inertia is {}, where friction takes and inertia is positive; {which}.",
                format_significant(-loss.value, 2),
                format_significant(inertia.value, 2)
            ),
        );
        Ok(Some(Suspicion::new(fault, undo)))
    }

    /// Returns true if the joint's reference runs against its position.
    pub(crate) fn reference_against(&self, j: usize) -> bool {
        let longest = self.runs.iter().max_by_key(|run| run.len());
        let joint = longest.and_then(|run| run.joints.get(j));
        let scale = joint.and_then(|own| reference_scale(&own.q_raw, own.reference.as_ref()?));
        scale.is_some_and(|s| s < 0.0)
    }

    /// Returns measured gravity and inertia over the described ones, if they are described and the motion shows them.
    pub(crate) fn scales(&self, data: &Rows, j: usize, described: Option<&Described>) -> Scales {
        let Some(described) = described.filter(|_| self.states_from(j)) else {
            return (None, None);
        };
        let x = columns(data, j, described);
        let (tau, first) = (&data.tau[j], x.ncols() - 2);
        let Some(fit) = Fit::of(&x, tau, &(0..first + 2).collect::<Vec<_>>()) else {
            return (None, None);
        };
        let shown = |c: usize| -> Option<Measured> {
            let order: Vec<usize> = (0..first + 2).filter(|o| *o != c).collect();
            let without = Fit::of(&x, tau, &order)?.unexplained();
            fit.parameter(c)
                .filter(|m| m.sigmas().abs() > 5.0 && without - fit.unexplained() > 0.05)
        };
        // A description that explains little of the torque gives no scale.
        let whole = fit.unexplained() < 0.2;
        (
            shown(first).filter(|_| whole),
            shown(first + 1).filter(|_| whole),
        )
    }

    /// Returns true if the description states all links from joint `j` outwards, which its torque moves.
    pub(crate) fn states_from(&self, j: usize) -> bool {
        let stated = |joint: &Joint| joint.inertial.as_ref().is_some_and(|i| i.mass > 0.0);
        self.robot.joints[j..].iter().all(stated)
    }

    /// Returns the described torques of these rows; `None` without rows, or if joint `j`'s torque is not described.
    pub(crate) fn stated(&self, data: &Rows, j: usize) -> Result<Option<Described>, DiagnoseError> {
        if data.len() == 0 || !self.states_from(j) {
            return Ok(None);
        }
        self.described(data).map(Some)
    }

    /// Returns the described torques of these rows.
    pub(crate) fn described(&self, data: &Rows) -> Result<Described, DiagnoseError> {
        self.described_under(data, self.robot.gravity)
    }

    /// Returns the described torques under another gravity, m/s² in frame 0.
    pub(crate) fn described_under(
        &self,
        data: &Rows,
        gravity: [f64; 3],
    ) -> Result<Described, DiagnoseError> {
        let (n, rows) = (self.robot.joints.len(), data.len());
        let mut parameters = self.robot.standard_parameters();
        for row in &mut parameters {
            row[column::VISCOUS..].fill(0.0);
        }
        let mut turned = self.robot.clone();
        turned.gravity = gravity;
        let chain = chain_of(&turned).map_err(model_error)?;
        let model = ModelBatch::new(&chain, &parameters).map_err(model_error)?;
        let (mut weight, mut all) = (vec![0.0; n * rows], vec![0.0; n * rows]);
        model.gravity(&data.q, &mut weight).map_err(model_error)?;
        model
            .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut all)
            .map_err(model_error)?;
        let split = |list: &[f64]| -> Vec<Vec<f64>> {
            (0..n)
                .map(|j| list[j * rows..(j + 1) * rows].to_vec())
                .collect()
        };
        let (weight, mut all) = (split(&weight), split(&all));
        let rotors = self.robot.motor_parameters();
        let motors = data.of_motors(&self.form)?;
        for (own, columns) in all.iter_mut().zip(&motors) {
            for (motor, rotor) in rotors.iter().enumerate() {
                let column = columns.column(motor * MOTOR_COLUMNS + motor_column::INERTIA);
                let inertia = rotor[motor_column::INERTIA];
                // A rotor that is not described adds nothing, even if its column is no number.
                if inertia != 0.0 {
                    for (to, y) in own.iter_mut().zip(column.iter()) {
                        *to += y * inertia;
                    }
                }
            }
        }
        Ok(Described {
            weight,
            all,
            motors,
        })
    }

    /// Suspects torques of several joints that are all a thousand times too large or small: no description is that
    /// wrong everywhere.
    pub(crate) fn thousandfold(&self, described: Option<&Described>) -> Option<Suspicion> {
        let mut shown = Vec::new();
        let mut weighed = false;
        for j in 0..self.robot.joints.len() {
            let (gravity, inertia) = self.scales(&self.rows, j, described);
            weighed |= gravity.is_some();
            shown.extend(gravity.or(inertia).map(|m| (j, m.value)));
        }
        let near = |unit: f64| {
            let apart = |f: f64| (f / unit).abs().ln().abs() < THOUSAND_APART.ln();
            (shown.iter()).all(|(j, f)| apart(*f) && !names::is_ratio(&self.robot.joints[*j], *f))
        };
        // A rotor that is not described makes inertia look larger, never weight.
        if shown.len() < 2 || !weighed {
            return None;
        }
        let (_, unit) = self.robot.joints[shown[0].0].kind.units();
        let unit = format_unit(unit);
        let what = match (near(1000.0), near(1e-3)) {
            (true, _) => format!("as m{unit} for {unit} or mA for A would be"),
            (_, true) => format!(
                "as k{unit} for {unit}, A for mA, or masses of the description in g would make it"
            ),
            _ => return None,
        };
        let least = shown
            .iter()
            .map(|(_, f)| f.abs())
            .fold(f64::INFINITY, f64::min);
        let most = shown.iter().map(|(_, f)| f.abs()).fold(0.0, f64::max);
        let columns: Vec<String> = shown.iter().map(|(j, _)| format!("tau{}", j + 1)).collect();
        let (last, others) = columns.split_last()?;
        let factor = if near(1000.0) { 1e-3 } else { 1000.0 };
        let fault = fault(
            self.runs,
            "unit",
            About::Torque,
            "",
            format!(
                "{} and {last} are {} to {} times what the description's gravity and inertia need, {what}; give torques in {unit}, at the joints.",
                others.join(", "),
                format_significant(least, 4),
                format_significant(most, 4)
            ),
        );
        Some(Suspicion::new(fault, Undo::Torque(None, factor)))
    }

    /// Suspects factors between recording and description that no change of the robot causes.
    pub(crate) fn against_description(
        &self,
        j: usize,
        described: Option<&Described>,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let joint = &self.robot.joints[j];
        let (gravity, inertia) = self.scales(&self.rows, j, described);
        // Drive parts that are not described make the inertia larger, never smaller.
        let complete = joint
            .drive
            .as_ref()
            .is_none_or(|d| d.rotor_inertia > 0.0 || d.joint_inertia > 0.0);
        let inertia = inertia
            .map(|m| m.value)
            .filter(|s| complete || s.abs() < 1.0);
        let large = |s: f64| !(1.0 / CHANGE..CHANGE).contains(&s.abs());
        let apart = |a: f64, b: f64| (a / b).abs().ln().abs() > f64::ln(2.5);
        let n = j + 1;
        let torque = |factor: f64, of: &str| {
            let name = names::of_torque(joint, factor);
            // Between a parameter change and a named factor an unusual robot is possible.
            (name.is_some() || !(0.125..8.0).contains(&factor.abs())).then(|| {
                // On a light last link a tool may weigh many times the link.
                let tool = match factor {
                    1.0..100.0 => ", or as a tool or payload that the description does not state would make it",
                    _ => "",
                };
                let (kind, what) = name.map_or_else(
                    || ("unit", "more than a change of the robot makes; check the torque constant, the ratio and the unit (mA for A, or mN·m for N·m, make it a thousand times as large)".to_owned()),
                    |name| (name.kind(), name.text),
                );
                let fault = self.say(
                    kind,
                    About::Torque,
                    j,
                    format!(
                        "tau{n} is {} times what the description's {of}, {what}{tool}.",
                        format_significant(factor, 4)
                    ),
                );
                Suspicion::new(fault, Undo::Torque(Some(j), 1.0 / factor))
            })
        };
        Ok(match (gravity.map(|m| m.value), inertia) {
            (Some(g), Some(i)) if large(g) && !apart(g, i) => torque(g, "gravity and inertia need"),
            (Some(g), None) if large(g) => torque(g, "gravity needs"),
            (None, Some(i)) if large(i) => torque(i, "inertia needs"),
            (Some(g), Some(i)) if !large(g) && !(0.05..20.0).contains(&(i / g).abs()) => {
                let clock = (i / g).abs().sqrt();
                let fault = self.say(
                    "clock",
                    About::Recording,
                    j,
                    format!(
                        "Gravity fits the description, but the inertia seen in the motion is {:.4} times what it states: t looks like {}, {clock:.4} of them a second, unless the inertia described is wrong, the rotor's by the square of the gear ratio among it.",
                        i / g,
                        names::of_clock(clock)
                    ),
                );
                Some(Suspicion::new(fault, Undo::Clock(1.0 / clock)))
            }
            (Some(g), _) if (-2.0..-0.5).contains(&g) && self.sign(j, described)?.is_none() => {
                let held = match self.fits[j].as_ref() {
                    Some(fit) => {
                        let (loss, _, own) = self.senses(j, fit)?;
                        loss.sigmas() > 3.0 || own.sigmas() > 3.0
                    }
                    None => false,
                };
                let which = if held {
                    format!(
                        "friction and inertia have the right sense: q{n} and tau{n} are both counted the other way round, or the zero of q{n} is half a turn off"
                    )
                } else {
                    format!("reverse tau{n} or q{n}, unless the zero of q{n} is half a turn off")
                };
                let undo = match held {
                    true => Undo::Both(j),
                    false => Undo::Torque(Some(j), -1.0),
                };
                let fault = self.say(
                    "sign",
                    About::Motion,
                    j,
                    format!(
                        "Gravity acts on joint {n} {g:.2} times as the description says; {which}."
                    ),
                );
                Some(Suspicion::new(fault, undo))
            }
            _ => None,
        })
    }
}
