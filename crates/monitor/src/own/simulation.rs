//! A user's own model on the rows as they come, with exact derivatives of its outputs by the watched parameters.
//!
//! Simulations of `N` derivatives run side by side until every watched parameter has one. **Cost** of a row: that many simulations of the
//! model from row to row; nothing is allocated, but for the past of what is delayed.

use ct_model::{Dual, Scalar, Simulation};
use ct_signals::Hold;

use super::OwnModel;
use crate::{Each, intake::Sample, sensitivity::Model as Running};

struct Lanes<'a, const N: usize> {
    simulations: Vec<Simulation<'a, Dual<N>>>,
    /// Outputs of each simulation.
    observed: Vec<Vec<Dual<N>>>,
    /// Model's time since its start, and its units in one second.
    time: f64,
    per_second: f64,
    /// Whether the simulation diverged.
    failed: bool,
}

/// The model with these monitored parameters, from these states, which do not depend on parameters.
pub(super) fn running<'a>(
    own: &OwnModel<'a>,
    theta: &[f64],
    states: &[f64],
) -> Box<dyn Running + 'a> {
    match theta.len() {
        0..=4 => Box::new(in_lanes::<4>(own, theta, states)),
        _ => Box::new(in_lanes::<8>(own, theta, states)),
    }
}

fn in_lanes<'a, const N: usize>(own: &OwnModel<'a>, theta: &[f64], states: &[f64]) -> Lanes<'a, N> {
    let watched = own.watched();
    let values = own.parameters_with(theta);
    let states: Vec<Dual<N>> = states.iter().map(|x| Dual::constant(*x)).collect();
    let with_derivatives = |chunk: &[usize]| {
        let lane = |i: usize| chunk.iter().position(|own| *own == i).unwrap_or(N);
        let parameters: Vec<Dual<N>> = values
            .iter()
            .enumerate()
            .map(|(i, value)| Dual::variable(*value, lane(i)))
            .collect();
        Simulation::new(own.model, &parameters, &states, 0.0)
    };
    let simulations: Vec<_> = watched.chunks(N).map(with_derivatives).collect();
    let outputs = own.model.spec().outputs.len();
    Lanes {
        observed: vec![vec![Dual::constant(0.0); outputs]; simulations.len()],
        simulations,
        time: 0.0,
        per_second: 1.0 / own.time_unit,
        failed: false,
    }
}

impl<const N: usize> Running for Lanes<'_, N> {
    fn observe(&mut self, sample: &Sample) {
        for (simulation, observed) in self.simulations.iter_mut().zip(&mut self.observed) {
            simulation.read(&sample.inputs, observed);
        }
    }

    fn read(&mut self, output: usize, row: &mut [f64]) -> f64 {
        for (lanes, observed) in row.chunks_mut(N).zip(&self.observed) {
            for (to, derivative) in lanes.iter_mut().zip(observed[output].eps) {
                *to = derivative;
            }
        }
        match self.observed.first() {
            Some(observed) if !self.failed => observed[output].re,
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
        let states = first.map_or(&[][..], Simulation::state);
        states.iter().map(|x| x.re).collect()
    }

    fn stands(&self) -> f64 {
        0.0
    }
}
