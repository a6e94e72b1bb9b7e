//! Checks of the drives, alone and together: the motors must move all joints at every allowed position.

use rig_shared::transmission::TransmissionError;

use super::ball_screw_crank::BallScrewCrank;
use super::drive::{Drive, MotorLimits};
use super::fault::{Fault, MAX_NUMBER, Requirement, Step, is_safe_magnitude, number, written};
use super::joint::Joint;
use super::serial_robot::Robot;

/// Margin around the crank's range within which a dead centre is refused, rad. There the ratio is 1 % of its maximum.
const MARGIN: f64 = 0.01;

/// Number of positions at which the Jacobian is tested, in addition to the middle position.
const TRIED: usize = 200;

fn key_path(k: usize, rest: &[Step]) -> Vec<Step> {
    let mut key_path = vec![Step::Key("joint"), Step::At(k), Step::Key("drive")];
    key_path.extend_from_slice(rest);
    key_path
}

/// Returns the first fault of the drives, if any.
pub(super) fn check_transmission(robot: &Robot) -> Result<(), Fault> {
    use Step::{Key, Name};
    for (k, joint) in robot.joints.iter().enumerate() {
        let Some(drive) = &joint.drive else { continue };
        for (name, ratio) in &drive.couples {
            let place = || key_path(k, &[Key("couples"), Name(name.clone())]);
            known(robot, &joint.name, name, "couples", place)?;
            if *name == joint.name {
                return Err(Fault {
                    key_path: place(),
                    what: format!("a joint that the drive of joint `{}` couples", joint.name),
                    found: format!("`{name}` itself"),
                    advice: "its own ratio is gear_ratio; name other joints here".into(),
                });
            }
            finite(
                &joint.name,
                name,
                *ratio,
                "motor turns per joint turn",
                place,
            )?;
        }
        if let Some(screw) = &drive.screw {
            for (name, weight) in &screw.angle {
                let place = || key_path(k, &[Key("screw"), Key("angle"), Name(name.clone())]);
                known(robot, &joint.name, name, "turns its crank by", place)?;
                finite(
                    &joint.name,
                    name,
                    *weight,
                    "turns of the crank per joint turn",
                    place,
                )?;
            }
            check_crank(robot, k, screw)?;
        }
    }
    check_jacobian(robot)
}

fn known(
    robot: &Robot,
    joint: &str,
    name: &str,
    what: &str,
    place: impl Fn() -> Vec<Step>,
) -> Result<(), Fault> {
    if robot.joint_index(name).is_some() {
        return Ok(());
    }
    let all: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    Err(Fault {
        key_path: place(),
        what: format!("a joint that the drive of joint `{joint}` {what}"),
        found: format!("`{name}`"),
        advice: format!("this robot's joints are {}", all.join(", ")),
    })
}

fn finite(
    joint: &str,
    name: &str,
    value: f64,
    unit: &str,
    place: impl Fn() -> Vec<Step>,
) -> Result<(), Fault> {
    if is_safe_magnitude(value) {
        return Ok(());
    }
    Err(Fault {
        key_path: place(),
        what: format!("the ratio of joint `{name}` in the drive of joint `{joint}`"),
        found: written(value),
        advice: format!("it must be a finite number, at most {MAX_NUMBER:e}, in {unit}"),
    })
}

/// Checks that the crank turns with its own joint, has a range, and has no dead centre within the range.
fn check_crank(robot: &Robot, k: usize, screw: &BallScrewCrank) -> Result<(), Fault> {
    use Step::Key;
    let joint = &robot.joints[k].name;
    if screw.angle.get(joint).is_none_or(|w| *w == 0.0) {
        return Err(Fault {
            key_path: key_path(k, &[Key("screw"), Key("angle")]),
            what: format!("what turns the crank of joint `{joint}`"),
            found: "other joints only".into(),
            advice: format!("its own joint must; write for instance {joint} = 1.0"),
        });
    }
    let Some([low, high]) = screw.range.or_else(|| robot.crank_box(screw)) else {
        return Err(Fault {
            key_path: key_path(k, &[Key("screw")]),
            what: format!("the range of the crank of joint `{joint}`"),
            found: "not given".into(),
            advice: "a screw's length does not say which of two angles its crank has; give range = [lowest, highest] in rad, or the position limits of its joints".into(),
        });
    };
    // Dead centres repeat every half turn.
    let half = std::f64::consts::PI;
    let first = screw.dead_centre();
    let next = first + half * ((low - MARGIN - first) / half).ceil();
    if next <= high + MARGIN {
        return Err(Fault {
            key_path: key_path(k, &[Key("screw")]),
            what: format!("the ratio of the screw of joint `{joint}`"),
            found: format!("0 where its crank is at {next:.4} rad, a dead centre in its range {low:.4} to {high:.4}"),
            advice: "no motor torque reaches the joint there; correct crank and anchor, or give a range without it".into(),
        });
    }
    Ok(())
}

