//! Factors of a ratio, too small for a unit, that all the description states shows alike.
//!
//! A payload, a worn gear or a cold one changes weight, inertia or friction. Nothing but a ratio changes all of them by one
//! factor: of a torque that is f times too large weight, inertia, viscous and dry friction are f times what is described; of a
//! position that is f times too large inertia and viscous friction are 1/f of it, dry friction is as described and gravity has
//! another period.
//!
//! Leaves out: joints whose friction or links are not described, those whose motors move other joints too, and slides'
//! positions, which have no period.

use super::super::DiagnoseError;
use super::super::outcome::About;
use super::fit::Fit;
use super::model::Judge;
use super::rows::Rows;
use super::senses::{Described, columns};
use super::trial::Suspicion;
use rig_model::robot::JointKind;
use rig_output::format_significant;

/// A wrong ratio is no smaller factor of a position.
const LEAST: f64 = 1.5;
/// … or of a torque, as a payload in a cold rig comes near.
const LEAST_OF_TORQUE: f64 = 1.8;
/// Weight and inertia are off by one ratio alike within this factor; a payload adds to each what it will.
const ALIKE: f64 = 1.15;
/// Weight and inertia of a description are right within this factor, its friction within the square of it.
const RIGHT: f64 = 1.25;
/// Share of what is left that gravity of another period has to leave, at most; that all else fits is what decides.
const BETTER: f64 = 0.95;
/// Standard deviations that each has to stand from zero.
const CLEAR: f64 = 5.0;
/// Farthest factor of a position in steps of 3 %; units are farther.
const FARTHEST: i32 = 55;

/// What is measured over what is described.
struct Shares {
    dry: f64,
    viscous: f64,
    weight: f64,
    inertia: f64,
    unexplained: f64,
}

/// How far apart two shares are, as a factor of at least one.
fn apart(a: f64, b: f64) -> f64 {
    if a <= 0.0 || b <= 0.0 {
        return f64::INFINITY;
    }
    (a / b).max(b / a)
}

impl Judge<'_> {
    /// The ratio that all that is described of joint `j` is off by.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] where the description is no chain.
    pub(super) fn alike(
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

    /// A torque that is a multiple of the joint's.
    fn torque_alike(&self, j: usize, shares: &Shares) -> Result<Option<Suspicion>, DiagnoseError> {
        let three = [shares.weight, shares.viscous, shares.dry];
        let factor = three.iter().product::<f64>().cbrt();
        let drive = self.robot.joints[j].drive.as_ref();
        // Where the ratio of the description is wrong, so is its reflected rotor, by the square.
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
            let fault = self.say(
                "ratio",
                About::Torque,
                j,
                format!(
                    "tau{} is {} times what the description's weight, viscous friction and dry friction need alike ({}, {} and {} times), which no change of the robot makes; check the gear ratio and the torque constant.",
                    j + 1,
                    format_significant(factor, 3),
                    format_significant(shares.weight, 3),
                    format_significant(shares.viscous, 3),
                    format_significant(shares.dry, 3),
                ),
            );
            // Four values by one factor: no trial of masses alone sees that.
            Suspicion { fault, undo: None }
        }))
    }

    /// A position that is a multiple of the joint's.
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
                ..self.scaled(j, &[factor], recorded.unexplained, shares.unexplained)
            }))
    }

    /// Measured over described of joint `j`; none where something is not described or does not show.
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
