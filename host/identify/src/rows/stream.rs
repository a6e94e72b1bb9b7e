//! Rows of the differential and the integral model, streamed from a recording.

use super::differential::Differential;
use super::equation::Rows;
use super::integral::Integral;
use super::plan::Plan;
use super::tally::Tally;
use crate::error::IdentifyError;
use crate::options::ModelKind;
use rig_data::prepare::{Motion, PrepareError, Recording, worked_motion};

/// Streams the rows of `recording` into `take`.
///
/// # Errors
/// Errors of reading and of `take`.
pub fn each_rows(
    recording: &dyn Recording,
    plan: &Plan,
    model: ModelKind,
    take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
) -> Result<Tally, IdentifyError> {
    if plan.one_way.is_empty() || model == ModelKind::Integral {
        return each_row_made(recording, plan, model, take);
    }
    let mut left_out = Tally::default();
    let mut slide = |rows: &Rows| {
        let mut own = rows.clone();
        for joint in &plan.one_way {
            joint.apply(&mut own, &mut left_out);
        }
        take(&own)
    };
    let mut tally = each_row_made(recording, plan, model, &mut slide)?;
    tally.used -= left_out.slow.iter().sum::<u64>();
    tally.add(&left_out);
    Ok(tally)
}

/// The same, with all rows of joints that move in one direction.
fn each_row_made(
    recording: &dyn Recording,
    plan: &Plan,
    model: ModelKind,
    take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
) -> Result<Tally, IdentifyError> {
    if let Some(tally) = plan.cache.replay(recording, model, take)? {
        return Ok(tally);
    }
    plan.cache.keep(
        recording,
        model,
        |keep| make_rows(recording, plan, model, keep),
        take,
    )
}

fn make_rows(
    recording: &dyn Recording,
    plan: &Plan,
    model: ModelKind,
    take: &mut dyn FnMut(&Rows) -> Result<(), PrepareError>,
) -> Result<Tally, IdentifyError> {
    let mut total = Tally::default();
    let treatment = plan.treatment;
    let mut give = |(rows, part): (Rows, Tally)| {
        total.add(&part);
        take(&rows)
    };
    match model {
        ModelKind::Differential => {
            let maker = Differential::new(plan)?;
            if let Some(mut earlier) = plan.cache.earlier(recording, model)? {
                let work = |motion: Motion| counted(&motion, |tally| maker.used(&motion, tally));
                let mut renew = |(used, part): (Rows, Tally)| {
                    let mut rows = earlier.next()?.unwrap_or_default();
                    for (equation, used) in rows.equations.iter_mut().zip(used.equations) {
                        equation.keep = used.keep;
                    }
                    give((rows, part))
                };
                worked_motion(recording, treatment, 0, &work, &mut renew)?;
                return Ok(total);
            }
            let work = |motion: Motion| counted(&motion, |tally| maker.rows(&motion, tally));
            worked_motion(recording, treatment, 0, &work, &mut give)?;
        }
        ModelKind::Integral => {
            let maker = Integral::new(plan)?;
            let work = |motion: Motion| counted(&motion, |tally| maker.rows(&motion, tally));
            // A window's quadrature needs one row beyond it.
            worked_motion(recording, treatment, plan.window + 1, &work, &mut give)?;
        }
    }
    Ok(total)
}

/// Computes the rows of one piece and counts the excluded ones.
fn counted(
    motion: &Motion,
    rows: impl FnOnce(&mut Tally) -> Result<Rows, PrepareError>,
) -> Result<(Rows, Tally), PrepareError> {
    let mut tally = Tally::default();
    if motion.usable.0 >= motion.usable.1 {
        tally.short += motion.t.len() as u64;
    }
    Ok((rows(&mut tally)?, tally))
}

/// Computes the rows of one piece of motion.
pub(crate) fn rows_of(
    motion: &Motion,
    plan: &Plan,
    model: ModelKind,
    tally: &mut Tally,
) -> Result<Rows, PrepareError> {
    match model {
        ModelKind::Differential => Differential::new(plan)?.rows(motion, tally),
        ModelKind::Integral => Integral::new(plan)?.rows(motion, tally),
    }
}
