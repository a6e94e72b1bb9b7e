//! Reads a trajectory as samples.

use std::path::Path;

use super::content::TrajectoryFile;
use super::samples::{SampledReference, check_rate};
use crate::ExciteError;
use crate::interpolation::Samples;
use rig_data::{
    Block, EffortNeed, Implausible, JointColumns, Source, implausible_positions, long_step,
    unit_of_steps,
};
use rig_model::robot::Robot;
use rig_output::format_short;

/// Share of a joint's motion that every second sample may miss of the others. At 10 % a sine has 7.4 samples a period: the
/// interpolation of all samples is within 0.2 % of its position and 2 % of its velocity.
const MISSED: f64 = 0.1;
/// Distance from the interpolation that counts as noise, rad or m: ten steps of the encoder that `rig control` assumes.
const NOISE: f64 = 1e-4;
/// Highest speed of a robot's joint without a described limit, rad/s or m/s.
const FASTEST: f64 = 100.0;
/// Relative difference of two rates that are the same.
const SAME_RATE: f64 = 1e-6;

/// Reads a trajectory as [`load_reference`] does, and interpolates samples of another rate to `rate` (Hz). Returns the
/// rate of the file too, if it was interpolated.
///
/// # Errors
/// As [`load_reference`]; [`ExciteError::Option`] for a rate that is not between 1 Hz and 1 MHz; [`ExciteError::Coarse`] if the samples do not show the motion between them.
pub fn reference_at(
    path: &Path,
    robot: &Robot,
    rate: f64,
) -> Result<(SampledReference, Option<f64>), ExciteError> {
    check_rate(rate)?;
    let read = load_reference(path, robot, rate)?;
    let own = 1.0 / read.period;
    if (own / rate - 1.0).abs() <= SAME_RATE {
        return Ok((read, None));
    }
    let mut even = SampledReference {
        period: 1.0 / rate,
        position: Vec::new(),
        velocity: Vec::new(),
        acceleration: Vec::new(),
    };
    for (j, (position, joint)) in read.position.iter().zip(&robot.joints).enumerate() {
        let rates = (read.velocity.get(j).zip(read.acceleration.get(j)))
            .map(|(v, a)| [v.as_slice(), a.as_slice()]);
        let samples = Samples {
            period: read.period,
            position,
            rates,
        };
        let missed = samples.missed(NOISE);
        if missed > MISSED {
            return Err(ExciteError::Coarse {
                path: path.into(),
                joint: joint.name.clone(),
                rate: own,
                missed,
                most: MISSED,
            });
        }
        // Rounding errors must not take the last instant away.
        let last = ((position.len().saturating_sub(1)) as f64 * rate / own + 1e-6).floor();
        let instants = 0..=last.max(0.0) as usize;
        let all: Vec<_> = (instants.map(|k| samples.at(k as f64 * own / rate))).collect();
        even.position.push(all.iter().map(|r| r.position).collect());
        even.velocity.push(all.iter().map(|r| r.velocity).collect());
        (even.acceleration).push(all.iter().map(|r| r.acceleration).collect());
    }
    Ok((even, Some(own)))
}

/// Reads a trajectory as samples: a `.toml` trajectory sampled at `rate` (Hz), or the `ref` columns of a sampled one
/// (its `q` columns if there are none) at its own rate. Velocities and accelerations are those of the file where its `q` is
/// the reference, as `rig excite` writes it; otherwise there are none.
///
/// # Errors
/// [`ExciteError`] with the place of the error.
pub fn load_reference(
    path: &Path,
    robot: &Robot,
    rate: f64,
) -> Result<SampledReference, ExciteError> {
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase);
    if extension.as_deref() == Some("toml") {
        let file = TrajectoryFile::load(path)?;
        file.fits(robot, path)?;
        return file.sampled(rate);
    }
    let source = Source::open_with(path, robot, EffortNeed::Optional)?;
    let mut sampled = SampledReference {
        period: source.sampling().period,
        position: vec![Vec::new(); robot.joints.len()],
        velocity: Vec::new(),
        acceleration: Vec::new(),
    };
    let uneven = |row| ExciteError::Uneven {
        path: path.into(),
        row,
    };
    let mut designed = true;
    let blocks = source.read_all()?.0;
    if let Some(what) = blocks.first().and_then(|all| wrong_unit(all, robot)) {
        return Err(ExciteError::Units {
            path: path.into(),
            what,
        });
    }
    for (k, block) in blocks.iter().enumerate() {
        if source.sampling().irregular || k > 0 {
            return Err(uneven(block.first_line));
        }
        for (to, from) in sampled.position.iter_mut().zip(&block.joints) {
            to.extend(from.reference.as_ref().unwrap_or(&from.q));
            designed &= from.reference.as_ref() == Some(&from.q);
            designed &= from.qd.is_some() && from.qdd.is_some();
        }
    }
    if let (true, Some(block)) = (designed, blocks.first()) {
        let each = |pick: fn(&JointColumns) -> &Option<Vec<f64>>| -> Vec<Vec<f64>> {
            (block.joints.iter().flat_map(pick).cloned()).collect()
        };
        sampled.velocity = each(|joint| &joint.qd);
        sampled.acceleration = each(|joint| &joint.qdd);
    }
    // One sample has no period.
    if sampled.period <= 0.0 {
        return Err(uneven(1));
    }
    Ok(sampled)
}

/// Returns what is wrong with the units of a trajectory, by the checks of recordings; `None` if nothing is.
fn wrong_unit(block: &Block, robot: &Robot) -> Option<String> {
    let wanted = Block {
        t: block.t.clone(),
        joints: (block.joints.iter())
            .map(|own| JointColumns {
                q: own.reference.as_ref().unwrap_or(&own.q).clone(),
                ..JointColumns::default()
            })
            .collect(),
        ..Block::default()
    };
    let column = |joint: usize| match block.joints[joint - 1].reference {
        Some(_) => "ref",
        None => "q",
    };
    implausible_positions(&wanted, robot)
        .into_iter()
        .find_map(|own| match own {
            Implausible::Degrees {
                joint,
                lowest,
                highest,
                limit,
                ..
            } => Some(format!(
                "{}{joint} looks like degrees (range {} to {}, while the joint reaches {} rad); give it in rad",
                column(joint),
                format_short(lowest),
                format_short(highest),
                format_short(limit)
            )),
            _ => None,
        })
        .or_else(|| long_steps(&wanted, robot))
}

/// Returns a sentence if t is in milliseconds or less: its steps are long, and the motion is possible in a thousandth of
/// the time. A motion that is sampled as seldom and is possible in seconds alone is left.
fn long_steps(block: &Block, robot: &Robot) -> Option<String> {
    let step = long_step(&block.t)?;
    let possible = (block.joints.iter().zip(&robot.joints)).all(|(own, joint)| {
        let limit = joint.limits.as_ref().map_or(FASTEST, |own| own.velocity);
        let largest = (own.q.windows(2)).fold(0.0f64, |most, q| most.max((q[1] - q[0]).abs()));
        largest / (1e-3 * step) <= 10.0 * limit
    });
    possible.then(|| {
        format!(
            "t looks like {} (its steps are {step:.4}); give it in s, or at more than 5 Hz if it is in s",
            unit_of_steps(step)
        )
    })
}
