//! Tests against physics of other code.

#![allow(clippy::unwrap_used, clippy::panic)]

mod frequency;
mod friction;
mod loading;
mod noisy_force;
mod periodic;
mod rig;
mod statics;
mod weight;
mod yielding;
