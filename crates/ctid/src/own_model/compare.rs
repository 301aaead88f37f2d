//! A model of its user's own fitted to records, and how far it is off.

use std::collections::BTreeMap;
use std::time::Instant;

use ct_signals::Record;
use greybox::{Fit, FitOptions, ModelSetup, weighted_rms};
use serde::Serialize;

use super::file::{OwnModelFile, Records};
use crate::Error;
use crate::output::Found;

/// A held-out record's initial states are fitted on so many samples, and it is scored from there on.
const STATE_ROWS: usize = 5;
/// Estimates whose correlation is above this are not known one without the other.
const TOGETHER: f64 = 0.999;

/// A parameter or an initial state as it was fitted.
#[derive(Debug, Serialize)]
pub(crate) struct Estimate {
    /// Its name.
    pub name: String,
    /// Its value \[unit\].
    pub value: f64,
    /// Its standard error; `None` where it is known, at a bound or not determined.
    pub std_error: Option<f64>,
    /// Its unit as the text has it.
    pub unit: String,
    /// It is not fitted.
    pub known: bool,
}

/// The model and how far it is off, as each step of a diagnosis has it.
#[derive(Debug, Serialize)]
pub(crate) struct Step {
    /// The effect that was added: none.
    pub added: Option<String>,
    /// Simulation error of an only output \[its unit\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse: Option<f64>,
    /// Simulation error by output, on the fitted records \[unit of the output\].
    pub rmse_per_output: BTreeMap<String, f64>,
    /// The same on the held-out records.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_test_per_output: Option<BTreeMap<String, f64>>,
    /// Simulation error, each output divided by its noise, which is what a linear prediction from the past leaves: 1 is the noise floor.
    pub weighted_rmse: f64,
    /// Bayesian information criterion.
    pub bic: f64,
    /// All parameters, then the initial states.
    pub parameters: Vec<Estimate>,
    /// Starts of the fit.
    pub starts: usize,
    /// How many of them ended in the best minimum.
    pub starts_agree: usize,
}

/// Measured and model, of one output of one record.
#[derive(Debug)]
pub(crate) struct Curves {
    pub record: String,
    pub output: String,
    pub unit: String,
    /// Length of the record \[s\].
    pub length: f64,
    pub measured: Vec<f64>,
    pub model: Vec<f64>,
}

/// What `ctid compare` finds.
#[derive(Debug, Serialize)]
pub(crate) struct Comparison {
    pub schema: u32,
    /// The model's name.
    pub model: String,
    pub effects: Vec<String>,
    pub steps: [Step; 1],
    /// Fitted entries that these records do not determine, alone or together with another one.
    pub not_determined: Vec<Vec<String>>,
    pub seconds: f64,
    #[serde(skip)]
    pub curves: Vec<Curves>,
}

impl Found for Comparison {}

