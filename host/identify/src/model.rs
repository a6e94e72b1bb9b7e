//! Rows of the differential and the integral model, streamed from a recording.

use rig_shared::multibody::{COLUMNS, Chain, column};
use rig_shared::transmission::{DriveKind, MOTOR_COLUMNS, Transmission};

use super::cache::RowCache;
use super::differential::Differential;
use super::integral::Integral;
use super::one_way::OneWay;
use super::{IdentifyError, ModelKind};
use rig_data::prepare::{Masked, Motion, PrepareError, Recording, Treatment, worked_motion};

/// The definition of the rows.
pub struct Plan<'a> {
    /// Geometry.
    pub chain: &'a Chain<f64>,
    /// Drives.
    pub transmission: &'a Transmission<f64>,
    /// Wanted columns (of the base parameters): 14 per joint, followed by 3 per motor.
    pub columns: &'a [usize],
    /// Treatment of the recordings.
    pub treatment: &'a Treatment,
    /// Length of a window of the integral model, rows at the full rate.
    pub window: usize,
    /// Distance between the starts of neighbouring windows, rows at the full rate.
    pub stride: usize,
    /// Per joint, scale of its torque in the energy balance (its RMS), N·m or N.
    pub loudness: Vec<f64>,
    /// Joints that move in one direction only.
    pub one_way: Vec<OneWay>,
    /// Rows computed so far.
    pub cache: RowCache,
}

/// The origin of a regressor column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Belongs {
    /// Column of [`Chain`]'s regressors, 14 per joint.
    Joint(usize),
    /// Column of [`Transmission`]'s: motor, and index among its three.
    Motor(usize, usize),
    /// Zero for these drives.
    Nothing,
}

impl Plan<'_> {
    /// Returns the origin of column `c`.
    pub(super) fn belongs(&self, c: usize) -> Belongs {
        let standard = self.chain.parameter_count();
        if let Some(motor) = c.checked_sub(standard) {
            let (k, which) = (motor / MOTOR_COLUMNS, motor % MOTOR_COLUMNS);
            return match self.transmission.kind(k) {
                Some(DriveKind::Coupled | DriveKind::Varying) => Belongs::Motor(k, which),
                _ => Belongs::Nothing,
            };
        }
        // The joint has no drive inertia if a motor column holds it.
        let drive = c % COLUMNS == column::DRIVE_INERTIA;
        if drive && !self.transmission.has_joint_inertia(c / COLUMNS) {
            Belongs::Nothing
        } else {
            Belongs::Joint(c)
        }
    }
}

/// One equation at many instants: x·β = y.
#[derive(Clone, Debug, Default)]
pub struct Equation {
    /// Row-major, rows × columns.
    pub x: Vec<f64>,
    /// Torque, or the energy of a window scaled to a torque.
    pub y: Vec<f64>,
    /// True if the row is used.
    pub keep: Vec<bool>,
}

/// Rows of one piece.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Time, s (start of the window for the integral model).
    pub t: Vec<f64>,
    /// One per joint for the differential model, one for the integral model.
    pub equations: Vec<Equation>,
    /// Per joint, position at each row.
    pub q: Vec<Vec<f64>>,
    /// Per joint, velocity at each row.
    pub qd: Vec<Vec<f64>>,
}

/// Counts of excluded rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Used rows over all equations.
    pub used: u64,
    /// Per joint (or window), too slow.
    pub slow: Vec<u64>,
    /// Per joint (or window), saturated.
    pub saturated: Vec<u64>,
    /// Rows, before decimation, in segments too short for the filters.
    pub short: u64,
}

impl Tally {
    pub(super) fn count(list: &mut Vec<u64>, k: usize) {
        if list.len() <= k {
            list.resize(k + 1, 0);
        }
        list[k] += 1;
    }

    /// Adds another count.
    pub(super) fn add(&mut self, part: &Self) {
        self.used += part.used;
        self.short += part.short;
        for (list, more) in [
            (&mut self.slow, &part.slow),
            (&mut self.saturated, &part.saturated),
        ] {
            list.resize(list.len().max(more.len()), 0);
            for (a, b) in list.iter_mut().zip(more) {
                *a += b;
            }
        }
    }

    /// Returns the counts as entries for a report.
    pub fn masked(&self) -> Vec<Masked> {
        let entries = |list: &[u64], why: &str| {
            list.iter()
                .enumerate()
                .filter(|(_, rows)| **rows > 0)
                .map(|(k, rows)| Masked {
                    joint: k + 1,
                    rows: *rows,
                    why: why.to_owned(),
                })
                .collect::<Vec<_>>()
        };
        let mut all = entries(
            &self.slow,
            "speed of the joint, or of a motor coupled to it, below the threshold: friction there is not Coulomb and viscous, or its sign is not known",
        );
        all.extend(entries(&self.saturated, "torque at its limit"));
        if self.short > 0 {
            all.push(Masked {
                joint: 0,
                rows: self.short,
                why: "rows of stretches between gaps in time that are too short for the filters"
                    .into(),
            });
        }
        all
    }
}

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
pub(super) fn rows_of(
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

pub(super) fn failed(e: impl std::fmt::Display) -> PrepareError {
    PrepareError::Stopped(e.to_string())
}
