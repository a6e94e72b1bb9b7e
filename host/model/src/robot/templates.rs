//! The descriptions that come with the program.

/// Description that `rig init one-link` writes: the one-link rig. Every line has its unit and meaning.
pub const ONE_LINK_TEMPLATE: &str = include_str!("../../../robots/one-link.toml");

/// The EMPS axis (Janot, Gautier, Brunot 2019) without prior inertial or friction values.
pub const EMPS: &str = include_str!("../../../robots/emps.toml");

/// The IRp-6 with its ball screws, absolute drives and coupled wrist. Each figure has its source.
pub const IRP6_TEMPLATE: &str = include_str!("../../../robots/irp6.toml");

/// A planar arm with two direct drives, like the EDDA. Every figure is representative.
pub const EDDA_TEMPLATE: &str = include_str!("../../../robots/edda.toml");

/// The Stäubli TX40 with its coupled wrist, for its published recording.
pub const TX40: &str = include_str!("../../../robots/tx40.toml");

/// The double pendulum of the DFKI whose public recordings the project reproduces.
pub const DOUBLE_PENDULUM: &str = include_str!("../../../robots/double-pendulum.toml");

/// The pendulum on a Dynamixel XL330. Its public recordings have a voltage and no current.
pub const XL330: &str = include_str!("../../../robots/xl330.toml");

/// Returns the commented description that `rig init <kind>` writes, or `None` for an unknown kind.
pub fn template(kind: &str) -> Option<&'static str> {
    match kind {
        "one-link" => Some(ONE_LINK_TEMPLATE),
        "edda" => Some(EDDA_TEMPLATE),
        "irp6" => Some(IRP6_TEMPLATE),
        "emps" => Some(EMPS),
        "tx40" => Some(TX40),
        "double-pendulum" => Some(DOUBLE_PENDULUM),
        "xl330" => Some(XL330),
        _ => None,
    }
}
