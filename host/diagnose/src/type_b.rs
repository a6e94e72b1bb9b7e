//! What an interval has to hold besides noise: no law is quite the rig's, noise of the position makes inertia come out too small, and
//! no recording says when within a sample its columns were read.
//!
//! Uncertainties of type B (JCGM 100:2008, Guide to the expression of uncertainty in measurement, 4.3) that are added in squares to
//! what stretches of the recordings say. The shares are what emulated rigs of other laws and steps than the library's came out
//! wrong by, on recordings whose intervals were too narrow by that; a real rig may be further off.
//!
//! Leaves out: laws of another form than the rig's, whose parameters are not the rig's at all; a torque constant that is wrong,
//! which scales everything alike.

use rig_shared::effects::{Kind, Parameter, Scale};

/// Share of a value that its law is off by.
const LAW: f64 = 0.01;
/// … of the share of friction that a gear carries beside its load: of six rigs with 0.25 it came out 0.02 off, RMS, with intervals of
/// half as much.
const SHARE: f64 = 0.07;
/// … of inertia and gravity of a link: eight rigs with nothing hidden gave inertias 0.1 to 0.4 % too small.
pub(super) const LINK: f64 = 0.003;

/// Standard deviation of a parameter with what its law is off by; `slack` is what the instants of sampling alone may make a torque
/// late by, s. Whole numbers are exact.
pub(super) fn widened(kind: Kind, parameter: &Parameter, value: f64, std: f64, slack: f64) -> f64 {
    if parameter.scale == Scale::Whole {
        return std;
    }
    let instants = match kind {
        // Anywhere within it, none likelier than another (4.3.7).
        Kind::MeasurementDelay => slack / 3.0_f64.sqrt(),
        _ => 0.0,
    };
    let share = if kind.optional().contains(&parameter.name) {
        SHARE
    } else {
        LAW
    };
    std.hypot(share * value).hypot(instants)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_known_no_better_than_the_instants_of_sampling() {
        let delay = &Kind::MeasurementDelay.about().gains[0];
        let std = widened(Kind::MeasurementDelay, delay, 0.004, 1e-5, 0.0006);
        assert!((std - 0.0006 / 3.0_f64.sqrt()).abs() < 5e-6, "{std}");
        let stiffness = &Kind::Spring.about().gains[0];
        let std = widened(Kind::Spring, stiffness, 2.0, 0.0, 0.0006);
        assert!((std - 0.02).abs() < 1e-12, "{std}");
        assert_eq!(
            widened(Kind::Spring, stiffness, 2.0, f64::INFINITY, 0.0),
            f64::INFINITY
        );
    }
}
