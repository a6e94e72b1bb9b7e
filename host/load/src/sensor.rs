//! The load from the wrist sensor, stage by stage.

use nalgebra::{Matrix3, Rotation3};
use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::{PreprocessingPlan, Recording, surveyed};
use rig_model::robot::{Origin, Reads, Robot, WristSensor};
use rig_output::{capital, format_significant, format_value};

use crate::axes::parameters_from;
use crate::causes::{Cause, Compared, Tried, compared, explains};
use crate::changed_columns::{Columns, changed_columns};
use crate::error::LoadError;
use crate::estimate::{CERTAIN, Estimate, PLAUSIBLE_DISTANCE, Spread, Square, estimate};
use crate::faulty_rows::FaultyRows;
use crate::findings::{SensorFindings, Told};
use crate::frozen::identical_poses;
use crate::gain_error::{self, ACCURACY};
use crate::hanging::{hanging, remedy};
use crate::intake::{Intake, Sensing, judged, moving};
use crate::mounting::{Channels, Mounting};
use crate::selection::{deviation, selected};
use crate::settle::settled;
use crate::statistics::Recorded;
use crate::system::{Fit, Nuisance, Sensed, Unknowns};
use crate::units::{alternatives, named};

/// Most times that the readings are shifted by the delay found.
const MOST_SHIFTS: usize = 8;

/// Identifies the load from the wrist sensor; adds sentences to `warnings`.
///
/// # Errors
/// [`LoadError`].
pub(crate) fn by_sensor(
    sensing: &Sensing,
    warnings: &mut Vec<String>,
) -> Result<(Estimate, SensorFindings), LoadError> {
    let robot = sensing.robot;
    let sensor = robot.wrist_sensor.clone().unwrap_or_default();
    if let Some(text) = sensor.too_far() {
        if !sensing.even_if_wrong {
            return Err(LoadError::Fault(text));
        }
        warnings.push(text);
    }
    let judged = judged(sensing, &sensor)?;
    let moving = moving(sensing, &judged);
    let moving: Vec<&dyn Recording> = moving.iter().map(|r| r as &dyn Recording).collect();
    let (surveys, usable) = surveyed(&moving, robot.joints.len())?;
    let mut intake = Intake::of(sensing, &sensor, judged, surveys, &usable)?;
    warnings.extend(intake.notes());
    let pose = robot.flange_pose() * sensor.pose();
    let to_axes = parameters_from(&(pose.rotation.inverse() * robot.flange_pose()));
    warnings.extend(lower_cutoff(&mut intake, &sensor, &to_axes)?);
    let (mut delay, mut shifts) = (0.0, 0);
    let mut faulty = FaultyRows::default();
    loop {
        let mut said = Vec::new();
        let recordings = faulty.left_out(&intake, delay, &mut said)?;
        refuse_identical(&recordings, sensing, &mut said)?;
        let sensed = Sensed {
            recordings: &recordings,
            to_axes: &to_axes,
            gravity: robot.gravity.into(),
            lever: lever(&sensor),
        };
        let mut compared = compared(&sensed, &sensor)?;
        // Columns that are wrong make poses that look faulty. They are compared in a motion once its delay is known.
        let is_still = recordings.iter().all(|own| own.poses);
        let changed =
            |compared: &Compared| changed_columns(&intake, &faulty, &sensor, (&sensed, compared));
        let early = is_still.then(|| changed(&compared)).transpose()?;
        if let Some(Columns::Wrong(_, score)) = early {
            compared.columns = score;
        }
        if faulty.search(&intake, &sensed, &compared, (&sensor, delay))? {
            continue;
        }
        // The equations have a delay to first order only, so the readings are shifted by it and read again.
        if let Some(further) = compared.delay
            && shifts < MOST_SHIFTS
        {
            delay += further;
            shifts += 1;
            continue;
        }
        let columns = match early {
            Some(columns) => columns,
            None => changed_columns(&intake, &faulty, &sensor, (&sensed, &compared))?,
        };
        let beside = match faulty.channel(&sensed, &sensor) {
            Some(_) => None,
            None => wrong_columns(columns, sensing.even_if_wrong)?,
        };
        let fitted = match faulty.channel(&sensed, &sensor) {
            Some(cut) => without_cut(&sensed, &compared, sensing, cut, &mut said)?,
            None => believed(&sensed, compared, sensing, &mut said)?,
        };
        warnings.extend(said);
        warnings.extend(faulty.words(&sensed, &sensor, sensing.even_if_wrong)?);
        let found = finished(
            &sensed,
            fitted,
            sensing,
            (&sensor, delay),
            intake.plan,
            warnings,
        )?;
        warnings.extend(beside);
        return Ok(found);
    }
}

