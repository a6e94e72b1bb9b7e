//! Position zeros and factors, from their effect on the described torques.
//!
//! Gravity, inertia and coupling of a described robot depend on its joint positions. A grid search and then a fine
//! search find the zero or factor with which the description explains the torques best.
//!
//! Leaves out: the zero of a joint without gravity, if no joint behind it shows it; a tilted base or tool
//! (`gravity_tilt` and the payload are other names for that).

use core::f64::consts::{PI, TAU};

use crate::DiagnoseError;
use crate::faults::candidates::Before;
use crate::faults::judge::Judge;
use crate::faults::levels::ODDS;
use crate::faults::names;
use crate::faults::physical::INDEPENDENT;
use crate::faults::undo::Undo;
use rig_model::robot::JointKind;

/// Steps of the grid over a whole turn.
const DIRECTIONS: u32 = 24;
/// Least zero error, rad; a smaller one is a calibration, which `identify` and `diagnose` estimate themselves.
const LEAST_TURN: f64 = 0.35;
/// Factors per decade on the grid of a position, from a tenth to ten times.
const A_DECADE: i32 = 12;
/// Steps of the fine search; each narrows it to two thirds.
const CLOSER: usize = 12;
/// Relative difference below which a found factor is a named one.
const NAMED: f64 = 0.04;
/// Least factor; one closer to one is left to effects.
const LEAST_FACTOR: f64 = 1.4;

impl Judge<'_> {
    /// Returns the zero of joint `j` with which the description explains the recording best; `None` for its own zero.
    ///
    /// # Errors
    /// [`DiagnoseError::Model`] if the description is no chain.
    pub(crate) fn zero(&self, j: usize, before: &Before) -> Result<Option<Undo>, DiagnoseError> {
        if self.robot.joints[j].kind == JointKind::Prismatic {
            return Ok(None);
        }
        let step = TAU / f64::from(DIRECTIONS);
        let gain = |angle: f64| self.gain_without(&Undo::Zero(j, angle), before);
        let grid = (1..DIRECTIONS).map(|k| f64::from(k) * step - PI);
        let Some(near) = best(grid.chain([PI]), &gain)? else {
            return Ok(None);
        };
        let angle = closely(near - step, near + step, &gain)?;
        let turn = (angle + PI).rem_euclid(TAU) - PI;
        Ok((turn.abs() > LEAST_TURN).then_some(Undo::Zero(j, turn)))
    }

    /// Returns the factor of joint `j`'s position, or of all positions, with which the description explains the
    /// recording best; `None` for one. `sense` is the factor's sign.
    ///
    /// # Errors
    /// As for [`Self::zero`].
    pub(crate) fn factor(
        &self,
        j: Option<usize>,
        sense: f64,
        before: &Before,
    ) -> Result<Option<Undo>, DiagnoseError> {
        let gain = |factor: f64| self.gain_without(&Undo::Position(j, factor), before);
        let step = 10f64.powf(1.0 / f64::from(A_DECADE));
        let named = match sense > 0.0 {
            true => self.named_factors(j),
            false => Vec::new(),
        };
        let reached = |factor: &f64| match j {
            Some(j) => self.reaches(j, *factor),
            None => (0..self.robot.joints.len()).all(|j| self.reaches(j, *factor)),
        };
        // A common factor of all positions without a name would mean another robot.
        let decades = if j.is_some() { A_DECADE } else { 0 };
        let grid = (-decades..=decades).map(|k| sense * step.powi(k));
        let far = |factor: &f64| *factor < 0.0 || factor.ln().abs() > LEAST_FACTOR.ln();
        let tried: Vec<f64> = (grid.chain(named.iter().copied()))
            .filter(|f| far(f) && *f != -1.0 && reached(f))
            .collect();
        let Some(near) = best(tried.into_iter(), &gain)? else {
            return Ok(None);
        };
        if j.is_none() {
            return Ok(Some(Undo::Position(None, near)));
        }
        let [low, high] = [near.abs() / step, near.abs() * step].map(f64::ln);
        let close = sense * closely(low, high, &|log: f64| gain(sense * log.exp()))?.exp();
        let most = gain(close)?;
        // A named factor that is as near as the description is right, or explains nearly as much, is the likelier one.
        let mut likelier: Option<(f64, f64)> = None;
        for own in named.into_iter().filter(|own| reached(own)) {
            let gained = gain(own)?;
            let near = (close / own).ln().abs() < NAMED;
            let better = likelier.is_none_or(|(_, best)| gained > best);
            if better && (near || most - gained < 2.0 * ODDS / INDEPENDENT) {
                likelier = Some((own, gained));
            }
        }
        if let Some((own, _)) = likelier {
            return Ok(Some(Undo::Position(j, own)));
        }
        Ok((far(&close) && reached(&close)).then_some(Undo::Position(j, close)))
    }

    /// Returns the factors of joint `j`'s position, or of all positions, that have a name.
    fn named_factors(&self, j: Option<usize>) -> Vec<f64> {
        match j {
            Some(j) => names::factors_of_position(&self.robot.joints[j]),
            None => vec![TAU, 1.0 / 57.296, 57.296],
        }
    }

    /// Returns true if a transformation is a factor of positions that has a name.
    pub(crate) fn is_named(&self, undo: &Undo) -> bool {
        match undo {
            Undo::Position(j, factor) => self.named_factors(*j).contains(factor),
            _ => false,
        }
    }
}

/// Returns the value with the largest positive gain.
fn best(
    values: impl Iterator<Item = f64>,
    gain: &dyn Fn(f64) -> Result<f64, DiagnoseError>,
) -> Result<Option<f64>, DiagnoseError> {
    let mut found: Option<(f64, f64)> = None;
    for value in values {
        let own = gain(value)?;
        if own > found.map_or(0.0, |(_, most)| most) {
            found = Some((value, own));
        }
    }
    Ok(found.map(|(value, _)| value))
}

/// Returns the value with the largest gain between two; the gain has one maximum there.
fn closely(
    mut low: f64,
    mut high: f64,
    gain: &dyn Fn(f64) -> Result<f64, DiagnoseError>,
) -> Result<f64, DiagnoseError> {
    for _ in 0..CLOSER {
        let third = (high - low) / 3.0;
        if gain(low + third)? < gain(high - third)? {
            low += third;
        } else {
            high -= third;
        }
    }
    Ok(0.5 * (low + high))
}
