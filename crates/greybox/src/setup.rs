//! A structure set against records: the vector that is fitted, its bounds, and the simulation with derivatives.

use std::collections::BTreeMap;

use ct_signals::{ArModel, Hold, Record};
use plants::{
    Command, Dual, MAX_VESSELS, Scalar, Scales, Simulator, Structure, controller::Controller,
};

use crate::{
    Error, LinearPlant, Replay, Triangle,
    feedback::{Feedback, Response, step},
    reading_step::reading_step,
};

/// More than sums of squares over a record differ by where they are taken in another order.
const ROUNDING: f64 = 1e-9;

/// A structure, the records, and which parameters are free.
///
/// The fitted vector holds the structure's parameters (free ones and fixed ones), then for every record the initial
/// level of every vessel and what stood behind every lag ([`Structure::lags`]) and, where the loop is simulated
/// ([`Setup::in_loop`]), the states of the controller.
#[derive(Debug, Clone)]
pub struct Setup<'a> {
    /// The structure.
    pub structure: Structure,
    /// The records that are fitted together.
    pub records: &'a [Record],
    /// Parameters that are not fitted, with their values.
    pub fixed: BTreeMap<String, f64>,
    /// Equal parts of a sampling interval in the simulation.
    pub substeps: usize,
    names: Vec<String>,
    bounds: Vec<(f64, f64)>,
    /// Positions of the parameters that are fitted.
    free: Vec<usize>,
    /// How many entries come before the initial states.
    parameters: usize,
    /// The controller, where the loop is simulated.
    feedback: Option<Feedback>,
}

/// A loop that ran on its reference.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopRun {
    /// The reading, a series for each record.
    pub output: Vec<Vec<f64>>,
    /// The controller's command, a series for each record.
    pub command: Vec<Vec<f64>>,
}

/// What a simulation shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// The reading, a series for each record.
    pub output: Vec<Vec<f64>>,
    /// Smallest and largest level of each vessel over all records.
    pub level: [(f64, f64); MAX_VESSELS],
    /// Mean level of each vessel over all records.
    pub mean_level: [f64; MAX_VESSELS],
}

/// What an initial state costs in [`Setup::price`].
///
/// The logarithm of the samples stands for what a record tells of a parameter, which grows with its length. An initial state is
/// forgotten after a few time constants, and a longer record tells no more of it. Two is the price of Akaike's criterion. Where
/// it costs the logarithm, a lag, whose state before the record is unknown, is handicapped against a dead time.
const STATE_PRICE: f64 = 2.0;

/// The derivatives and the residual of every sample, one record after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Entries of a row: the free entries of the vector, then the residual.
    pub columns: usize,
    /// Samples of each record.
    pub lengths: Vec<usize>,
    /// Row by row.
    pub values: Vec<f64>,
}

impl Rows {
    /// The rows of one record after the other, each a slice of `length x columns` values.
    pub fn records(&self) -> impl Iterator<Item = &[f64]> {
        let mut rest = self.values.as_slice();
        self.lengths.iter().map(move |&length| {
            let (record, after) = rest.split_at(length * self.columns);
            rest = after;
            record
        })
    }

    /// The folded rows, whitened by a noise model, with columns chosen and put in this order.
    pub(crate) fn fold(&self, order: &[usize], noise: &ArModel) -> Triangle {
        let mut triangle = Triangle::new(order.len());
        let mut whitener = noise.whitener(order.len());
        let mut chosen = vec![0.0; order.len()];
        for record in self.records() {
            whitener.reset();
            for row in record.chunks_exact(self.columns) {
                for (to, &column) in chosen.iter_mut().zip(order) {
                    *to = row[column];
                }
                whitener.push(&mut chosen);
                triangle.push(&chosen);
            }
        }
        triangle.finish();
        triangle
    }
}

/// Scales of records as the structure meets them first.
pub(crate) fn scales_of(records: &[Record], input_range: Option<f64>) -> Option<Scales> {
    let wider = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
    let input = records.iter().map(Record::input_range).reduce(wider)?;
    let output = records.iter().map(Record::output_range).reduce(wider)?;
    let sample = records
        .iter()
        .map(Record::sample_interval)
        .fold(f64::INFINITY, f64::min);
    let duration = records.iter().map(Record::duration).fold(0.0, f64::max);
    let mut scales = Scales::from_ranges(input, output, sample, duration);
    if let Some(range) = input_range {
        scales.input_range = range;
    }
    scales.reading_step = reading_step(records).unwrap_or(0.0);
    Some(scales)
}