/// Returns the lever by which the noise of a sensor's moments is that of its forces, m: both go with the ranges. Without these
/// it is the distance of a plausible load.
fn lever(sensor: &WristSensor) -> f64 {
    match (sensor.force_range, sensor.moment_range) {
        (Some(force), Some(moment)) if force > 0.0 => moment / force,
        _ => PLAUSIBLE_DISTANCE,
    }
}

/// Refuses recordings of poses that have identical readings.
///
/// # Errors
/// [`LoadError::Fault`] with the poses, unless the user goes on.
fn refuse_identical(
    recordings: &[Recorded],
    sensing: &Sensing,
    warnings: &mut Vec<String>,
) -> Result<(), LoadError> {
    let gravity = sensing.robot.gravity.into();
    let mut found = (recordings.iter()).filter_map(|own| identical_poses(own, &gravity));
    match found.next() {
        Some(text) if !sensing.even_if_wrong => Err(LoadError::Fault(text)),
        text => {
            warnings.extend(text.into_iter().chain(found));
            Ok(())
        }
    }
}

/// Filters the positions lower if the robot hardly moves beside their noise, and says so.
fn lower_cutoff(
    intake: &mut Intake,
    sensor: &WristSensor,
    to_axes: &Square,
) -> Result<Option<String>, LoadError> {
    let gravity = intake.robot().gravity.into();
    let sign = sensor.reads.unwrap_or(Reads::Load).sign();
    let cutoff = intake.lower_cutoff(&|recordings| {
        let sensed = Sensed {
            recordings,
            to_axes,
            gravity,
            lever: lever(sensor),
        };
        let unknowns = Unknowns {
            tool: recordings.iter().any(|own| !own.loaded),
            ..Unknowns::default()
        };
        let fit = sensed.fit(&Mounting::of(sign), &unknowns);
        (fit.misfit(), explains(&sensed, &fit))
    })?;
    Ok(cutoff.map(|cutoff| {
        format!(
            "The robot hardly moves beside the noise of its positions; they were filtered at {} Hz. Record a livelier motion, or poses.",
            format_significant(cutoff, 3)
        )
    }))
}

/// A fit, and what it was decided on.
struct Fitted {
    fit: Fit,
    /// Exchange of channels that was put right.
    channels: Channels,
    alternatives: Vec<[Nuisance; 2]>,
    /// Scale of the moments that is an alternative, and its standard deviation.
    scale: Option<[f64; 2]>,
}

/// Decides which explanation of the readings is believed.
///
/// # Errors
/// [`LoadError::Fault`] with the causes that are no property of a sound sensor, unless the user goes on.
fn believed(
    sensed: &Sensed,
    compared: Compared,
    sensing: &Sensing,
    warnings: &mut Vec<String>,
) -> Result<Fitted, LoadError> {
    let fitted = |tried: Tried, channels: Channels| Fitted {
        fit: tried.selected.fit,
        channels,
        alternatives: tried.selected.alternatives,
        scale: tried.selected.scale,
    };
    let as_recorded = Channels::as_recorded();
    let described = compared.described;
    let is_turned = matches!(&compared.causes[..], [only] if only.cause == Cause::Turned);
    let mut causes = compared.causes;
    if causes.is_empty() {
        return Ok(fitted(described, as_recorded));
    }
    if is_turned {
        return Ok(fitted(causes.remove(0), as_recorded));
    }
    let text = match causes.first() {
        Some(own) if is_accurate(own) => format!(
            "{}. A sound sensor may do this.",
            capital(&words_of(sensed, own)[0])
        ),
        Some(own) if own.cause == Cause::Hanging => hanging_words(&own.selected.fit, sensing.robot),
        _ => fault_of(sensed, &described.selected.fit, &causes),
    };
    if !sensing.even_if_wrong && !is_accurate(&causes[0]) {
        return Err(LoadError::Fault(text));
    }
    let first = causes.remove(0);
    Ok(match first.cause.clone() {
        Cause::Channels(channels) => {
            warnings.push(format!(
                "{text} The load was identified with them put right."
            ));
            fitted(first, channels)
        }
        Cause::Turned | Cause::Hanging => {
            warnings.push(text);
            fitted(first, as_recorded)
        }
        // With a gain of its own a channel tells nothing of the load's size.
        Cause::Dead(channel) | Cause::Gain(channel) => {
            warnings.push(left_out(&text, channel));
            fitted(first, as_recorded)
        }
        // Units are not converted behind the user's back.
        Cause::Described | Cause::Scale | Cause::ScaleAndTurned | Cause::ScaleAndChannels(_) => {
            warnings.push(text);
            fitted(described, as_recorded)
        }
    })
}

