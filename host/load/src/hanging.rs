//! A robot that hangs from the ceiling, with a description whose gravity is that of a robot on the floor.
//!
//! At rest reversed gravity is the same as readings of the opposite sign. In a motion the inertia of the load tells them
//! apart: it does not turn with gravity.

use nalgebra::{Rotation3, Unit, Vector3};
use rig_model::robot::{Origin, Robot};

use crate::causes::explains;
use crate::mounting::Mounting;
use crate::selection::selected;
use crate::settle::{DECISIVE, settled};
use crate::system::{Fit, Sensed};

/// Returns a mounting with gravity reversed; `None` if there are poses, which do not tell it from the opposite reading.
pub(crate) fn reversed(sensed: &Sensed, start: &Mounting) -> Option<Mounting> {
    if sensed.recordings.iter().any(|own| own.poses) || sensed.gravity == Vector3::zeros() {
        return None;
    }
    let down = start.gravity * sensed.gravity;
    let level = Unit::new_normalize(down.cross(&Vector3::ith(down.iamin(), 1.0)));
    let half_turn = Rotation3::from_axis_angle(&level, std::f64::consts::PI);
    Some(Mounting {
        gravity: half_turn * start.gravity,
        ..start.clone()
    })
}

/// Returns the fit with gravity reversed if it explains a motion decisively better than a fit does that leaves the sense of
/// the readings open. With `sign_stated` the sense is that of `start`.
pub(crate) fn hanging(
    sensed: &Sensed,
    fit: &Fit,
    start: &Mounting,
    sign_stated: bool,
) -> Option<Fit> {
    let reversed = reversed(sensed, start)?;
    let plain = fit.unknowns.plain();
    let mut own = selected(sensed, sensed.fit(&reversed, &plain), &reversed).fit;
    let mass = |fit: &Fit| fit.values.first().copied().unwrap_or(0.0);
    if mass(&own) < 0.0 && !sign_stated {
        own = settled(sensed, &own.mounting.opposite(), &own.unknowns);
    }
    let is_better = own.misfit() < fit.misfit() - DECISIVE;
    (mass(&own) > 0.0 && is_better && explains(sensed, &own)).then_some(own)
}

/// Says how gravity that is reversed is written.
pub(crate) fn remedy(robot: &Robot) -> String {
    // No negative zero.
    let up = robot.gravity.map(|g| format!("{}", 0.0 - g)).join(", ");
    format!(
        "write gravity = [{up}] into {}",
        match robot.origin {
            Origin::Urdf => "a TOML description (`rig init --from`)",
            Origin::Own => "the description",
        }
    )
}
