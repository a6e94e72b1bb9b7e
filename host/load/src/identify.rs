//! The whole identification of a load: sensor, torques, or both.

use nalgebra::SymmetricEigen;
use rig_data::prepare::Recording;
use rig_identify::{chain_of, f_p_value, least_eigenvalue};
use rig_model::robot::{Load, Robot};
use rig_output::{format_p_value, format_significant, format_unit, listed};
use rig_shared::multibody::{COLUMN_NAMES, Chain, INERTIAL_PARAMETERS};

use crate::axes::parameters_from;
use crate::body::body;
use crate::cut_torque;
use crate::error::LoadError;
use crate::estimate::{
    CERTAIN, CONTRADICTS, Estimate, Parameters, Spread, Square, estimate, sizes_of,
};
use crate::findings::SensorFindings;
use crate::intake::Sensing;
use crate::known_mass::MassCheck;
use crate::limits::too_heavy;
use crate::load_friction;
use crate::missing::missing;
use crate::options::{By, LoadOptions};
use crate::result::{Agreement, LoadIdentification, NotShown, TorqueFindings, numbers, symbol};
use crate::sensor::by_sensor;
use crate::torque::{Driven, Equations, equations};

/// Standard deviation along a direction, relative to the plausible size, up to which two estimates are compared.
const COMPARED: f64 = 0.5;

/// Identifies the load at the flange from recordings with it, and recordings without it if there are any.
///
/// The sensor's equations are linear in the ten parameters (Atkeson, An & Hollerbach 1986; Swevers et al. 2007); the
/// bias of the sensor, its drift, rotation, position and delay, and a base that leans are estimated with them where the
/// data show them. By torque the ten columns of the last link
/// explain what the recordings with the load show beyond those without it (Khalil, Gautier & Lemoine 2007).
///
/// Leaves out: elasticity between flange and load, gains of several channels and crosstalk of the
/// sensor, cables that pull. At rest an error of
/// the sensor's position is an error of the centre of mass, and neither is seen.
///
/// # Errors
/// [`LoadError`].
pub fn identify_load(
    robot: &Robot,
    with: &[&dyn Recording],
    without: &[&dyn Recording],
    options: &LoadOptions,
) -> Result<LoadIdentification, LoadError> {
    let to_joint = parameters_from(&robot.flange_pose());
    let chain = chain_of(robot)?;
    let mut warnings = Vec::new();
    let sensed = sensed(robot, &chain, [with, without], options, &mut warnings)?;
    let driven = match options.by {
        By::Sensor => None,
        By::Torque | By::Both => Some(by_torque(
            &Driven {
                robot,
                with,
                without,
                to_joint: &to_joint,
                prepare: &options.prepare,
                even_if_wrong: options.even_if_wrong,
            },
            sensed.as_ref().map(|(found, _)| found.values[0]),
            &mut warnings,
        )?),
    };
    let (sensed, sensor) = sensed.unzip();
    let (driven, torque) = driven.unzip();
    let mass_checks = mass_checks(
        robot,
        [(sensed.as_ref(), By::Sensor), (driven.as_ref(), By::Torque)],
        options,
        &mut warnings,
    )?;
    if torque.as_ref().is_some_and(|torque| !torque.with_unloaded) {
        warnings.push(by_description(robot)?);
    }
    warnings.extend(torque.as_ref().and_then(unused));
    let agreement = (sensed.as_ref().zip(driven.as_ref())).map(|(a, b)| agreement(a, b));
    let contradicts = agreement.as_ref().and_then(contradiction);
    let mut found = match (sensed, driven) {
        // What contradicts each other has no mean.
        (Some(sensed), Some(_)) if contradicts.is_some() => sensed,
        (Some(a), Some(b)) => fused(&a, &b),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return Err(LoadError::TooFew { rows: 0, least: 1 }),
    };
    warnings.extend(contradicts);
    if let Some(tool) = &options.tool {
        found = without_tool(found, tool)?;
    }
    if options.by != By::Torque {
        let mass = found.values[0];
        let centre = [1, 2, 3].map(|k| found.values[k] / mass);
        warnings.extend(too_heavy(robot, &chain, with, mass, centre)?);
    }
    let not_shown = missing(robot, &chain, &to_joint, &found, options.by);
    described(
        robot,
        options.by,
        &found,
        Parts {
            sensor,
            torque,
            agreement,
            mass_checks,
            not_shown,
            warnings,
        },
    )
}

