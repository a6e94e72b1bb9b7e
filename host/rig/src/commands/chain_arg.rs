//! Options that select a chain in the tree of a URDF file.

use clap::Args as ClapArgs;
use rig_model::robot::ChainChoice;

/// The chain of a URDF file that is the robot.
#[derive(Clone, Debug, Default, ClapArgs)]
pub(crate) struct ChainArg {
    /// Link of a URDF that the robot begins at [default: the root; joints above it are locked]
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// Link of a URDF that the robot ends at [default: the end of the only long branch, without a gripper]
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Joint of a URDF that is held at this position, rad or m; repeat for several
    #[arg(long, value_name = "JOINT=VALUE", value_parser = lock)]
    lock: Vec<(String, f64)>,
}

impl ChainArg {
    /// Returns the choice that the options state.
    pub(crate) fn choice(&self) -> ChainChoice {
        ChainChoice {
            base: self.base.clone(),
            tip: self.tip.clone(),
            locks: self.lock.clone(),
        }
    }
}

/// Reads JOINT=VALUE.
fn lock(text: &str) -> Result<(String, f64), String> {
    let wrong = || format!("\"{text}\" is not JOINT=VALUE, such as finger=0.02 (rad or m)");
    let (name, value) = text.rsplit_once('=').ok_or_else(wrong)?;
    let value: f64 = value.trim().parse().map_err(|_| wrong())?;
    if name.is_empty() || !value.is_finite() {
        return Err(wrong());
    }
    Ok((name.to_owned(), value))
}
