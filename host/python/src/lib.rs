//! The Python package `rig_dynamics`: robot descriptions, dynamics, recordings, identification and diagnosis over NumPy
//! arrays.
//!
//! This crate converts between Python and the libraries of the workspace. Checks of recordings, their sentences and the
//! written files are those of the program `rig`. `package/rig_dynamics/_native.pyi` documents every function for its users.

mod array;
mod base;
mod diagnosis;
mod dynamics;
mod error;
mod excitation;
mod identification;
mod inputs;
mod json;
mod load;
mod recording;
mod robot;
mod simulation;
mod trajectory;
mod watch;

/// The native part of the package; `package/rig_dynamics/__init__.py` re-exports it.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::base::{BaseParameters, base_parameters};
    #[pymodule_export]
    use super::diagnosis::{Diagnosis, Step, Value, diagnose};
    #[pymodule_export]
    use super::error::{Error, Remark};
    #[pymodule_export]
    use super::excitation::excite;
    #[pymodule_export]
    use super::identification::{BaseParameter, Identification, JointFit, identify};
    #[pymodule_export]
    use super::load::{LoadIdentification, identify_load};
    #[pymodule_export]
    use super::recording::Recording;
    #[pymodule_export]
    use super::robot::Robot;
    #[pymodule_export]
    use super::simulation::simulate;
    #[pymodule_export]
    use super::trajectory::Trajectory;
}
