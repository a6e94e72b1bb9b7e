//! The pose and the force that show the stiffness of a drive.

use nalgebra::Vector3;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::SeedableRng;

use crate::error::ComplianceError;
use crate::map::range;
use crate::tool_point::ToolPoint;

/// Number of poses tried.
const POSES: usize = 400;

/// A pose with a force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Advice {
    /// Pose.
    pub pose: Vec<f64>,
    /// Direction of the force in the base axes.
    pub direction: [f64; 3],
    /// Torque of the drive per force.
    pub arm: f64,
    /// Share of the drive in the displacement if all drives were equally stiff.
    pub share: f64,
}

/// Finds the pose within the limits where a force at the tool point loads drive `k` most and the others least. The same
/// robot gives the same pose. `None` if no force at the tool point loads the drive.
///
/// # Errors
/// [`ComplianceError::Model`].
pub(crate) fn advice(tool: &ToolPoint<'_>, k: usize) -> Result<Option<Advice>, ComplianceError> {
    let mut dice = Pcg64Mcg::seed_from_u64(1);
    let ranges: Vec<[f64; 2]> = (0..tool.count()).map(|j| range(tool, j)).collect();
    let mut best: Option<(f64, Advice)> = None;
    for _ in 0..POSES {
        let pose: Vec<f64> = (ranges.iter())
            .map(|[low, high]| low + (high - low) * dice.random::<f64>())
            .collect();
        let per_twist = match tool.per_twist(&pose) {
            Ok((_, per_twist)) => per_twist,
            Err(ComplianceError::SingularDrives { .. }) => continue,
            Err(other) => return Err(other),
        };
        let column = |j: usize| Vector3::from(per_twist.fixed_view::<3, 1>(0, j));
        let own = column(k);
        let arm = own.norm();
        if !(arm > 1e-9) {
            continue;
        }
        let along = own / arm;
        let squares: f64 = (0..tool.count())
            .map(|j| column(j).dot(&along).powi(2))
            .sum();
        let share = arm * arm / squares;
        let score = share * arm;
        if best.as_ref().is_none_or(|(most, _)| score > *most) {
            best = Some((
                score,
                Advice {
                    pose,
                    direction: along.into(),
                    arm,
                    share,
                },
            ));
        }
    }
    Ok(best.map(|(_, advice)| advice))
}
