//! A user's own model fitted to records: the basis of comparisons, simulations and exports.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ct_signals::Record;
use effect_search::residual_tests::InputDependence;
use effect_search::{ControlLoop, Options, Thresholds, held_out, in_needed_loop, widened};
use greybox::{
    Fit, FitOptions, FitUncertainty, ModelSetup, Robust, SimulatedLoop, TimeLimit,
    moved_by_weighting,
};
use missing_effect::Effort;

use super::blame::{blame, blame_search};
use super::enclosed::{first_fit_of, in_loop};
use super::file::{OwnModelFile, Records};
use crate::findings::{self, Reader};
use crate::{Error, MessageNames};

/// Share of the time for adding the effects of the file one after the other.
const OF_EFFECTS: f64 = 0.5;

/// A model, the records that it is fitted to, and the fit.
#[derive(Clone)]
pub struct FittedModel {
    given: OwnModelFile,
    model: OwnModelFile,
    records: Records,
    options: FitOptions,
    fit: Fit,
    simulated_loop: Option<Arc<SimulatedLoop>>,
    control_loop: Option<ControlLoop>,
    effort: Effort,
}

/// Time limit of a fit: at the limit the fit stops, and its present estimate is the result.
#[derive(Debug, Clone, Copy, Default)]
pub struct FitLimit<'a> {
    /// A time.
    pub time: Option<Duration>,
    /// A flag that is set.
    pub interrupt: Option<&'a AtomicBool>,
}

impl<'a> FitLimit<'a> {
    /// The limit of a search of a plant.
    pub(crate) fn of(options: &missing_effect::Options<'a>) -> Self {
        Self {
            time: options.time_limit,
            interrupt: options.interrupt,
        }
    }
}

/// Agreement of a simulation with a measured output.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputScore {
    /// The output.
    pub output: String,
    /// Root mean square of the simulation error \[unit of the output\].
    pub rmse: f64,
    /// `100 (1 - rmse/s)` with the standard deviation s of the readings that are scored, %.
    pub fit_percent: f64,
}

/// What was left out of a fit, and how to get it.
pub(super) fn cut_short(effort: &Effort) -> Option<String> {
    let said = findings::effort(effort, Reader::Commands);
    (!said.is_empty()).then(|| said.join(" "))
}

impl FittedModel {
    /// Fits a model, with its effects in it, to records; `simulate_loop`: the loop of the file's controllers is simulated from its references
    /// if that is possible.
    ///
    /// # Errors
    /// If the records do not allow a fit, with the names of those that cause it.
    pub fn fit(
        file: &OwnModelFile,
        records: Records,
        (options, simulate_loop): (&FitOptions, bool),
        limit: FitLimit,
    ) -> Result<Self, Error> {
        let began = Instant::now();
        let of_effects = Options {
            seed: options.seed,
            time_limit: limit.time.map(|time| time.mul_f64(OF_EFFECTS)),
            interrupt: limit.interrupt,
            simulate_loop,
            ..Options::default()
        };
        let model = file.mended_within(Some(&records), &of_effects)?;
        let effects_are_cut = !file.effects.on.is_empty()
            && of_effects.time_limit.is_some_and(|t| began.elapsed() >= t);
        let setup = setup_of(&model, &records)?;
        ct_signals::require_samples(&records.records, setup.free().len())?;
        let rest = limit.time.map(|t| t.saturating_sub(began.elapsed()));
        let time = Arc::new(TimeLimit::new(rest));
        if effects_are_cut {
            time.leave_out("steps of the fits of the effects");
        }
        let setup = setup.with_time_limit(time.clone(), limit.interrupt);
        let (setup, fit) = first_fit_of(file, &records, setup, (options, simulate_loop))?;
        let (fit, simulated_loop, control_loop) =
            in_loop(file, &records, (setup, fit), (options, simulate_loop))?;
        if time.passed() {
            time.leave_out("steps of the fit");
        }
        let effort = Effort {
            limit: limit.time.map(|time| time.as_secs_f64()),
            left_out: time.left_out(),
            interrupted: limit
                .interrupt
                .is_some_and(|flag| flag.load(Ordering::Relaxed)),
        };
        Ok(Self {
            given: file.clone(),
            model,
            records,
            options: *options,
            fit,
            simulated_loop,
            control_loop,
            effort,
        })
    }

