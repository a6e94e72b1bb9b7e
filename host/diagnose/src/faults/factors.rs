//! Factors between recording and description that no change of the robot causes.

use crate::DiagnoseError;
use crate::faults::described::Described;
use crate::faults::finding::Fault;
use crate::faults::judge::Judge;
use crate::faults::misfit::{Misfit, Needs};
use crate::faults::names;
use crate::faults::suspicion::Suspicion;
use crate::faults::undo::Undo;

/// Largest factor of a parameter change; units and ratios change more.
const CHANGE: f64 = 5.0;
/// Factors within this ratio of a thousand, or a thousandth, count as that: stand-in masses are wrong by as much.
const THOUSAND_APART: f64 = 2.5;

impl Judge<'_> {
    /// Suspects torques of several joints that are all a thousand times too large or small: no description is that
    /// wrong everywhere.
    pub(crate) fn thousandfold(&self, described: Option<&Described>) -> Option<Suspicion> {
        let mut shown = Vec::new();
        let mut weighed = false;
        for j in 0..self.robot.joints.len() {
            let (gravity, inertia) = self.scales(&self.rows, j, described);
            weighed |= gravity.is_some();
            shown.extend(gravity.or(inertia).map(|m| (j, m.value)));
        }
        let near = |unit: f64| {
            let apart = |f: f64| (f / unit).abs().ln().abs() < THOUSAND_APART.ln();
            (shown.iter()).all(|(j, f)| apart(*f) && !names::is_ratio(&self.robot.joints[*j], *f))
        };
        // A rotor that is not described makes inertia look larger, never weight.
        if shown.len() < 2 || !weighed {
            return None;
        }
        let large = near(1000.0);
        if !large && !near(1e-3) {
            return None;
        }
        let least = shown
            .iter()
            .map(|(_, f)| f.abs())
            .fold(f64::INFINITY, f64::min);
        let most = shown.iter().map(|(_, f)| f.abs()).fold(0.0, f64::max);
        let factor = if large { 1e-3 } else { 1000.0 };
        let fault = Fault::of_recording(Misfit::Thousandfold {
            joints: shown.iter().map(|(j, _)| *j).collect(),
            factors: [least, most],
            large,
        });
        Some(Suspicion::new(fault, Undo::Torque(None, factor)))
    }

    /// Suspects factors between recording and description that no change of the robot causes.
    pub(crate) fn against_description(
        &self,
        j: usize,
        described: Option<&Described>,
    ) -> Result<Option<Suspicion>, DiagnoseError> {
        let joint = &self.robot.joints[j];
        let (gravity, inertia) = self.scales(&self.rows, j, described);
        // Drive parts that are not described make the inertia larger, never smaller.
        let complete = joint.drive.is_none() || self.states_drive(j);
        let inertia = inertia
            .map(|m| m.value)
            .filter(|s| complete || s.abs() < 1.0);
        let large = |s: f64| !(1.0 / CHANGE..CHANGE).contains(&s.abs());
        let apart = |a: f64, b: f64| (a / b).abs().ln().abs() > f64::ln(2.5);
        // Two torques that agree show a factor, however small they are beside friction.
        let agreed = match self.scales_above(&self.rows, j, described, 0.0) {
            (Some(g), Some(i)) if complete && large(g.value) && !apart(g.value, i.value) => {
                Some(g.value)
            }
            _ => None,
        };
        Ok(match (gravity.map(|m| m.value), inertia) {
            (Some(g), Some(i)) if large(g) && !apart(g, i) => self.torque_times(j, g, Needs::Both),
            (Some(g), None) if large(g) => self.torque_times(j, g, Needs::Gravity),
            (None, Some(i)) if large(i) => self.torque_times(j, i, Needs::Inertia),
            (Some(g), Some(i)) if !large(g) && !(0.05..20.0).contains(&(i / g).abs()) => {
                Some(self.clock_times(j, i / g))
            }
            (Some(g), _) if (-2.0..-0.5).contains(&g) && self.sign(j, described)?.is_none() => {
                Some(self.gravity_reversed(j, g)?)
            }
            (None, None) => agreed.and_then(|g| self.torque_times(j, g, Needs::Both)),
            _ => None,
        })
    }

    /// Suspects a torque that is `factor` times the described, which `needs` less; `None` if an unusual robot may be the
    /// reason.
    fn torque_times(&self, j: usize, factor: f64, needs: Needs) -> Option<Suspicion> {
        let name = names::of_torque(&self.robot.joints[j], factor);
        // Between a parameter change and a named factor an unusual robot is possible.
        if name.is_none() && (0.125..8.0).contains(&factor.abs()) {
            return None;
        }
        let found = Misfit::TorqueTimes {
            factor,
            needs,
            name,
        };
        let fault = Fault::of_joint(j, found);
        Some(Suspicion::new(fault, Undo::Torque(Some(j), 1.0 / factor)))
    }

    /// Suspects a clock that makes the inertia `times` the described, where gravity is as described.
    fn clock_times(&self, j: usize, times: f64) -> Suspicion {
        let clock = times.abs().sqrt();
        let fault = Fault::of_joint(j, Misfit::InertiaTimes { times });
        Suspicion::new(fault, Undo::Clock(1.0 / clock))
    }

    /// Suspects a wrong sense or zero of a joint on which gravity acts `times` as described, below zero.
    fn gravity_reversed(&self, j: usize, times: f64) -> Result<Suspicion, DiagnoseError> {
        let held = match self.fits[j].as_ref() {
            Some(fit) => {
                let (loss, _, own) = self.senses(j, fit)?;
                loss.sigmas() > 3.0 || own.sigmas() > 3.0
            }
            None => false,
        };
        let undo = match held {
            true => Undo::Both(j),
            false => Undo::Torque(Some(j), -1.0),
        };
        let fault = Fault::of_joint(j, Misfit::GravityReversed { times, held });
        Ok(Suspicion::new(fault, undo))
    }
}
