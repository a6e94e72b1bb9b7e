//! Parameters that are identifiable from the data, and the others.

use nalgebra::DMatrix;
use rig_shared::multibody::{COLUMNS, column};
use rig_shared::transmission::MOTOR_COLUMNS;
use serde::Serialize;

use super::base::Base;
use super::columns::preference;
use super::independent::{Independent, independent_columns};
use crate::bodies::prior::Prior;
use crate::estimators::linear::triangle;
use crate::rows::factor::TriangularFactor;
use rig_model::robot::JointKind;

/// A combination that the data do not determine, or determine less well than the description.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotExcited {
    /// The base parameter that was not identified on its own or is weakly excited.
    pub combination: String,
    /// Reason.
    pub why: String,
    /// A motion that would excite it.
    pub motion: String,
}

/// Relative distance of a column of unit length from the combinations of the others, below which its base parameter is
/// not excited. Its value would rest on a thousandth of the torque, about as much as filters and sensors distort.
const EXCITED: f64 = 1e-3;

/// Returns the identifiable columns of the accumulated regressor, and the combinations that the others join.
pub(crate) fn excited(base: &Base, factor: &TriangularFactor) -> Independent {
    let (excitation, _) = factor.system();
    without_traces(
        independent_columns(&excitation, &data_order(base), EXCITED),
        &excitation,
    )
}

/// Returns the base columns in the order in which they are kept if some are collinear.
fn data_order(base: &Base) -> Vec<usize> {
    let preferred = preference(&base.kinds);
    let rank = |c: usize| preferred.iter().position(|&x| x == c).unwrap_or(usize::MAX);
    let mut order: Vec<usize> = (0..base.len()).collect();
    // Motor columns are not in the list of preference: they come last, in their order.
    order.sort_by_key(|&k| rank(base.columns[k]));
    order
}

/// Removes from the combinations the terms that are too small for these data, so that a parameter is not printed with a
/// hundred-thousandth of another.
fn without_traces(mut data: Independent, excitation: &DMatrix<f64>) -> Independent {
    for k in 0..excitation.ncols() {
        let length = excitation.column(k).norm();
        for (row, &c) in data.kept.iter().enumerate() {
            let share = data.combination[(row, k)].abs() * excitation.column(c).norm();
            if c != k && share < EXCITED * length {
                data.combination[(row, k)] = 0.0;
            }
        }
    }
    data
}

/// Returns the parameters that are not identified on their own, with the reason and a motion that would help.
pub(crate) fn not_excited(base: &Base, data: &Independent) -> Vec<NotExcited> {
    (0..base.len())
        .filter(|k| !data.kept.contains(k))
        .map(|k| {
            let partners: Vec<String> = data
                .kept
                .iter()
                .enumerate()
                .filter(|(row, _)| data.combination[(*row, k)].abs() > 1e-6)
                .map(|(_, &c)| base.column_name(base.columns[c]))
                .collect();
            let why = if partners.is_empty() {
                "It has no effect on the torque in these data.".to_owned()
            } else {
                format!(
                    "In these data its torque is, to within {:.2} % of itself, a combination of that of {}; their sum is identified instead.",
                    100.0 * data.remainder[k],
                    partners.join(", ")
                )
            };
            NotExcited {
                combination: base.expression(k),
                why,
                motion: motion(base, k),
            }
        })
        .collect()
}

/// Describes a motion that would excite base parameter `k` better.
fn motion(base: &Base, k: usize) -> String {
    let links = base.kinds.len() * COLUMNS;
    let motor = base.columns[k].checked_sub(links);
    let link = motor.map_or(base.columns[k] / COLUMNS, |m| m / MOTOR_COLUMNS);
    let joint = base.joints[link] + 1;
    let revolute = base.kinds[link] == JointKind::Revolute;
    match base.columns[k] % COLUMNS {
        _ if motor.is_some() => format!(
            "Move joint {joint} and the joints that its drive is coupled to together and against each other, at several speeds and with changing accelerations."
        ),
        column::VISCOUS => {
            format!("Move joint {joint} at several clearly different speeds, in both directions.")
        }
        column::COULOMB => format!("Move joint {joint} slowly in both directions, with reversals."),
        column::OFFSET => format!(
            "Move joint {joint} in both directions and, where it lifts, over a wider range of positions."
        ),
        1..=3 if revolute => {
            format!("Move joint {joint} over a wider range of positions, at best half a turn.")
        }
        _ => format!("Accelerate joint {joint} and its neighbours harder, in different postures."),
    }
}

/// Returns parameters that are identified on their own but less well than the prior knows them: more than half of a
/// combined estimate would be prior. `factor` is in units of σ·√(correlation time) of the residual.
pub(crate) fn hardly_excited(
    base: &Base,
    data: &Independent,
    prior: &Prior,
    factor: &TriangularFactor,
    names: &[(String, String)],
) -> Vec<NotExcited> {
    let Some(inverse) = triangle(factor, data).try_inverse() else {
        return Vec::new();
    };
    let own = prior.own(&(&data.combination * &base.combination));
    (0..data.kept.len())
        .filter_map(|k| {
            let known = inverse.row(k).norm();
            let plausible = own
                .row(k)
                .iter()
                .enumerate()
                .map(|(c, share)| {
                    let u = prior.uncertainty[c];
                    (share * prior.size[c] * if u.is_finite() { u } else { 1.0 }).powi(2)
                })
                .sum::<f64>()
                .sqrt();
            let (name, unit) = names.get(k)?;
            (known > plausible).then(|| NotExcited {
                combination: name.clone(),
                why: format!(
                    "These data alone know it to {} {unit} (standard deviation), less well than the {} {unit} within which it is plausible without them.",
                    rig_output::format_significant(known, 3),
                    rig_output::format_significant(plausible, 3)
                ),
                motion: motion(base, data.kept[k]),
            })
        })
        .collect()
}