    /// Restores a saved fit of this model to these records.
    ///
    /// # Errors
    /// If it is not a fit of this model to these records.
    pub fn of_fit(
        file: &OwnModelFile,
        records: Records,
        options: &FitOptions,
        fit: Fit,
    ) -> Result<Self, Error> {
        let model = file.mended(Some(&records))?;
        let setup = setup_of(&model, &records)?;
        let entries = setup.names().len();
        if entries != fit.x.len() {
            return Err(Error::Usage(format!(
                "the fit has {} entries, and {} has {entries} with these records: fit it again",
                fit.x.len(),
                file.base.name
            )));
        }
        let controllers = file.loop_controllers(&records)?;
        let setup = in_needed_loop(setup, &fit.x, &controllers, &Thresholds::DEFAULT);
        let (_, simulated_loop, control_loop) =
            in_loop(file, &records, (setup, fit.clone()), (options, true))?;
        Ok(Self {
            given: file.clone(),
            model,
            records,
            options: *options,
            fit,
            simulated_loop,
            control_loop,
            effort: Effort::default(),
        })
    }

    /// The model without inserted effects, and the effects separately.
    #[must_use]
    pub fn given(&self) -> &OwnModelFile {
        &self.given
    }

    /// The model with its effects in it.
    #[must_use]
    pub fn model(&self) -> &OwnModelFile {
        &self.model
    }

    /// The records.
    #[must_use]
    pub fn records(&self) -> &Records {
        &self.records
    }

    /// The same fit with these records in place of its own.
    pub(super) fn with_records(&self, records: Vec<Record>) -> Self {
        Self {
            records: Records {
                records,
                ..self.records.clone()
            },
            ..self.clone()
        }
    }

    /// The fit.
    #[must_use]
    pub fn estimate(&self) -> &Fit {
        &self.fit
    }

    /// Options of the fit.
    #[must_use]
    pub fn options(&self) -> &FitOptions {
        &self.options
    }

    /// The control loop of the records; `None` if the file has no controller and no feedback was detected.
    #[must_use]
    pub fn control_loop(&self) -> Option<&ControlLoop> {
        self.control_loop.as_ref()
    }

    /// The time limit of the fit, and the steps that were cut short.
    #[must_use]
    pub fn effort(&self) -> &Effort {
        &self.effort
    }

    /// What the reader has to know of the fit: whether it was cut short, and whether the loop of its records is not simulated.
    pub(super) fn warnings(&self) -> Vec<String> {
        let known = self.control_loop.as_ref().filter(|known| !known.simulated);
        let of_loop = known.map(|known| self.given.loop_sentence(known, &MessageNames::PROGRAM));
        cut_short(&self.effort).into_iter().chain(of_loop).collect()
    }

    /// A warning if the residual of the fit depends on the inputs: then it is more than noise. A fit that was cut short says nothing.
    pub(super) fn lacks_an_effect(&self) -> Result<Option<String>, Error> {
        if !self.effort.left_out.is_empty() {
            return Ok(None);
        }
        let setup = self.setup()?;
        let thresholds = Thresholds::DEFAULT;
        let dependence = |setup: &ModelSetup| {
            let found = InputDependence::at(setup, &self.fit.x, &thresholds);
            found.filter(|found| found.p < thresholds.not_noise)
        };
        // In a simulated loop a part of the fed-back noise remains in the residual of a nonlinear plant.
        let found = match (&self.simulated_loop, dependence(&setup)) {
            (Some(of), Some(_)) if !of.is_needed() => {
                dependence(&setup_of(&self.model, &self.records)?)
            }
            (_, found) => found,
        };
        Ok(found.map(|found| {
            let outputs = &setup.records()[0].outputs;
            format!(
                "the residual of the fit at {} depends on {}, and the band does not include this model error: `ctid diagnose` shows what is missing",
                outputs[found.residual % outputs.len()].name,
                found.input
            )
        }))
    }