/// Returns true if a cause is a gain that is no fault of the sensor.
fn is_accurate(tried: &Tried) -> bool {
    match tried.cause {
        Cause::Gain(channel) => {
            (tried.selected.fit.mounting.gains[channel] - 1.0).abs() <= ACCURACY
        }
        _ => false,
    }
}

/// Says which error of the columns explains the readings, or explains them as well as what was found.
///
/// # Errors
/// [`LoadError::Fault`] with the columns if nothing else explains the readings, unless the user goes on.
fn wrong_columns(found: Columns, even_if_wrong: bool) -> Result<Option<String>, LoadError> {
    match found {
        Columns::Silent => Ok(None),
        Columns::Wrong(text, _) if !even_if_wrong => Err(LoadError::Fault(text)),
        Columns::Wrong(text, _) | Columns::AsGood(text) => Ok(Some(text)),
    }
}

/// Returns the fit of the five channels beside one that is cut in most poses.
///
/// # Errors
/// [`LoadError::Fault`] with the channel, unless the user goes on.
fn without_cut(
    sensed: &Sensed,
    compared: &Compared,
    sensing: &Sensing,
    (channel, text): (usize, String),
    warnings: &mut Vec<String>,
) -> Result<Fitted, LoadError> {
    if !sensing.even_if_wrong {
        return Err(LoadError::Fault(text));
    }
    warnings.push(left_out(&text, channel));
    let described = &compared.described;
    let start = described.start.with_gain(channel, 0.0);
    let plain = described.selected.fit.unknowns.plain();
    let own = selected(sensed, sensed.fit(&start, &plain), &start);
    Ok(Fitted {
        fit: own.fit,
        channels: Channels::as_recorded(),
        alternatives: own.alternatives,
        scale: None,
    })
}

/// Says that a channel was left out.
fn left_out(text: &str, channel: usize) -> String {
    format!(
        "{text} The load was identified without {}.",
        WRENCH_COLUMNS[channel]
    )
}

/// Returns the described axes of the sensor in the frame of the last joint.
fn described(sensing: &Sensing, sensor: &WristSensor) -> Matrix3<f64> {
    let pose = sensing.robot.flange_pose() * sensor.pose();
    pose.rotation.to_rotation_matrix().into_inner()
}

/// Returns the load of a fit with what the readings tell beside it. `delay` is what the readings were shifted by.
fn finished(
    sensed: &Sensed,
    fitted: Fitted,
    sensing: &Sensing,
    (sensor, delay): (&WristSensor, f64),
    prepared: Option<PreprocessingPlan>,
    warnings: &mut Vec<String>,
) -> Result<(Estimate, SensorFindings), LoadError> {
    let fit = weighing(sensed, fitted.fit, sensing, sensor, warnings)?;
    let explains = explains(sensed, &fit);
    let segments = sensed.factors(&fit);
    let spread = match sensed.recordings.iter().all(|r| r.poses) {
        true => Spread::Residuals(fit.freedom().max(1.0) as usize),
        false => Spread::Segments,
    };
    let mut found = estimate(&segments, sensed_mass(&fit), spread);
    let slopes = gain_error::slopes(sensed, &fit, sensed_mass(&fit));
    let gain_error = gain_error::count(&mut found, &slopes, sensor.gain_std);
    let findings = Told {
        sensed,
        fit: &fit,
        robot: sensing.robot,
        described: &described(sensing, sensor),
        sensor,
        channels: fitted.channels,
        alternatives: fitted.alternatives,
        scale: fitted.scale,
        delay,
        explains,
        gain_error,
    };
    let pose = sensing.robot.flange_pose() * sensor.pose();
    warnings.extend(findings.implausible(&found, &pose, sensing.even_if_wrong)?);
    warnings.extend(findings.not_rigid(sensing.even_if_wrong)?);
    let findings = findings.findings(prepared, warnings);
    Ok((found, findings))
}

/// Returns the mass by a fit.
fn sensed_mass(fit: &Fit) -> f64 {
    fit.values.first().copied().unwrap_or(0.0)
}

