//! `ctid compare` for a user's own model: the fit, and the simulation errors on fitted and held-out records.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ct_signals::{ArModel, Clock, parts};
use effect_search::{
    ControlLoop, Estimate, MendedGaps, NoiseFloor, Options, Step, held_out, output_steps, widened,
};
use greybox::{FitOptions, TimeLimit, not_determined, weighted_rms};
use missing_effect::Effort;
use serde::Serialize;

use super::blame::{blame, blame_search};
use super::effects::RecordNumbers;
use super::file::{OwnModelFile, Records};
use super::fitted::{FitLimit, FittedModel};
use crate::Error;

/// The initial states of held-out records are fitted within this share of the time, whatever the fit took.
const OF_HELD_OUT: f64 = 0.25;

/// Measured values and model output, for one output of one record.
#[derive(Debug, Clone)]
pub struct Curves {
    /// The record's name.
    pub record: String,
    /// The output's name.
    pub output: String,
    /// Unit of the values.
    pub unit: String,
    /// Sampling instants \[s\].
    pub time: Vec<f64>,
    /// Measured values, NaN if missing \[unit of the output\].
    pub measured: Vec<f64>,
    /// Output of the model \[unit of the output\].
    pub model: Vec<f64>,
}

/// Result of `ctid compare`.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Version of this layout.
    pub schema: u32,
    /// The model's name.
    pub model: String,
    /// The effects of the model file that are in the model.
    pub effects: Vec<String>,
    /// Numbers of the records that the effects contain.
    pub record_numbers: RecordNumbers,
    /// The fitted model.
    pub steps: [Step; 1],
    /// Innovation variance of each output's residual: the part that its past does not predict.
    pub noise: Vec<NoiseFloor>,
    /// Handling of the gaps of the records; `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaps: Option<MendedGaps>,
    /// The control loop of the records; `None` if no controller is known and no feedback was detected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control_loop: Option<ControlLoop>,
    /// The time limit, and the steps that were cut short.
    pub effort: Effort,
    /// Computing time \[s\].
    pub seconds: f64,
    /// Format of times.
    #[serde(skip)]
    pub clock: Clock,
    /// Measured values and model output, for each output of each record.
    #[serde(skip)]
    pub curves: Vec<Curves>,
}

/// Fits the model and computes its errors. The seed, the time limit and the interruption flag of the options are used.
///
/// # Errors
/// If nothing can be fitted; the message names the file that causes it.
pub fn compare(
    file: &OwnModelFile,
    records: &Records,
    options: &Options,
) -> Result<Comparison, Error> {
    let began = Instant::now();
    let fit_options = FitOptions {
        seed: options.seed,
        ..FitOptions::default()
    };
    let limit = FitLimit {
        time: options.time_limit,
        interrupt: options.interrupt,
    };
    let fitted = FittedModel::fit(
        file,
        records.clone(),
        (&fit_options, options.simulate_loop),
        limit,
    )?;
    let mut comparison = fitted.compare()?;
    comparison.seconds = began.elapsed().as_secs_f64();
    Ok(comparison)
}

impl FittedModel {
    /// Errors of the fitted model on its records and on the held-out records.
    ///
    /// # Errors
    /// Where a simulation is not finite, or the initial states of a held-out record cannot be fitted.
    pub fn compare(&self) -> Result<Comparison, Error> {
        let began = Instant::now();
        let mut comparison = compared(self)?;
        comparison.seconds = began.elapsed().as_secs_f64();
        Ok(comparison)
    }
}

