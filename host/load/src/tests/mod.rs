#![allow(clippy::unwrap_used, clippy::panic)]

mod causes;
mod columns;
mod frozen;
mod made;
mod sensor;
mod sentences;
mod torque;
mod warm_up;
mod zeroed;
