//! The load from the wrist sensor, stage by stage.

use nalgebra::Matrix3;
use rig_data::WRENCH_COLUMNS;
use rig_data::prepare::{PreprocessingPlan, Recording, surveyed};
use rig_model::robot::{Reads, WristSensor};
use rig_output::format_significant;

use crate::convention::{Compared, compare, other_unit, settled};
use crate::error::LoadError;
use crate::estimate::{CERTAIN, Estimate, Spread, estimate};
use crate::findings::{SensorFindings, Told};
use crate::intake::{Intake, Sensing, judged, moving};
use crate::mounting::{Channels, Mounting};
use crate::rows::LEAST_ROWS;
use crate::selection::{Selected, selected};
use crate::system::{Fit, Nuisance, Sensed, Unknowns};

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
    let intake = Intake::of(sensing, &sensor, judged, surveys, &usable)?;
    warnings.extend(intake.notes());
    let (mut delay, mut shifts) = (0.0, 0);
    loop {
        let mut said = Vec::new();
        let recordings = intake.read(delay, &mut said)?;
        let sensed = Sensed {
            recordings: &recordings,
            to_joint: sensing.to_joint,
            gravity: robot.gravity.into(),
        };
        let fitted = fitted(&sensed, sensing, &sensor, &mut said)?;
        // The equations have a delay to first order only, so the readings are shifted by it and read again.
        if let Some(further) = sensed.delay(&fitted.fit)
            && shifts < MOST_SHIFTS
        {
            delay += further;
            shifts += 1;
            continue;
        }
        warnings.extend(said);
        return finished(
            &sensed,
            fitted,
            sensing,
            (&sensor, delay),
            intake.plan,
            warnings,
        );
    }
}

/// A fit, and what it was decided on.
struct Fitted {
    fit: Fit,
    /// Exchange of channels that was put right.
    channels: Channels,
    alternatives: Vec<[Nuisance; 2]>,
}

/// Fits the equations with the channels that are believed and the properties that the readings show.
fn fitted(
    sensed: &Sensed,
    sensing: &Sensing,
    sensor: &WristSensor,
    warnings: &mut Vec<String>,
) -> Result<Fitted, LoadError> {
    let unknowns = Unknowns {
        tool: sensed.recordings.iter().any(|r| !r.loaded),
        ..Unknowns::default()
    };
    let rows = sensed.used_rows(&unknowns);
    if (rows as usize) < LEAST_ROWS {
        return Err(LoadError::TooFew {
            rows: rows as usize,
            least: LEAST_ROWS,
        });
    }
    let sign = sensor.reads.unwrap_or(Reads::Load).sign();
    let mounting = Mounting::of(&described(sensing, sensor), sign);
    let compared = compare(sensed, &mounting, &unknowns, sensor.reads.is_some());
    let Believed {
        fit,
        start,
        channels,
    } = believed(sensed, &mounting, &unknowns, compared, sensing, warnings)?;
    let Selected { fit, alternatives } = selected(sensed, fit, &start);
    Ok(Fitted {
        fit,
        channels,
        alternatives,
    })
}

/// Returns the described axes of the sensor in the frame of the last joint.
fn described(sensing: &Sensing, sensor: &WristSensor) -> Matrix3<f64> {
    let pose = sensing.robot.last_link * sensor.pose();
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
    if let Some(words) = other_unit(sensed, &fitted.fit) {
        let text = format!(
            "A rigid load does not fit forces and moments: {words}. Forces must be in N and moments in N·m."
        );
        if !sensing.even_if_wrong {
            return Err(LoadError::Fault(text));
        }
        warnings.push(text);
    }
    let fit = weighing(sensed, fitted.fit, sensing, sensor, warnings)?;
    let segments = sensed.factors(&fit);
    let spread = match sensed.recordings.iter().all(|r| r.poses) {
        true => Spread::Residuals(fit.freedom().max(1.0) as usize),
        false => Spread::Segments,
    };
    let found = estimate(&segments, sensed_mass(&fit), spread);
    let findings = Told {
        sensed,
        fit: &fit,
        robot: sensing.robot,
        described: &described(sensing, sensor),
        sensor,
        channels: fitted.channels,
        alternatives: fitted.alternatives,
        delay,
    };
    let pose = sensing.robot.last_link * sensor.pose();
    warnings.extend(findings.implausible(&found, &pose, sensing.even_if_wrong)?);
    warnings.extend(findings.not_rigid(sensing.even_if_wrong)?);
    let findings = findings.findings(prepared, warnings);
    Ok((found, findings))
}

