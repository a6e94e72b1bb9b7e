#![allow(clippy::unwrap_used, clippy::panic)]

mod made;
mod sensor;
mod torque;
