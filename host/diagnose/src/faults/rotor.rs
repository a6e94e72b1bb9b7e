//! A described rotor with more inertia than the whole joint.
//!
//! A rotor acts on its joint by the square of the gear ratio. With a recorded current, a ratio k times too large makes
//! torque and all inertia k times too large, but the described rotor k² times. For a large k it exceeds the inertia of
//! the whole joint. No change of links, friction or payload does that, only a wrong description of the rotor.
//!
//! Leaves out: motors that move several joints; ratios that are too small, which make the rotor lighter.

use crate::DiagnoseError;
use crate::faults::finding::Fault;
use crate::faults::judge::Judge;
use crate::faults::misfit::Misfit;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;

/// Least ratio of the rotor's inertia to that of the whole joint.
const HEAVIER: f64 = 1.5;
/// Least difference of both, in standard deviations of the joint's inertia.
const CLEAR: f64 = 5.0;
/// Largest residual share of the torque's variance.
const LEFT: f64 = 0.2;

impl Judge<'_> {
    /// Suspects a described rotor of joint `j` that exceeds the joint.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn heavy_rotor(&self, j: usize) -> Result<Option<Suspicion>, DiagnoseError> {
        let joint = &self.robot.joints[j];
        let alone = (self.robot.joints.iter().filter_map(|j| j.drive.as_ref()))
            .all(|drive| drive.couples.is_empty());
        let Some((drive, fit)) =
            (joint.drive.as_ref().filter(|_| alone)).zip(self.fits[j].as_ref())
        else {
            return Ok(None);
        };
        let rotor = drive.rotor_inertia * drive.gear_ratio * drive.gear_ratio;
        let whole = fit.functional(&self.inertia(j)?);
        let seen = whole.sigmas() > CLEAR && fit.unexplained() < LEFT;
        if !seen || rotor < HEAVIER * whole.value || rotor - whole.value < CLEAR * whole.std {
            return Ok(None);
        }
        let whole = whole.value;
        let fault = Fault::of_joint(j, Misfit::HeavyRotor { rotor, whole });
        Ok(Some(Suspicion::new(fault, Undo::Rotor(j))))
    }
}