impl<'a> Setup<'a> {
    /// A structure against records.
    ///
    /// # Errors
    /// Where there is no record, a record is not sound, or `fixed` names a parameter that there is not.
    pub fn new(
        structure: Structure,
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
    ) -> Result<Self, Error> {
        Self::build(structure, records, fixed, None)
    }

    fn build(
        structure: Structure,
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
        feedback: Option<Feedback>,
    ) -> Result<Self, Error> {
        if records.is_empty() {
            return Err(Error::NoRecord);
        }
        for record in records {
            record.validate()?;
        }
        let plant = structure.plant;
        let mut names = structure.parameter_names();
        let mut bounds: Vec<(f64, f64)> = structure
            .parameters()
            .iter()
            .map(|p| (p.lower, p.upper))
            .collect();
        for name in fixed.keys() {
            // A name of an effect that is not on in this structure is no mistake: it waits.
            let effect_known = name
                .split_once('.')
                .is_some_and(|(effect, _)| plants::EffectInfo::find(effect).is_some());
            if !names.contains(name) && !effect_known {
                return Err(Error::UnknownParameter {
                    name: name.clone(),
                    known: names.join(", "),
                });
            }
        }
        let mut free: Vec<usize> = (0..names.len())
            .filter(|&i| !fixed.contains_key(&names[i]))
            .collect();
        let reach = structure.scales.largest_level().max(f64::MIN_POSITIVE);
        // An empty tank is a trap: the outflow's slope is infinite there, and a step that overshot to it would stay.
        let lowest = if plant.outlet() == plants::Outlet::Torricelli {
            1e-6 * reach
        } else {
            -1e3 * reach
        };
        let lags = structure.lags();
        let parameters = names.len();
        for (r, record) in records.iter().enumerate() {
            let of = if records.len() > 1 {
                format!(", record {}", r + 1)
            } else {
                String::new()
            };
            for vessel in 0..plant.vessels() {
                free.push(names.len());
                names.push(format!("{}(0){of}", plant.level_name(vessel)));
                bounds.push((lowest, 1e3 * reach));
            }
            // Before the record anything may have happened, and a lag remembers it.
            for &lag in &lags {
                let (name, range) = structure.lag_before(lag, record.input.values[0]);
                let name = name + &of;
                if !fixed.contains_key(&name) {
                    free.push(names.len());
                }
                names.push(name);
                bounds.push(range);
            }
            if let Some(feedback) = &feedback {
                for (name, range) in feedback.entries(r, structure.scales.input) {
                    let name = name + &of;
                    if feedback.released && !fixed.contains_key(&name) {
                        free.push(names.len());
                    }
                    names.push(name);
                    bounds.push(range);
                }
            }
        }
        Ok(Self {
            structure,
            records,
            fixed,
            substeps: 1,
            names,
            bounds,
            free,
            parameters,
            feedback,
        })
    }

    /// The same structure and records in the loop of a controller, simulated from the reference, and the vector `x` with
    /// the controller's initial states: those with which it gives the measured command.
    ///
    /// From here on [`Setup::rows`], [`Setup::linearise`] and all fits take the loop for the model, and their rows are
    /// filtered so that the residual is the disturbance at the plant's output (the head of `feedback.rs` says how and
    /// why). [`Setup::simulate`] and [`Setup::residuals`] go on to run on the measured command, so that errors compare.
    ///
    /// # Errors
    /// Where a record has no reference or a constant one, or its command is not held.
    pub fn in_loop(&self, controller: &Controller, x: &[f64]) -> Result<(Self, Vec<f64>), Error> {
        let (sum, count) = self
            .records
            .iter()
            .flat_map(|record| &record.input.values)
            .fold((0.0, 0.0), |(sum, count), u| (sum + u, count + 1.0));
        let plant = LinearPlant::at(&self.structure, &x[..self.parameter_count()], sum / count)?;
        let feedback = Feedback::new(controller, self.records, plant)?;
        let mut with = x[..self.parameter_count()].to_vec();
        for (r, replay) in feedback.replays.iter().enumerate() {
            with.extend(&x[self.plant_states_of(r)]);
            with.extend(&replay.states);
        }
        Ok((self.rebuilt(self.structure.clone(), Some(feedback))?, with))
    }

