//! A search that begins with the effects of a description.

use std::sync::Arc;

use super::{Profile, STAYS, Search, in_the_shadow};
use crate::diagnose::DiagnoseError;
use crate::diagnose::columns::{Candidate, Source};
use crate::diagnose::fit::{Evidence, Fit};
use crate::diagnose::profile::{LEAST_GAIN, LEAST_SIGMAS};
use crate::diagnose::stated::{candidate, is_one};

impl<'a> Search<'a> {
    /// Whether an effect is one that the description states.
    pub(in crate::diagnose) fn is_described(&self, effect: &Candidate) -> bool {
        self.described.iter().any(|placed| is_one(placed, effect))
    }

    /// How many of the effects, those of the description first, it states.
    pub(in crate::diagnose) fn count_described(&self, chosen: &[Profile]) -> usize {
        let described = |p: &&Profile| self.is_described(&p.candidate);
        chosen.iter().take_while(described).count()
    }

    /// The effects of the description, refined from its shapes, as far as they stand.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(super) fn begun(
        &mut self,
        base: &Fit,
        renew: &dyn Fn(&[Profile]) -> Result<Source<'a>, DiagnoseError>,
    ) -> Result<Vec<Profile>, DiagnoseError> {
        let mut chosen = Vec::new();
        for placed in &self.described {
            let (candidate, shapes) = (candidate(placed), placed.effect.shapes);
            chosen.push(Profile {
                columns: Arc::new(self.source.columns(&candidate, &shapes)?),
                candidate,
                shapes,
                evidence: Evidence::default(),
                vanished: None,
            });
        }
        if chosen.is_empty() {
            return Ok(chosen);
        }
        for _ in 0..2 {
            // Load and inertia as they are with the effects in.
            self.renewed(renew(&chosen)?);
            self.refine_all(base, &mut chosen)?;
        }
        self.standing(base, &mut chosen)?;
        Ok(chosen)
    }

    /// Drops what no longer stands by itself; gives what has vanished. What the description states needs no least size, and
    /// is no stand-in for being small beside another.
    pub(super) fn standing(
        &self,
        base: &Fit,
        chosen: &mut Vec<Profile>,
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        let mut vanished = Vec::new();
        let mut i = 0;
        while i < chosen.len() {
            let e = &chosen[i].evidence;
            let unsure = e.p_value > STAYS || e.gain_sigmas < LEAST_SIGMAS;
            let weak = if self.is_described(&chosen[i].candidate) {
                unsure
            } else {
                chosen.len() > 1
                    && (unsure || e.joint_gain < LEAST_GAIN || in_the_shadow(chosen, i))
            };
            if weak || chosen[i].vanished.is_some() {
                let gone = chosen.remove(i);
                vanished.extend(gone.vanished.map(|_| gone.candidate));
                self.refine_all(base, chosen)?;
                i = 0;
            } else {
                i += 1;
            }
        }
        Ok(vanished)
    }
}
