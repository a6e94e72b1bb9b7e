//! Which chain of a URDF tree is the robot.

/// A choice of the chain that is the robot, within the tree of links of a URDF file.
///
/// Without a base the chain begins at the root of the tree. Without a tip it is found by rule; a tree with several equally
/// long branches is then refused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChainChoice {
    /// Link that the chain begins at. Joints above it are locked.
    pub base: Option<String>,
    /// Link that the chain ends at. What it carries is part of the last body.
    pub tip: Option<String>,
    /// Joints that are fixed at a value, rad or m.
    pub locks: Vec<(String, f64)>,
}
