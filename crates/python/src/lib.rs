//! The native part of the Python package `ctid`: arrays in, results of the crates out. No algorithm is in it.
//!
//! | what | where |
//! |---|---|
//! | exceptions | `error.rs`; the names of arguments in their messages: `message_names.rs` |
//! | arguments that are arrays of numbers | `arrays.rs` |
//! | long work: the interpreter's lock is released, Ctrl-C is heard | `work.rs` |
//! | frames as the program reads its records | `frame.rs` |
//! | a user's own model, its fit, its diagnosis | `model.rs` with its records in `own.rs`, `fit.rs`, `diagnosis.rs` |
//! | the matrices of a model about a point | `linear.rs` |
//! | one of the plants, its model file, its fit, its next experiment, its text | `tank_model.rs`, `tank_file.rs`, `tank.rs`, `tank_design.rs`, `tank_text.rs` |
//! | a model that runs in parallel with the plant | `monitor.rs` |
//! | linear models from records | `identify.rs` |
//! | recursive estimators, and output error in a loop | `rls.rs`, `oe.rs` |
//! | published tables | `tables.rs` |
//! | results for Python: curves and matrices, simulations, JSON | `series.rs`, `simulation.rs`, `json.rs` |
//! | the time limit of a search | `time_limit.rs` |
//! | objects as bytes, for `pickle` | `bytes.rs` |
//!
//! What users see is in `python/ctid`: it makes frames of these arrays and says what types there are.

mod arrays;
mod bytes;
mod diagnosis;
mod error;
mod fit;
mod frame;
mod identify;
mod json;
mod linear;
mod message_names;
mod model;
mod monitor;
mod oe;
mod own;
mod rls;
mod series;
mod simulation;
mod tables;
mod tank;
mod tank_design;
mod tank_file;
mod tank_model;
mod tank_text;
mod time_limit;
mod work;

use pyo3::prelude::*;

/// Native classes and functions.
#[pymodule]
mod _ctid {
    #[pymodule_export]
    use crate::diagnosis::Diagnosis;
    #[pymodule_export]
    use crate::error::{DataError, Error, ModelError};
    #[pymodule_export]
    use crate::fit::Fit;
    #[pymodule_export]
    use crate::frame::Frame;
    #[pymodule_export]
    use crate::identify::identify;
    #[pymodule_export]
    use crate::model::Model;
    #[pymodule_export]
    use crate::monitor::Monitor;
    #[pymodule_export]
    use crate::oe::{StabilizedOe, fcloe_fit};
    #[pymodule_export]
    use crate::rls::ContinuousRls;
    #[pymodule_export]
    use crate::tables::{baysse_tables, udink_tables};
    #[pymodule_export]
    use crate::tank::TankFit;
    #[pymodule_export]
    use crate::tank_design::tank_design;
    #[pymodule_export]
    use crate::tank_model::Tank;
    #[pymodule_export]
    use crate::time_limit::time_limit;
}