    fn rebuilt(&self, structure: Structure, feedback: Option<Feedback>) -> Result<Self, Error> {
        let mut setup = Self::build(structure, self.records, self.fixed.clone(), feedback)?;
        setup.substeps = self.substeps;
        Ok(setup)
    }

    /// The same setup with the controller's initial states fitted like the others.
    ///
    /// They are known from the measured command, and by default they stay there: the knowledge of where the command
    /// stood is worth much. Let go, they take the offset of a linear tank with them, whose standard error is then gone, and
    /// a static coefficient of a tank is known half as well.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_unknown_controller_states(&self) -> Result<Self, Error> {
        let mut feedback = self.feedback.clone();
        if let Some(feedback) = &mut feedback {
            feedback.released = true;
        }
        self.rebuilt(self.structure.clone(), feedback)
    }

    /// What the controller gives on the measured reading of each record; empty where the loop is not simulated.
    #[must_use]
    pub fn replays(&self) -> &[Replay] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays)
    }

    /// A setup from records alone: the scales are taken from them.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn from_records(
        plant: plants::Plant,
        known: plants::Known,
        effects: &[plants::Placed],
        records: &'a [Record],
        fixed: BTreeMap<String, f64>,
    ) -> Result<Self, Error> {
        let scales = scales_of(records, known.input_range).ok_or(Error::NoRecord)?;
        let mut structure = Structure::new(plant, known, scales);
        for &effect in effects {
            structure = structure.with(effect)?;
        }
        Self::new(structure, records, fixed)
    }

    /// The same records against another structure.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_structure(&self, structure: Structure) -> Result<Self, Error> {
        self.rebuilt(structure, self.feedback.clone())
    }

    /// The same structure against other records, in the same scales, run on the measured command.
    ///
    /// # Errors
    /// As [`Setup::new`].
    pub fn with_records<'b>(&self, records: &'b [Record]) -> Result<Setup<'b>, Error> {
        let mut setup = Setup::new(self.structure.clone(), records, self.fixed.clone())?;
        setup.substeps = self.substeps;
        Ok(setup)
    }

    /// Names of the vector's entries.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Bounds of the vector's entries.
    #[must_use]
    pub fn bounds(&self) -> &[(f64, f64)] {
        &self.bounds
    }

    /// Positions of the entries that are fitted.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// How many of the vector's entries are parameters, before the initial states.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.parameters
    }

    /// The unit of every entry in words.
    #[must_use]
    pub fn unit_labels(&self) -> Vec<String> {
        let record = &self.records[0];
        let (level, input) = (&record.output.unit, &record.input.unit);
        let parameters = self.structure.parameters();
        let mut units: Vec<String> = parameters
            .iter()
            .map(|info| self.structure.unit_label(info, level, input))
            .collect();
        for _ in self.records {
            units.extend((0..self.structure.plant.vessels()).map(|_| level.clone()));
            units.extend(self.structure.lags().iter().map(|lag| {
                if lag.effect.place == plants::Place::Actuator {
                    input.clone()
                } else {
                    level.clone()
                }
            }));
            let controller = self.feedback.as_ref().map_or(0, |f| f.controller.states());
            units.extend((0..controller).map(|_| input.clone()));
        }
        units
    }

    /// Entries of one record: its initial levels, what its lags begin with, the controller's states.
    pub(crate) fn states(&self) -> usize {
        (self.names.len() - self.parameters) / self.records.len()
    }

    /// Puts the fixed parameters' values in their places.
    pub(crate) fn impose_fixed(&self, x: &mut [f64]) {
        for (name, value) in self.names.iter().zip(x) {
            if let Some(fixed) = self.fixed.get(name) {
                *value = *fixed;
            }
        }
    }

    /// Holds every parameter; only initial levels stay free.
    pub(crate) fn freeze_parameters(&mut self) {
        let count = self.parameter_count();
        self.free.retain(|&i| i >= count);
    }

    /// What the fitted numbers cost in the Bayesian information criterion, with a noise of so many coefficients and its variance:
    /// the logarithm of the samples each, but [`STATE_PRICE`] for an initial state.
    #[must_use]
    pub fn price(&self, noise_order: usize) -> f64 {
        let (parameters, states): (Vec<usize>, Vec<usize>) =
            self.free.iter().partition(|&&i| i < self.parameters);
        let lasting = parameters.len() + 1 + noise_order;
        lasting as f64 * (self.samples() as f64).ln() + STATE_PRICE * states.len() as f64
    }

    /// Samples in all records.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.records.iter().map(Record::len).sum()
    }

    /// Positions of the initial states of record `r`.
    fn states_of(&self, r: usize) -> std::ops::Range<usize> {
        let n = self.states();
        let from = self.parameter_count() + r * n;
        from..from + n
    }

    /// Positions of the plant's initial states of record `r`, from 0, without those of the controller.
    #[must_use]
    pub fn plant_states_of(&self, r: usize) -> std::ops::Range<usize> {
        let own = self.states_of(r);
        let controller = self.feedback.as_ref().map_or(0, |f| f.controller.states());
        own.start..own.end - controller
    }

    /// The controller's initial states as they give the measured command of record `r`.
    pub(crate) fn controller_states(&self, r: usize) -> &[f64] {
        self.feedback.as_ref().map_or(&[], |f| &f.replays[r].states)
    }

    /// Runs one record on any scalar; `each` sees every sample's reading and the levels; it may stop the run.
    fn run<T: Scalar>(
        &self,
        record: &Record,
        simulator: &mut Simulator<T>,
        mut each: impl FnMut(usize, T, &Simulator<T>) -> bool,
    ) {
        simulator.set_substeps(self.substeps);
        let n = record.len();
        for k in 0..n {
            let y = simulator.read();
            if !each(k, y, simulator) {
                return;
            }
            if k + 1 < n {
                simulator.advance(command(record, k), record.time[k + 1] - record.time[k]);
            }
        }
    }

    /// Simulates all records on their measured commands.
    ///
    /// # Errors
    /// Where the vector has the wrong length.
    pub fn simulate(&self, x: &[f64]) -> Result<Simulated, Error> {
        let mut simulated = Simulated {
            output: Vec::with_capacity(self.records.len()),
            level: [(f64::INFINITY, f64::NEG_INFINITY); MAX_VESSELS],
            mean_level: [0.0; MAX_VESSELS],
        };
        for (r, record) in self.records.iter().enumerate() {
            let mut simulator = Simulator::new(
                &self.structure,
                &x[..self.parameter_count()],
                &x[self.plant_states_of(r)],
                record.input.values[0],
            )?;
            let mut output = Vec::with_capacity(record.len());
            self.run(record, &mut simulator, |_, y, simulator| {
                output.push(y);
                for (i, level) in simulator.levels().into_iter().enumerate() {
                    simulated.level[i].0 = simulated.level[i].0.min(level);
                    simulated.level[i].1 = simulated.level[i].1.max(level);
                    simulated.mean_level[i] += level;
                }
                true
            });
            simulated.output.push(output);
        }
        let samples = self.samples() as f64;
        for mean in &mut simulated.mean_level {
            *mean /= samples;
        }
        Ok(simulated)
    }

    /// The loop that runs on its reference; `None` where no controller is known.
    ///
    /// # Errors
    /// Where the vector has the wrong length.
    pub fn simulate_loop(&self, x: &[f64]) -> Result<Option<LoopRun>, Error> {
        let Some(feedback) = &self.feedback else {
            return Ok(None);
        };
        let mut run = LoopRun {
            output: Vec::with_capacity(self.records.len()),
            command: Vec::with_capacity(self.records.len()),
        };
        for (r, record) in self.records.iter().enumerate() {
            let states = self.plant_states_of(r);
            let theta = &x[..self.parameter_count()];
            let at_rest = record.input.values[0];
            let mut simulator =
                Simulator::new(&self.structure, theta, &x[states.clone()], at_rest)?;
            simulator.set_substeps(self.substeps);
            let mut regulator = feedback
                .controller
                .start(&x[states.end..self.states_of(r).end]);
            let (mut output, mut command) = (Vec::new(), Vec::new());
            for k in 0..record.len() {
                let y = simulator.read();
                let h = step(record, k);
                let beside = feedback.replays[r].beside[k];
                let u = regulator.command_beside(reference(record, k), y, beside, h);
                simulator.advance_held(u, h);
                output.push(y);
                command.push(u);
            }
            run.output.push(output);
            run.command.push(command);
        }
        Ok(Some(run))
    }

    /// What is taken for noise, a series for each record: measured minus model or, where the loop is simulated, the
    /// disturbance at the plant's output that explains it.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn disturbance(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let (Some(feedback), Some(run)) = (&self.feedback, self.simulate_loop(x)?) else {
            return self.residuals(x);
        };
        let mut response = feedback.response(1);
        let series = self.records.iter().zip(run.output).zip(run.command);
        Ok(series
            .map(|((record, model), command)| {
                response.reset();
                let measured = record.output.values.iter().zip(&record.input.values);
                measured
                    .zip(model.iter().zip(&command))
                    .map(|((y, u), (ym, um))| {
                        let mut row = [y - ym];
                        response.add_to(&mut row);
                        response.advance(&[um - u]);
                        row[0]
                    })
                    .collect()
            })
            .collect())
    }

    /// Measured minus model, both on the measured command, a series for each record.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn residuals(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let simulated = self.simulate(x)?;
        Ok(self
            .records
            .iter()
            .zip(simulated.output)
            .map(|(record, model)| {
                record
                    .output
                    .values
                    .iter()
                    .zip(model)
                    .map(|(y, m)| y - m)
                    .collect()
            })
            .collect())
    }

    /// The folded rows `[d model/d x_free, measured - model]`, whitened by the noise model; `None` where the
    /// simulation is not finite.
    #[must_use]
    pub fn linearise(&self, x: &[f64], noise: &ArModel) -> Option<Triangle> {
        self.linearise_below(x, noise, f64::INFINITY)
    }

    /// The same; `None` too where the cost is above a limit, which is known long before the last sample as a rule.
    pub(crate) fn linearise_below(
        &self,
        x: &[f64],
        noise: &ArModel,
        limit: f64,
    ) -> Option<Triangle> {
        let columns = self.free.len() + 1;
        let mut triangle = Triangle::new(columns);
        let mut whitener = noise.whitener(columns);
        // The triangle's cost is a sum in another order.
        let limit = limit * (1.0 + ROUNDING);
        let mut cost = 0.0;
        self.each_row(x, |first, row| {
            if first {
                whitener.reset();
            }
            whitener.push(row);
            cost += row[columns - 1] * row[columns - 1];
            triangle.push(row);
            cost <= limit
        })?;
        triangle.finish();
        Some(triangle)
    }

    /// Whether the cost is above a limit, or not finite.
    pub(crate) fn costs_more(&self, x: &[f64], noise: &ArModel, limit: f64) -> bool {
        let mut whitener = noise.whitener(1);
        let limit = limit * (1.0 + ROUNDING);
        let mut cost = 0.0;
        let within = self.each_row_in_lanes::<0>(x, &[], |first, row| {
            if first {
                whitener.reset();
            }
            whitener.push(row);
            cost += row[0] * row[0];
            cost <= limit
        });
        within.is_none()
    }

    /// The rows `[d model/d x_free, measured - model]`, one for each sample of all records, as they are; `None` where
    /// the simulation is not finite.
    #[must_use]
    pub fn rows(&self, x: &[f64]) -> Option<Rows> {
        let columns = self.free.len() + 1;
        let mut values = Vec::with_capacity(self.samples() * columns);
        self.each_row(x, |_, row| {
            values.extend_from_slice(row);
            true
        })?;
        Some(Rows {
            columns,
            lengths: self.records.iter().map(Record::len).collect(),
            values,
        })
    }

    /// Shows every row, and whether it is the first one of its record, until `each` has seen enough; `None` then too.
    fn each_row(&self, x: &[f64], each: impl FnMut(bool, &mut [f64]) -> bool) -> Option<()> {
        // Parameters and one record's initial states; a few lane counts, so that short vectors stay cheap.
        let parameters = self
            .free
            .iter()
            .filter(|&&i| i < self.parameter_count())
            .count();
        match parameters + self.states() {
            0..=4 => self.each_row_in_lanes::<4>(x, &self.free, each),
            5..=6 => self.each_row_in_lanes::<6>(x, &self.free, each),
            7..=8 => self.each_row_in_lanes::<8>(x, &self.free, each),
            9..=10 => self.each_row_in_lanes::<10>(x, &self.free, each),
            11..=12 => self.each_row_in_lanes::<12>(x, &self.free, each),
            // One lane more, and a compiler copies a dual by a call instead of in registers.
            13..=15 => self.each_row_in_lanes::<15>(x, &self.free, each),
            _ => self.each_row_in_lanes::<8>(x, &self.free, each),
        }
    }

    /// The same with derivatives by some of the entries, in simulators of so many lanes.
    fn each_row_in_lanes<const L: usize>(
        &self,
        x: &[f64],
        by: &[usize],
        mut each: impl FnMut(bool, &mut [f64]) -> bool,
    ) -> Option<()> {
        let columns = by.len() + 1;
        let mut row = vec![0.0; columns];
        let count = self.parameter_count();
        // What the commands of the loop do to the plant: its commands for the derivatives, for the residual what it was given
        // less that.
        let mut response: Option<(Response, Vec<f64>)> = self
            .feedback
            .as_ref()
            .map(|feedback| (feedback.response(columns), vec![0.0; columns]));
        for (r, record) in self.records.iter().enumerate() {
            let own = self.states_of(r);
            let plant = self.plant_states_of(r);
            if let Some((response, commands)) = &mut response {
                response.reset();
                commands.fill(0.0);
            }
            // Columns of this record: the free parameters and its own initial levels, in lanes of one simulator or,
            // where they are too many, of several that run side by side.
            let lanes: Vec<usize> = (0..by.len())
                .filter(|&column| by[column] < count || own.contains(&by[column]))
                .collect();
            let mut chunks: Vec<&[usize]> = lanes.chunks(L.max(1)).collect();
            if chunks.is_empty() {
                chunks.push(&[]);
            }
            let mut simulators = Vec::with_capacity(chunks.len());
            for chunk in &chunks {
                let dual = |i: usize| {
                    let lane = chunk
                        .iter()
                        .position(|&column| by[column] == i)
                        .unwrap_or(L);
                    Dual::<L>::variable(x[i], lane)
                };
                let theta: Vec<_> = (0..count).map(dual).collect();
                let levels: Vec<_> = plant.clone().map(dual).collect();
                let mut simulator =
                    Simulator::new(&self.structure, &theta, &levels, record.input.values[0])
                        .ok()?;
                simulator.set_substeps(self.substeps);
                let regulator = self.feedback.as_ref().map(|feedback| {
                    let states: Vec<_> = (plant.end..own.end).map(dual).collect();
                    feedback.controller.start(&states)
                });
                simulators.push((simulator, regulator));
            }
            let n = record.len();
            for k in 0..n {
                row.fill(0.0);
                let mut model = f64::NAN;
                for ((simulator, regulator), chunk) in simulators.iter_mut().zip(&chunks) {
                    let y = simulator.read();
                    model = y.re;
                    for (lane, &column) in chunk.iter().enumerate() {
                        row[column] = y.eps[lane];
                    }
                    if k + 1 == n {
                        continue;
                    }
                    let h = record.time[k + 1] - record.time[k];
                    match (regulator, &self.feedback) {
                        (Some(regulator), Some(feedback)) => {
                            let beside = feedback.replays[r].beside[k];
                            let u = regulator.command_beside(reference(record, k), y, beside, h);
                            if let Some((_, commands)) = &mut response {
                                for (lane, &column) in chunk.iter().enumerate() {
                                    commands[column] = -u.eps[lane];
                                }
                                commands[columns - 1] = u.re - record.input.values[k];
                            }
                            simulator.advance_held(u, h);
                        }
                        _ => simulator.advance(command(record, k), h),
                    }
                }
                row[columns - 1] = record.output.values[k] - model;
                if let Some((response, commands)) = &mut response {
                    response.add_to(&mut row);
                    response.advance(commands);
                }
                if !row.iter().all(|value| value.is_finite()) {
                    return None;
                }
                if !each(k == 0, &mut row) {
                    return None;
                }
            }
        }
        Some(())
    }

    /// Takes the smallest number of substeps for which halving the step moves no reading by more than `1e-6` of the
    /// output's range.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn choose_substeps(&mut self, x: &[f64]) -> Result<(), Error> {
        let (low, high) = self
            .records
            .iter()
            .map(Record::output_range)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), range| {
                (low.min(range.0), high.max(range.1))
            });
        let tolerance = 1e-6 * (high - low);
        // The simulator itself cuts steps that are long against a time constant: until its cuts are the longer ones,
        // halving changes nothing, which says nothing.
        let rounding = 1e-13 * low.abs().max(high.abs());
        let mut enough = None;
        self.substeps = 1;
        let mut coarse = self.simulate(x)?;
        while self.substeps < 64 {
            let n = self.substeps;
            self.substeps = 2 * n;
            let fine = self.simulate(x)?;
            let moved = coarse
                .output
                .iter()
                .flatten()
                .zip(fine.output.iter().flatten())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            if moved > tolerance {
                enough = None;
            } else {
                enough = enough.or(Some(n));
                if moved > rounding {
                    break;
                }
            }
            coarse = fine;
        }
        self.substeps = enough.unwrap_or(self.substeps);
        Ok(())
    }

    /// The scales that a simulation shows: levels of every vessel and the throughput.
    ///
    /// A level that is not measured is what the model makes it, a wrong model several times too high or too low: its
    /// range reaches down to an empty vessel.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn scales_at(&self, x: &[f64]) -> Result<Scales, Error> {
        let simulated = self.simulate(x)?;
        let plant = self.structure.plant;
        let mut scales = self.structure.scales.clone();
        for vessel in 0..plant.vessels() {
            let (low, high) = simulated.level[vessel];
            if low.is_finite() && high.is_finite() && high > low {
                let measured = vessel + 1 == plant.vessels();
                scales.level[vessel] = if measured {
                    (low, high)
                } else {
                    (low.min(0.0), high.max(0.0))
                };
                scales.operating_level[vessel] = simulated.mean_level[vessel];
            }
        }
        let (sum, n) = self
            .records
            .iter()
            .flat_map(|record| &record.input.values)
            .fold((0.0, 0usize), |(sum, n), u| (sum + u.abs(), n + 1));
        scales.flow = (x[0] * sum / n as f64).abs();
        Ok(scales)
    }
}

