//! The learned model on the rows as they come, with exact derivatives of its readings.

use ct_signals::Hold;
use plants::{Command, Dual, Scalar, Simulator, SimulatorNumber, Structure};

use crate::{Each, intake::Sample};

/// The most parameters by which derivatives are taken; further ones stay as they were learned.
pub(crate) const MOST_LANES: usize = 15;

/// A simulation with derivatives by the parameters of its structure.
pub(crate) trait Model: Send + Sync {
    /// Reads all outputs now, under the inputs of this row; once a sample.
    fn observe(&mut self, sample: &Sample);
    /// The reading of an output as it was observed, once a sample; its derivatives go to `row`, as many as there are lanes.
    fn read(&mut self, output: usize, row: &mut [f64]) -> f64;
    /// Moves on from one sample to the next.
    fn advance(&mut self, hold: Hold, from: &Sample, to: &Sample);
    /// The states; for a plant, the level of each vessel.
    fn states(&self) -> Each<f64>;
    /// Position of the actuator; for plants only.
    fn stands(&self) -> f64;
}

struct Lanes<T: SimulatorNumber>(Simulator<T>);

impl<T: SimulatorNumber> Model for Lanes<T> {
    fn observe(&mut self, _sample: &Sample) {}
    fn read(&mut self, output: usize, row: &mut [f64]) -> f64 {
        let y = self.0.read(output);
        for (to, derivative) in row.iter_mut().zip(y.slopes()) {
            *to = *derivative;
        }
        y.value()
    }
    fn advance(&mut self, hold: Hold, from: &Sample, to: &Sample) {
        self.0.advance(command(hold, from, to), to.time - from.time);
    }
    fn states(&self) -> Each<f64> {
        self.0.levels().map(Scalar::value).into_iter().collect()
    }
    fn stands(&self) -> f64 {
        self.0.stands()
    }
}

/// How many parameters have a lane.
pub(crate) fn lanes(parameters: usize) -> usize {
    parameters.min(MOST_LANES)
}

/// A simulation from given levels, which depend on no parameter; `at_rest` is the command before.
pub(crate) fn model(
    structure: &Structure,
    substeps: usize,
    theta: &[f64],
    levels: &[f64],
    at_rest: f64,
) -> Result<Box<dyn Model>, plants::Error> {
    match lanes(theta.len()) {
        0..=4 => simulated_in::<Dual<4>>(structure, substeps, theta, levels, at_rest),
        5..=8 => simulated_in::<Dual<8>>(structure, substeps, theta, levels, at_rest),
        _ => simulated_in::<Dual<MOST_LANES>>(structure, substeps, theta, levels, at_rest),
    }
}

fn simulated_in<T: SimulatorNumber>(
    structure: &Structure,
    substeps: usize,
    theta: &[f64],
    levels: &[f64],
    at_rest: f64,
) -> Result<Box<dyn Model>, plants::Error> {
    let theta: Vec<T> = theta
        .iter()
        .enumerate()
        .map(|(lane, value)| T::variable(*value, lane))
        .collect();
    let levels: Vec<T> = levels.iter().map(|level| T::constant(*level)).collect();
    let mut simulator = Simulator::new(structure, &theta, &levels, at_rest)?;
    simulator.set_substeps(substeps);
    Ok(Box::new(Lanes(simulator)))
}

/// The command from one sample to the next.
pub(crate) fn command(hold: Hold, from: &Sample, to: &Sample) -> Command {
    match hold {
        Hold::Zero => Command::held(from.inputs[0]),
        Hold::First => Command::ramp(from.inputs[0], to.inputs[0]),
    }
}
