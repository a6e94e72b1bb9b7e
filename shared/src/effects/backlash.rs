//! Backlash of a gear.

use super::about::{About, Channel, Confusion, Direction, Need, Parameter, Scale};
use super::instant::Instant;
use super::law::{GAINS, Law, MEMORY, SHAPES};
use crate::scalar::Real;

pub(super) struct Backlash;

impl Law for Backlash {
    const ABOUT: About = About {
        name: "backlash",
        law: None,
        title: "backlash of the gear",
        equation: "torque = stiffness · bend + damping · d(twist)/dt while the teeth touch, 0 within the gap; bend = twist − clamp(twist, ±gap/2), twist = θm/ratio − q",
        source: "Nordin and Gutman 2002, sec. 2; damping that never pulls, Hunt and Crossley 1975",
        channel: Channel::Transmission,
        direction: Direction::Indifferent,
        gains: &[],
        shapes: &[
            Parameter {
                name: "gap",
                unit: "rad",
                bounds: [0.0, f64::INFINITY],
                range: [1.0e-3, 0.04],
                scale: Scale::Logarithmic,
                meaning: "whole play at the joint",
            },
            Parameter {
                name: "stiffness",
                unit: "N*m/rad",
                bounds: [f64::MIN_POSITIVE, f64::INFINITY],
                range: [500.0, 2.0e4],
                scale: Scale::Logarithmic,
                meaning: "of the teeth in contact",
            },
            Parameter {
                name: "damping",
                unit: "N*m*s/rad",
                bounds: [0.0, f64::INFINITY],
                range: [0.1, 50.0],
                scale: Scale::Logarithmic,
                meaning: "of the teeth in contact",
            },
            Parameter {
                name: "link_friction",
                unit: "1",
                bounds: [0.0, 1.0],
                range: [0.0, 1.0],
                scale: Scale::Linear,
                meaning: "share of the joint's friction that acts on the link's side of the gear",
            },
        ],
        signature: "the load vanishes over an angle where its sign changes, followed by impacts",
        confused: &[
            Confusion {
                with: "presliding",
                exact: false,
                separated_by: "reversals at q = 90 degrees, where gravity closes a gap",
            },
            Confusion {
                with: "joint_elasticity",
                exact: false,
                separated_by: "small motion at q = 90 degrees, where gravity closes a gap",
            },
        ],
        needs: &[Need::Reversals(8)],
        compensable: false,
        leaves_out: "friction within the gap, a gap that varies from tooth to tooth",
    };

    #[inline(always)]
    fn terms<T: Real>(_: &[T; SHAPES], _: &mut [T; MEMORY], _: &Instant<T>) -> [T; GAINS] {
        [T::ZERO; GAINS]
    }
}

/// Returns the torque that a gear passes from motor to link, N·m: backlash, then a spring and damping in contact.
///
/// `twist` is the motor's angle over the ratio minus the joint's angle, rad, and `rate` its derivative. `gap` is the
/// whole backlash, rad; `stiffness` is in N·m/rad, `damping` in N·m·s/rad. Teeth with backlash only push; a shaft
/// without pulls too.
#[inline(always)]
pub fn transmission_torque<T: Real>(gap: T, stiffness: T, damping: T, twist: T, rate: T) -> T {
    let half = T::from_f64(0.5) * gap;
    let bend = twist - twist.clamp_to(-half, half);
    let torque = stiffness * bend + damping * rate;
    let separated = T::ZERO.lt(gap) & (torque * bend).le(T::ZERO);
    T::select(separated, T::ZERO, torque)
}
