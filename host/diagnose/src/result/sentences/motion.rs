//! Sentences on the simulated motion.

use crate::models::output_error::APART;
use crate::models::simulated_motion::{Failed, Simulation};
use crate::outcome::{ByMotion, Diagnosis, Waterfall};
use crate::result::sentences::number::number;
use rig_model::robot::title_of;
use rig_output::format_significant;

/// Says how the motion was simulated, and which model could not be.
pub(crate) fn simulated(simulation: &Simulation) -> String {
    let Simulation { how, failed } = simulation;
    let Some(Failed { last, why }) = failed else {
        return how.clone();
    };
    let whose = match last {
        Some(kind) => format!("The model with {} among its effects", title_of(*kind)),
        None => "The model without effects".to_owned(),
    };
    format!("{how} {whose} was not simulated: {why}")
}

/// Gives the error of the simulated motion from the refitted description to the last model, on joints with effects.
pub(crate) fn motion_error(d: &Diagnosis) -> Option<String> {
    let of_joint = |w: &Waterfall| {
        let mut steps = d.steps.iter().filter(|s| s.joint == w.joint);
        let first = steps.next()?;
        let last = steps.next_back().unwrap_or(first);
        let unit = if w.unit == "N" { "mm" } else { "mrad" };
        let [before, after] = [first.motion_rms?[0], last.motion_rms?[1]].map(|x| number(1e3 * x));
        let place = match d.waterfall.len() {
            1 => String::new(),
            _ => format!(" at joint {}", w.joint),
        };
        Some(format!("{after} {unit} RMS{place}, {before} {unit} before"))
    };
    let told: Vec<String> = d.waterfall.iter().filter_map(of_joint).collect();
    (!told.is_empty()).then(|| format!("The simulated motion is off by {}.", told.join("; ")))
}

/// Compares the fit to the simulated motion with that to the torque.
pub(crate) fn refitted(told: &ByMotion) -> String {
    let [was, is] = told.motion_rms.map(|rms| format_significant(1e3 * rms, 3));
    let stands = if told.adopted {
        "; away from rests and reversals, about which filters blur it, the torque is left hardly worse: those values stand."
    } else {
        "; the torque's values stand."
    };
    let furthest = (told.parameters.iter()).max_by(|a, b| a.sigmas.total_cmp(&b.sigmas));
    let agree = match furthest {
        Some(p) if p.sigmas > APART => format!(
            "The two differ by {} standard deviations in {}: trust no more digits than they share.",
            format_significant(p.sigmas, 2),
            p.parameter
        ),
        Some(p) => format!(
            "The two agree within {} of their standard deviations.",
            format_significant(p.sigmas, 2)
        ),
        None => String::new(),
    };
    format!(
        "Fitted once more, all {} parameters together, to the simulated motion of the training data, the model departs from it by {is} m{} RMS instead of {was}{stands} {agree}",
        told.parameters.len(),
        told.unit,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adopted_values_are_said_to_stand() {
        let told = ByMotion {
            unit: "rad".into(),
            motion_rms: [2e-3, 1e-3],
            torque_unit: "N*m".into(),
            torque_rms: [0.1, 0.1],
            adopted: true,
            parameters: Vec::new(),
            text: String::new(),
        };
        let said = refitted(&told);
        assert!(said.contains("those values stand."), "{said}");
    }
}
