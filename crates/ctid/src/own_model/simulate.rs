//! A user's own model on new inputs.

use std::path::Path;

use ct_signals::{Columns, Heading, ReadSummary, Reading, Record, record_names};
use greybox::{FitOptions, FitUncertainty, InitialStates, ModelSetup, output_errors};

use super::file::{OwnModelFile, Records};
use super::fitted::{FitLimit, FittedModel};
use crate::Error;
use crate::simulate::{
    Band, Inputs, LEVEL, ReadInputs, Simulated, SimulatedOutput, StateSource, begins_with_readings,
    of_first_readings, read_inputs,
};

/// Simulates the model on the inputs of a record, after a fit to other records if there are any.
///
/// # Errors
/// One line that names the file, the place and the correction.
pub(crate) fn simulate(
    file: &OwnModelFile,
    mut records: Option<Records>,
    inputs: &Inputs,
    options: &FitOptions,
    limit: FitLimit,
) -> Result<(Simulated, Vec<ReadSummary>), Error> {
    let read_options = ct_signals::ReadOptions {
        hold: file.hold,
        ..inputs.options.clone()
    };
    let mut read = read_inputs(&inputs.path, &file.columns, &read_options, |e| {
        file.named(e)
    })?;
    file.convert(&mut read.record, &mut read.summary)?;
    let mut summaries = Vec::new();
    let time_unit = match &mut records {
        None => file.time_unit(&inputs.path)?,
        Some(records) => {
            let mut all = std::mem::take(&mut records.records);
            all.push(read.record);
            crate::input::on_one_clock(&mut all);
            read.record = all.pop().unwrap_or_default();
            records.records = all;
            summaries.append(&mut records.summaries);
            records.time_unit
        }
    };
    summaries.push(read.summary.clone());
    let name = &inputs.path;
    let fitted = match records {
        None => None,
        Some(records) => Some(FittedModel::fit(file, records, (options, true), limit)?),
    };
    let mended;
    let model = match &fitted {
        None => {
            mended = file.mended(None)?;
            &mended
        }
        Some(fitted) => fitted.model(),
    };
    let of = (model, fitted.as_ref(), time_unit);
    let mut found = simulated(of, (&read, name, inputs.first), LEVEL, options)?;
    found.effects.clone_from(&file.effects.on);
    found.warnings.extend(file.other_time_unit(time_unit));
    if let Some(fitted) = &fitted {
        found.warnings.extend(fitted.warnings());
        found.warnings.extend(fitted.lacks_an_effect()?);
    }
    Ok((found, summaries))
}

impl FittedModel {
    /// The model on the inputs of another record. Where that has readings its initial states are fitted to the `first` of each output, or
    /// more where these do not tell. `level`: the probability with which the band holds, within 0 and 1.
    ///
    /// # Errors
    /// Where an input is not whole, or the simulation does not go on, with the place and the correction.
    pub fn simulate(&self, reading: Reading, first: usize, level: f64) -> Result<Simulated, Error> {
        let name = std::path::PathBuf::from(&reading.record.name);
        let columns = Columns {
            time: Some(reading.summary.time_header.clone()),
            ..Columns::default()
        };
        let mut read = ReadInputs::of(&name, reading, &columns)?;
        self.model().convert(&mut read.record, &mut read.summary)?;
        let mut all = self.records().records.clone();
        all.push(read.record);
        crate::input::on_one_clock(&mut all);
        read.record = all.pop().unwrap_or_default();
        let whole = self.with_records(all);
        let of = (self.model(), Some(&whole), whole.records().time_unit);
        let mut found = simulated(of, (&read, &name, first), level, self.options())?;
        found.effects.clone_from(&self.given().effects.on);
        Ok(found)
    }
}

