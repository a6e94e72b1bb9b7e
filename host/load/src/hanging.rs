//! A robot that hangs from the ceiling, with a description whose gravity is that of a robot on the floor.
//!
//! At rest reversed gravity is the same as readings of the opposite sign. In a motion the inertia of the load tells them
//! apart: it does not turn with gravity.

use rig_model::robot::{Origin, Robot};

use crate::causes::explains;
use crate::mounting::Mounting;
use crate::selection::selected;
use crate::settle::{DECISIVE, settled};
use crate::system::{Fit, Sensed};

/// Returns the fit with gravity reversed if it explains a motion decisively better than a fit does that leaves the sense of
/// the readings open. With `sign_stated` the sense is that of `start`.
pub(crate) fn hanging(
    sensed: &Sensed,
    fit: &Fit,
    start: &Mounting,
    sign_stated: bool,
) -> Option<Fit> {
    let reversed = sensed.reversed_gravity(start)?;
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
