//! Analysis of the recorded voltages, joint by joint.

use rig_shared::effects::{Kind, Parameter, SHAPES};

use crate::acceptance::coordinates::Coordinate;
use crate::acceptance::residual_dependence::locate;
use crate::columns::candidate::Candidate;
use crate::fit::least_squares::Fit;
use crate::fit::solution::{Solution, jackknifed, solve};
use crate::fit::systematic_uncertainty::inflated;
use crate::gap::closed;
use crate::levels::SIGNIFICANT;
use crate::motor_voltage::equation::{ACROSS, CONSTANT, CURRENT, Equation, FADES, SPEED};
use crate::motor_voltage::left::Rest;
use crate::motor_voltage::remarks::{constant_off, resistance_off};
use crate::motor_voltage::winding::{DeadZone, Lack, Left, Moved, Part, Refusal, Winding};
use crate::outcome::{Detectable, Map, Place, Step, Tried, Value};
use crate::recordings::context::{DiagnosisContext, PreparedData};
use crate::recordings::noise_floor;
use crate::result::limits::smallest;
use crate::result::pictures::map;
use crate::result::places::place;
use crate::rows::regression::Column;
use crate::search::fitted_candidate::FittedCandidate;
use crate::{DiagnoseError, Options};

/// Share of the voltage's squares in the residual above which the winding's equation does not fit.
const EXPLAINED: f64 = 0.1;
/// Least RMS reduction of the voltage residual by a dead zone.
pub(crate) const LEAST_SHARE: f64 = 0.1;

/// Analyses the recorded voltages, joint by joint. Also returns the joints without a result, and why.
///
/// # Errors
/// [`DiagnoseError::Model`].
pub(crate) fn windings(
    context: &DiagnosisContext,
    prepared: &PreparedData,
    held_out: Option<&PreparedData>,
    options: &Options,
) -> Result<(Vec<Winding>, Vec<(usize, Lack)>), DiagnoseError> {
    let (mut found, mut silent) = (Vec::new(), Vec::new());
    for joint in 0..context.robot.joints.len() {
        let Some(training) = Equation::of(context.robot, joint, prepared, &options.clamped)? else {
            if (options.clamped.iter()).any(|run| run.joints[joint].voltage.is_some()) {
                silent.push((joint, Lack::ClampedAlone));
            }
            continue;
        };
        let held = match held_out {
            Some(held_out) => Equation::of(context.robot, joint, held_out, &[])?,
            None => None,
        };
        let analysis = Analysis::of(context, joint, prepared, &training, held.as_ref(), options);
        match analysis.and_then(|analysis| analysis.winding()) {
            Ok(winding) => found.push(winding),
            Err(why) => silent.push((joint, why)),
        }
    }
    Ok((found, silent))
}

/// The voltage equation of one joint's motor, fitted without a dead zone.
struct Analysis<'a> {
    context: &'a DiagnosisContext<'a>,
    /// From 0.
    joint: usize,
    training: &'a Equation,
    held: Option<&'a Equation>,
    options: &'a Options,
    /// Pairs of runs that repeat one motion.
    pairs: Vec<(usize, usize)>,
    coordinates: Vec<Coordinate>,
    /// Fit of no column.
    plain: Fit<'a>,
    /// Fit of the nominal columns.
    base: Fit<'a>,
    /// Coefficients of the nominal columns.
    before: Solution,
    /// Tried dead zones of all joints.
    trials: usize,
}

/// The final fit of a motor's voltage.
struct Fitted<'a> {
    /// Index of the dead zone in [`FADES`].
    fade: usize,
    /// The likeliest dead zone if it is accepted.
    accepted: Option<FittedCandidate>,
    /// Fit of the nominal columns, and of the dead zone if it is accepted.
    last: Fit<'a>,
    /// Coefficients of these columns.
    after: Solution,
    /// Noise floor of the voltage, V, if a motion was repeated.
    repeated: Option<f64>,
}

impl<'a> Analysis<'a> {
    /// Fits the nominal columns.
    ///
    /// # Errors
    /// Reason why nothing follows from the voltage.
    fn of(
        context: &'a DiagnosisContext<'a>,
        joint: usize,
        prepared: &PreparedData,
        training: &'a Equation,
        held: Option<&'a Equation>,
        options: &'a Options,
    ) -> Result<Self, Lack> {
        let rows = &training.rows;
        let columns: Vec<_> = rows.nominal.iter().collect();
        let first = Fit::new(rows, vec![1.0], 0.1).taking(columns.iter().copied());
        let weight = 1.0 / first.rms(0).max(f64::MIN_POSITIVE);
        let plain = Fit::new(
            rows,
            vec![weight],
            noise_floor::memory(rows, &[first.residual(0)]),
        );
        let base = plain.clone().taking(columns.iter().copied());
        let before = solve(&plain, &columns, &[]).ok_or(Lack::Inseparable)?;
        let left = (base.rms(0) / plain.rms(0)).powi(2);
        if left > EXPLAINED {
            return Err(Lack::Unexplained(left));
        }
        for (place, part) in [(CURRENT, Part::Resistance), (SPEED, Part::BackEmf)] {
            if before.values[place] <= 0.0 {
                return Err(Lack::NotPositive(part));
            }
        }
        Ok(Self {
            context,
            joint,
            training,
            held,
            options,
            pairs: noise_floor::repeats(&prepared.runs),
            coordinates: training.coordinates(),
            plain,
            base,
            before,
            trials: context.robot.joints.len() * FADES.len(),
        })
    }

