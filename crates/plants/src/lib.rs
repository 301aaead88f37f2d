//! Tank models as chains actuator -> vessels -> sensor, and the catalogue of effects that may be missing from a model.
//!
//! A [`Structure`] is a plant with its active effects. A [`Simulator`] steps a structure from sample to sample for any [`Scalar`]: `f64`,
//! or [`Dual`]s that carry exact derivatives.
//!
//! ```
//! use plants::{Command, Known, Plant, Scales, Simulator, Structure};
//!
//! # fn main() -> Result<(), plants::Error> {
//! let scales = Scales::from_ranges((0.0, 10.0), (5.0, 20.0), 1.0, 600.0);
//! let tank = Structure::new(Plant::SingleTank, Known { area: [Some(154.0), None, None], ..Known::default() }, scales);
//! // pump_gain [cm^3/(V s)], alpha [cm^2.5/s]; level(0) = 9 cm; the command before the record is 4 V.
//! let mut simulator = Simulator::<f64>::new(&tank, &[9.0, 11.0], &[9.0], 4.0)?;
//! let before = simulator.read(0);
//! simulator.advance(Command::held(5.0), 1.0);
//! assert!(simulator.read(0) > before);
//! # Ok(())
//! # }
//! ```
//!
//! # Measured disturbances
//! The second input of a record is, for joined tanks, the command to the second pump. For every other plant it may be a measured flow into
//! a vessel ([`Known::disturbance`]), held or a ramp between samples, with its own gain: `S dH/dt = ... + disturbance_gain d` or, if the
//! outflow is linear, `tau dy/dt + y = ... + disturbance_gain d`. Effects at the actuator do not act on the disturbance.
//!
//! # Steps longer than a time constant
//! A step of up to one time constant of the fastest vessel is a Runge-Kutta step of order four. A longer step is cut into parts of doubling
//! length, each an exponential Runge-Kutta step (ETDRK4): S. M. Cox, P. C. Matthews, J. Computational Physics 176 (2002) 430-455; A.-K.
//! Kassam, L. N. Trefethen, SIAM J. Scientific Computing 26 (2005) 1214-1233. A vessel that is near its steady state takes one part. With
//! one step per sample of 1.6 to 45 time constants, any single effect and levels from 4 to 20, the error of the output is at most 0.0003
//! (linear vessels; without an effect in a vessel, linear plants are exact) and 0.006 (Torricelli):
//! `cargo test -p plants --test all fast_vessels:: -- --nocapture`. If a level changes so much within the shortest part, 1/32 of a step,
//! that its decay rate is not constant, that part is an implicit step of order one, which conserves mass.

mod actuator;
pub mod controller;
mod damped;
mod domain;
pub mod effects;
mod error;
mod inflow;
mod known;
mod lag_response;
mod law;
mod limits;
mod linear;
mod moments;
mod names;
mod plant;
mod scales;
mod sensor;
mod simulator;
mod structure;
mod term;
mod text;
mod unit;
mod vessels;

pub use ct_model::{Dual, Scalar};
pub use domain::Domain;
pub use effects::{CATALOGUE, EffectInfo, Place};
pub use error::Error;
pub use known::Known;
pub use law::{Balance, Law, Rim, Side};
pub use limits::MAX_VESSELS;
pub use names::Names;
pub use plant::{Outlet, ParameterInfo, Plant};
pub use scales::{Deciles, OutputScales, Picked, Scales, deciles};
pub use simulator::{Command, Simulator, SimulatorNumber};
pub use structure::{Placed, Site, Structure, WIDENED};
pub use term::{Fitted, MOST_KNOTS, Term, Variable};
pub use unit::Unit;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
