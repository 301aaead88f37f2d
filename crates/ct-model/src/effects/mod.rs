//! Ports of a model, and effects at them: what may be missing in a model, as a transformation of the model.
//!
//! An effect is a small model itself ([`Effect`]), one file each. [`candidates`] lists which effect can act at which port of a model,
//! [`apply`] gives the model with some of them in it, whose parameters are parameters of the new model. At their absent values the new
//! model gives the outputs of the old one.
//!
//! ```
//! use ct_model::effects::{Visited, apply, candidates};
//! use ct_model::ModelSpec;
//!
//! let block = ModelSpec::parse(
//!     "model Block
//!        parameter Real k(unit=\"1/s\", min=0) = 0.1;
//!        input Real u(unit=\"degC\");
//!        output Real T(unit=\"degC\", start=20);
//!      equation
//!        der(T) = k*(u - T);
//!      end Block;",
//! )?;
//! let visited = Visited::nominal(&block);
//! let all = candidates(&block, &visited);
//! let lag = all.iter().find(|candidate| candidate.id == "lag(u)").unwrap();
//! let mended = apply(&block, &[lag])?;
//! assert_eq!(mended.parameters[1].about.name, "lag_u_tau");
//! assert_eq!(mended.states.len(), 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod apply;
mod balance;
mod between;
mod candidate;
mod description;
mod domain;
mod effect;
mod electrical;
mod fragment;
mod hydraulic;
mod input;
mod level_shift;
mod mechanical;
mod output;
mod own;
mod parameter;
mod port;
mod scale;
mod shape;
mod thermal;
mod unit_text;
mod visited;

pub use apply::{ApplyError, apply};
pub use candidate::{
    Candidate, EffectParameter, best_of_each_choice, candidates, candidates_keeping,
    check_term_name, level_shifts, shapes_keeping,
};
pub use description::DescribedParameter;
pub use effect::{Effect, EffectText, Place, Role, Starts};
pub use own::{OwnCandidate, OwnError, OwnParameter, OwnState, own_candidate, own_candidates};
pub use port::{Port, Ports};
pub use shape::bells;
pub use visited::{Span, Visited};

/// All effects, sorted by place; effects of a chain are in the order of the chain.
pub fn all_effects() -> impl Iterator<Item = &'static Effect> {
    const GROUPS: [&[Effect]; 9] = [
        &input::EFFECTS,
        &electrical::EFFECTS,
        // Effects of the sensor of a level come before the general ones of a sensor.
        &hydraulic::EFFECTS,
        &output::EFFECTS,
        &thermal::EFFECTS,
        &mechanical::EFFECTS,
        &balance::EFFECTS,
        &parameter::EFFECTS,
        &between::EFFECTS,
    ];
    GROUPS.into_iter().flatten()
}
