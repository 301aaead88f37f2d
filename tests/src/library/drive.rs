//! Inputs of a model, and the resulting records.

use ct_model::effects::Visited;
use ct_model::{Model, ModelSpec, Simulation};
use ct_signals::{Channel, Hold, Record};
use ctid_examples::model_records::DrivenModel;
use greybox::LoopController;
use plants::controller::Controller;

use super::Series;

/// A loop: its input and its output, with the gain \[input unit per output unit\] and the integral time in rows.
fn controller(model: &str) -> (usize, usize, f64, f64) {
    match model {
        "heated-block" => (0, 0, 3.0, 25.0),
        "coupled-heaters" => (0, 0, 3.0, 40.0),
        "dc-motor" => (0, 1, 0.08, 15.0),
        // With a gain above 7, the controller's delay of one sample makes this lightly damped oscillator unstable.
        "mass-spring" => (0, 0, 4.0, 100.0),
        "house" => (0, 0, 1.5, 20.0),
        "bioreactor" => (0, 0, -0.02, 60.0),
        // A drawn current lowers the voltage.
        "battery" => (0, 0, -1.0, 200.0),
        _ => (0, 0, 0.3, 40.0),
    }
}

/// Parameters that the model's file has as known, or as measured beside the record with a relative error.
pub(super) fn side_measurements(
    model: &str,
) -> (&'static [&'static str], &'static [(&'static str, f64)]) {
    match model {
        "heated-block" => (&["C"], &[]),
        "mass-spring" => (&["m"], &[]),
        "coupled-heaters" => (&[], &[("eA", 0.09)]),
        "battery" => (&[], &[("R0", 0.06)]),
        "dc-motor" => (&[], &[("R", 0.04)]),
        _ => (&[], &[]),
    }
}

pub(super) struct Drive<'a> {
    pub(super) driven: &'a DrivenModel,
    pub(super) inputs: Vec<Vec<Vec<f64>>>,
    pub(super) initial: Vec<Vec<f64>>,
    pub(super) closed: bool,
}