/// Fits the model and says how far it is off.
///
/// # Errors
/// Where nothing can be fitted, with the file that is to blame.
pub(crate) fn compare(
    file: &OwnModelFile,
    records: &Records,
    options: &FitOptions,
) -> Result<Comparison, Error> {
    let began = Instant::now();
    let spec = file.model.spec();
    let blame = |error: greybox::Error| Error::File {
        file: records
            .records
            .iter()
            .map(|r| r.name.as_str())
            .collect::<Vec<_>>()
            .join(", "),
        what: error.to_string(),
    };
    let setup = ModelSetup::new(
        &file.model,
        &records.records,
        &file.known,
        records.time_unit,
    )
    .map_err(blame)?;
    let setup = setup.with_priors(&file.priors).map_err(blame)?;
    let parameters = setup.free().len();
    ct_signals::require_samples(&records.records, parameters)?;
    let fit = setup.fit(options).map_err(blame)?;
    let simulated = setup
        .simulate(&fit.x)
        .ok_or_else(|| blame(greybox::Error::Stopped))?;
    let test = held_out(&setup, &fit, &records.test, options).map_err(blame)?;
    let noise = setup
        .output_noise(&fit.x)
        .ok_or_else(|| blame(greybox::Error::Stopped))?;
    let outputs: Vec<&ct_model::About> = spec
        .outputs
        .iter()
        .map(|output| spec.about(output.variable))
        .collect();
    let named = |rms: &[f64]| -> BTreeMap<String, f64> {
        let pairs = outputs.iter().zip(rms);
        pairs
            .map(|(about, rms)| (about.name.clone(), *rms))
            .collect()
    };
    let units = spec.parameters.iter().map(|p| &p.about.unit);
    let states = records
        .records
        .iter()
        .flat_map(|_| spec.states.iter().map(|s| &s.about.unit));
    let errors = fit.std_errors();
    let free = setup.free();
    let entries = setup.names().iter().zip(units.chain(states)).enumerate();
    let estimates = entries.map(|(i, (name, unit))| Estimate {
        name: name.clone(),
        value: fit.x[i],
        std_error: errors[i],
        unit: unit.clone(),
        known: !free.contains(&i),
    });
    let step = Step {
        added: None,
        rmse: (outputs.len() == 1).then(|| fit.rmse[0]),
        rmse_per_output: named(&fit.rmse),
        rmse_test_per_output: test.map(|rms| named(&rms)),
        weighted_rmse: weighted_rms(&fit.rmse, &noise, &fit.samples_per_output),
        bic: fit.bic(),
        parameters: estimates.collect(),
        starts: fit.starts,
        starts_agree: fit.agree,
    };
    let measured = records.records.iter().flat_map(|record| {
        let channels = record.outputs.iter().zip(&outputs);
        channels.map(move |(channel, about)| (record, channel, about))
    });
    let curves = measured
        .zip(simulated)
        .map(|((record, channel, about), model)| Curves {
            record: record.name.clone(),
            output: about.name.clone(),
            unit: about.unit.clone(),
            length: record.duration(),
            measured: channel.values.clone(),
            model,
        });
    Ok(Comparison {
        schema: 2,
        model: spec.name.clone(),
        effects: Vec::new(),
        not_determined: not_determined(&setup, &fit),
        curves: curves.collect(),
        steps: [step],
        seconds: began.elapsed().as_secs_f64(),
    })
}

/// Simulation error of each output on held-out records.
fn held_out(
    setup: &ModelSetup,
    fit: &Fit,
    test: &[Record],
    options: &FitOptions,
) -> Result<Option<Vec<f64>>, greybox::Error> {
    if test.is_empty() {
        return Ok(None);
    }
    let outputs = fit.rmse.len();
    let mut sums = vec![(0.0, 0_usize); outputs];
    for record in test {
        let whole = [record.clone()];
        let first = [record.rows(0..STATE_ROWS)];
        let states = setup.held_out(&first, &fit.x)?.fit_states(options)?;
        let model = setup.held_out(&whole, &fit.x)?.simulate(&states);
        for (o, sum) in sums.iter_mut().enumerate() {
            let measured = &record.outputs[o].values;
            let Some(model) = &model else {
                sum.0 = f64::NAN;
                continue;
            };
            for (y, m) in measured
                .iter()
                .zip(&model[o])
                .skip(STATE_ROWS)
                .filter(|(y, _)| !y.is_nan())
            {
                sum.0 += (y - m).powi(2);
                sum.1 += 1;
            }
        }
    }
    Ok(Some(
        sums.into_iter()
            .map(|(sum, n)| (sum / n.max(1) as f64).sqrt())
            .collect(),
    ))
}

/// Entries that the records do not determine: alone, or pairs of which they tell one combination only.
fn not_determined(setup: &ModelSetup, fit: &Fit) -> Vec<Vec<String>> {
    let names = setup.names();
    let mut found = Vec::new();
    match fit.correlations() {
        Some((entries, matrix)) => {
            for (i, row) in matrix.iter().enumerate() {
                for (j, c) in row.iter().enumerate().take(i) {
                    if c.abs() > TOGETHER {
                        found.push(vec![names[entries[j]].clone(), names[entries[i]].clone()]);
                    }
                }
            }
        }
        // Not all can be told: those without a trace in the outputs are named.
        None => {
            let free = setup.free();
            let length = |column: usize| fit.triangle.column_norm(column);
            let silent = (0..free.len()).filter(|&column| length(column) <= f64::MIN_POSITIVE);
            found.extend(silent.map(|column| vec![names[free[column]].clone()]));
            if found.is_empty() {
                found.push(free.iter().map(|&i| names[i].clone()).collect());
            }
        }
    }
    found
}