/// The command from sample `k` to the next one.
fn command(record: &Record, k: usize) -> Command {
    let u = &record.input.values;
    match record.hold {
        Hold::Zero => Command::held(u[k]),
        Hold::First => Command::ramp(u[k], u[k + 1]),
    }
}

/// The set point at sample `k`; not a number where the record has none.
fn reference(record: &Record, k: usize) -> f64 {
    record.reference.as_ref().map_or(f64::NAN, |r| r.values[k])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use ct_signals::Signal;
    use plants::{Known, Plant};

    #[test]
    fn a_cost_above_a_limit_is_seen_with_and_without_derivatives() {
        let wave = |k: usize| 5.0 + (0.1 * k as f64).sin();
        let record = Record {
            name: "wave".into(),
            time: (0..300).map(|k| 2.0 * k as f64).collect(),
            input: Signal::new("u", "V", (0..300).map(wave).collect()),
            output: Signal::new("y", "cm", (0..300).map(|k| 2.0 * wave(k + 40)).collect()),
            reference: None,
            hold: Hold::Zero,
        };
        let records = [record];
        let fixed = BTreeMap::new();
        let known = Known::default();
        let setup = Setup::from_records(Plant::CascadedTanks, known, &[], &records, fixed).unwrap();
        let x = [0.05, 0.1, 0.08, 7.0, 9.0];
        for noise in [
            ArModel::white(1.0),
            ArModel::from_coefficients(&[0.9, -0.3], 0.2).unwrap(),
        ] {
            let cost = setup.linearise(&x, &noise).unwrap().cost();
            for (share, above) in [(1.0 - 1e-6, true), (1.0, false), (1.0 + 1e-6, false)] {
                let limit = share * cost;
                assert_eq!(setup.costs_more(&x, &noise, limit), above);
                let below = setup.linearise_below(&x, &noise, limit);
                assert_eq!(below.map(|below| below.cost()), (!above).then_some(cost));
            }
            assert!(setup.costs_more(&[f64::NAN; 5], &noise, f64::INFINITY));
        }
    }
}
