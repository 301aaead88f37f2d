//! The text of a plant with effects, fitted to its records.
//!
//! Each effect of the catalogue becomes the effect at a port of the plant's text that it is. Where an effect can act at several ports
//! (`nonlinearity(u)`, `varies_with(pump_gain,u)`) all are fitted, and the one with the least error is written. The error must not be larger
//! than that of the plant.

use ct_model::ModelSpec;
use ct_signals::{Columns, Hold, Record};
use greybox::FitOptions;
use missing_effect::{Options, Problem};
use rayon::prelude::*;

use crate::own_model::{FitLimit, FittedModel, OwnModelFile, OwnSettings, Records};
use crate::{Error, numbers};

/// Largest relative difference by which the simulation error of the text may be above that of the plant.
const SAME_ERROR: f64 = 0.01;
/// A difference of errors is rounding below this share of the largest reading.
const ROUNDING: f64 = 1e-6;
/// Largest number of combinations of ports.
const MOST_FITS: usize = 64;

/// The text of a plant, and the sets of effects at its ports that its effects can be.
pub(super) struct AtPorts {
    spec: ModelSpec,
    sets: Vec<Vec<String>>,
}

impl AtPorts {
    /// The effects of a plant at the ports of its text; looked for before anything is fitted.
    ///
    /// # Errors
    /// If the text cannot have an effect, or has no parameter for a setting of the model file.
    pub(super) fn of(problem: &Problem) -> Result<Self, String> {
        let plant = problem.plant;
        if let Some(term) = problem.terms.first() {
            return Err(format!(
                "the term {} of your own has no place in the text of {}",
                term.name,
                plant.id()
            ));
        }
        let mut first = problem.records[0].clone();
        let spec = plant.spec_of(&problem.known, &mut first);
        let spec = spec.map_err(|error| error.to_string())?;
        if spec.inputs.len() != first.inputs.len() {
            return Err(format!(
                "the text of {} has {} inputs, and the records have {}",
                plant.id(),
                spec.inputs.len(),
                first.inputs.len()
            ));
        }
        let is_parameter = |name: &str| spec.parameters.iter().any(|p| p.about.name == name);
        let mut given = problem.priors.keys().chain(&problem.fixed);
        if let Some(name) = given.find(|name| !is_parameter(name)) {
            return Err(format!(
                "{name} is given (a prior, or fixed), and the text of {} has no such parameter",
                plant.id()
            ));
        }
        let mut sets: Vec<Vec<String>> = vec![Vec::new()];
        for placed in &problem.effects {
            let ports = plant.at_ports(&spec, placed);
            if ports.is_empty() {
                return Err(format!(
                    "the text of {} has no effect that is {}",
                    plant.id(),
                    placed.effect.id
                ));
            }
            let with_each = sets.iter().flat_map(|set| {
                ports
                    .iter()
                    .filter(|port| !set.contains(port))
                    .map(|port| [&set[..], std::slice::from_ref(port)].concat())
            });
            sets = with_each.take(MOST_FITS).collect();
            if sets.is_empty() {
                return Err(format!(
                    "{} is the same effect in the text of {} as another one of the model file",
                    placed.effect.id,
                    plant.id()
                ));
            }
        }
        Ok(Self { spec, sets })
    }

    /// The text with fitted values and their standard errors. `records`: of the plant's fit; `columns`, `hold`: of the model file; `errors`:
    /// the root mean square of the plant's simulation error at each output, on the measured command.
    ///
    /// # Errors
    /// Where the text does not fit as well as the plant.
    pub(super) fn fitted(
        &self,
        problem: &Problem,
        records: &[Record],
        (columns, hold): (&Columns, Hold),
        errors: &[f64],
        options: &Options,
    ) -> Result<String, String> {
        let plant = problem.plant;
        let mut records = records.to_vec();
        for record in &mut records {
            plant
                .spec_of(&problem.known, record)
                .map_err(|error| error.to_string())?;
            record.references.clear();
        }
        let levels = records.iter().flat_map(|record| &record.outputs);
        let levels = levels.flat_map(|level| &level.values).copied();
        let largest = levels.fold(0.0, |most: f64, level| most.max(level.abs()));
        let settings = OwnSettings {
            columns: columns.clone(),
            priors: problem.priors.clone(),
            hold,
            ..OwnSettings::default()
        };
        let records = Records {
            records,
            test: Vec::new(),
            gaps: None,
            time_unit: 1.0,
            summaries: Vec::new(),
        };
        let limit = FitLimit::of(options);
        let fits = self.sets.par_iter().map(|effects| {
            let settings = OwnSettings {
                effects: effects.clone(),
                ..settings.clone()
            };
            let file = OwnModelFile::new(plant.id(), self.spec.clone(), settings)?;
            FittedModel::fit(
                &file,
                records.clone(),
                (&FitOptions::default(), false),
                limit,
            )
        });
        let fits: Vec<Result<FittedModel, Error>> = fits.collect();
        // Root mean square of the ratios of the errors: 1 where the text fits as the plant does.
        let ratio = |fitted: &FittedModel| {
            let both = fitted.estimate().rmse.iter().zip(errors);
            let rounding = ROUNDING * largest;
            let ratios = both.map(|(own, of_plant)| (own / (of_plant + rounding)).powi(2));
            (ratios.sum::<f64>() / errors.len() as f64).sqrt()
        };
        let (fitted, failed): (Vec<_>, Vec<_>) = fits.into_iter().partition(Result::is_ok);
        let fitted = fitted.into_iter().flatten();
        let Some(best) = fitted.min_by(|a, b| ratio(a).total_cmp(&ratio(b))) else {
            let why = failed.into_iter().find_map(Result::err);
            let why = why.map_or_else(String::new, |error| error.to_string());
            return Err(format!("no fit of the text: {why}"));
        };
        let ratio = ratio(&best);
        if ratio <= 1.0 + SAME_ERROR {
            let text = best.text(&format!("plant {}", plant.id()));
            let text = text.map_err(|error| error.to_string())?;
            let effects = problem.effects.iter().zip(&best.given().effects.on);
            let named: Vec<String> = effects
                .map(|(placed, port)| format!("{} is {port}", placed.effect.id))
                .collect();
            let said = format!("\n// Time is in seconds. {}.\n", named.join(", "));
            return Ok(text.replacen('\n', &said, 1));
        }
        let cut = best.effort().left_out.first();
        Err(format!(
            "with {}, the simulation error of the text of {} is {} times that of the plant{}",
            best.given().effects.on.join(", "),
            plant.id(),
            numbers::significant(ratio, 3),
            cut.map_or_else(String::new, |_| {
                ", and its fit reached the time limit (--effort)".to_string()
            })
        ))
    }
}