/// Returns the mass by a fit.
fn sensed_mass(fit: &Fit) -> f64 {
    fit.values.first().copied().unwrap_or(0.0)
}

/// Channels that are believed.
struct Believed {
    /// Fit with them.
    fit: Fit,
    /// The mounting as described, with channels put right.
    start: Mounting,
    /// Exchange of channels that was put right.
    channels: Channels,
}

/// Decides which channels are believed, and if the sensor stands turned by quarters.
fn believed(
    sensed: &Sensed,
    mounting: &Mounting,
    unknowns: &Unknowns,
    compared: Compared,
    sensing: &Sensing,
    warnings: &mut Vec<String>,
) -> Result<Believed, LoadError> {
    let as_recorded = Channels::as_recorded();
    let Some((channels, fit)) = compared.better else {
        return Ok(Believed {
            fit: sensed.fit(mounting, unknowns),
            start: mounting.clone(),
            channels: as_recorded,
        });
    };
    // Which of the two opposite wrenches is read need not be stated: the sign of the mass tells.
    let sensor = sensing.robot.wrist_sensor.as_ref();
    let reads = sensor.and_then(|sensor| sensor.reads);
    let may_be_opposite = reads.is_none() || is_opposite(&channels);
    let is_turned = channels.is_rotation() || may_be_opposite && channels.is_opposite_rotation();
    if is_turned {
        return Ok(Believed {
            fit,
            start: mounting.clone(),
            channels: as_recorded,
        });
    }
    let text = fault_of(&channels, &compared.stated, &fit);
    if !sensing.even_if_wrong {
        return Err(LoadError::Fault(text));
    }
    warnings.push(format!(
        "{text} The load was identified with them put right."
    ));
    Ok(Believed {
        fit,
        start: mounting.after(&channels),
        channels,
    })
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
    if sensed_mass(&fit) >= 0.0 {
        return Ok(fit);
    }
    if let Some(stated) = sensor.reads {
        let [is, says] = match stated {
            Reads::Load => ["robot", "load"],
            Reads::Robot => ["load", "robot"],
        };
        let text = format!(
            "The load would weigh {} kg: the readings have the sign of reads = \"{is}\", but [wrist_sensor] says reads = \"{says}\". Correct it.",
            format_significant(sensed_mass(&fit), 4)
        );
        if !sensing.even_if_wrong {
            return Err(LoadError::Fault(text));
        }
        warnings.push(text);
    }
    Ok(settled(sensed, &fit.mounting.opposite(), &fit.unknowns))
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
            "it is {} ± {} kg; record poses in which gravity has other directions in the sensor, or a heavier load",
            format_significant(mass, 3),
            format_significant(std, 2)
        ),
    })
}

/// Returns true if all six channels are reversed and nothing else.
fn is_opposite(channels: &Channels) -> bool {
    channels.force == -Matrix3::identity() && channels.moment == -Matrix3::identity()
}

/// Says which channels are wrong, and how much better the readings fit without the fault.
fn fault_of(channels: &Channels, stated: &Fit, better: &Fit) -> String {
    let rms = |fit: &Fit| {
        format!(
            "{} N and {} N·m RMS",
            format_significant(fit.noise[0], 3),
            format_significant(fit.noise[1], 3)
        )
    };
    let or = match channels.is_opposite_rotation() {
        true => " (or the sensor is turned and `reads` has the other value)",
        false => "",
    };
    format!(
        "The sensor's channels look wrong: {}{or}. As recorded a rigid load leaves {}, put right {}. Correct the columns {}, or the wiring.",
        channels.words(),
        rms(stated),
        rms(better),
        WRENCH_COLUMNS.join(" ")
    )
}
