//! Sentences on the dependence of a residual on a coordinate.

use crate::acceptance::residual_dependence::dependence::{Dependence, Form, Parity};
use rig_output::{format_significant, format_unit};

/// Says where a residual lies.
pub(crate) fn text(own: &Dependence) -> String {
    let [from, to] = own.interval;
    let Form::Along {
        whole_range,
        parity,
    } = own.form
    else {
        return format!(
            "{:.0} % of what comes back in each run of the motion has frequencies between {} and {} Hz.",
            100.0 * own.share,
            format_significant(from, 2),
            format_significant(to, 2)
        );
    };
    let place = match whole_range {
        true => "over its whole range".to_owned(),
        false => format!(
            "mostly between {} and {} {}",
            format_significant(from, 3),
            format_significant(to, 3),
            format_unit(&own.unit)
        ),
    };
    let parity = match parity {
        Some(Parity::Odd) => ", odd in it",
        Some(Parity::Even) => ", even in it",
        None => "",
    };
    format!(
        "{:.0} % of the excess goes with the {}, {place}{parity}.",
        100.0 * own.share,
        own.coordinate
    )
}
