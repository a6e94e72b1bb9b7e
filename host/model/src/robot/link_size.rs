//! The largest size of a link, and what is said beyond it.
//!
//! The bound, 100 m, is by judgement: no link of an arm has this length or this radius of gyration. Lengths in
//! millimetres exceed it from links of 0.1 m on; inertias in g·mm² exceed it from radii of gyration of 3 mm on.

use rig_output::format_significant;

/// Bound on the length and the radius of gyration of a link, m.
pub(super) const LARGEST_LINK: f64 = 100.0;

/// Returns the end of a sentence on a length that exceeds the bound.
pub(super) fn too_long(length: f64) -> String {
    format!(
        "no link of a robot is {LARGEST_LINK} m long; it must be in m, and were these mm, it would be {}",
        format_significant(length / 1000.0, 4)
    )
}

/// Returns the fault of moments of inertia up to `largest` kg·m² about the centre of a mass of `mass` kg; `None` if the
/// radius of gyration is possible.
pub(super) fn too_wide(largest: f64, mass: f64) -> Option<String> {
    let radius = (largest / mass).sqrt();
    (mass > 0.0 && radius > LARGEST_LINK).then(|| {
        let as_if = |factor: f64| format_significant(largest / factor, 4);
        format!(
            "at a mass of {} kg that is a radius of gyration of {} m, and no link of a robot is {LARGEST_LINK} m long; it must be in kg·m², and were it in kg·mm², it would be {}, in g·mm² {}",
            format_significant(mass, 4),
            format_significant(radius, 4),
            as_if(1e6),
            as_if(1e9)
        )
    })
}
