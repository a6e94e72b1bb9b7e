//! Model mismatch: residual of a right effect whose law is not exactly the rig's.

use rig_shared::effects::Kind;

use crate::columns::candidate::Candidate;
use crate::columns::kinds::{is_constant, is_gear};
use crate::fit::evidence::sigmas;
use crate::search::fitted_candidate::FittedCandidate;
use rig_model::robot::Robot;

/// Mismatch as a share of the squares that an effect removes. A law that closes 93 % of the gap leaves this share …
const SHADOW: f64 = 0.005;
/// … a Stribeck curve has other forms than the library's, and a law closes 86 % …
const SHADOW_OF_A_CURVE: f64 = 0.02;
/// … a constant and the direction of gravity have one form only: their mismatch is at standstill …
const SHADOW_OF_A_CONSTANT: f64 = 0.001;
/// … and 86 % for gears, driven by the measured motion. Harmonics of an eccentric gear's wave may reach this share;
/// they are no second effect.
const SHADOW_OF_A_GEAR: f64 = 0.02;

/// Standard deviations between blocks by which an effect exceeds another one's mismatch where that one acts little.
const CLEAR: f64 = 3.0;

/// Share of load friction's squares that position friction may mimic, if the motor's share of the inertia is unknown.
/// With half the inertia in the motor, a true one leaves a quarter.
const SHADOW_OF_AN_UNKNOWN_DRIVE: f64 = 0.4;

/// Returns true if an effect removes no more than the mismatch of another one on its joint.
pub(crate) fn in_the_shadow(robot: &Robot, chosen: &[FittedCandidate], i: usize) -> bool {
    let taken = |p: &FittedCandidate| -> Vec<f64> { p.evidence.taken().collect() };
    let own = taken(&chosen[i]);
    (chosen.iter().enumerate()).any(|(k, other)| {
        let casting = taken(other);
        let harmonic = is_harmonic(&chosen[i].candidate, &other.candidate);
        let share = match [other, &chosen[i]].map(|p| p.candidate.kind) {
            [Kind::LoadFriction, Kind::PositionFriction] if !knows_drive(robot, other) => {
                SHADOW_OF_AN_UNKNOWN_DRIVE
            }
            _ if harmonic => SHADOW_OF_A_GEAR,
            _ => shadow(other),
        };
        k != i
            && other.candidate.joint == chosen[i].candidate.joint
            && own.iter().sum::<f64>() < share * casting.iter().sum::<f64>()
            // The mismatch of a wave spreads over its turn. It is largest at its zero crossings.
            && (harmonic
                || !errs_where_it_acts(other.candidate.kind)
                || !clear(&own, &casting, share))
    })
}

/// Returns true if a gear wave is a harmonic of another one: tooth errors are no pure sine over a turn of their shaft.
/// Only orders within the search range of a shaft count.
fn is_harmonic(own: &Candidate, of: &Candidate) -> bool {
    if own.kind != Kind::GearEccentricity || !own.is_another_order(of) {
        return false;
    }
    let [Some(order), Some(first)] = [own, of].map(|c| c.order.map(f64::from_bits)) else {
        return false;
    };
    let [lowest, highest] = own.kind.about().shapes[0].range;
    let times = (order / first).round();
    (2.0..=highest / lowest).contains(&times) && (order - times * first).abs() < 1e-6 * order
}

/// Returns true if the description states the motor's share of the inertia, which no gear carries.
fn knows_drive(robot: &Robot, of: &FittedCandidate) -> bool {
    let drive = robot.joints[of.candidate.joint].drive.as_ref();
    drive.is_some_and(|d| d.joint_inertia + d.rotor_inertia > 0.0)
}

/// Returns true if a law's mismatch is proportional to its torque, as for contacts and waves. A friction curve errs
/// between its active and inactive ranges.
fn errs_where_it_acts(kind: Kind) -> bool {
    let waves = [
        Kind::Cogging,
        Kind::GearEccentricity,
        Kind::EncoderEccentricityMotor,
        Kind::EncoderEccentricityJoint,
        Kind::TorqueRipple,
    ];
    is_gear(kind) || waves.contains(&kind)
}