/// Compares the masses by sensor and by torques with the known one, if there is one.
///
/// # Errors
/// [`LoadError::Fault`] if the forces look like another unit, unless the user goes on.
fn mass_checks(
    robot: &Robot,
    estimates: [(Option<&Estimate>, By); 2],
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<MassCheck>, LoadError> {
    let Some(known) = options.known_mass else {
        return Ok(Vec::new());
    };
    let beside = options.tool.as_ref().map_or(0.0, |tool| tool.mass);
    let sensor = robot.wrist_sensor.clone().unwrap_or_default();
    let checked: Vec<(&Estimate, MassCheck)> = (estimates.into_iter())
        .filter_map(|(found, by)| {
            let found = found?;
            Some((found, MassCheck::of(found, by, known, beside)?))
        })
        .collect();
    let checks: Vec<MassCheck> = checked.iter().map(|(_, check)| *check).collect();
    if let [(a, sensor), (b, torque)] = &checked[..] {
        let freedom = a.degrees_of_freedom.min(b.degrees_of_freedom);
        if let Some(text) = MassCheck::both(sensor, torque, freedom) {
            warnings.push(text);
            return Ok(checks);
        }
    }
    for (found, check) in &checked {
        let centre = [1, 2, 3].map(|k| found.values[k] / found.values[0]);
        let refutes = |other| check.is_refuted_by(other, found.degrees_of_freedom);
        let confirmed = checks.iter().any(refutes);
        let places = [centre, sensor.position];
        match check.words(confirmed, places, found.degrees_of_freedom) {
            Err(LoadError::Fault(text)) if options.even_if_wrong => warnings.push(text),
            other => warnings.extend(other?),
        }
    }
    Ok(checks)
}

/// Identifies the load by the sensor, if it is wanted.
///
/// # Errors
/// [`LoadError`].
fn sensed(
    robot: &Robot,
    chain: &Chain<f64>,
    [with, without]: [&[&dyn Recording]; 2],
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Result<Option<(Estimate, SensorFindings)>, LoadError> {
    if options.by == By::Torque {
        return Ok(None);
    }
    let loaded = with.iter().map(|r| (*r, true));
    let all: Vec<(&dyn Recording, bool)> =
        loaded.chain(without.iter().map(|r| (*r, false))).collect();
    let sensing = Sensing {
        robot,
        chain,
        recordings: &all,
        prepare: &options.prepare,
        poses: options.poses,
        even_if_wrong: options.even_if_wrong,
    };
    by_sensor(&sensing, warnings).map(Some)
}

/// What is told beside the load.
struct Parts {
    sensor: Option<SensorFindings>,
    torque: Option<TorqueFindings>,
    agreement: Option<Agreement>,
    mass_checks: Vec<MassCheck>,
    not_shown: Vec<NotShown>,
    warnings: Vec<String>,
}

/// Composes the result.
fn described(
    robot: &Robot,
    by: By,
    found: &Estimate,
    parts: Parts,
) -> Result<LoadIdentification, LoadError> {
    let Parts {
        sensor,
        torque,
        agreement,
        mass_checks,
        not_shown,
        mut warnings,
    } = parts;
    let numbers = numbers(found);
    let body = body(found).ok_or_else(|| LoadError::NoMass {
        why: format!(
            "it is {} ± {} kg; {}",
            format_significant(found.values[0], 3),
            format_significant(found.std()[0], 2),
            match found.values[0] < -CERTAIN * found.std()[0] {
                true => "a negative mass is that of recordings with and without the load that were exchanged (--data, --without), or of torques with the opposite sign",
                false => "record a livelier motion, or more poses",
            }
        ),
    })?;
    let all_shown = found.shown().iter().all(|s| *s);
    let consistent = least_eigenvalue(found.values.as_slice()) > 0.0;
    if all_shown && !consistent {
        warnings.push(inconsistent(found, &body));
    }
    Ok(LoadIdentification {
        schema: "rig-load/1",
        robot: robot.name.clone(),
        by,
        parameters: numbers.parameters,
        covariance: numbers.covariance,
        mass: numbers.mass,
        centre: numbers.centre,
        inertia: numbers.inertia,
        inertia_shown: numbers.inertia_shown,
        principal_moments: numbers.principal_moments,
        principal: numbers.principal,
        principal_axes: numbers.principal_axes,
        body: Load {
            inertia_known: numbers.inertia_shown,
            ..Load::of(body.into())
        },
        consistent,
        degrees_of_freedom: found.degrees_of_freedom,
        sensor,
        torque,
        agreement,
        mass_checks,
        not_shown,
        warnings,
    })
}

/// Subtracts a known load. Where its inertia was assumed, that of the rest is not shown either.
fn without_tool(mut found: Estimate, tool: &Load) -> Result<Estimate, LoadError> {
    found.values -= Parameters::from(tool.parameters());
    let (mass, std) = (found.values[0], found.std()[0]);
    if mass < CERTAIN * std {
        return Err(LoadError::NoMass {
            why: format!(
                "the sensor or the torques show {} kg, and --subtract has {} kg, so that {} ± {} kg are left for it; check that the load is mounted, and that the file describes the tool",
                format_significant(mass + tool.mass, 4),
                format_significant(tool.mass, 4),
                format_significant(mass, 3),
                format_significant(std, 2)
            ),
        });
    }
    found.sizes = sizes_of(mass);
    if !tool.inertia_known {
        found.hide_inertia();
    }
    Ok(found)
}

/// Says which joints' torques were not used.
fn unused(torque: &TorqueFindings) -> Option<String> {
    let joints: Vec<String> = (torque.joints.iter().zip(&torque.residual))
        .filter(|(_, residual)| residual.is_none())
        .map(|(name, _)| name.clone())
        .collect();
    (!joints.is_empty()).then(|| {
        format!(
            "No torque of {} was used: the joint rests, and friction hides its torque. The other joints gave the load; a motion of all joints tells more (`rig excite --load`).",
            listed(&joints)
        )
    })
}

/// Says what the torques by a description are worth.
///
/// # Errors
/// [`LoadError::Model`]: no link of the description has a mass.
fn by_description(robot: &Robot) -> Result<String, LoadError> {
    let weighs = |link: usize| (robot.link_inertial(link)).is_some_and(|own| own.mass != 0.0);
    if !(0..robot.link_count()).any(weighs) {
        return Err(LoadError::Model(format!(
            "{} describes no link with a mass, so the torque of the robot without the load is unknown; record it (--without), or identify the robot first (`rig identify`)",
            robot.name
        )));
    }
    let doubt = match robot.identified {
        Some(_) => "its errors, as of friction near reversals, are not in the standard deviations",
        None => {
            "it was not identified (`rig identify`), and its errors, as of friction near reversals, are not in the standard deviations"
        }
    };
    Ok(format!(
        "The description gave the torque of the robot without the load; {doubt}. A recording without the load (--without) avoids this."
    ))
}

/// Says of which joints a rigid load and friction leave more than noise: half of the residual's power is not explained by
/// the noise of the torque above the band.
fn unexplained(driven: &Driven, equations: &Equations) -> Option<String> {
    let all = (driven.robot.joints.iter()).zip(equations.noise.iter().zip(&equations.floor));
    let list: Vec<String> = all
        .filter_map(|(joint, (residual, floor))| {
            let (residual, floor) = ((*residual)?, (*floor)?);
            let unit = format_unit(joint.kind.units().1);
            (residual.powi(2) > 2.0 * floor.powi(2)).then(|| {
                format!(
                    "{} {unit} RMS of {}, where noise would leave {} {unit}",
                    format_significant(residual, 3),
                    joint.name,
                    format_significant(floor, 3)
                )
            })
        })
        .collect();
    (!list.is_empty()).then(|| {
        format!(
            "The load and friction as modelled leave more of the torques than noise as that above the band: {}. The values can be wrong by more than their standard deviations. Likely causes: friction that changes with speed, position, temperature or load, contact, cables, noise of the positions, or noise of the torques that is slow.",
            listed(&list)
        )
    })
}

/// Identifies the load from joint torques; adds sentences to `warnings`. `mass` is a first guess for the plausible sizes.
fn by_torque(
    driven: &Driven,
    mass: Option<f64>,
    warnings: &mut Vec<String>,
) -> Result<(Estimate, TorqueFindings), LoadError> {
    let equations = equations(driven)?;
    let joints = &driven.robot.joints;
    warnings.extend(cut_torque::words(
        &equations.cut,
        joints,
        driven.even_if_wrong,
    )?);
    let mut mass = mass.unwrap_or(1.0);
    let mut found = estimate(&equations.segments, mass, Spread::Segments);
    // The plausible sizes follow the mass; where torques show no mass they stay those of a kilogram.
    if found.shown()[0] && found.values[0] > 0.0 {
        mass = found.values[0];
        found = estimate(&equations.segments, mass, Spread::Segments);
    }
    if !found.shown().iter().any(|s| *s) {
        return Err(LoadError::NoMass {
            why: "the joint torques show none of its parameters; record a livelier motion, or a heavier load".to_owned(),
        });
    }
    let (friction, constant) = (&equations.friction, equations.constant_friction);
    warnings.extend(load_friction::words(friction, joints, constant));
    warnings.extend(unexplained(driven, &equations));
    Ok((
        found,
        TorqueFindings {
            joints: joints.iter().map(|j| j.name.clone()).collect(),
            residual: equations.noise,
            noise: equations.floor,
            load_friction: equations.friction,
            with_unloaded: !driven.without.is_empty(),
            prepared: equations.plan,
            traces: equations.traces,
        },
    ))
}

/// Combines two estimates, each weighted by its information.
fn fused(a: &Estimate, b: &Estimate) -> Estimate {
    let sizes = a.sizes;
    let information = a.information + b.information;
    // In plausible sizes: directions that neither shows have no information.
    let scale = Square::from_diagonal(&sizes);
    let eigen = SymmetricEigen::new(scale * information * scale);
    let right = scale * (a.information * a.values + b.information * b.values);
    let (mut covariance, mut beyond) = (Square::zeros(), Square::zeros());
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let axis = eigen.eigenvectors.column(k);
        if *value > 1.0 {
            covariance += axis * axis.transpose() / *value;
        } else {
            beyond += axis * axis.transpose();
        }
    }
    Estimate {
        values: scale * (covariance * right),
        covariance: scale * covariance * scale,
        beyond: scale * beyond * scale,
        information,
        sizes,
        degrees_of_freedom: a.degrees_of_freedom.max(b.degrees_of_freedom),
    }
}

/// Compares two estimates along the directions that both show.
fn agreement(a: &Estimate, b: &Estimate) -> Agreement {
    let scale = Square::from_diagonal(&a.sizes.map(|s| 1.0 / s));
    let difference = scale * (a.values - b.values);
    let spread = scale * (a.covariance + b.covariance) * scale;
    let hidden = scale * (a.beyond + b.beyond) * scale;
    let eigen = SymmetricEigen::new(spread + hidden);
    let (mut squares, mut directions) = (0.0, 0);
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let axis = eigen.eigenvectors.column(k);
        let is_hidden = axis.dot(&(hidden * axis)) > COMPARED.powi(2);
        if *value > 0.0 && *value < COMPARED.powi(2) && !is_hidden {
            squares += axis.dot(&difference).powi(2) / value;
            directions += 1;
        }
    }
    let chance = match directions {
        0 => 1.0,
        // Hotelling's T²: both covariances come from few segments.
        _ => {
            let count = f64::from(directions);
            let freedom = a.degrees_of_freedom.min(b.degrees_of_freedom) as f64 - count + 1.0;
            let ratio = squares * freedom / (count * (freedom + count - 1.0));
            f_p_value(ratio, [count, freedom.max(1.0)]).unwrap_or(1.0)
        }
    };
    Agreement {
        chance,
        directions: directions as usize,
        by_sensor: a.values.into(),
        by_sensor_std: a.std().into(),
        by_torque: b.values.into(),
        by_torque_std: b.std().into(),
    }
}

