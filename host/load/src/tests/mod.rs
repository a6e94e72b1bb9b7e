#![allow(clippy::unwrap_used, clippy::panic)]

mod causes;
mod made;
mod sensor;
mod torque;
