//! The model mathematics over blocks of samples, written for vector registers.
//!
//! A block holds [`LANES`] samples. Every quantity is a [`Lane`]: an array with one entry per sample. Each step of a
//! recursion is one loop over the lanes, and its body is the formula for one sample without branches. Compilers turn it
//! into vector instructions of the width for which the CALLER is compiled: every function here is inlined, so a caller
//! compiled for a wider instruction set gets it throughout. The caller also chooses whether a product is rounded before
//! it is added ([`MulAdd`](crate::lanes::MulAdd)). With [`Rounded`](crate::lanes::Rounded) results are the same to the
//! last bit for any instruction set.
//!
//! Knowledge of the chain saves work in every sample. Twists of a quarter turn and zero lengths select one of a few
//! loop bodies for each joint ([`Frame`]). Parameters with the same action are grouped beforehand ([`Body`]).
//!
//! The kernels are written over the number ([`Element`](crate::lanes::Element)), `f32` or `f64`; chain and parameters are
//! given in `f64` and rounded once.
//!
//! Angles beyond [`ANGLE_LIMIT`](crate::lanes::Element::ANGLE_LIMIT) take one sample at a time: slower, equally accurate.

mod body;
mod columns;
mod derivatives;
mod forward;
mod forward_derivatives;
mod frame;
mod inertia;
mod inverse;
mod lane;
mod regressor;

pub use body::Body;
pub use columns::Section;
pub use derivatives::{DerivativeBlock, inverse_dynamics_derivatives};
pub use forward::{NotPositive, forward_dynamics};
pub use forward_derivatives::{derivative_buffers, forward_dynamics_derivatives};
pub use frame::Frame;
pub use inertia::{CompositeBlock, inertia_matrix, lower};
pub use inverse::{JointBlock, inverse_dynamics};
pub use lane::{LANES, Lane, Lane3};
pub use regressor::{AxisBlock, differential_regressor, energy_regressor};
