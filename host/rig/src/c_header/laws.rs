//! The laws of effects in C: the torque per unit of each gain, as `rig_shared::effects` has it in Rust.

use rig_shared::effects::Kind;

/// Presliding by Dahl, exact over a period of constant velocity.
const DAHL: &str = "const rig_real travel = at->velocity * at->period;
const rig_real ratio = rig_friction_ratio(at);
if (travel != 0) {
    const rig_real goal = travel > 0 ? ratio : -ratio;
    m[0] = goal + (m[0] - goal) * RIG_EXP(-RIG_ABS(travel) / (s[0] * ratio));
}
h[0] = m[0] / ratio - at->direction;";

/// Presliding by Canudas de Wit and others, exact over a period of constant velocity.
const LUGRE: &str = "const rig_real travel = at->velocity * at->period;
const rig_real ratio = rig_friction_ratio(at);
const rig_real speed = at->velocity / s[2];
const rig_real level = 1 + s[1] * RIG_EXP(-speed * speed);
if (travel != 0) {
    const rig_real goal = travel > 0 ? level * ratio : -level * ratio;
    m[0] = goal + (m[0] - goal) * RIG_EXP(-RIG_ABS(travel) / (s[0] * level * ratio));
}
h[0] = m[0] / ratio - at->direction;
h[1] = at->velocity - RIG_ABS(at->velocity) * (m[0] / ratio) / level;";

/// Presliding by elements that slip one after the other.
const MAXWELL: &str = "const rig_real travel = at->velocity * at->period;
const rig_real ratio = rig_friction_ratio(at);
rig_real yield_at = s[0];
for (int k = 3; k >= 0; --k) {
    m[k] += travel / yield_at;
    if (m[k] > ratio) m[k] = ratio;
    if (m[k] < -ratio) m[k] = -ratio;
    h[k] = m[k] / ratio - at->direction;
    yield_at /= 2;
}";

/// Viscous friction that falls with the heat of the joint, by the implicit Euler method; what the last digit loses is kept.
const HEAT: &str = "const rig_real share = at->period / (s[0] + at->period);
const rig_real more = (at->friction * at->velocity - m[0]) * share + m[1];
const rig_real next = m[0] + more;
m[1] = more - (next - m[0]);
m[0] = next;
h[0] = -at->velocity * next;";

/// Returns the lines of a law, which set `h[0]` to `h[3]` from shapes `s`, hidden state `m` and instant `at`; none for an effect
/// that is no torque of the joint.
pub(super) fn law(kind: Kind) -> Option<&'static str> {
    Some(match kind {
        Kind::Stribeck => {
            "const rig_real ratio = at->velocity / s[0];
h[0] = RIG_EXP(-ratio * ratio) * at->direction;"
        }
        Kind::StribeckExponential => {
            "h[0] = RIG_EXP(-RIG_ABS(at->velocity / s[0])) * at->direction;"
        }
        Kind::AsymmetricCoulomb => "h[0] = at->direction * at->direction;",
        Kind::QuadraticDrag => "h[0] = at->velocity * RIG_ABS(at->velocity);",
        Kind::LoadFriction => "h[0] = RIG_ABS(at->load + s[0] * at->friction) * at->direction;",
        Kind::PositionFriction => {
            "h[0] = RIG_COS(s[0] * at->position) * at->direction;
h[1] = RIG_SIN(s[0] * at->position) * at->direction;"
        }
        Kind::PreslidingDahl => DAHL,
        Kind::PreslidingLugre => LUGRE,
        Kind::PreslidingMaxwell => MAXWELL,
        Kind::ViscousWarmupTime => "h[0] = -at->velocity * (1 - RIG_EXP(-at->time / s[0]));",
        Kind::ViscousWarmupTemperature => "h[0] = -at->velocity * at->temperature_rise;",
        Kind::ViscousWarmupHeat => HEAT,
        Kind::Cogging | Kind::GearEccentricity => {
            "h[0] = RIG_COS(s[0] * at->motor_angle);
h[1] = RIG_SIN(s[0] * at->motor_angle);"
        }
        Kind::TorqueRipple => {
            "h[0] = at->drive_torque * RIG_COS(s[0] * at->motor_angle);
h[1] = at->drive_torque * RIG_SIN(s[0] * at->motor_angle);"
        }
        Kind::Spring => {
            "h[0] = at->position;
h[1] = 1;"
        }
        Kind::TorqueOffset => "h[0] = 1;",
        Kind::TorqueSaturation => "h[0] = at->drive_torque * at->drive_torque * at->drive_torque;",
        Kind::InertiaCoupling => {
            "h[0] = at->other_acceleration;
h[1] = at->other_velocity * at->other_velocity;
h[2] = at->other_velocity;"
        }
        // Of the gravity and the mass of the model.
        Kind::GravityTilt | Kind::Payload => return None,
        // Readings, voltages, and parts between motor and link.
        Kind::Backlash
        | Kind::JointElasticity
        | Kind::EncoderEccentricityMotor
        | Kind::EncoderEccentricityJoint
        | Kind::CurrentOffset
        | Kind::MeasurementDelay
        | Kind::DriveDeadzone => return None,
    })
}