/// Checks that the motors together move all joints, at the middle position and at positions spread over the range.
fn check_jacobian(robot: &Robot) -> Result<(), Fault> {
    let n = robot.joints.len();
    let refuse = |error: TransmissionError, q: &[f64]| {
        let (k, what) = match error {
            TransmissionError::Singular { motor }
            | TransmissionError::OwnRatioZero { motor }
            | TransmissionError::NotFinite { motor, .. }
            | TransmissionError::NoLead { motor }
            | TransmissionError::NoScrew { motor } => (
                motor,
                format!("the drive of joint `{}`", robot.joints[motor].name),
            ),
            _ => (0, "the drives of the robot".to_owned()),
        };
        let shown: Vec<String> = q.iter().map(|x| format!("{x:.3}")).collect();
        Err(Fault {
            key_path: key_path(k, &[]),
            what,
            found: format!("singular at joint positions [{}]", shown.join(", ")),
            advice: "the motors must move every joint, each in a way of its own; correct its ratios (couples, gear_ratio) or its screw".into(),
        })
    };
    if robot.joints.iter().all(|j| j.drive.is_none()) {
        return Ok(());
    }
    let middle = robot.middle_position();
    let transmission = match robot.transmission() {
        Ok(transmission) => transmission,
        Err(error) => return refuse(error, &middle),
    };
    let tries = if transmission.is_constant() { 0 } else { TRIED };
    let mut qd = vec![0.0; n];
    for draw in 0..=tries {
        let q = if draw == 0 {
            middle.clone()
        } else {
            spread(robot, &middle, draw)
        };
        if let Err(error) = transmission.joint_velocity(&q, &vec![1.0; n], &mut qd) {
            return refuse(error, &q);
        }
    }
    Ok(())
}

/// Returns position `draw` of an even sequence over the limits (Roberts 2018: powers of the generalised golden ratio).
/// Shifts it so that every crank stays within its range.
fn spread(robot: &Robot, middle: &[f64], draw: usize) -> Vec<f64> {
    let n = middle.len();
    let mut golden = 2.0f64;
    for _ in 0..40 {
        golden = (1.0 + golden).powf(1.0 / (n as f64 + 1.0));
    }
    let mut q: Vec<f64> = middle
        .iter()
        .zip(&robot.joints)
        .enumerate()
        .map(|(j, (&mid, joint))| {
            let share = (0.5 + draw as f64 * golden.powi(-(j as i32 + 1))).fract();
            match joint.limits.as_ref().map(|l| l.position) {
                Some([low, high]) if low.is_finite() && high.is_finite() => {
                    low + share * (high - low)
                }
                _ => mid + share - 0.5,
            }
        })
        .collect();
    for (k, joint) in robot.joints.iter().enumerate() {
        let Some(screw) = joint.drive.as_ref().and_then(|d| d.screw.as_ref()) else {
            continue;
        };
        let Some([low, high]) = screw.range.or_else(|| robot.crank_box(screw)) else {
            continue;
        };
        let own = screw.angle.get(&joint.name).copied().unwrap_or(1.0);
        let now = screw.offset
            + screw
                .angle
                .iter()
                .filter_map(|(name, w)| robot.joint_index(name).map(|j| w * q[j]))
                .sum::<f64>();
        q[k] += (now.clamp(low, high) - now) / own;
    }
    q
}

/// Checks a drive on its own. [`check_transmission`] checks the drives together.
pub(super) fn check_drive(joint: &Joint, drive: &Drive) -> Result<(), Fault> {
    check_ratio(joint, drive)?;
    check_numbers(joint, drive)?;
    if let Some(limits) = &drive.limits {
        check_motor_limits(joint, limits)?;
    }
    match &drive.screw {
        Some(screw) => check_screw(joint, screw),
        None => Ok(()),
    }
}

/// Returns the way from a joint to a key of its drive.
fn of_drive(key: &'static str) -> [Step; 2] {
    [Step::Key("drive"), Step::Key(key)]
}

