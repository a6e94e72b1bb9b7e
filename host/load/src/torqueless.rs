//! A recording of the sensor that may have no joint torques.

use rig_data::Block;
use rig_data::prepare::{PrepareError, Recording};

/// A recording whose missing torques are zero: the survey of the motion asks for them, the sensor does not.
pub(crate) struct Torqueless<'a>(pub(crate) &'a dyn Recording);

impl Recording for Torqueless<'_> {
    fn source(&self) -> Option<&dyn Recording> {
        Some(self.0)
    }

    fn each_block(
        &self,
        rows: usize,
        take: &mut dyn FnMut(Block) -> Result<(), PrepareError>,
    ) -> Result<(), PrepareError> {
        self.0.each_block(rows, &mut |mut block| {
            let rows = block.len();
            for joint in &mut block.joints {
                joint.tau.resize(rows, 0.0);
            }
            take(block)
        })
    }
}
