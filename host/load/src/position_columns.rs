//! Position columns that are exchanged or reversed, or have another zero, in poses at rest that no cause explains.
//!
//! Each change is undone and the load fitted again. Leaves out: several changes at once, and motions.

use rig_data::Block;
use rig_data::prepare::{Changed, Recording};
use rig_model::robot::{JointKind, Robot, WristSensor};
use rig_output::{capital, format_significant};

use crate::causes::{EXPLAINED, explains};
use crate::error::LoadError;
use crate::intake::{Intake, Sensing, judged};
use crate::mounting::Mounting;
use crate::settle::DECISIVE;
use crate::system::{Sensed, Unknowns};

/// Zeros that are tried over a turn: gravity turns by a tenth of its size between two.
const ZEROS: i32 = 64;
/// Halvings of the step from the best of them.
const HALVINGS: i32 = 16;

/// A change of the position columns.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// The positions of two joints are exchanged.
    Exchanged(usize, usize),
    /// The position of a joint has the opposite sign.
    Reversed(usize),
    /// The position of a joint is counted from another zero: the angle to add, rad.
    Zero(usize, f64),
}

impl Change {
    fn words(&self) -> [String; 2] {
        match *self {
            Self::Exchanged(a, b) => [
                format!("q{} and q{} are exchanged", a + 1, b + 1),
                "exchange these columns".to_owned(),
            ],
            Self::Reversed(j) => [
                format!("q{} has the opposite sign", j + 1),
                format!("reverse the column q{}", j + 1),
            ],
            Self::Zero(j, angle) => [
                format!(
                    "q{} is counted from another zero ({} rad to be added)",
                    j + 1,
                    format_significant(angle, 3)
                ),
                format!("check the zero of q{}", j + 1),
            ],
        }
    }

    /// Takes the change out of a block.
    fn undo(self, block: &mut Block) {
        match self {
            Self::Exchanged(a, b) => block.joints.swap(a, b),
            Self::Reversed(j) => block.joints[j].q.iter_mut().for_each(|q| *q = -*q),
            Self::Zero(j, angle) => block.joints[j].q.iter_mut().for_each(|q| *q += angle),
        }
    }
}

/// Says which change of the position columns explains readings at rest that nothing else does; `None` if none does.
///
/// # Errors
/// [`LoadError`].
pub(crate) fn changed_positions(
    sensing: &Sensing,
    sensor: &WristSensor,
    like: &Sensed,
    mounting: &Mounting,
) -> Result<Option<String>, LoadError> {
    let try_out = |change: Change| misfit(sensing, sensor, like, (mounting, change));
    let joints = sensing.robot.joints.len();
    let mut found: Vec<(f64, Change)> = Vec::new();
    let mut offer = |change: Change| -> Result<(), LoadError> {
        found.extend(try_out(change)?.map(|misfit| (misfit, change)));
        Ok(())
    };
    for a in 0..joints {
        offer(Change::Reversed(a))?;
        for b in a + 1..joints {
            offer(Change::Exchanged(a, b))?;
        }
        if let Some(angle) = zero(sensing.robot, a, &try_out)? {
            offer(Change::Zero(a, angle))?;
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(least) = found.first().map(|own| own.0) else {
        return Ok(None);
    };
    let as_good = found.iter().take_while(|own| own.0 < least + DECISIVE);
    let words: Vec<[String; 2]> = as_good.take(2).map(|own| own.1.words()).collect();
    let [what, remedy] = [0, 1].map(|k| {
        let all: Vec<&str> = words.iter().map(|own| own[k].as_str()).collect();
        all.join(", or ")
    });
    Ok(Some(format!(
        "The positions look wrong: {what}. As recorded a rigid load leaves more than {} % of what the sensor reads beside the bias, otherwise less. {}.",
        format_significant(100.0 * EXPLAINED, 2),
        capital(&remedy)
    )))
}

/// Returns the angle to add to the position of a joint, rad, with which a rigid load leaves least; `None` for a joint that
/// does not turn, or if no angle leaves about the noise.
fn zero(
    robot: &Robot,
    joint: usize,
    try_out: &dyn Fn(Change) -> Result<Option<f64>, LoadError>,
) -> Result<Option<f64>, LoadError> {
    if robot.joints[joint].kind != JointKind::Revolute {
        return Ok(None);
    }
    let mut step = std::f64::consts::TAU / f64::from(ZEROS);
    let mut best: Option<(f64, f64)> = None;
    for k in (1 - ZEROS / 2..=ZEROS / 2).filter(|k| *k != 0) {
        let angle = step * f64::from(k);
        if let Some(misfit) = try_out(Change::Zero(joint, angle))?
            && best.is_none_or(|(least, _)| misfit < least)
        {
            best = Some((misfit, angle));
        }
    }
    for _ in 0..HALVINGS {
        step *= 0.5;
        let Some((_, middle)) = best else { break };
        for angle in [middle - step, middle + step] {
            if let Some(misfit) = try_out(Change::Zero(joint, angle))?
                && best.is_none_or(|(least, _)| misfit < least)
            {
                best = Some((misfit, angle));
            }
        }
    }
    Ok(best.map(|(_, angle)| angle))
}

/// Returns the misfit of a load without a change of the positions; `None` if it leaves more than about the noise.
fn misfit(
    sensing: &Sensing,
    sensor: &WristSensor,
    like: &Sensed,
    (mounting, change): (&Mounting, Change),
) -> Result<Option<f64>, LoadError> {
    let undo = |block: &mut Block| change.undo(block);
    let all: Vec<Changed> = (sensing.recordings.iter())
        .map(|(inner, _)| Changed {
            inner: *inner,
            change: &undo,
        })
        .collect();
    let pairs = all.iter().zip(sensing.recordings);
    let recordings: Vec<(&dyn Recording, bool)> = pairs
        .map(|(own, (_, loaded))| (own as &dyn Recording, *loaded))
        .collect();
    let sensing = Sensing {
        recordings: &recordings,
        ..*sensing
    };
    let judged = judged(&sensing, sensor)?;
    if judged.iter().any(|own| !own.poses) {
        return Ok(None);
    }
    let intake = Intake::of(&sensing, sensor, judged, Vec::new(), &[])?;
    let recordings = intake.read(0.0, &[], &mut Vec::new())?;
    let sensed = Sensed {
        recordings: &recordings,
        ..*like
    };
    let unknowns = Unknowns {
        tool: recordings.iter().any(|own| !own.loaded),
        ..Unknowns::default()
    };
    let fit = sensed.fit(mounting, &unknowns);
    Ok(explains(&sensed, &fit).then(|| fit.misfit()))
}
