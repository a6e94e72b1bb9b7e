#![allow(clippy::unwrap_used, clippy::panic)]

mod causes;
mod columns;
mod controllers;
mod frozen;
mod made;
mod sensor;
mod sentences;
mod solids;
mod torque;
mod warm_up;
mod zeroed;
