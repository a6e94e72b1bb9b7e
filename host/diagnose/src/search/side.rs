//! On which side of a gear a constant acts: a gear transmits a torque on the link and knows nothing of a sensor's error, so that
//! friction under load, or a play's touches, tell the one from the other.
//!
//! Leaves out: friction that differs with the direction, which is a constant on the motor's side here.

use rig_shared::effects::Kind;

use super::{Search, is_constant, is_gear, with};
use crate::DiagnoseError;
use crate::columns::{Candidate, Source};
use crate::fit::Fit;
use crate::profile::Profile;

/// Of effects that are one constant in the torque, one of each side.
const ON_THE_LINK: Kind = Kind::TorqueOffset;
const ELSEWHERE: Kind = Kind::CurrentOffset;
/// Standard deviations between blocks from which on a side is certain.
const CERTAIN: f64 = 5.0;

impl<'a> Search<'a> {
    /// Gives constants beside friction under load or a gear the name of the side on which they explain more. What a description
    /// states keeps its name.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn sides(
        &mut self,
        base: &Fit,
        chosen: &mut Vec<Profile>,
        renew: &dyn Fn(&[Profile]) -> Result<Source<'a>, DiagnoseError>,
    ) -> Result<(), DiagnoseError> {
        self.sided.clear();
        for i in 0..chosen.len() {
            let own = chosen[i].candidate;
            let kind = match own.kind {
                ON_THE_LINK => ELSEWHERE,
                ELSEWHERE | Kind::AsymmetricCoulomb => ON_THE_LINK,
                _ => continue,
            };
            let carries = |p: &Profile| {
                let Candidate { kind, joint, .. } = p.candidate;
                joint == own.joint && (kind == Kind::LoadFriction || is_gear(kind))
            };
            let other = Candidate { kind, ..own };
            if !chosen.iter().any(carries)
                || self.is_described(&own)
                || !self.library.contains(&other)
            {
                continue;
            }
            let mut turned = chosen.clone();
            turned[i].candidate = other;
            self.renewed(renew(&turned)?);
            for _ in 0..2 {
                // First its own columns, then what it does beside those of the others.
                self.refine_all(base, &mut turned)?;
            }
            let left = |chosen: &[Profile]| with(base, chosen, None).rms(own.joint);
            let stands = turned.iter().all(|p| p.vanished.is_none());
            if stands && left(&turned) < left(chosen) {
                std::mem::swap(chosen, &mut turned);
            } else {
                self.renewed(renew(chosen)?);
            }
            if (chosen[i].evidence).ahead_of(&turned[i].evidence) > CERTAIN {
                self.sided.push(chosen[i].candidate);
            }
        }
        Ok(())
    }

    /// Whether a gear tells that what it is called is no constant of another kind.
    pub(crate) fn is_not(&self, own: &Candidate, kind: Kind) -> bool {
        is_constant(kind)
            && own.kind.on_the_link() != kind.on_the_link()
            && self.sided.contains(own)
    }
}
