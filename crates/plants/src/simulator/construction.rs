//! Construction of a simulator from a structure, its parameters and initial states.

use super::{Disturbance, Joined, Layout, SecondPump, Simulator, SimulatorNumber};
use crate::actuator::Actuator;
use crate::sensor::Sensor;
use crate::vessels::{Valves, Vessels};
use crate::{Error, Outlet, Place, Scalar, Structure, effects, term};

impl<T: SimulatorNumber> Simulator<T> {
    /// `theta`: in the order of [`Structure::parameters`]. `initial`: the level of each vessel when the record begins and, if the lags do
    /// not start in steady state, an excess for each of [`Structure::lags`]. `at_rest`: the constant command before the record began.
    ///
    /// # Errors
    /// If the number of parameters or initial values is wrong for the structure.
    pub fn new(
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: f64,
    ) -> Result<Self, Error> {
        Self::with_inputs(structure, theta, initial, [at_rest, 0.0])
    }

    /// As [`Simulator::new`] for a plant with two pumps: `at_rest` holds both commands before the record began. A measured disturbance
    /// ([`crate::Known::disturbance`]) has no memory, so its value before the record is not used.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub fn with_inputs(
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: [f64; 2],
    ) -> Result<Self, Error> {
        Self::starting_at(0.0, structure, theta, initial, at_rest)
    }

    /// As [`Simulator::with_inputs`] for a record that is a later part of an experiment: it begins at `start` \[s\] on the clock of drifts,
    /// steps and periods.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub fn starting_at(
        start: f64,
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: [f64; 2],
    ) -> Result<Self, Error> {
        T::starting_at(start, structure, theta, initial, at_rest)
    }
}

