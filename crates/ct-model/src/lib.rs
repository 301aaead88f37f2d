//! Lumped models in continuous time as text, in a flat subset of Modelica, the language in which engineers already write physical models.
//!
//! ```
//! use ct_model::ModelSpec;
//!
//! let text = r#"
//! model HeatedBlock "a block with a heater, in a room"
//!   parameter Real C(unit="J/K", min=0) = 50 "heat capacity";
//!   parameter Real k(unit="W/K", min=0) = 0.1 "loss to the room";
//!   parameter Real g(unit="W/%", min=0) = 0.02 "heater";
//!   input Real u(unit="%");
//!   input Real Ta(unit="degC");
//!   output Real y(unit="degC") = T;
//!   Real T(unit="degC", start=20);
//!   Real loss(unit="W") = k*(T - Ta);
//! equation
//!   C*der(T) = g*u - loss;
//! end HeatedBlock;
//! "#;
//! let model = ModelSpec::parse(text)?;
//! assert_eq!((model.states.len(), model.inputs.len(), model.outputs.len()), (1, 2, 1));
//!
//! // A construct outside the subset is an error with its place and the correction.
//! let error = ModelSpec::parse(&text.replace("k*(T", "kk*(T")).unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "10:25: `kk` is not declared: declare it, or did you mean `k`?"
//! );
//! # Ok::<(), ct_model::TextError>(())
//! ```
//!
//! # The subset
//! - One `model`: declarations of `Real` variables, then equations. No `connect`, no inheritance, no arrays, no acausal equations: every
//!   state has one equation `der(x) = e` or `c*der(x) = e`, every other variable one assignment, in its declaration or under `equation`, in
//!   any order. A circle of assignments is refused with its names.
//! - `parameter` is fitted, and its value is where a fit starts; `final parameter` and `constant` are not fitted. A `final parameter` that
//!   others define follows them. `min` and `max` bound the fit. `start` of a state is where its initial value starts; `fixed=true`: it is
//!   known.
//! - `+ - * / ^`, comparison, `and or not`, `if then elseif else`, the functions of [`Function`], `time`, `delay(x, d)`. `noEvent` and
//!   `smooth` are read and mean nothing more.
//! - Everything else is refused ([`TextError`]). An unknown name is an error, never zero.
//!
//! [`ModelSpec`] prints as text that reads back as the same model ([`ModelSpec::parse`]). [`unit_warnings`] says where units do not fit
//! together, [`check_units`] at which place of a text, and which units are unknown, [`implied_time_unit`] per which
//! unit of time the units make `der()`.
//!
//! **Reference**: Modelica Association, Modelica - A Unified Object-Oriented Language for Systems Modeling, Language Specification 3.6,
//! 2023: appendix A for the grammar of expressions.

pub mod effects;
mod expression;
mod hard_nonlinearity;
mod linear_form;
mod linearity;
mod scalar;
mod simulation;
mod spec;
mod tape;
mod text;
mod time_unit;
mod units;

pub use expression::{Comparison, Condition, Expression, Function, Operator, Variable};
pub use hard_nonlinearity::OperatingPoint;
pub use linear_form::{LinearForm, TransferFunction};
pub use linearity::Linearity;
pub use scalar::{Dual, Scalar};
pub use simulation::{
    Method, Model, NoSolution, SharedSimulation, Simulation, SimulationNumber, TOLERANCE,
};
pub use spec::{About, Flow, Given, Input, ModelSpec, Output, Parameter, State};
pub use text::{Position, TextError, check_units};
pub use time_unit::implied_time_unit;
pub use units::{UnitWarning, unit_warnings};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