/// Returns the fit with a positive mass, and checks the stated sense of the readings by it.
fn weighing(
    sensed: &Sensed,
    fit: Fit,
    sensing: &Sensing,
    sensor: &WristSensor,
    warnings: &mut Vec<String>,
) -> Result<Fit, LoadError> {
    weighs(sensed, &fit)?;
    if let Some(text) = exchanged_recordings(sensed, &fit) {
        if !sensing.even_if_wrong {
            return Err(LoadError::Fault(text));
        }
        warnings.push(text);
    }
    let (mass, stated) = (sensed_mass(&fit), sensor.reads);
    let start = Mounting::of(stated.unwrap_or(Reads::Load).sign());
    let hangs = match mass < 0.0 || !explains(sensed, &fit) {
        true => hanging(sensed, &fit, &start, stated.is_some()),
        false => None,
    };
    let (text, fit) = match (hangs, mass < 0.0, stated) {
        (Some(hangs), ..) => (Some(hanging_words(&hangs, sensing.robot)), hangs),
        (None, false, _) => (None, fit),
        (None, true, _) if sensed.is_of_either_sign(&fit) => {
            let reversed = sensed.upside_down(&fit.mounting);
            (None, settled(sensed, &reversed, &fit.unknowns))
        }
        (None, true, stated) => {
            let text = stated.map(|stated| wrong_sense(mass, sensed, sensing.robot, stated));
            let fit = settled(sensed, &fit.mounting.opposite(), &fit.unknowns);
            (text, fit)
        }
    };
    match text {
        Some(text) if !sensing.even_if_wrong => Err(LoadError::Fault(text)),
        text => {
            warnings.extend(text);
            Ok(fit)
        }
    }
}

/// Says that gravity points the other way than described.
fn hanging_words(fit: &Fit, robot: &Robot) -> String {
    format!(
        "Gravity points the other way than the description says, as for a robot that hangs: weight and inertia of the load agree then ({} kg). If it hangs, {}.",
        format_significant(sensed_mass(fit), 4),
        remedy(robot)
    )
}

/// Says that the readings have another sign than is stated. At rest reversed gravity is the same.
fn wrong_sense(mass: f64, sensed: &Sensed, robot: &Robot, stated: Reads) -> String {
    let [is, says] = match stated {
        Reads::Load => ["robot", "load"],
        Reads::Robot => ["load", "robot"],
    };
    let hangs = match sensed.recordings.iter().all(|own| own.poses) {
        true => format!(" If the robot hangs, {} instead.", remedy(robot)),
        false => String::new(),
    };
    format!(
        "The load would weigh {} kg: the readings have the sign of reads = \"{is}\", but {} says reads = \"{says}\". Correct it, or look for a position column with the opposite sign.{hangs}",
        format_significant(mass, 4),
        match robot.origin {
            Origin::Urdf => "--reads",
            Origin::Own => "[wrist_sensor] or --reads",
        }
    )
}

/// Refuses readings in which nothing weighs.
fn weighs(sensed: &Sensed, fit: &Fit) -> Result<(), LoadError> {
    let mass = sensed_mass(fit);
    let segments = sensed.factors(fit);
    let freedom = fit.freedom().max(1.0) as usize;
    let found = estimate(&segments, mass.abs(), Spread::Residuals(freedom));
    let std = found.std()[0];
    if mass.abs() > CERTAIN * std {
        return Ok(());
    }
    Err(LoadError::NoMass {
        why: format!(
            "it is {} ± {} kg (one standard deviation); {}",
            format_significant(mass, 3),
            format_significant(std, 2),
            match fit.unknowns.tool {
                true =>
                    "the recordings with and without the load read the same weight, so check that the load is mounted in the first and not in the second",
                false =>
                    "check that a load is mounted beyond the sensor, and record poses in which gravity has other directions in the sensor, or a heavier load",
            }
        ),
    })
}

/// Share of the load's mass from which on the recording without it carries a body of the opposite sign. A flange that carries nothing
/// gives the whole mass if the recordings are exchanged, with noise, and none if the readings have the wrong sign.
const CARRIED: f64 = 0.5;

/// Says that the sensor carries less with the load than without it. The mass of both is that of one body, whatever sign the
/// readings have.
fn exchanged_recordings(sensed: &Sensed, fit: &Fit) -> Option<String> {
    let tool = fit.unknowns.tool.then(|| sensed.tool_mass(fit))?;
    let load = sensed_mass(fit);
    (load * tool < 0.0 && tool.abs() > CARRIED * load.abs()).then(|| {
        format!(
            "The sensor carries {} kg with the load and {} kg without it: --data and --without look exchanged. Exchange them.",
            format_significant((tool + load).abs(), 4),
            format_significant(tool.abs(), 4)
        )
    })
}

