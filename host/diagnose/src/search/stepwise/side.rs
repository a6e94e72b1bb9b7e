//! The side of a gear on which a constant acts. A gear transmits a torque on the link, but no sensor error. So load
//! friction or backlash contacts distinguish them.
//!
//! Limit: direction-dependent friction counts as a constant on the motor side.

use rig_shared::effects::Kind;

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::{is_constant, is_gear};
use crate::fit::least_squares::Fit;
use crate::search::chosen::with;
use crate::search::fitted_candidate::FittedCandidate;
use crate::search::stepwise::{Renew, Search};

/// One constant for each side.
const ON_THE_LINK: Kind = Kind::TorqueOffset;
const ELSEWHERE: Kind = Kind::CurrentOffset;
/// Standard deviations between blocks above which a side is certain.
const CERTAIN: f64 = 5.0;

impl<'a> Search<'a> {
    /// Names constants beside load friction or a gear by the side that explains more. Described constants keep their
    /// names.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn constant_side(
        &mut self,
        base: &Fit,
        chosen: &mut Vec<FittedCandidate>,
        renew: &Renew<'_, 'a>,
    ) -> Result<(), DiagnoseError> {
        self.sided.clear();
        for i in 0..chosen.len() {
            let own = chosen[i].candidate;
            let kind = match own.kind {
                ON_THE_LINK => ELSEWHERE,
                ELSEWHERE | Kind::AsymmetricCoulomb => ON_THE_LINK,
                _ => continue,
            };
            let carries = |p: &FittedCandidate| {
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
                // First refines its own columns, then its evidence beside the others.
                self.refine_all(base, &mut turned)?;
            }
            let left = |chosen: &[FittedCandidate]| with(base, chosen, None).rms(own.joint);
            let stands = turned.iter().all(|p| p.at_bound.is_none());
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

    /// Returns true if a gear excludes that this constant is of another kind.
    pub(crate) fn is_not(&self, own: &Candidate, kind: Kind) -> bool {
        is_constant(kind)
            && own.kind.acts_on_link() != kind.acts_on_link()
            && self.sided.contains(own)
    }
}
