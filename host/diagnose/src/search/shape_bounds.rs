//! Bounds of a candidate's shapes that depend on the rig.

use std::f64::consts::TAU;

use rig_shared::effects::{Kind, SHAPES};

use crate::DiagnoseError;
use crate::columns::candidate::Candidate;
use crate::columns::kinds::is_gear;
use crate::levels::CLOSED_TEETH;
use crate::search::stepwise::Search;

/// Lowest link resonance on closed teeth, Hz. Softer teeth fit the motion between two contacts of a wide backlash, as a
/// spring with a small gap, and then no effect is accepted.
const SLOWEST_TEETH: f64 = 0.5 * CLOSED_TEETH;

impl Search<'_> {
    /// Returns lower and upper bounds of a candidate's shapes that depend on the rig.
    ///
    /// A gear with a link resonance above half the row rate is refused (`acceptance::credibility`). The search ends at the
    /// row rate and at critical damping there, because a stiffer gear needs many steps per sample.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn ends(&self, candidate: &Candidate) -> Result<[[f64; SHAPES]; 2], DiagnoseError> {
        let [mut least, mut most] = [[f64::NEG_INFINITY; SHAPES], [f64::INFINITY; SHAPES]];
        let (true, Some(run)) = (is_gear(candidate.kind), self.source.runs.first()) else {
            return Ok([least, most]);
        };
        let mass = self.source.mass(candidate.joint, 0)?;
        let slowest = TAU * SLOWEST_TEETH;
        let fastest = (TAU / self.source.thinning.period(run.rate)).max(2.0 * slowest);
        for (place, shape) in candidate.kind.about().shapes.iter().enumerate() {
            if candidate.kind == Kind::Backlash && shape.name == "stiffness" {
                least[place] = slowest.powi(2) * mass;
            }
            match shape.name {
                "stiffness" if mass > 0.0 => most[place] = fastest.powi(2) * mass,
                "damping" if mass > 0.0 => most[place] = 2.0 * fastest * mass,
                _ => {}
            }
        }
        Ok([least, most])
    }

    /// Returns a candidate's grid within its [`Self::ends`].
    ///
    /// # Errors
    /// [`DiagnoseError::Model`].
    pub(crate) fn grid_within(
        &self,
        candidate: &Candidate,
    ) -> Result<Vec<[f64; SHAPES]>, DiagnoseError> {
        let [_, most] = self.ends(candidate)?;
        let within =
            |point: [f64; SHAPES]| std::array::from_fn(|place| point[place].min(most[place]));
        Ok(self.grid(candidate).into_iter().map(within).collect())
    }
}