    /// Returns the joint's results.
    ///
    /// # Errors
    /// As [`Self::of`].
    fn winding(&self) -> Result<Winding, Lack> {
        let (fade, likeliest) = self.likeliest();
        let refused = self.refused(likeliest.as_ref());
        let tried = self.tried(likeliest.as_ref());
        let fitted = self.fitted(fade, likeliest.filter(|_| refused.is_none()))?;
        let after = &fitted.after;
        let left = self.left(&fitted);
        let scale = self.training.torque_per_ampere / after.values[CURRENT];
        let robot = self.context.robot;
        Ok(Winding {
            joint: self.joint,
            // The constant in u is −R·i₀.
            offset: [
                -scale * after.values[CONSTANT],
                scale.abs() * after.std(CONSTANT),
            ],
            // If the equation does not hold, its coefficients are wrong.
            constant: constant_off(robot, self.joint, after).filter(|_| left.is_none()),
            resistance: resistance_off(robot, self.joint, after).filter(|_| left.is_none()),
            tried,
            refused,
            detectable: self.detectable(&fitted),
            dead_zone: (fitted.accepted.as_ref()).map(|accepted| self.dead_zone(accepted, &fitted)),
            left,
        })
    }

    /// Returns the columns of a dead zone.
    fn dead(&self, fade: usize) -> &'a [Column] {
        std::slice::from_ref(&self.training.dead_zones[fade])
    }

    /// Returns the name of the joint.
    fn name(&self) -> &'a str {
        &self.context.robot.joints[self.joint].name
    }

    /// Returns the index of the likeliest dead zone, and its fit; `None` if none is distinct.
    fn likeliest(&self) -> (usize, Option<FittedCandidate>) {
        let likeliest = (0..FADES.len())
            .filter_map(|k| {
                let own = self.base.distinct(self.dead(k))?;
                let evidence = self.base.evidence(&own, &[[0.0, f64::INFINITY]])?;
                Some((k, evidence))
            })
            .max_by(|a, b| a.1.explained.total_cmp(&b.1.explained));
        let fade = likeliest.as_ref().map_or(0, |(k, _)| *k);
        let profile = likeliest.map(|(k, evidence)| FittedCandidate {
            candidate: Candidate::on(Kind::DriveDeadzone, self.joint),
            shapes: [0.0; SHAPES],
            columns: std::sync::Arc::new(self.dead(k).to_vec()),
            evidence,
            at_bound: None,
            followed: None,
            otherwise: None,
            accepted_by_observer: false,
            near_collinear: false,
        });
        (fade, profile)
    }

    /// Returns true if the user excludes dead zones.
    fn left_out(&self) -> bool {
        self.options.without.contains(&Kind::DriveDeadzone)
    }

    /// Returns the reason why the likeliest dead zone is rejected.
    fn refused(&self, likeliest: Option<&FittedCandidate>) -> Option<Refusal> {
        match likeliest {
            _ if self.left_out() => Some(Refusal::LeftOut),
            Some(profile) => {
                (profile.refused(self.trials).map(Refusal::Evidence)).or_else(|| too_small(profile))
            }
            None => Some(Refusal::NoVoltage),
        }
    }

    /// Returns the tried dead zone, without the reason for its refusal.
    fn tried(&self, likeliest: Option<&FittedCandidate>) -> Tried {
        let evidence = likeliest.map(|p| &p.evidence);
        Tried {
            effect: Kind::DriveDeadzone.about().name.to_owned(),
            joint: self.name().to_owned(),
            step: 0,
            gain: evidence.map_or(0.0, |e| e.gain),
            gain_sigmas: evidence.map_or(0.0, |e| e.gain_sigmas),
            p_value: evidence.map_or(1.0, |e| e.corrected(self.trials)),
            refused: String::new(),
        }
    }

    /// Fits the equation with the dead zone, if it is accepted.
    fn fitted(&self, fade: usize, accepted: Option<FittedCandidate>) -> Result<Fitted<'a>, Lack> {
        let rows = &self.training.rows;
        let mut last = self.base.clone();
        if accepted.is_some() {
            last.push(&self.training.dead_zones[fade]);
        }
        let after = match accepted {
            Some(_) => {
                let memory = noise_floor::memory(rows, &[last.residual(0)]);
                let plain = self.plain.clone().clustered(memory, &self.pairs);
                let all: Vec<_> = rows.nominal.iter().chain(self.dead(fade)).collect();
                jackknifed(&plain, &[], &all, &[], &self.training.fading(fade))
                    .ok_or(Lack::Inseparable)?
            }
            None => self.before.clone(),
        };
        let repeated = noise_floor::from_repeats(rows, &self.pairs, &last.residual(0), None, 0)
            .map(|repeated| repeated.noise);
        Ok(Fitted {
            fade,
            accepted,
            last,
            after,
            repeated,
        })
    }

    /// Returns the smallest detectable dead zone, if none was accepted.
    fn detectable(&self, fitted: &Fitted) -> Option<Detectable> {
        if fitted.accepted.is_some() {
            return None;
        }
        let about = Kind::DriveDeadzone.about();
        let column = self
            .base
            .distinct(self.dead(fitted.fade))?
            .first()
            .cloned()?;
        Some(Detectable {
            effect: about.name.to_owned(),
            joint: self.name().to_owned(),
            parameter: about.gains[0].name.to_owned(),
            size: smallest(&self.base, &column, 1, self.trials)?,
            size_at_worst: None,
            unit: about.gains[0].unit.to_owned(),
        })
    }

    /// Returns the significant dependences of a residual on current and speed, the strongest first.
    fn places(&self, fit: &Fit, floor: f64) -> impl Iterator<Item = Place> {
        let places = locate(
            &self.training.rows,
            &self.coordinates,
            &fit.residual(0),
            None,
            fit.block_of_rows(),
            0,
            self.name(),
            floor,
            self.options.seed,
        );
        (places.into_iter().filter(|p| p.p_value < SIGNIFICANT)).map(|p| place(&p))
    }

    /// Returns the unexplained remainder of the voltage.
    fn left(&self, fitted: &Fitted<'a>) -> Option<Left> {
        // A dead zone too small for a name still explains its part.
        let mut known = fitted.last.clone();
        if fitted.accepted.is_none() && !self.left_out() {
            known.push(&self.training.dead_zones[fitted.fade]);
        }
        Rest {
            joint: self.name(),
            voltage: self.plain.rms(0),
            rms: [self.base.rms(0), known.rms(0)],
            floor: fitted.repeated,
        }
        .left(|| self.places(&known, fitted.repeated.unwrap_or(0.0)).next())
    }

    /// Returns the accepted dead zone with its entries in the result.
    fn dead_zone(&self, accepted: &FittedCandidate, fitted: &Fitted) -> DeadZone {
        let about = Kind::DriveDeadzone.about();
        let (before, after) = (&self.before, &fitted.after);
        let floor = fitted.repeated.unwrap_or_else(|| fitted.last.rms(0));
        let unseen = self.held.map(|held| {
            [(before, None), (after, Some(fitted.fade))]
                .map(|(solution, k)| held.rms(&solution.values, k))
        });
        let train = [self.base.rms(0), fitted.last.rms(0)];
        let at = before.values.len();
        DeadZone {
            described: (self.context.stated).holds(Kind::DriveDeadzone, self.joint),
            volts: after.values[at],
            step: Step {
                effect: about.name.to_owned(),
                law: None,
                joint: self.name().to_owned(),
                set: vec![about.name.to_owned()],
                parameters: std::iter::once((
                    about.gains[0].name.to_owned(),
                    value(after, at, &about.gains[0]),
                ))
                .collect(),
                p_value: accepted.corrected(self.trials),
                name_probability: f64::NAN,
                runner_up: None,
                runner_up_gap_closed: None,
                rms_unit: "V".to_owned(),
                train_rms: train,
                holdout_rms: unseen,
                motion_rms: None,
                gap_closed: closed(unseen.unwrap_or(train), floor),
                why: String::new(),
            },
            fade: FADES[fitted.fade],
            floor,
            places: self.places(&self.base, floor).take(1).collect(),
            moved: [(CURRENT, Part::Resistance), (SPEED, Part::BackEmf)].map(|(place, part)| {
                Moved {
                    part,
                    before: before.values[place],
                    after: [after.values[place], after.std(place)],
                }
            }),
            map: Map {
                joint: self.name().to_owned(),
                residual_unit: "V".to_owned(),
                ..map(
                    &self.training.rows,
                    &self.coordinates[ACROSS],
                    [&self.base, &fitted.last],
                    0,
                )
            },
        }
    }
}

/// Returns the reason why a small voltage step is not an inverter's: other errors of the equation are as large.
fn too_small(profile: &FittedCandidate) -> Option<Refusal> {
    let volts = profile.evidence.gains[0];
    let share = profile.evidence.gain;
    (volts < least_volts() || share < LEAST_SHARE).then_some(Refusal::Small { volts, share })
}

/// Returns the least voltage step of an inverter, V.
pub(crate) fn least_volts() -> f64 {
    Kind::DriveDeadzone.about().gains[0].range[0]
}

fn value(solution: &Solution, k: usize, volts: &Parameter) -> Value {
    let value = solution.values[k];
    Value {
        value,
        std: inflated(Kind::DriveDeadzone, volts, value, solution.std(k), 0.0),
        unit: volts.unit.to_owned(),
    }
}
