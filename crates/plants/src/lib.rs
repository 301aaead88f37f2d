//! Tank models as chains actuator -> vessels -> sensor, and the catalogue of effects that a believed
//! model may lack.
//!
//! A [`Structure`] is a plant with the effects that are on; a [`Simulator`] steps it from sample to
//! sample on any [`Scalar`]: plain `f64`, or [`Dual`]s that carry exact derivatives.
//!
//! ```
//! use plants::{Command, Known, Plant, Scales, Simulator, Structure};
//!
//! # fn main() -> Result<(), plants::Error> {
//! let scales = Scales::from_ranges((0.0, 10.0), (5.0, 20.0), 1.0, 600.0);
//! let tank = Structure::new(Plant::SingleTank, Known { area: [Some(154.0), None], ..Known::default() }, scales);
//! // pump_gain [cm^3/(V s)], alpha [cm^2.5/s]; level(0) = 9 cm; the pump stands at 4 V.
//! let mut simulator = Simulator::<f64>::new(&tank, &[9.0, 11.0], &[9.0], 4.0)?;
//! let before = simulator.read();
//! simulator.advance(Command::held(5.0), 1.0);
//! assert!(simulator.read() > before);
//! # Ok(())
//! # }
//! ```

mod actuator;
pub mod controller;
mod damped;
pub mod effects;
mod error;
mod inflow;
mod law;
mod linear;
mod moments;
mod plant;
mod scalar;
mod sensor;
mod simulator;
mod structure;
mod term;
mod unit;
mod vessels;

pub use effects::{CATALOGUE, EffectInfo, Place};
pub use error::Error;
pub use law::{Law, Rim};
pub use plant::{Outlet, ParameterInfo, Plant};
pub use scalar::{Dual, Scalar};
pub use simulator::{Command, Simulator};
pub use structure::{Known, MAX_VESSELS, Placed, Scales, Site, Structure};
pub use term::{Fitted, MOST_KNOTS, Term, Variable};
pub use unit::Unit;