/// Says why the readings do not fit, and how much better they do without it.
fn fault_of(sensed: &Sensed, described: &Fit, causes: &[Tried]) -> String {
    let rms = |fit: &Fit| {
        let [force, moment] = fit.noise;
        format!(
            "{} N and {} N·m RMS",
            format_significant(force, 3),
            format_significant(moment, 3)
        )
    };
    let words: Vec<[String; 2]> = causes.iter().map(|own| words_of(sensed, own)).collect();
    let [what, remedies] = [0, 1].map(|k| {
        let all: Vec<&str> = words.iter().map(|own| own[k].as_str()).collect();
        all.join(", or ")
    });
    let begin = match causes.first().map(|own| &own.cause) {
        Some(Cause::Channels(_) | Cause::ScaleAndChannels(_) | Cause::Dead(_) | Cause::Gain(_)) => {
            "The sensor's channels look wrong"
        }
        _ => "A rigid load does not fit forces and moments as recorded",
    };
    let best = causes.first().map_or(described, |own| &own.selected.fit);
    let figures = match sensed
        .origin(described)
        .filter(|_| explains(sensed, described))
    {
        Some(error) => format!(
            "Otherwise the readings fit only if the sensor's origin lies {} m from the described one",
            format_significant(error.norm(), 3)
        ),
        None => format!(
            "As recorded a rigid load leaves {}, put right {}",
            rms(described),
            rms(best)
        ),
    };
    format!("{begin}: {what}. {figures}. {}.", capital(&remedies))
}

/// Says what is wrong, and what mends it.
fn words_of(sensed: &Sensed, tried: &Tried) -> [String; 2] {
    let fit = &tried.selected.fit;
    match &tried.cause {
        Cause::Described => [String::new(), String::new()],
        Cause::Hanging => [
            "the robot hangs, so that gravity points the other way".to_owned(),
            "correct gravity in the description".to_owned(),
        ],
        Cause::Channels(channels) => {
            let or = match channels.is_opposite_rotation() {
                true => " (or the sensor is turned and `reads` has the other value)",
                false => "",
            };
            [format!("{}{or}", channels.words()), columns_remedy()]
        }
        Cause::Turned => [
            turned_words(tried),
            "correct the rotation of the sensor".to_owned(),
        ],
        Cause::Scale => unit_words(sensed, fit),
        Cause::Dead(channel) | Cause::Gain(channel) => gain_words(sensed, fit, *channel),
        Cause::ScaleAndChannels(channels) => {
            let [what, remedy] = unit_words(sensed, fit);
            [
                format!("{}, and {what}", channels.words()),
                format!("{}, and {remedy}", columns_remedy()),
            ]
        }
        Cause::ScaleAndTurned => {
            let [what, remedy] = unit_words(sensed, fit);
            [format!("{what}, and {}", turned_words(tried)), remedy]
        }
    }
}

/// Says how exchanged channels are mended.
fn columns_remedy() -> String {
    format!(
        "correct the columns {}, or the wiring",
        WRENCH_COLUMNS.join(" ")
    )
}

fn turned_words(tried: &Tried) -> String {
    let turn = tried.start.force.transpose() * tried.selected.fit.mounting.force;
    let sense = turn.determinant().signum();
    let angle = Rotation3::from_matrix_unchecked(turn * sense).angle();
    format!(
        "the sensor is turned by {} degrees against the description",
        format_significant(angle.to_degrees(), 3)
    )
}

/// Says what a channel reads against the five others, and what to check.
fn gain_words(sensed: &Sensed, fit: &Fit, channel: usize) -> [String; 2] {
    let name = WRENCH_COLUMNS[channel];
    let gain = match sensed.gain(fit) {
        None => format!(
            "{name} shows nothing of the load that the five others carry: it is dead, or cut in nearly all rows, or reads its noise only"
        ),
        Some(_) => {
            let std = deviation(sensed, fit, Nuisance::Gain(channel));
            format!(
                "{name} reads {} times what the load by the five others gives",
                format_value(fit.mounting.gains[channel], std)
            )
        }
    };
    [
        gain,
        format!("check the cable, the amplifier and the calibration of {name}"),
    ]
}

/// Names the unit of the moments against that of the forces, and the option that converts it.
fn unit_words(sensed: &Sensed, fit: &Fit) -> [String; 2] {
    let units = named(sensed, fit);
    let scale = fit.mounting.scale;
    if units.is_empty() {
        return [
            format!(
                "the moments are {} times those that the forces and the motion give (± one standard deviation), and no unit that is known has this factor",
                format_value(scale, scale * deviation(sensed, fit, Nuisance::Scale))
            ),
            "give forces in N and moments in N·m".to_owned(),
        ];
    }
    let [words, options] = alternatives(&units);
    [words, format!("give {options}")]
}
