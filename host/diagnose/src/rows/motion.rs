//! Motion of all joints over a run.

use rig_data::runs::{JointRun, Run};

/// Returns position, velocity and acceleration of all joints over a run.
pub(crate) fn motion_of(run: &Run) -> [Vec<Vec<f64>>; 3] {
    let of = |pick: fn(&JointRun) -> &Vec<f64>| -> Vec<Vec<f64>> {
        run.joints.iter().map(|j| pick(j).clone()).collect()
    };
    [of(|j| &j.q), of(|j| &j.qd), of(|j| &j.qdd)]
}

/// Returns the motion of the links, where link encoders were recorded, else of the joints.
pub(crate) fn links_of(run: &Run) -> [Vec<Vec<f64>>; 3] {
    let mut motion = motion_of(run);
    for (j, joint) in run.joints.iter().enumerate() {
        if let Some(link) = &joint.link {
            for (to, from) in motion.iter_mut().zip(link) {
                to[j].clone_from(from);
            }
        }
    }
    motion
}