/// Says that sensor and torques contradict each other.
fn contradiction(agreement: &Agreement) -> Option<String> {
    (agreement.chance < CONTRADICTS).then(|| {
        let apart = |k: usize| {
            let std = agreement.by_sensor_std[k].hypot(agreement.by_torque_std[k]);
            (agreement.by_sensor[k] - agreement.by_torque[k]).abs() / std.max(f64::MIN_POSITIVE)
        };
        let all = 0..INERTIAL_PARAMETERS;
        let worst = all.max_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        // Mass and first moments, and the entry of the inertia that differs most.
        let parameters: Vec<String> = (0..4)
            .chain(worst.filter(|k| *k >= 4))
            .map(|k| {
                format!(
                    "{} {} ± {} by the sensor, {} ± {} by the torques",
                    symbol(COLUMN_NAMES[k]),
                    format_significant(agreement.by_sensor[k], 4),
                    format_significant(agreement.by_sensor_std[k], 2),
                    format_significant(agreement.by_torque[k], 4),
                    format_significant(agreement.by_torque_std[k], 2)
                )
            })
            .collect();
        format!(
            "Sensor and joint torques contradict each other (probability by chance {}): {}. {}The result is that of the sensor alone. Check the units and scales of both: a torque constant that is 5 % wrong makes a mass by torque 5 % wrong.",
            format_p_value(agreement.chance),
            listed(&parameters),
            worst.map_or_else(String::new, |k| {
                format!(
                    "{} differs most, by {} standard deviations (SI units). ",
                    symbol(COLUMN_NAMES[k]),
                    format_significant(apart(k), 2)
                )
            })
        )
    })
}