impl Drive<'_> {
    /// Inputs as they were given, and outputs without noise, of each record.
    #[allow(clippy::type_complexity)]
    pub(super) fn simulate(
        &self,
        spec: &ModelSpec,
        noise: &[Vec<Vec<f64>>],
    ) -> Option<Vec<Series>> {
        let model = Model::new(spec.clone());
        let parameters = model.parameters();
        let (u, y, gain, _) = controller(self.driven.name);
        let loops = self.controllers();
        let mut all = Vec::new();
        for (r, (inputs, own)) in self.inputs.iter().zip(&self.initial).enumerate() {
            let mut initial = model.starts(&parameters);
            initial[..own.len()].copy_from_slice(own);
            let mut inputs = inputs.clone();
            let (low, high) = range(&inputs[u]);
            let begin = r as f64 * 1.02 * inputs[u].len() as f64 * self.driven.interval;
            let mut simulation = Simulation::new(&model, &parameters, &initial, begin);
            let mut outputs = vec![Vec::new(); spec.outputs.len()];
            let mut read = vec![0.0; outputs.len()];
            let middle = 0.5 * (low + high);
            let mut running = loops.first().map(|of| of.controller.start(&[middle]));
            let (mut reference, mut first) = (Vec::new(), None);
            let rows_of = inputs[u].len();
            for k in 0..rows_of {
                let now = |inputs: &[Vec<f64>], k: usize| -> Vec<f64> {
                    inputs.iter().map(|input| input[k]).collect()
                };
                let asked = inputs[u][k];
                // A command answers to the reading of the row before: the terminals of a cell follow their current at once.
                if let Some(running) = &running {
                    inputs[u][k] = running.clone().command(0.0, 0.0, 1.0);
                }
                let from = now(&inputs, k);
                simulation.read(&from, &mut read);
                if let Some(running) = &mut running {
                    let measured = read[y] + noise.get(r).map_or(0.0, |n| n[y][k]);
                    // The reference moves as the command of the open loop does, around where the output began.
                    let wanted = *first.get_or_insert(measured) + 0.5 * (asked - middle) / gain;
                    running.command(wanted, measured, 1.0);
                    reference.push(wanted);
                }
                for (output, value) in outputs.iter_mut().zip(&read) {
                    output.push(*value);
                }
                if k + 1 < rows_of {
                    let to = if self.driven.lines && !self.closed {
                        now(&inputs, k + 1)
                    } else {
                        from.clone()
                    };
                    let until = begin + (k + 1) as f64 * self.driven.interval;
                    simulation.advance(&from, &to, until).ok()?;
                }
            }
            if outputs.iter().flatten().any(|v| !v.is_finite()) {
                return None;
            }
            all.push(Series {
                inputs,
                outputs,
                reference,
            });
        }
        Some(all)
    }

    /// The controller of the records, if there is one: `(1 - q^-1) u = gain (q^-1 - (1 - 1/rows) q^-2) e`.
    pub(super) fn controllers(&self) -> Vec<LoopController> {
        let (input, output, gain, rows) = controller(self.driven.name);
        let (low, high) = range(&self.inputs[0][input]);
        let r = [0.0, gain, gain * (1.0 / rows - 1.0)];
        let law = Controller::sampled(&r, &[1.0, -1.0], (low, high));
        let of = |law: Controller| LoopController {
            controller: law.at_output(output),
            input,
            reference: Some(0),
        };
        law.ok()
            .filter(|_| self.closed)
            .map(of)
            .into_iter()
            .collect()
    }

    pub(super) fn records(
        &self,
        spec: &ModelSpec,
        simulated: &[Series],
        noise: &[Vec<Vec<f64>>],
    ) -> Vec<Record> {
        let unit = self.driven.time_unit.0;
        let hold = if self.driven.lines && !self.closed {
            Hold::First
        } else {
            Hold::Zero
        };
        let one = |(r, series): (usize, &Series)| {
            let Series {
                inputs,
                outputs,
                reference,
            } = series;
            let rows = inputs[0].len();
            let begin = r as f64 * 1.02 * rows as f64 * self.driven.interval;
            let channel = |about: &ct_model::About, values: Vec<f64>| {
                Channel::new(&about.name, &about.unit, values)
            };
            let read = outputs.iter().enumerate().map(|(o, values)| {
                let added = |(k, y): (usize, &f64)| y + noise.get(r).map_or(0.0, |n| n[o][k]);
                let values = values.iter().enumerate().map(added).collect();
                channel(spec.about(spec.outputs[o].variable), values)
            });
            let time = |k: usize| (begin + k as f64 * self.driven.interval) * unit;
            Record {
                name: format!("record {}", r + 1),
                time: (0..rows).map(time).collect(),
                inputs: spec
                    .inputs
                    .iter()
                    .zip(inputs)
                    .map(|(input, values)| channel(&input.about, values.clone()).with_hold(hold))
                    .collect(),
                outputs: read.collect(),
                references: if reference.is_empty() {
                    Vec::new()
                } else {
                    let (_, y, ..) = controller(self.driven.name);
                    let about = spec.about(spec.outputs[y].variable);
                    vec![Channel::new("reference", &about.unit, reference.clone())]
                },
                ..Record::default()
            }
        };
        simulated.iter().enumerate().map(one).collect()
    }
}

pub(super) fn range(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

#[allow(clippy::type_complexity)]
pub(super) fn visited(
    spec: &ModelSpec,
    drive: &Drive,
    simulated: &[Series],
) -> Result<Visited, String> {
    let model = Model::new(spec.clone());
    let mut all: Option<Visited> = None;
    for ((r, Series { inputs, .. }), initial) in simulated.iter().enumerate().zip(&drive.initial) {
        let rows = inputs[0].len();
        let begin = r as f64 * 1.02 * rows as f64 * drive.driven.interval;
        let time: Vec<f64> = (0..rows)
            .map(|k| begin + k as f64 * drive.driven.interval)
            .collect();
        let by_row: Vec<Vec<f64>> = (0..rows)
            .map(|k| inputs.iter().map(|input| input[k]).collect())
            .collect();
        let parameters = model.parameters();
        let own = Visited::of_simulation(
            spec,
            (&parameters, initial),
            &time,
            &by_row,
            drive.driven.time_unit.1,
        )
        .map_err(|error| error.to_string())?;
        match &mut all {
            None => all = Some(own),
            Some(all) => all.join(&own),
        }
    }
    all.ok_or_else(|| "no record".to_string())
}
