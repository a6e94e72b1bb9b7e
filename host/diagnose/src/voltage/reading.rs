//! Reading of recordings for a voltage-driven simulation, with the controllers that they show.

use crate::DiagnoseError;
use crate::voltage::law::Law;
use crate::voltage::log::{Log, SIDE};
use rig_data::prepare::Recording;
use rig_numerics::statistics;

/// Row distance, in periods, above which there is a gap; a closer voltage is known well enough.
const GAP: f64 = 5.0;
/// Column that shows whether the drive is on.
const ENABLE: &str = "torque_enable";
/// Column of the supply's voltage.
const SUPPLY: &str = "supply";

/// Reads the first joint of `recordings`.
///
/// # Errors
/// Errors of reading; a recording without a voltage.
pub(crate) fn logs(recordings: &[&dyn Recording]) -> Result<Vec<Log>, DiagnoseError> {
    let mut list: Vec<Log> = Vec::new();
    for source in recordings {
        let first = list.len();
        source.each_block(65_536, &mut |block| {
            let follows = |log: &Log| {
                let rows = log.t.len();
                rows > 1
                    && block.t.first().is_some_and(|t| {
                        let period = (log.t[rows - 1] - log.t[0]) / (rows - 1) as f64;
                        t - log.t[rows - 1] < GAP * period
                    })
            };
            let joins = list.len() > first && list.last().is_some_and(follows);
            if !(block.continues && list.len() > first || joins) {
                list.push(Log {
                    label: source.label(),
                    ..Log::default()
                });
            }
            let rows = block.len();
            let on = block.extra.iter().find(|(name, _)| name == ENABLE);
            let on = on.map_or_else(
                || vec![true; rows],
                |(_, c)| c.iter().map(|x| *x != 0.0).collect(),
            );
            let supply = block.extra.iter().find(|(name, _)| name == SUPPLY);
            let supply = supply.map_or_else(|| vec![1.0; rows], |(_, c)| c.clone());
            if let (Some(log), Some(joint)) = (list.last_mut(), block.joints.into_iter().next()) {
                log.t.extend(block.t);
                log.q.extend(joint.q);
                log.u.extend(joint.voltage.unwrap_or_default());
                log.on.extend(on);
                log.supply.extend(supply);
                log.reference.extend(joint.reference.unwrap_or_default());
            }
            Ok(())
        })?;
        if list[first..].iter().any(|log| log.u.len() != log.t.len()) {
            return Err(DiagnoseError::NoVoltage(source.label()));
        }
    }
    // A log shorter than two parabolas is not simulated.
    list.retain(|log| log.t.len() > 4 * SIDE);
    for log in &mut list {
        log.read_controller();
    }
    // The result must not depend on the order of the files. In this order, folds have weak and strong motions each.
    let strength = |log: &Log| statistics::mean_square(&log.u);
    list.sort_by(|a, b| (strength(a).total_cmp(&strength(b))).then_with(|| a.label.cmp(&b.label)));
    Ok(list)
}

impl Log {
    /// Identifies the controller from the rows.
    pub(crate) fn read_controller(&mut self) {
        self.read_slopes();
        if let Some(law) = Law::of(self) {
            (self.law, self.integral) = (Some(law.controller), law.integral);
        }
    }
}
