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
    /// Identified viscous and Coulomb friction of the joint.
    pub(super) friction: [f64; 2],
    /// True if gravity can load the joint.
    pub(super) loaded: bool,
    /// Motor turns per turn of the joint.
    pub(super) ratio: f64,
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
        let cause = self.rows.cause(self.friction, self.loaded);
        let late = self.rows.late();
        // The better of two explanations counts.
        let is_late = late
            .as_ref()
            .is_some_and(|late| (cause.as_ref()).is_none_or(|cause| late.moved < cause.left));
        let cause = cause
            .filter(|_| !is_late)
            .map(|own| own.told(self.sweep, self.joint, self.number, self.ratio));
        let strange = || {
            let shown = self.rows.gravity_shown(points);
            shown.doubt(self.noise, self.sweep, self.joint, self.number)
        };
        let scale = if self.loaded { strange() } else { None };
        let clock = late.filter(|_| is_late).and_then(|late| {
            let moved = self.rows.earlier(late.by)?;
            let (points, _) = moved.points(self.stretches, self.options);
            let moved = chosen(&law::decide(&points)?, decision.warranted);
            consistency::late_doubt(
                &late,
                [&recorded, &moved],
                scale.is_some(),
                self.sweep,
                self.number,
                units[1],
            )
        });
        let impossible =
            consistency::impossible(&recorded, points.len(), self.joint, self.number, units);
        (cause.or(clock).or(scale).into_iter().chain(impossible)).collect()
    }
}