fn compared(fitted: &FittedModel) -> Result<Comparison, Error> {
    let (file, records, fit) = (fitted.model(), fitted.records(), fitted.estimate());
    let spec = file.model.spec();
    let blame = |error: greybox::Error| blame(&records.records, error);
    let options = fitted.options();
    let mut effort = fitted.effort().clone();
    let share = effort
        .limit
        .map(|limit| Duration::from_secs_f64(OF_HELD_OUT * limit));
    let afterwards = Arc::new(TimeLimit::new(share));
    let setup = fitted.setup()?.with_time_limit(afterwards.clone(), None);
    let simulated = setup
        .simulate(&fit.x)
        .ok_or_else(|| blame(greybox::Error::Stopped))?;
    let test = held_out(&setup, fit, &records.test);
    let test = test.map_err(|error| blame_search(&records.records, error))?;
    if test.is_some() && afterwards.passed() {
        let left_out = "steps of the fit of the held-out records' initial states";
        effort.left_out.push(left_out.to_string());
    }
    let noise = setup
        .output_noise(&fit.x)
        .ok_or_else(|| blame(greybox::Error::Stopped))?;
    let outputs: Vec<&ct_model::About> = spec.about_outputs().collect();
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
    let noise_floors = outputs
        .iter()
        .zip(&noise)
        .map(|(about, &sigma)| NoiseFloor {
            output: about.name.clone(),
            level: sigma,
            innovation: sigma,
            coefficients: Vec::new(),
        });
    let noise_floors = noise_floors.collect();
    // The fit minimises the simulation error: its residual has the noise's spectrum.
    let errors = setup
        .robust(fit, options.noise_order)
        .map_or_else(|_| fit.std_errors(), |robust| robust.std_errors);
    let errors = match fitted.bias_of_feedback(&setup)? {
        Some(moved) => widened(errors, &moved),
        None => errors,
    };
    let free = setup.free();
    let entries = setup.names().iter().zip(units.chain(states)).enumerate();
    let estimates = entries.map(|(i, (name, unit))| Estimate {
        name: name.clone(),
        value: fit.x[i],
        std_error: errors[i],
        unit: unit.clone(),
        known: !free.contains(&i),
        effect: file.effects.parameters.get(name).cloned(),
    });
    let step = Step {
        added: None,
        rmse: (outputs.len() == 1).then(|| fit.rmse[0]),
        rmse_per_output: named(&fit.rmse),
        rmse_test_per_output: test.as_ref().map(|test| named(&test.rmse)),
        state_rows: test.as_ref().map(|test| test.state_rows.clone()),
        weighted_rmse: weighted_rms(&fit.rmse, &noise, &fit.samples_per_output),
        bic: fit.bic(),
        parameters: estimates.collect(),
        starts: fit.starts,
        starts_agree: fit.agree,
        not_determined: not_determined(&setup, fit),
        outputs: {
            let white: Vec<ArModel> = noise.iter().map(|sigma| ArModel::white(*sigma)).collect();
            output_steps(&setup, fit, &simulated, &white, test.as_ref())
        },
        simulated: simulated
            .iter()
            .cloned()
            .chain(test.into_iter().flat_map(|test| test.simulated))
            .collect(),
    };
    let whole = parts::joined(&records.records);
    let of_whole = parts::joined_series(&records.records, outputs.len(), &simulated);
    let measured = whole.iter().flat_map(|record| {
        let channels = record.outputs.iter().zip(&outputs);
        channels.map(move |(channel, about)| (record, channel, about))
    });
    let curves = measured
        .zip(of_whole)
        .map(|((record, channel, about), model)| Curves {
            record: record.name.clone(),
            output: about.name.clone(),
            unit: about.unit.clone(),
            time: record.time.clone(),
            measured: channel.values.clone(),
            model,
        });
    Ok(Comparison {
        schema: 4,
        model: spec.name.clone(),
        effects: file.effects.on.clone(),
        record_numbers: file.record_numbers.clone(),
        clock: Clock::of(&records.records),
        curves: curves.collect(),
        steps: [step],
        noise: noise_floors,
        gaps: records.gaps,
        control_loop: fitted.control_loop().cloned(),
        effort,
        seconds: 0.0,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::path::{Path, PathBuf};
    use std::time::Duration;

    use super::*;
    use crate::input::Files;
    use crate::look::Look;
    use crate::own_model::{AnyModelFile, export, said, simulate};
    use crate::simulate::Inputs;

    const CUT: &str = "Left out by the time limit of 0 s: steps of the fit. For a longer search: `--effort thorough` (limit 10 min).";

    /// The heated block of the examples, its record, and the files.
    fn heated_block() -> (OwnModelFile, Records, Files) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models");
        let (model, data) = (
            folder.join("heated-block.toml"),
            folder.join("heated-block.csv"),
        );
        let AnyModelFile::Own(file) = AnyModelFile::read(&model).unwrap() else {
            unreachable!("it names a text")
        };
        let files = Files {
            data: vec![data],
            test: Vec::new(),
            model: PathBuf::from("m.toml"),
            options: ct_signals::ReadOptions::default(),
        };
        let records = file.records(&files).unwrap();
        (*file, records, files)
    }

    /// A time limit that has passed still gives a fit, and one line reports that it was cut short.
    #[test]
    fn the_limit_on_the_time_is_kept_and_said() {
        let (file, records, _) = heated_block();
        let within = |limit: Duration| {
            let options = Options {
                time_limit: Some(limit),
                ..Options::default()
            };
            compare(&file, &records, &options).unwrap()
        };
        let cut = within(Duration::ZERO);
        assert_eq!(cut.effort.left_out, ["steps of the fit"]);
        let text = said(&file, &cut, Look::plain());
        assert!(text.contains(&format!("warning: {CUT}\n")), "{text}");
        let whole = within(Duration::from_secs(600));
        assert!(whole.effort.left_out.is_empty() && whole.effort.limit == Some(600.0));
        assert!(whole.steps[0].rmse <= cut.steps[0].rmse);
        assert!(!said(&file, &whole, Look::plain()).contains("time limit"));
    }

    #[test]
    fn fits_for_an_export_and_a_simulation_keep_the_limit_too() {
        let (file, records, files) = heated_block();
        let inputs = Inputs {
            path: files.data[0].clone(),
            options: ct_signals::ReadOptions::default(),
            first: 10,
        };
        for (seconds, warnings) in [(0, vec![CUT.to_string()]), (600, Vec::new())] {
            let limit = FitLimit {
                time: Some(Duration::from_secs(seconds)),
                interrupt: None,
            };
            let options = FitOptions::default();
            let with_records = Some((records.clone(), &files));
            let (exported, _) = export(&file, with_records, &options, limit).unwrap();
            assert_eq!(exported.warnings, warnings);
            let fitted_to = Some(records.clone());
            let (simulated, _) = simulate(&file, fitted_to, &inputs, &options, limit).unwrap();
            assert_eq!(simulated.warnings, warnings);
        }
    }
}