    /// The model against its records, as it was fitted.
    ///
    /// # Errors
    /// Those of the fit, which has passed them.
    pub fn setup(&self) -> Result<ModelSetup<'_>, Error> {
        let setup = setup_of(&self.model, &self.records)?;
        Ok(match &self.simulated_loop {
            Some(simulated) => setup.in_loop(simulated.clone()),
            None => setup,
        })
    }

    /// The uncertainty of all fitted parameters, with the noise model of the residual; `None` if the simulation at the fit is not finite.
    ///
    /// # Errors
    /// As [`FittedModel::setup`].
    pub fn robust(&self) -> Result<Option<Robust>, Error> {
        let setup = self.setup()?;
        let mut robust = setup.robust(&self.fit, self.options.noise_order).ok();
        if let Some(robust) = &mut robust
            && let Some(moved) = self.bias_of_feedback(&setup)?
        {
            robust.std_errors = widened(std::mem::take(&mut robust.std_errors), &moved);
        }
        Ok(robust)
    }

    /// Uncertainty of the parameters; `None` if the records do not determine all of them.
    pub(super) fn uncertainty(&self, setup: &ModelSetup) -> Result<Option<FitUncertainty>, Error> {
        let count = setup.parameter_count();
        let known = FitUncertainty::of(setup, &self.fit, count, self.options.noise_order);
        let mut known = known.map_err(|error| blame(&self.records.records, error))?;
        if let Some(known) = &mut known
            && let Some(moved) = self.bias_of_feedback(setup)?
        {
            known.widen(&moved);
        }
        Ok(known)
    }

    /// About the bias of each entry from feedback in a loop that is not simulated; `None` without such a loop.
    ///
    /// # Errors
    /// Where a fit with the other weighting fails.
    pub(super) fn bias_of_feedback(&self, setup: &ModelSetup) -> Result<Option<Vec<f64>>, Error> {
        let FitOptions {
            noise_order,
            stopping,
            ..
        } = self.options;
        if !ControlLoop::widens(self.control_loop.as_ref()) {
            return Ok(None);
        }
        let moved = moved_by_weighting(setup, &self.fit, noise_order, stopping);
        let moved =
            moved.map_err(|error| blame(&self.records.records, greybox::Error::from(error)))?;
        Ok(Some(moved))
    }

    /// Scores of simulations of other records, output by output. Initial states are fitted to the first rows of each record, which are not
    /// scored; all other parameters are fixed.
    ///
    /// # Errors
    /// Where a record is not one of this model, or its initial states cannot be fitted.
    pub fn score(&self, test: &[Record]) -> Result<Vec<OutputScore>, Error> {
        let setup = self.setup()?;
        let found = held_out(&setup, &self.fit, test);
        let found = found.map_err(|error| blame_search(test, error))?;
        let Some(found) = found else {
            return Ok(Vec::new());
        };
        let scored = |o: usize| -> Vec<f64> {
            let all = test.iter().zip(&found.state_rows);
            let all = all.flat_map(|(record, rows)| record.outputs[o].values.iter().skip(*rows));
            all.copied().filter(|value| !value.is_nan()).collect()
        };
        let all = found.rmse.iter().enumerate();
        Ok(self.scores(all.map(|(o, &rmse)| (rmse, scored(o)))))
    }

    /// Scores of the model on its fitted records, output by output.
    #[must_use]
    pub fn score_of_fit(&self) -> Vec<OutputScore> {
        let of = |(o, &rmse): (usize, &f64)| {
            let records = self.records.records.iter();
            let values = records.flat_map(|record| record.outputs[o].present());
            (rmse, values.collect())
        };
        self.scores(self.fit.rmse.iter().enumerate().map(of))
    }

    /// Scores of each output, from its error and the scored readings.
    fn scores(&self, errors: impl Iterator<Item = (f64, Vec<f64>)>) -> Vec<OutputScore> {
        let outputs = self.model.model.spec().about_outputs().zip(errors);
        let outputs = outputs.map(|(about, (rmse, values))| {
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            OutputScore {
                output: about.name.clone(),
                rmse,
                fit_percent: 100.0 * (1.0 - rmse / (squares / count).sqrt()),
            }
        });
        outputs.collect()
    }
}

/// A model with its effects in it against records.
fn setup_of<'a>(model: &'a OwnModelFile, records: &'a Records) -> Result<ModelSetup<'a>, Error> {
    let setup = ModelSetup::new(
        &model.model,
        &records.records,
        &model.known,
        records.time_unit,
    );
    let setup = setup.and_then(|setup| setup.with_priors(&model.priors));
    setup.map_err(|error| blame(&records.records, error))
}