/// Returns true if an effect clearly exceeds the other one's mismatch in the half of the blocks where that one acts
/// least.
fn clear(own: &[f64], casting: &[f64], share: f64) -> bool {
    let mut blocks: Vec<[f64; 2]> = (own.iter().zip(casting)).map(|(o, c)| [*o, *c]).collect();
    blocks.sort_by(|a, b| a[1].total_cmp(&b[1]));
    blocks.truncate(blocks.len() / 2);
    let beyond: Vec<f64> = blocks
        .iter()
        .map(|[own, cast]| own - share * cast)
        .collect();
    sigmas(&beyond) > CLEAR
}

/// Returns the mismatch as a share of the squares that an effect removes.
pub(crate) fn shadow(of: &FittedCandidate) -> f64 {
    match of.candidate.kind {
        kind if is_gear(kind) => SHADOW_OF_A_GEAR,
        kind if is_constant(kind) || kind == Kind::GravityTilt => SHADOW_OF_A_CONSTANT,
        Kind::Stribeck | Kind::StribeckExponential => SHADOW_OF_A_CURVE,
        _ => SHADOW,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_where_the_other_does_nothing_is_no_shadow_of_it() {
        // A contact in every fourth block, and a constant effect in all.
        let loud = |k: usize| if k.is_multiple_of(4) { 100.0 } else { 0.5 };
        let casting: Vec<f64> = (0..80).map(loud).collect();
        let share = SHADOW_OF_A_GEAR;
        let whole: f64 = casting.iter().sum();
        let everywhere: Vec<f64> = (0..80).map(|k| 0.3 + 0.02 * f64::from(k % 5)).collect();
        assert!(everywhere.iter().sum::<f64>() < share * whole);
        assert!(clear(&everywhere, &casting, share));
        // The same size, but proportional to the casting effect.
        let shadow: Vec<f64> = casting.iter().map(|c| 0.9 * share * c).collect();
        assert!(!clear(&shadow, &casting, share));
        // The same size where the other is quiet, but in one block.
        let mut once = vec![0.0; 80];
        once[1] = 24.0;
        assert!(!clear(&once, &casting, share));
    }

    #[test]
    fn harmonics_of_a_gear_are_of_the_same_teeth() {
        let wave = |kind, order| Candidate::on(kind, 1).shaped(&[order, 0.0, 0.0, 0.0]);
        let gear = |order| wave(Kind::GearEccentricity, order);
        for (own, of) in [(2.0, 1.0), (3.0, 1.0), (6.0 / 45.0, 2.0 / 45.0)] {
            assert!(is_harmonic(&gear(own), &gear(of)), "{own} of {of}");
            assert!(!is_harmonic(&gear(of), &gear(own)), "{of} of {own}");
        }
        // Another shaft; and a motor's slots and poles set each of its harmonics separately.
        assert!(!is_harmonic(&gear(1.0), &gear(2.0 / 45.0)));
        assert!(!is_harmonic(&gear(3.0), &gear(2.0)));
        let cogging = |order| wave(Kind::Cogging, order);
        assert!(!is_harmonic(&cogging(24.0), &cogging(12.0)));
        let elsewhere = Candidate {
            joint: 2,
            ..gear(1.0)
        };
        assert!(!is_harmonic(&gear(2.0), &elsewhere));
    }

    #[test]
    fn friction_errs_between_where_it_acts_and_where_not() {
        for kind in [
            Kind::Backlash,
            Kind::Cogging,
            Kind::EncoderEccentricityMotor,
        ] {
            assert!(errs_where_it_acts(kind), "{kind:?}");
        }
        for kind in [Kind::Stribeck, Kind::PreslidingDahl, Kind::LoadFriction] {
            assert!(!errs_where_it_acts(kind), "{kind:?}");
        }
    }
}
