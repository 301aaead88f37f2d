//! Coverage of the intervals of fitted models of `examples/models`: two outputs in coloured noise, with a share of the readings missing.

use std::collections::BTreeMap;

use ct_model::{Given, Model, Simulation};
use ct_signals::{Channel, Hold, Record, noise};
use ctid_examples::model_records::DrivenModel;
use greybox::{FitOptions, ModelSetup};
use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

/// Correlation of the noise from row to row.
const CORRELATION: f64 = 0.8;
/// Share of the readings that are missing.
const MISSING: f64 = 0.3;

/// For one fitted number, in how many records its interval of 95 % contained the true value.
#[derive(Debug, Clone)]
pub struct Coverage {
    /// Name of the number.
    pub name: String,
    /// Number of records whose interval contained the true value.
    pub held: usize,
    /// Records that gave an interval.
    pub of: usize,
}

/// The record that a seed draws: inputs, noise and what is missing.
fn record(driven: &DrivenModel, seed: u64) -> Record {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let model = Model::new(driven.spec.clone());
    let spec = model.spec();
    let rows = driven.rows;
    let inputs = driven.inputs(rows, &mut rng).unwrap_or_default();
    let parameters = model.parameters();
    let mut simulation = Simulation::new(&model, &parameters, &driven.initial, 0.0);
    let mut read = vec![0.0; spec.outputs.len()];
    let mut outputs = vec![vec![f64::NAN; rows]; spec.outputs.len()];
    let at = |k: usize| -> Vec<f64> { inputs.iter().map(|input| input[k]).collect() };
    for k in 0..rows {
        simulation.read(&at(k), &mut read);
        for (output, value) in outputs.iter_mut().zip(&read) {
            output[k] = *value;
        }
        if k + 1 < rows {
            let to = at(if driven.lines { k + 1 } else { k });
            let until = (k + 1) as f64 * driven.interval;
            if simulation.advance(&at(k), &to, until).is_err() {
                break;
            }
        }
    }
    for (output, sigma) in outputs.iter_mut().zip(&driven.noise) {
        let added = noise::ar1(rows, *sigma, CORRELATION, &mut rng);
        for (value, added) in output.iter_mut().zip(added) {
            let missing = rng.random::<f64>() < MISSING;
            *value = if missing { f64::NAN } else { *value + added };
        }
    }
    let hold = if driven.lines {
        Hold::First
    } else {
        Hold::Zero
    };
    let channel = |about: &ct_model::About, values| Channel::new(&about.name, &about.unit, values);
    let seconds = |k: usize| k as f64 * driven.interval * driven.time_unit.0;
    let of_inputs = spec.inputs.iter().zip(inputs);
    let of_outputs = spec.outputs.iter().zip(outputs);
    Record {
        name: format!("record {seed}"),
        time: (0..rows).map(seconds).collect(),
        inputs: of_inputs
            .map(|(input, values)| channel(&input.about, values).with_hold(hold))
            .collect(),
        outputs: of_outputs
            .map(|(output, values)| channel(spec.about(output.variable), values))
            .collect(),
        ..Record::default()
    }
}

/// Whether the intervals of 95 % of a record contain the true value, for every fitted number that has one: as `ctid compare` fits and says
/// them. Fits begin at the values of the model's text.
#[must_use]
pub fn of_record(driven: &DrivenModel, seed: u64) -> Vec<(String, bool)> {
    let mut believed = driven.spec.clone();
    for (parameter, guess) in believed.parameters.iter_mut().zip(&driven.guesses) {
        if parameter.given == Given::Fitted {
            parameter.value = *guess;
        }
    }
    let model = Model::new(believed);
    let records = [record(driven, seed)];
    let known = BTreeMap::new();
    let options = FitOptions {
        starts: 1,
        ..FitOptions::default()
    };
    let Ok(setup) = ModelSetup::new(&model, &records, &known, driven.time_unit.0) else {
        return Vec::new();
    };
    let fitted = setup.fit(&options);
    let fitted = fitted.and_then(|fit| Ok((setup.robust(&fit, options.noise_order)?, fit)));
    let Ok((robust, fit)) = fitted else {
        return Vec::new();
    };
    let parameters = driven.spec.parameters.iter().map(|p| p.value);
    let truth = parameters.chain(driven.initial.iter().copied());
    let numbers = setup.names().iter().zip(truth).zip(&fit.x);
    numbers
        .zip(robust.half_widths(0.95))
        .filter_map(|(((name, truth), x), half)| Some((name.clone(), (x - truth).abs() <= half?)))
        .collect()
}

/// Counts over all records with these seeds.
#[must_use]
pub fn count(records: &[Vec<(String, bool)>]) -> Vec<Coverage> {
    let mut all: Vec<Coverage> = Vec::new();
    for (name, held) in records.iter().flatten() {
        let position = all.iter().position(|coverage| coverage.name == *name);
        let position = position.unwrap_or_else(|| {
            all.push(Coverage {
                name: name.clone(),
                held: 0,
                of: 0,
            });
            all.len() - 1
        });
        all[position].of += 1;
        all[position].held += usize::from(*held);
    }
    all
}
