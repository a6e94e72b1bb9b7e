//! Controllers in recordings of a voltage-driven joint.

use crate::voltage::log::Log;
use rig_model::robot::{AntiWindup, VoltageController};

/// Largest relative difference between proportional gains of one controller. 10 %: on the XL330 recordings gains of one
/// setting differed by 1 %, settings by 100 % (November 2026).
const ONE: f64 = 0.1;

/// One controller and its number of recordings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    /// Mean of the gains.
    pub controller: VoltageController,
    /// Number of recordings.
    pub count: usize,
}

/// Recordings whose controller drives the model in the closed loop, instead of the recorded voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Driven {
    /// Number of these recordings.
    pub closed: usize,
    /// Number of all.
    pub all: usize,
}

/// Returns the controllers of recordings, by number of recordings; among equals the stiffer first.
pub(crate) fn shown(logs: &[Log]) -> Vec<Shown> {
    let mut groups: Vec<Vec<VoltageController>> = Vec::new();
    for law in logs.iter().filter_map(|log| log.law) {
        let near = |group: &&mut Vec<VoltageController>| {
            let other = group[0].proportional;
            (law.proportional - other).abs() <= ONE * law.proportional.max(other)
        };
        match groups.iter_mut().find(near) {
            Some(group) => group.push(law),
            None => groups.push(vec![law]),
        }
    }
    let mut list: Vec<Shown> = (groups.iter())
        .map(|group| Shown {
            controller: merged(group),
            count: group.len(),
        })
        .collect();
    list.sort_by(|a, b| {
        let stiffness = |s: &Shown| s.controller.proportional;
        (b.count.cmp(&a.count)).then_with(|| stiffness(b).total_cmp(&stiffness(a)))
    });
    list
}

/// Returns the mean gains; a term counts with all recordings, even if only some resolve it.
fn merged(group: &[VoltageController]) -> VoltageController {
    let mean =
        |of: fn(&VoltageController) -> f64| group.iter().map(of).sum::<f64>() / group.len() as f64;
    let first = group[0];
    let clamps = |c: &&VoltageController| c.anti_windup == AntiWindup::Clamping;
    VoltageController {
        proportional: mean(|c| c.proportional),
        integral: mean(|c| c.integral),
        derivative: mean(|c| c.derivative),
        velocity_feedforward: mean(|c| c.velocity_feedforward),
        acceleration_feedforward: mean(|c| c.acceleration_feedforward),
        // Beside an integral, the constant is its initial value in one recording.
        bias: match group.iter().any(|c| c.integral != 0.0) {
            true => 0.0,
            false => mean(|c| c.bias),
        },
        limit: group
            .iter()
            .fold(first.limit, |most, c| match (most, c.limit) {
                (Some(a), Some(b)) => Some(a.max(b)),
                _ => None,
            }),
        anti_windup: match 2 * group.iter().filter(clamps).count() > group.len() {
            true => AntiWindup::Clamping,
            false => AntiWindup::None,
        },
        supply: [mean(|c| c.supply[0]), mean(|c| c.supply[1])],
    }
}