/// A model with its effects on the inputs of a record, with initial states fitted to the first readings. `path` is the name in errors.
///
/// # Errors
/// Where the simulation does not go on.
fn simulated(
    (file, fitted, time_unit): (&OwnModelFile, Option<&FittedModel>, f64),
    (read, path, first): (&ReadInputs, &Path, usize),
    level: f64,
    options: &FitOptions,
) -> Result<Simulated, Error> {
    let record = &read.record;
    let spec = file.model.spec();
    let count = spec.parameters.len();
    let own = std::slice::from_ref(record);
    let wrong = |error: greybox::Error| Error::fit(path, error);
    let fit = match fitted {
        None => None,
        Some(fitted) => Some((fitted, fitted.setup()?)),
    };
    let setup = match &fit {
        None => ModelSetup::new(&file.model, own, &file.known, time_unit),
        Some((_, setup)) => setup.with_records(own),
    };
    let setup = setup.map_err(wrong)?;
    let parameters = match &fit {
        None => setup.start()[..count].to_vec(),
        Some((fitted, _)) => fitted.estimate().x[..count].to_vec(),
    };
    let mut warnings = Vec::new();
    let known = match &fit {
        None => None,
        Some((fitted, setup)) => {
            if fitted.control_loop().is_some_and(|known| known.needed) {
                warnings.push(
                    "the model is unstable without its controllers, and this simulation runs without them: the smallest error grows".to_string(),
                );
            }
            let known = fitted.uncertainty(setup)?;
            if known.is_none() {
                warnings.push(
                    "the records do not determine all parameters, so there is no band: `ctid compare` says which; fix some of them under [known], or give a [prior]".to_string(),
                );
            }
            known
        }
    };
    let (initial, states_from) = states(
        &setup,
        &parameters,
        (record, first),
        known.as_ref(),
        options,
    )
    .map_err(wrong)?;
    if states_from == StateSource::Text && begins_with_readings(record) && !spec.states.is_empty() {
        warnings.push(format!(
            "the readings of {} do not determine the initial states; those of the model text are used",
            record.name
        ));
    }
    let mut x = parameters.clone();
    x.extend(&initial.values);
    let Some(mean) = setup.simulate(&x) else {
        return Err(runs_away(&setup, record, path, &x, &spec.name));
    };
    let errors = match &known {
        None => None,
        Some(known) => {
            let errors = output_errors(&setup, &x, count, known, &initial);
            Some(errors.ok_or_else(|| runs_away(&setup, record, path, &x, &spec.name))?)
        }
    };
    let names = file.columns.outputs.iter();
    let names = names.map(|name| Heading::of(name).name);
    let outputs = spec.about_outputs().zip(names).zip(mean).enumerate();
    let outputs = outputs.map(|(o, ((about, name), mean))| {
        let band = errors.as_ref().zip(known.as_ref());
        SimulatedOutput {
            name,
            unit: about.unit.clone(),
            band: band.map(|(errors, known)| Band::of(&errors[o], known, o, level)),
            mean,
            measured: record.outputs[o].values.clone(),
        }
    });
    let std_error = |i: usize| known.as_ref()?.std_error(i);
    let fitted_to = fitted.map_or_else(Vec::new, |fitted| record_names(&fitted.records().records));
    let names = spec.parameters.iter().map(|p| p.about.name.clone());
    Ok(Simulated {
        schema: 1,
        model: spec.name.clone(),
        effects: Vec::new(),
        inputs: record.name.clone(),
        fitted_to: fitted_to.into_iter().map(String::from).collect(),
        parameters: names
            .zip(parameters)
            .enumerate()
            .map(|(i, (name, value))| (name, value, std_error(i)))
            .collect(),
        states: spec
            .states
            .iter()
            .map(|state| format!("{}(0)", state.about.name))
            .zip(initial.values.iter().copied())
            .collect(),
        states_from,
        level,
        outputs: outputs.collect(),
        warnings,
        length: record.duration(),
        time: read.time.clone(),
        readings: false,
    })
}

/// The initial states: fitted to the first readings, to more of them if these are not sufficient, or from the text.
fn states(
    setup: &ModelSetup,
    parameters: &[f64],
    (record, first): (&Record, usize),
    known: Option<&FitUncertainty>,
    options: &FitOptions,
) -> Result<(InitialStates, StateSource), greybox::Error> {
    let count = parameters.len();
    let entries: &[usize] = known.map_or(&[], |known| &known.entries);
    let fitted = of_first_readings((record, first), |begun| {
        let frozen = setup.held_out(begun, parameters)?;
        let Some(known) = known else {
            let x = frozen.fit_states(options)?;
            return Ok(Some(InitialStates::known(x[count..].to_vec(), 0)));
        };
        let model = setup.with_records(begun)?;
        let x: Vec<f64> = [parameters, &frozen.start()[count..]].concat();
        InitialStates::of_readings(&frozen, &model, &x, count, known, options.stopping)
    })?;
    if let Some(states) = fitted {
        return Ok((states, StateSource::Readings));
    }
    let states = InitialStates::of_text(setup.model(), parameters, entries);
    Ok((states, StateSource::Text))
}

/// Message for a simulation that diverges: time, and correction.
fn runs_away(setup: &ModelSetup, record: &Record, path: &Path, x: &[f64], model: &str) -> Error {
    let goes = |rows: usize| {
        let part = [record.rows(0..rows)];
        let setup = setup.with_records(&part);
        setup.is_ok_and(|setup| setup.simulate(x).is_some())
    };
    // The last row before the simulation diverges.
    let (mut good, mut bad) = (0, record.len());
    while bad - good > 1 {
        let middle = usize::midpoint(good, bad);
        if goes(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    let at = ct_signals::Clock::of([record]).at(record.time[good.saturating_sub(1)]);
    Error::file(
        path,
        format!(
            "the simulation of {model} cannot continue after {at}: a state grows without bound, or an equation has no value or an infinite slope there, as sign(d)*sqrt(abs(d)) at d = 0; correct the inputs there, the parameters' values, or the model's text: d/sqrt(abs(d) + c) with a small c has a finite slope"
        ),
    )
}
