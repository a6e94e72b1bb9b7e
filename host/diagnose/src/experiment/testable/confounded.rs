//! Effects that are collinear in torque and motion.

use rig_shared::effects::{Confusion, Kind};

use crate::recordings::external_load;
use rig_data::runs::Run;

/// Returns the effects that are collinear with this one in torque and motion, and the remedies. Pairs that these runs
/// resolve by a voltage or by a run without external loads are left out.
pub fn confounded(kind: Kind, joint: usize, runs: &[Run]) -> Vec<&'static Confusion> {
    let voltage = !runs.is_empty()
        && runs
            .iter()
            .all(|run| run.joints.get(joint).is_some_and(|j| j.voltage.is_some()));
    let is = |name: &str, of: fn(Kind) -> bool| Kind::from_name(name, None).is_some_and(of);
    let by_pull = |with: &str| {
        external_load::told_apart(runs) && kind.is_external() != is(with, Kind::is_external)
    };
    let by_voltage = |with: &str| voltage && (is_of_sensor(kind) || is(with, is_of_sensor));
    (kind.about().confused.iter())
        .filter(|c| c.exact && !by_pull(c.with) && !by_voltage(c.with))
        .collect()
}

/// Returns true for a reading of the current sensor without a current: the voltage follows the true current.
fn is_of_sensor(kind: Kind) -> bool {
    kind == Kind::CurrentOffset
}
