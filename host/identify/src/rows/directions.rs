//! Search for the joints that move in one direction only.

use rig_shared::multibody::{COLUMNS, column};

use super::one_way::{OneWay, Slides};
use super::plan::Plan;
use super::stream::each_rows;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use rig_data::prepare::Recording;

/// Finds the joints that move one way in the training data, if their dry friction and constant torque are both columns.
///
/// # Errors
/// Reading errors.
pub(crate) fn one_way(
    training: &[&dyn Recording],
    plan: &Plan,
) -> Result<Vec<OneWay>, IdentifyError> {
    let place =
        |joint: usize, own: usize| (plan.columns.iter()).position(|c| *c == joint * COLUMNS + own);
    let joints = plan.chain.joint_count();
    let places: Vec<(usize, usize)> = (0..joints)
        .filter(|joint| place(*joint, column::OFFSET).is_some())
        .filter_map(|joint| Some((joint, place(joint, column::COULOMB)?)))
        .collect();
    let mut slides = vec![Slides::default(); places.len()];
    let width = plan.columns.len();
    for recording in training {
        each_rows(*recording, plan, ModelKind::Differential, &mut |rows| {
            for ((joint, place), slides) in places.iter().zip(&mut slides) {
                let equation = &rows.equations[*joint];
                for (row, keep) in equation.x.chunks(width).zip(&equation.keep) {
                    if *keep {
                        slides.take(row[*place]);
                    }
                }
            }
            Ok(())
        })?;
    }
    let period = plan.treatment.decimation.max(1) as f64 / plan.treatment.sample_rate;
    Ok((places.into_iter().zip(slides))
        .filter_map(|((joint, place), slides)| {
            Some(OneWay {
                joint,
                place,
                direction: slides.one_way(period)?,
            })
        })
        .collect())
}
