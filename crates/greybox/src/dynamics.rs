//! Residuals and their derivatives from the simulation of records, whatever simulates them: a plant's kernel or a model's text.

use ct_model::Scalar;
use ct_signals::Record;
use estimation::Sample;

use crate::feedback::Response;

/// The simulation of one record, row by row, with its control loop if that is simulated.
pub(crate) trait Dynamics<T> {
    /// Computes the outputs at a row, and the commands of the controllers for them, in the order of the controllers. The rows come one after
    /// the other.
    fn read(&mut self, row: usize, outputs: &mut [T], commands: &mut Vec<T>);

    /// Goes on from a row to the next one; `None` if the simulation cannot.
    fn advance(&mut self, row: usize) -> Option<()>;
}

/// A vector of parameters and initial states, and the records that it simulates.
#[derive(Clone, Copy)]
pub(crate) struct Entries<'a> {
    pub records: &'a [Record],
    /// The parameters, then the initial states record by record.
    pub x: &'a [f64],
    pub parameters: usize,
    /// Initial states of each record.
    pub states: usize,
    pub outputs: usize,
    /// The entries whose derivatives are computed.
    pub by: &'a [usize],
}

/// A row of a record in all its simulations: those of the first derivatives come first.
pub(crate) struct Instant<'a, T> {
    pub record: usize,
    pub row: usize,
    /// The outputs of each simulation.
    pub read: &'a [T],
    /// The commands of each simulation; empty without a loop.
    pub commands: &'a [T],
    /// The derivatives that are not zero, in the order of the simulations: their columns.
    columns: &'a [usize],
}

impl<T: Scalar> Instant<'_, T> {
    /// Writes the derivatives of one of `count` numbers of each simulation into their columns.
    fn write(&self, numbers: &[T], (at, count): (usize, usize), row: &mut [f64], sign: f64) {
        for (lane, &column) in self.columns.iter().enumerate() {
            let number = &numbers[lane / T::LANES * count + at];
            row[column] = sign * number.slopes()[lane % T::LANES];
        }
    }
}

impl Entries<'_> {
    fn states_of(&self, record: usize) -> std::ops::Range<usize> {
        let from = self.parameters + record * self.states;
        from..from + self.states
    }

    /// Simulates the records, and passes every row to a function. A record needs derivatives by the parameters and by its own initial states:
    /// if one number cannot carry them all, several simulations run side by side. `begin`: starts the simulation of a record, given the numbers
    /// of its parameters and initial states.
    pub fn each_instant<T: Scalar, D: Dynamics<T>>(
        &self,
        mut begin: impl FnMut(usize, &[T], &[T]) -> Option<D>,
        mut each: impl FnMut(Instant<'_, T>) -> Option<()>,
    ) -> Option<()> {
        for (r, record) in self.records.iter().enumerate() {
            let own = self.states_of(r);
            let columns = 0..self.by.len();
            let has = |column: &usize| {
                let entry = self.by[*column];
                entry < self.parameters || own.contains(&entry)
            };
            let columns: Vec<usize> = columns.filter(has).collect();
            let mut chunks: Vec<&[usize]> = columns.chunks(T::LANES.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let simulation = |chunk: &&[usize]| {
                let number = |entry: usize| {
                    let mut lanes = chunk.iter();
                    let lane = lanes.position(|&column| self.by[column] == entry);
                    T::variable(self.x[entry], lane.unwrap_or(T::LANES))
                };
                let parameters: Vec<T> = (0..self.parameters).map(number).collect();
                let states: Vec<T> = own.clone().map(number).collect();
                begin(r, &parameters, &states)
            };
            let simulations = chunks.iter().map(simulation);
            let mut simulations = simulations.collect::<Option<Vec<D>>>()?;
            let mut read = vec![T::constant(0.0); self.outputs * chunks.len()];
            let mut commands = Vec::new();
            for k in 0..record.len() {
                commands.clear();
                let outputs = read.chunks_exact_mut(self.outputs);
                for (simulation, outputs) in simulations.iter_mut().zip(outputs) {
                    simulation.read(k, outputs, &mut commands);
                }
                each(Instant {
                    record: r,
                    row: k,
                    read: &read,
                    commands: &commands,
                    columns: &columns,
                })?;
                if k + 1 < record.len() {
                    for simulation in &mut simulations {
                        simulation.advance(k)?;
                    }
                }
            }
        }
        Some(())
    }

    /// Simulates the records, and passes the rows of residuals and their derivatives to `each`, until that returns false. `response`: of the
    /// linear plant to the commands of a loop, and the inputs that its controllers drive. Its input is, for the derivatives, minus those of the
    /// simulated command and, for the residual, the simulated command minus the measured one.
    pub fn each_row<T: Scalar, D: Dynamics<T>>(
        &self,
        mut response: Option<(Response, Vec<usize>)>,
        begin: impl FnMut(usize, &[T], &[T]) -> Option<D>,
        each: &mut dyn FnMut(Sample, &mut [f64]) -> bool,
    ) -> Option<()> {
        let columns = self.by.len() + 1;
        let mut row = vec![0.0; columns];
        let driven = response.as_ref().map_or(0, |(_, driven)| driven.len());
        let mut of_commands = vec![0.0; driven * columns];
        self.each_instant(begin, |instant: Instant<'_, T>| {
            let record = &self.records[instant.record];
            let k = instant.row;
            if let Some((response, _)) = response.as_mut().filter(|_| k == 0) {
                response.reset();
            }
            for output in 0..self.outputs {
                row.fill(0.0);
                instant.write(instant.read, (output, self.outputs), &mut row, 1.0);
                let model = instant.read[output].value();
                let measured = record.outputs[output].values[k];
                row[columns - 1] = measured - model;
                if let Some((response, _)) = &mut response {
                    response.add_to(output, &mut row, measured.is_nan());
                }
                let sample = Sample {
                    output,
                    first: k == 0,
                    missing: measured.is_nan(),
                };
                let derivatives = row[..columns - 1].iter().all(|v| v.is_finite());
                let residual = row[columns - 1].is_finite() || sample.missing;
                let finite = derivatives && residual && model.is_finite();
                if !(finite && each(sample, &mut row)) {
                    return None;
                }
            }
            if let Some((response, inputs)) = &mut response {
                of_commands.fill(0.0);
                let rows = of_commands.chunks_exact_mut(columns);
                for (d, (row, &input)) in rows.zip(inputs.iter()).enumerate() {
                    instant.write(instant.commands, (d, driven), row, -1.0);
                    row[columns - 1] = instant.commands[d].value() - record.inputs[input].values[k];
                }
                response.advance(&of_commands);
            }
            Some(())
        })
    }
}
