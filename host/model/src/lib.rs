//! Robot descriptions and their dynamics.
//!
//! [`robot`] reads TOML and URDF. [`batch`] evaluates dynamics and regressors over whole recordings with vector
//! instructions. [`effects`] holds the effects beyond the standard model. [`simulate`] closes the loop of model and
//! controller. The equations are in `rig-shared`, which the firmware uses as well.
//!
//! Torques of a six-joint arm along a motion, all samples in one call:
//!
//! ```
//! use rig_model::batch::ModelBatch;
//! use rig_model::robot::{Robot, TX40};
//! use rig_shared::multibody::Chain;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let robot = Robot::from_toml(TX40, "tx40.toml".as_ref())?;
//! let chain = robot.chain()?;
//! // In f64; a ModelBatch<f32> takes signals of f32.
//! let model: ModelBatch = ModelBatch::new(&chain, &robot.standard_parameters())?;
//! let still = vec![vec![0.0; 1000]; 6];
//! let position = vec![vec![0.3; 1000]; 6];
//! let mut torque = vec![0.0; 6 * 1000];
//! model.inverse_dynamics(&position, &still, &still, &mut torque)?;
//! let mut gravity = vec![0.0; 6 * 1000];
//! model.gravity(&position, &mut gravity)?;
//! assert!((torque[1000] - gravity[1000]).abs() < 1e-9);
//! # Ok(())
//! # }
//! ```

pub mod batch;
pub mod effects;
pub mod robot;
pub mod simulate;
