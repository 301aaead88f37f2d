//! A user's own model on the rows as they come, with exact derivatives of its outputs by the watched parameters.
//!
//! Simulations that carry a few derivatives each run side by side until every watched parameter has one. **Cost** of a row: that number of
//! simulations from row to row; nothing is allocated, except for the past of what is delayed.

use std::sync::Arc;

use ct_model::{Dual, SharedSimulation, SimulationNumber};
use ct_signals::Hold;

use super::OwnModel;
use crate::{Each, intake::Sample, sensitivity::Model as Running};

struct Lanes<T> {
    simulations: Vec<SharedSimulation<T>>,
    /// Outputs of each simulation.
    observed: Vec<Vec<T>>,
    /// Model's time since its start, and its units in one second.
    time: f64,
    per_second: f64,
    /// Whether the simulation diverged.
    failed: bool,
}

/// The model with these monitored parameters, from these states, which do not depend on parameters.
pub(super) fn running(own: &OwnModel, theta: &[f64], states: &[f64]) -> Box<dyn Running> {
    match theta.len() {
        0..=4 => Box::new(running_in::<Dual<4>>(own, theta, states)),
        _ => Box::new(running_in::<Dual<8>>(own, theta, states)),
    }
}

fn running_in<T: SimulationNumber + 'static>(
    own: &OwnModel,
    theta: &[f64],
    states: &[f64],
) -> Lanes<T> {
    let watched = own.watched();
    let values = own.parameters_with(theta);
    let states: Vec<T> = states.iter().map(|x| T::constant(*x)).collect();
    let with_derivatives = |chunk: &[usize]| {
        let lane = |i: usize| chunk.iter().position(|own| *own == i).unwrap_or(T::LANES);
        let parameters: Vec<T> = values
            .iter()
            .enumerate()
            .map(|(i, value)| T::variable(*value, lane(i)))
            .collect();
        SharedSimulation::new(Arc::clone(&own.model), &parameters, &states, 0.0)
    };
    let simulations: Vec<_> = watched.chunks(T::LANES).map(with_derivatives).collect();
    let outputs = own.model.spec().outputs.len();
    Lanes {
        observed: vec![vec![T::constant(0.0); outputs]; simulations.len()],
        simulations,
        time: 0.0,
        per_second: 1.0 / own.time_unit,
        failed: false,
    }
}

impl<T: SimulationNumber> Running for Lanes<T> {
    fn observe(&mut self, sample: &Sample) {
        for (simulation, observed) in self.simulations.iter_mut().zip(&mut self.observed) {
            simulation.read(&sample.inputs, observed);
        }
    }

    fn read(&mut self, output: usize, row: &mut [f64]) -> f64 {
        for (lanes, observed) in row.chunks_mut(T::LANES).zip(&self.observed) {
            for (to, derivative) in lanes.iter_mut().zip(observed[output].slopes()) {
                *to = *derivative;
            }
        }
        match self.observed.first() {
            Some(observed) if !self.failed => observed[output].value(),
            _ => f64::NAN,
        }
    }

    fn advance(&mut self, hold: Hold, from: &Sample, to: &Sample) {
        self.time += (to.time - from.time) * self.per_second;
        let ends = match hold {
            Hold::Zero => &from.inputs,
            Hold::First => &to.inputs,
        };
        for simulation in &mut self.simulations {
            let done = simulation.advance(&from.inputs, ends, self.time);
            self.failed |= done.is_err();
        }
    }

    fn states(&self) -> Each<f64> {
        let first = self.simulations.first();
        let states = first.map_or(&[][..], SharedSimulation::state);
        states.iter().map(|x| x.value()).collect()
    }

    fn stands(&self) -> f64 {
        0.0
    }
}
