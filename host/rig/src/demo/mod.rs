//! The demonstration without hardware: a rig that differs from its description is excited, recorded over the real wire
//! protocol, identified off-line and on-line, diagnosed and compensated. One report shows all results.

mod error;
mod figures;
mod motions;
mod result;
mod run;

pub use error::DemoError;
pub use result::Demo;
pub use run::run;