/// Checks that either a gear ratio or a screw moves the joint.
fn check_ratio(joint: &Joint, drive: &Drive) -> Result<(), Fault> {
    if drive.screw.is_none() {
        number(
            joint,
            &of_drive("gear_ratio"),
            "gear ratio",
            "motor turns per joint turn",
            Requirement::NotZero,
            drive.gear_ratio,
        )?;
    } else if drive.gear_ratio != 0.0 {
        return Err(Fault {
            key_path: of_drive("gear_ratio").to_vec(),
            what: format!("the gear ratio of joint `{}`", joint.name),
            found: drive.gear_ratio.to_string(),
            advice: "a screw moves this joint ([joint.drive.screw]); leave gear_ratio out".into(),
        });
    }
    Ok(())
}

/// Checks the single numbers of motor, gear and encoder.
fn check_numbers(joint: &Joint, drive: &Drive) -> Result<(), Fault> {
    use Requirement::{Finite, NotNegative, Positive};
    let numbers = [
        ("zero", "motor zero", "rad", Finite, drive.zero),
        (
            "rotor_inertia",
            "rotor inertia",
            "kg·m²",
            NotNegative,
            drive.rotor_inertia,
        ),
        (
            "joint_inertia",
            "drive inertia seen at the joint",
            "kg·m² (kg where prismatic)",
            Finite,
            drive.joint_inertia,
        ),
        (
            "coulomb",
            "Coulomb friction of the motor",
            "N·m, on the motor side",
            NotNegative,
            drive.coulomb,
        ),
        (
            "viscous",
            "viscous friction of the motor",
            "N·m·s/rad, on the motor side",
            NotNegative,
            drive.viscous,
        ),
        (
            "torque_constant",
            "torque constant",
            "N·m/A",
            NotNegative,
            drive.torque_constant,
        ),
    ];
    for (key, what, unit, requirement, value) in numbers {
        number(joint, &of_drive(key), what, unit, requirement, value)?;
    }
    let optional = [
        ("resistance", "Ω", drive.resistance),
        ("inductance", "H", drive.inductance),
        (
            "encoder_counts_per_rev",
            "counts per motor turn",
            drive.encoder_counts_per_rev,
        ),
        (
            "duty_full_scale",
            "units of the duty column",
            drive.duty_full_scale,
        ),
    ];
    for (key, unit, value) in optional {
        if let Some(v) = value {
            number(joint, &of_drive(key), key, unit, Positive, v)?;
        }
    }
    Ok(())
}

/// Checks the limits of a motor.
fn check_motor_limits(joint: &Joint, limits: &MotorLimits) -> Result<(), Fault> {
    use Step::Key;
    let key_path = |key| [Key("drive"), Key("limits"), Key(key)];
    for (key, what, unit, value) in [
        (
            "velocity",
            "speed limit of the motor",
            "rad/s",
            limits.velocity,
        ),
        ("torque", "torque limit of the motor", "N·m", limits.torque),
    ] {
        if let Some(value) = value {
            number(
                joint,
                &key_path(key),
                what,
                unit,
                Requirement::Positive,
                value,
            )?;
        }
    }
    match limits.position {
        Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => Err(Fault {
            key_path: key_path("position").to_vec(),
            what: format!("the range of the motor of joint `{}`", joint.name),
            found: format!("[{low}, {high}]"),
            advice: "it must be [lowest, highest], two finite numbers in rad of the motor".into(),
        }),
        _ => Ok(()),
    }
}

/// Checks the numbers of a screw.
fn check_screw(joint: &Joint, screw: &BallScrewCrank) -> Result<(), Fault> {
    use Requirement::{Finite, NotZero, Positive};
    use Step::{At, Key};
    let key_path = |k| [Key("drive"), Key("screw"), Key(k)];
    number(
        joint,
        &key_path("lead"),
        "lead of the screw",
        "m per motor turn",
        NotZero,
        screw.lead,
    )?;
    number(
        joint,
        &key_path("crank"),
        "crank of the screw",
        "m",
        Positive,
        screw.crank,
    )?;
    for (i, v) in screw.anchor.iter().enumerate() {
        let key_path = [Key("drive"), Key("screw"), Key("anchor"), At(i)];
        number(joint, &key_path, "anchor of the screw", "m", Finite, *v)?;
    }
    number(
        joint,
        &key_path("offset"),
        "crank's offset",
        "rad",
        Finite,
        screw.offset,
    )?;
    if let Some([low, high]) = screw.range
        && !(low.is_finite() && high.is_finite() && low < high)
    {
        return Err(Fault {
            key_path: key_path("range").to_vec(),
            what: format!("the range of the crank of joint `{}`", joint.name),
            found: format!("[{low}, {high}]"),
            advice: "it must be [lowest, highest], two finite angles in rad".into(),
        });
    }
    Ok(())
}
