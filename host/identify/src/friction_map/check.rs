//! The reasons not to trust a map.

use super::consistency;
use super::law;
use super::law::Decision;
use super::map::{FrictionMapOptions, FrictionPoint};
use super::passes::Stretch;
use super::rows::Rows;
use rig_model::robot::JointKind;

/// The input of a map's checks.
pub(super) struct Check<'a> {
    pub(super) rows: &'a Rows,
    pub(super) stretches: &'a [Stretch],
    pub(super) options: &'a FrictionMapOptions,
    pub(super) sweep: &'a str,
    pub(super) joint: &'a str,
    /// Residual of the joint's torque in the recordings of the fit, N·m or N rms.
    pub(super) noise: f64,
    /// Number of the joint, from 1.
    pub(super) number: usize,
    pub(super) kind: JointKind,
}

impl Check<'_> {
    /// Returns the reasons not to trust the map. The clock comes first, because a late torque looks like a wrong scale.
    pub(super) fn doubts(&self, points: &[FrictionPoint], decision: &Decision) -> Vec<String> {
        let units = match self.kind {
            JointKind::Revolute => ["N·m", "N·m·s/rad"],
            JointKind::Prismatic => ["N", "N·s/m"],
        };
        let chosen = |decision: &Decision, stribeck: bool| {
            let stribeck = decision.stribeck.clone().filter(|_| stribeck);
            stribeck.unwrap_or_else(|| decision.simple.clone())
        };
        let recorded = chosen(decision, decision.warranted);
        let clock = self.rows.late().and_then(|late| {
            let moved = self.rows.earlier(late.by)?;
            let (points, _) = moved.points(self.stretches, self.options);
            let moved = chosen(&law::decide(&points)?, decision.warranted);
            consistency::late_doubt(
                &late,
                [&recorded, &moved],
                self.sweep,
                self.number,
                units[1],
            )
        });
        let scale = || {
            (self.rows.gravity_shown(points)).doubt(self.noise, self.sweep, self.joint, self.number)
        };
        let impossible =
            consistency::impossible(&recorded, points.len(), self.joint, self.number, units);
        (clock.or_else(scale).into_iter().chain(impossible)).collect()
    }
}
