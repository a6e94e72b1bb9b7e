//! Parameters grouped by their action.

use super::super::chain::Chain;
use super::super::parameters::{COLUMNS, column, inertia};
use super::super::spatial::{Inertia, Symmetric3, Vector3};
use crate::lanes::Element;

/// The parameters of a joint after grouping, and those of its drive and friction.
///
/// A thin rod along the axis of a revolute joint (mass m, first moment (0, 0, mz), inertia diag(Iyy, Iyy, 0)) is not
/// affected by the joint's rotation, so it may belong to the link before. A body without mass and first moment is not
/// affected by a prismatic joint. Moving these parts from the tip to the base changes neither the torques nor the
/// inertia matrix. It removes three parameters from every revolute joint and six from every prismatic one (Gautier &
/// Khalil 1990; the grouping of customised Newton–Euler, Khalil & Kleinfinger 1987). The parts that reach the base act
/// on no joint.
#[derive(Clone, Copy, Debug)]
pub struct Body<T> {
    /// Zero if revolute.
    pub(super) mass: T,
    /// z component zero if revolute.
    pub(super) first_moment: [T; 3],
    /// Zero if prismatic; `yy` zero if revolute.
    pub(super) inertia: Symmetric3<T>,
    pub(super) drive: T,
    pub(super) viscous: T,
    pub(super) coulomb: T,
    pub(super) offset: T,
}

impl<T: Element> Body<T> {
    /// Groups the `parameters`, one row per joint of `chain`, into `bodies` (both of the chain's
    /// length), in `f64` before they are rounded.
    pub fn gather(chain: &Chain<f64>, parameters: &[[f64; COLUMNS]], bodies: &mut [Self]) {
        let nothing = Inertia {
            mass: 0.0,
            first_moment: Vector3([0.0; 3]),
            inertia: Symmetric3 {
                xx: 0.0,
                xy: 0.0,
                xz: 0.0,
                yy: 0.0,
                yz: 0.0,
                zz: 0.0,
            },
        };
        let mut handed = nothing;
        for ((joint, row), body) in chain.joints.iter().zip(parameters).zip(bodies).rev() {
            let own = inertia(row).plus(handed);
            let Vector3([mx, my, mz]) = own.first_moment;
            let i = own.inertia;
            let (kept, handed_down) = match joint.kind {
                super::super::chain::JointKind::Revolute => (
                    Inertia {
                        mass: 0.0,
                        first_moment: Vector3([mx, my, 0.0]),
                        inertia: Symmetric3 {
                            xx: i.xx - i.yy,
                            yy: 0.0,
                            ..i
                        },
                    },
                    Inertia {
                        mass: own.mass,
                        first_moment: Vector3([0.0, 0.0, mz]),
                        inertia: Symmetric3 {
                            xx: i.yy,
                            yy: i.yy,
                            ..nothing.inertia
                        },
                    },
                ),
                super::super::chain::JointKind::Prismatic => (
                    Inertia {
                        inertia: nothing.inertia,
                        ..own
                    },
                    Inertia {
                        inertia: i,
                        ..nothing
                    },
                ),
            };
            *body = Self {
                mass: T::from_f64(kept.mass),
                first_moment: kept.first_moment.0.map(T::from_f64),
                inertia: Symmetric3 {
                    xx: T::from_f64(kept.inertia.xx),
                    xy: T::from_f64(kept.inertia.xy),
                    xz: T::from_f64(kept.inertia.xz),
                    yy: T::from_f64(kept.inertia.yy),
                    yz: T::from_f64(kept.inertia.yz),
                    zz: T::from_f64(kept.inertia.zz),
                },
                drive: T::from_f64(row[column::DRIVE_INERTIA]),
                viscous: T::from_f64(row[column::VISCOUS]),
                coulomb: T::from_f64(row[column::COULOMB]),
                offset: T::from_f64(row[column::OFFSET]),
            };
            // The joint's position does not affect the parts that are passed on.
            handed = joint.transform(0.0).inertia_to_parent(handed_down);
        }
    }

    /// An empty body, to be overwritten.
    pub const NOTHING: Self = Self {
        mass: T::ZERO,
        first_moment: [T::ZERO; 3],
        inertia: Symmetric3::ZERO,
        drive: T::ZERO,
        viscous: T::ZERO,
        coulomb: T::ZERO,
        offset: T::ZERO,
    };
}
