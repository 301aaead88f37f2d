//! The text of a plant with effects, fitted to its records.
//!
//! Each effect of the catalogue becomes the effect at a port of the plant's text that it is. Where an effect can act at several ports
//! (`drift(alpha)`, `drift(outflow)`) all are fitted, and the one with the least error is written. The error has to be that of the plant.

use std::collections::BTreeMap;

use ct_signals::{Columns, Hold};
use greybox::FitOptions;
use missing_effect::{Options, Problem};
use rayon::prelude::*;

use crate::input::Files;
use crate::own_model::{FitLimit, FittedModel, OwnModelFile, OwnSettings, Records, without_gaps};
use crate::{Error, numbers};

/// Largest relative difference between the simulation errors of the plant and of its text.
const SAME_ERROR: f64 = 0.01;
/// Largest number of combinations of ports.
const MOST_FITS: usize = 64;

fn refused(files: &Files, why: &str) -> Error {
    let what = format!("--modelica: {why}; write its curves with --csv");
    Error::file(&files.model, &what)
}

/// The text of a plant with its effects, with fitted values and their standard errors. `columns`, `hold`: those of the model file.
///
/// # Errors
/// Where an effect is none of the text's, or the text does not fit as well as the plant.
pub(super) fn with_effects(
    problem: &Problem,
    (columns, hold): (&Columns, Hold),
    files: &Files,
    options: &Options,
) -> Result<String, Error> {
    let refuse = |why: String| Err(refused(files, &why));
    let plant = problem.plant;
    if !problem.terms.is_empty() {
        return refuse("a term of your own has no port of the plant's text".to_string());
    }
    let (mut records, mut spec) = (problem.records.clone(), None);
    for record in &mut records {
        let own = plant
            .spec_of(&problem.known, record)
            .map_err(|error| Error::Usage(error.to_string()))?;
        spec.get_or_insert(own);
        record.references.clear();
    }
    let Some(spec) = spec else {
        return refuse("there is no record".to_string());
    };
    let of_text = |name: &str| spec.find(name).is_some();
    let numbers_of = problem.priors.keys().chain(&problem.fixed);
    if let Some(name) = numbers_of.into_iter().find(|name| !of_text(name)) {
        return refuse(format!(
            "{name} has a prior or a fixed value, and is no parameter of the plant's text"
        ));
    }
    let mut sets: Vec<Vec<String>> = vec![Vec::new()];
    for placed in &problem.effects {
        let ports = plant.at_ports(&spec, placed);
        if ports.is_empty() {
            return refuse(format!(
                "{} is no effect at a port of the text of {}",
                placed.effect.id,
                plant.id()
            ));
        }
        let with_each = sets.iter().flat_map(|set| {
            ports.iter().map(|port| {
                let mut set = set.clone();
                set.push(port.clone());
                set
            })
        });
        sets = with_each.take(MOST_FITS).collect();
    }
    let known = problem.fixed.iter().filter_map(|name| {
        let value = problem.start.get(name)?;
        Some((name.clone(), *value))
    });
    let settings = OwnSettings {
        columns: columns.clone(),
        known: known.collect::<BTreeMap<String, f64>>(),
        priors: problem.priors.clone(),
        hold,
        ..OwnSettings::default()
    };
    let records = Records {
        records: without_gaps(&records),
        test: Vec::new(),
        time_unit: 1.0,
        summaries: Vec::new(),
    };
    let limit = FitLimit {
        time: options.time_limit,
        interrupt: options.interrupt,
    };
    let fits = sets.into_par_iter().map(|effects| {
        let settings = OwnSettings {
            effects,
            ..settings.clone()
        };
        let file = OwnModelFile::new(plant.id(), spec.clone(), settings)?;
        FittedModel::fit(&file, records.clone(), &FitOptions::default(), limit)
    });
    let fits: Vec<Result<FittedModel, Error>> = fits.collect();
    let error_of = |fitted: &FittedModel| {
        let squares = fitted.estimate().rmse.iter().map(|rmse| rmse * rmse);
        squares.sum::<f64>()
    };
    let mut failed = None;
    let fitted = fits.into_iter().filter_map(|fit| match fit {
        Ok(fitted) => Some(fitted),
        Err(error) => {
            failed = Some(error);
            None
        }
    });
    let best = fitted.min_by(|a, b| error_of(a).total_cmp(&error_of(b)));
    let Some(best) = best else {
        return Err(failed.unwrap_or_else(|| refused(files, "no fit is finite")));
    };
    // The text is simulated on the measured command.
    let options = Options {
        simulate_loop: false,
        ..*options
    };
    let of_plant =
        missing_effect::compare(problem, &options).map_err(|error| files.blame(error))?;
    let last = of_plant.steps.last();
    let outputs = last.map_or(&[][..], |step| &step.outputs[..]);
    for (own, output) in best.estimate().rmse.iter().zip(outputs) {
        if (own / output.rmse - 1.0).abs() > SAME_ERROR {
            return refuse(format!(
                "with {}, the text of {} has an error of {} and the plant one of {}",
                best.given().effects.on.join(", "),
                plant.id(),
                numbers::significant(*own, 3),
                numbers::significant(output.rmse, 3)
            ));
        }
    }
    best.text(&format!("plant {}", plant.id()))
}
