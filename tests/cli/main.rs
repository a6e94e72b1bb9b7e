//! The `rig` program as a person meets it at the terminal.
#![allow(clippy::unwrap_used, clippy::panic)]

mod bad_input;
mod cases;
mod clock;
mod compare;
mod compliance;
mod control;
mod diagnose;
mod doctor;
mod documented;
mod effects_page;
mod excite;
mod export;
mod friction_map;
mod inspect;
mod live;
mod load;
mod memory;
mod output;
mod overwrite;
mod project;
mod reference;
mod robots;
mod run;
mod simulate;
mod workflow;