/// Standard deviations up to which a value lies within its uncertainty.
const WITHIN: f64 = 2.0;

/// Says that no body has the estimated parameters, and whether one has values within their uncertainty.
fn inconsistent(found: &Estimate, body: &Parameters) -> String {
    let off = body - found.values;
    let std = found.std();
    let (worst, size) = (0..INERTIAL_PARAMETERS)
        .map(|k| (k, off[k].abs() / std[k].max(f64::MIN_POSITIVE)))
        .fold(
            (0, 0.0),
            |best, own| if own.1 > best.1 { own } else { best },
        );
    let figures = format!(
        "differs most in {} ({} instead of {} in SI units, {size:.1} standard deviations)",
        symbol(COLUMN_NAMES[worst]),
        format_significant(body[worst], 4),
        format_significant(found.values[worst], 4),
    );
    match size <= WITHIN {
        true => format!(
            "load.toml has the nearest values of a rigid body, because the estimated ones are those of none. This is within their uncertainty: it {figures}."
        ),
        false => format!(
            "No rigid body has these ten values, or values within their uncertainty. The nearest body, in load.toml, {figures}."
        ),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_contradiction_names_the_parameter_that_differs_most() {
        let by_sensor: [f64; 10] = [2.0, 0.06, -0.04, 0.2, 0.1, 0.0, 0.0, 0.1, 0.0, 0.03];
        let agreement = |at: usize| {
            let mut by_torque = by_sensor;
            by_torque[at] += 0.05;
            Agreement {
                chance: 1e-9,
                directions: 10,
                by_sensor,
                by_sensor_std: [1e-3; 10],
                by_torque,
                by_torque_std: [1e-3; 10],
            }
        };
        let inertia = contradiction(&agreement(7)).unwrap();
        assert!(
            inertia.contains("Iyy 0.1000") && inertia.contains("Iyy differs most, by 35"),
            "{inertia}"
        );
        let mass = contradiction(&agreement(0)).unwrap();
        assert!(
            mass.contains("m differs most") && !mass.contains("Iyy"),
            "{mass}"
        );
    }
}
