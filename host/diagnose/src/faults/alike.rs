//! Small ratio errors that change all described parameters by one factor.
//!
//! A payload or a worn or cold gear changes weight, inertia or friction. Only a ratio changes all of them alike. If a
//! torque is f times too large, weight, inertia, viscous and dry friction are f times the described. If a position is f
//! times too large, inertia and viscous friction are 1/f of it. Dry friction is as described, and gravity has another
//! period.
//!
//! Leaves out: joints without described friction or links; motors that move several joints; positions of prismatic
//! joints, which have no period.

use crate::DiagnoseError;
use crate::faults::described::{Described, columns};
use crate::faults::finding::Fault;
use crate::faults::fit::Fit;
use crate::faults::judge::Judge;
use crate::faults::misfit::Misfit;
use crate::faults::rows::Rows;
use crate::faults::suspicion::Suspicion;
use rig_model::robot::JointKind;

/// Least factor of a position by a wrong ratio.
const LEAST: f64 = 1.5;
/// … of a torque; a payload in a cold rig comes near.
const LEAST_OF_TORQUE: f64 = 1.8;
/// Ratio up to which weight and inertia agree with one factor; a payload changes each differently.
const ALIKE: f64 = 1.15;
/// Ratio up to which a description's weight and inertia are right; friction within its square.
const RIGHT: f64 = 1.25;
/// Least improvement by another period of gravity, as ratio of residuals; the agreement of all else decides.
const BETTER: f64 = 0.95;
/// Least distance of each value from zero, standard deviations.
const CLEAR: f64 = 5.0;
/// Largest factor of a position in steps of 3 %; units are larger.
const FARTHEST: i32 = 55;

/// Measured over described values.
struct Shares {
    dry: f64,
    viscous: f64,
    weight: f64,
    inertia: f64,
    unexplained: f64,
}

/// Returns the distance of two shares, as a factor of at least one.
fn apart(a: f64, b: f64) -> f64 {
    if a <= 0.0 || b <= 0.0 {
        return f64::INFINITY;
    }
    (a / b).max(b / a)
}

impl Judge<'_> {
    /// Returns the ratio error that all described values of joint `j` show.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn alike(
        &self,
        j: usize,
        described: Option<&Described>,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let Some(described) = described else {
            return Ok(None);
        };
        let Some(recorded) = self.shares(&self.rows, j, described) else {
            return Ok(None);
        };
        if let Some(fault) = self.torque_alike(j, &recorded)? {
            return Ok(Some(fault));
        }
        self.position_alike(j, &recorded)
    }

    /// Suspects a torque that is a multiple of the joint's.
    fn torque_alike(&self, j: usize, shares: &Shares) -> Result<Option<Suspicion>, DiagnoseError> {
        let three = [shares.weight, shares.viscous, shares.dry];
        let factor = three.iter().product::<f64>().cbrt();
        let drive = self.robot.joints[j].drive.as_ref();
        // A wrong described ratio changes the reflected rotor by its square.
        let rotor = drive.map_or(0.0, |d| d.rotor_inertia * d.gear_ratio * d.gear_ratio);
        let parameters = self.robot.standard_parameters().concat();
        let own = self.inertia(j)?;
        let stated: f64 = own.iter().zip(&parameters).map(|(w, p)| w * p).sum();
        let by_ratio = shares.inertia * stated / (stated - rotor * (1.0 - 1.0 / (factor * factor)));
        let inertia = apart(shares.inertia, shares.weight).min(apart(by_ratio, shares.weight));
        let alike = apart(factor, 1.0) > LEAST_OF_TORQUE
            && inertia < ALIKE
            && three.iter().all(|s| apart(*s, factor) < RIGHT);
        Ok(alike.then(|| {
            let found = Misfit::Alike {
                factor,
                weight: shares.weight,
                viscous: shares.viscous,
                dry: shares.dry,
            };
            let fault = Fault::of_joint(j, found);
            // A trial of masses alone cannot show four values with one factor.
            Suspicion::of_columns(fault)
        }))
    }

    /// Suspects a position that is a multiple of the joint's.
    fn position_alike(
        &self,
        j: usize,
        recorded: &Shares,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let far = |shares: &Shares| apart(shares.inertia, 1.0) > LEAST.sqrt();
        if self.robot.joints[j].kind == JointKind::Prismatic || !far(recorded) {
            return Ok(None);
        }
        let mut best: Option<(f64, Shares)> = None;
        for step in -FARTHEST..=FARTHEST {
            let factor = 1.03f64.powi(step);
            if apart(factor, 1.0) < LEAST {
                continue;
            }
            let rows = self.rows.rescaled(Some(j), factor);
            let described = self.described(&rows)?;
            let Some(shares) = self.shares(&rows, j, &described) else {
                continue;
            };
            let least = best.as_ref().map_or(f64::INFINITY, |b| b.1.unexplained);
            let right = apart(shares.weight, 1.0).max(apart(shares.inertia, 1.0)) < RIGHT
                && apart(shares.viscous, 1.0).max(apart(shares.dry, 1.0)) < RIGHT * RIGHT;
            if right && shares.unexplained < least {
                best = Some((factor, shares));
            }
        }
        let better = |s: &Shares| s.unexplained < BETTER * recorded.unexplained;
        Ok(best
            .filter(|(_, shares)| better(shares))
            .map(|(factor, shares)| Suspicion {
                undo: None,
                ..self.scaled(j, &[factor], [recorded.unexplained, shares.unexplained])
            }))
    }

    /// Returns measured over described values of joint `j`; `None` if any is not described or not identifiable.
    fn shares(&self, data: &Rows, j: usize, described: &Described) -> Option<Shares> {
        let friction = self.robot.joints[j].friction.as_ref()?;
        if !described.motors.is_empty() || friction.coulomb <= 0.0 || friction.viscous <= 0.0 {
            return None;
        }
        let x = columns(data, j, described);
        let fit = Fit::of(&x, &data.tau[j], &(0..x.ncols()).collect::<Vec<_>>())?;
        let shown = |c: usize| fit.parameter(c).filter(|m| m.sigmas() > CLEAR);
        Some(Shares {
            dry: shown(1)?.value / friction.coulomb,
            viscous: shown(2)?.value / friction.viscous,
            weight: shown(3)?.value,
            inertia: shown(4)?.value,
            unexplained: fit.unexplained(),
        })
    }
}