impl<T: Scalar> Simulator<T> {
    /// Implementation of [`Simulator::starting_at`].
    pub(super) fn construct(
        start: f64,
        structure: &Structure,
        theta: &[T],
        initial: &[T],
        at_rest: [f64; 2],
    ) -> Result<Self, Error> {
        let plant = structure.plant;
        let n = plant.vessels();
        let (levels, before) = initial.split_at(n.min(initial.len()));
        let lags = structure.lags();
        if levels.len() != n || !(before.is_empty() || before.len() == lags.len()) {
            return Err(Error::Count {
                what: "initial levels, and an excess for each lag",
                given: initial.len(),
                needed: n + lags.len(),
            });
        }
        let own = plant.parameters(&structure.scales).len();
        let counts: Vec<usize> = structure
            .effects()
            .iter()
            .map(|&placed| structure.effect_parameters(placed).len())
            .collect();
        let term_counts: Vec<usize> = structure
            .terms()
            .iter()
            .map(|term| term.parameters(&structure.scales).len())
            .collect();
        let needed = own + counts.iter().chain(&term_counts).sum::<usize>();
        if theta.len() != needed {
            return Err(Error::Count {
                what: "parameters",
                given: theta.len(),
                needed,
            });
        }
        let area = |i: usize| T::constant(structure.scales.area[i]);
        let zero = T::constant(0.0);
        let (pump_gain, parts) = match plant {
            crate::Plant::SingleTank => (theta[0], vec![(area(0), Outlet::Torricelli, theta[1])]),
            crate::Plant::CascadedTanks => (
                theta[0],
                vec![
                    (area(0), Outlet::Torricelli, theta[1]),
                    (area(1), Outlet::Torricelli, theta[2]),
                ],
            ),
            crate::Plant::SingleTankLinear => {
                (theta[0], vec![(theta[1], Outlet::Linear, theta[2])])
            }
            crate::Plant::CascadedTanksLinear => (
                theta[0],
                vec![
                    (theta[1], Outlet::Linear, zero),
                    (theta[2], Outlet::Linear, theta[3]),
                ],
            ),
            crate::Plant::FirstOrder => (theta[0], vec![(theta[1], Outlet::Linear, zero)]),
            crate::Plant::ThreeTank => {
                let valves = &theta[own - n..own];
                let orifice = structure.scales.orifice.unwrap_or(1.0);
                let part = |i: usize| (area(i), Outlet::Torricelli, valves[i] * orifice);
                (theta[0], (0..n).map(part).collect())
            }
        };
        let second_gain = structure.scales.input_2.map(|_| theta[1]);
        let second_gain = second_gain.filter(|_| plant.joined());
        let known = &structure.known;
        let disturbed = known
            .disturbed_vessel(plant)
            .filter(|_| structure.scales.input_2.is_some());
        let disturbance = disturbed.map(|vessel| Disturbance {
            gain: theta[own - 1],
            into_lower: vessel > 0,
        });
        let mut actuators = [Vec::new(), Vec::new()];
        let outputs = &structure.scales.outputs;
        let mut vessels = Vec::new();
        let mut sensors: Vec<Vec<_>> = outputs.iter().map(|_| Vec::new()).collect();
        // A copy of the laws of joined vessels without derivatives.
        let plain: Vec<f64> = theta.iter().map(|value| value.value()).collect();
        let mut values = Vec::new();
        let mut at = own;
        for (&placed, count) in structure.effects().iter().zip(counts) {
            let site = structure.site(placed);
            if plant.joined()
                && placed.effect.place == Place::Vessel
                && let Some(law) = effects::bind(placed.effect, &site, &plain[at..at + count])
            {
                values.push((placed.vessel, law));
            }
            if let Some(law) = effects::bind(placed.effect, &site, &theta[at..at + count]) {
                match placed.effect.place {
                    Place::Actuator => actuators[placed.vessel.min(1)].push(law),
                    Place::Vessel => vessels.push((placed.vessel, law)),
                    Place::Sensor => sensors[placed.vessel].push(law),
                }
            }
            at += count;
        }
        for (term, count) in structure.terms().iter().zip(term_counts) {
            if plant.joined() && term.place == Place::Vessel {
                values.push((term.vessel, term::bind(term, &plain[at..at + count])));
            }
            let law = term::bind(term, &theta[at..at + count]);
            match term.place {
                Place::Actuator => actuators[term.vessel.min(1)].push(law),
                Place::Vessel => vessels.push((term.vessel, law)),
                Place::Sensor => sensors[term.vessel].push(law),
            }
            at += count;
        }
        let [first, second] = actuators;
        let mut actuator = Actuator::new(first, at_rest[0], start);
        let mut second = second_gain.map(|gain| SecondPump {
            actuator: Actuator::new(second, at_rest[1], start),
            gain,
            pieces: Vec::new(),
        });
        let read = outputs.iter().map(|output| output.vessel.min(n - 1));
        let mut sensors: Vec<(usize, Sensor<T>)> =
            read.zip(sensors.into_iter().map(Sensor::new)).collect();
        // A structure has an effect at most once, so at most one sensor has a lag.
        let lagging = sensors.iter().position(|(_, sensor)| sensor.has_lag());
        let sample = structure.scales.sample_interval;
        for (lag, &before) in lags.iter().zip(before) {
            match lag.effect.place {
                Place::Actuator => match &mut second {
                    Some(second) if lag.vessel > 0 => {
                        second.actuator.set_initial_state(before, sample)
                    }
                    _ => actuator.set_initial_state(before, sample),
                },
                _ => sensors[lag.vessel].1.set_initial_state(before, sample),
            }
        }
        let watched = sensors[lagging.unwrap_or(0)].0;
        let layout = if plant.joined() {
            let levels_read = sensors.iter().map(|(vessel, _)| {
                let (low, high) = structure.scales.level[*vessel];
                low.abs().max(high.abs())
            });
            let valves = Valves::new(levels_read.fold(0.0, f64::max));
            let plain_parts = parts
                .iter()
                .map(|&(area, outlet, coefficient)| (area.value(), outlet, coefficient.value()));
            let plain_levels: Vec<f64> = levels.iter().map(|level| level.value()).collect();
            let seen = (watched, Some(valves));
            let values = Vessels::new(plain_parts.collect(), values, &plain_levels, seen);
            let mut vessels = Vessels::new(parts, vessels, levels, seen);
            vessels.cut_by(values);
            Layout::Joined(Box::new(Joined { vessels, second }))
        } else {
            let mut vessels = Vessels::new(parts, vessels, levels, (watched, None));
            if disturbance.as_ref().is_some_and(|d| d.into_lower) {
                vessels.feed_last();
            }
            Layout::Series(vessels)
        };
        Ok(Self {
            actuator,
            layout,
            sensors,
            lagging,
            pump_gain,
            disturbance,
            time: start,
            substeps: 1,
        })
    }
}
