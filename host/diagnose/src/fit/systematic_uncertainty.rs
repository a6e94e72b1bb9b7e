//! Systematic uncertainty of parameters: laws are inexact, position noise reduces inertia estimates, and the instants
//! of reading within a sample are unknown.
//!
//! It is an uncertainty of type B (JCGM 100:2008, Guide to the expression of uncertainty in measurement, 4.3). It is
//! added in squares to the spread between stretches. The shares are errors on emulated rigs with other laws and steps
//! than the library's, where intervals were too narrow by that. A real rig may deviate more.
//!
//! Leaves out: laws of another form, whose parameters are not the rig's; a wrong torque constant, which scales
//! everything.

use rig_shared::effects::{Kind, Parameter, Scale};

/// Relative error of a value from its law.
const LAW: f64 = 0.01;
/// … of a gear's share of friction on the link: six rigs with 0.25 had an RMS error of 0.02, with intervals of half as
/// much.
const SHARE: f64 = 0.07;
/// … of inertia and gravity of a link: eight rigs without hidden effects gave inertias 0.1 to 0.4 % too small.
pub(crate) const LINK: f64 = 0.003;

/// Returns the standard deviation of a parameter with its systematic error. `sampling_jitter` is the largest torque delay from
/// sampling instants alone, s. Whole numbers are exact.
pub(crate) fn inflated(
    kind: Kind,
    parameter: &Parameter,
    value: f64,
    std: f64,
    sampling_jitter: f64,
) -> f64 {
    if parameter.scale == Scale::Whole {
        return std;
    }
    let instants = match kind {
        // Uniformly distributed within it (4.3.7).
        Kind::MeasurementDelay => sampling_jitter / 3.0_f64.sqrt(),
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
        let std = inflated(Kind::MeasurementDelay, delay, 0.004, 1e-5, 0.0006);
        assert!((std - 0.0006 / 3.0_f64.sqrt()).abs() < 5e-6, "{std}");
        let stiffness = &Kind::Spring.about().gains[0];
        let std = inflated(Kind::Spring, stiffness, 2.0, 0.0, 0.0006);
        assert!((std - 0.02).abs() < 1e-12, "{std}");
        assert_eq!(
            inflated(Kind::Spring, stiffness, 2.0, f64::INFINITY, 0.0),
            f64::INFINITY
        );
    }
}
