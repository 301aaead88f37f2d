//! The result of a diagnosis: plain structs, written as JSON as they stand; everything that is
//! printed or plotted is derived from them.

use ct_signals::{ArModel, Channel, Clock, Record};
use greybox::{Noise, PriorValue};
use plants::{Domain, Plant};
use serde::{Deserialize, Deserializer, Serialize};

use crate::{MendedGaps, Unknown, numbers::value_and_error};

/// What the search found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every added effect is singled out by the data.
    Effect,
    /// Something is missing, and at least one added effect has a stand-in that fits as well.
    Undecided,
    /// The added effects explain the larger part of the error, and something else remains that is not noise.
    Partial,
    /// What the model leaves is not noise, and nothing in the catalogue explains it; after a comparison, which searches nothing: the
    /// model lacks something.
    Unexplained,
    /// Nothing is missing that these data would show.
    Adequate,
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name, `alpha` or `overflow.rim`; initial states are `level(0)` and the like.
    pub name: String,
    /// The estimate, in `unit`.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub value: f64,
    /// Its standard error, in `unit`; `None` where the data do not determine it or it sits at a bound.
    pub std_error: Option<f64>,
    /// Unit, for example `cm^2.5/s`.
    pub unit: String,
    /// What is known of it beside the records, where the model says so; the estimate has it in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorValue>,
}

/// Records that are further from a prior than so many standard errors of the two together disagree with it.
const DISAGREES: f64 = 3.0;

impl Parameter {
    /// Its prior in words, and how far it is from there where the two disagree.
    #[must_use]
    pub fn prior_words(&self) -> Option<String> {
        let prior = self.prior?;
        let (value, error) = value_and_error(prior.value, Some(prior.std_error));
        // The estimate has the prior in it: their difference is the less uncertain the better the prior is beside the records.
        let own = self.std_error.map_or(0.0, |error| error * error);
        let variance = prior.std_error * prior.std_error - own;
        let scale = if variance > 0.0 {
            variance.sqrt()
        } else {
            prior.std_error
        };
        let away = (self.value - prior.value).abs() / scale;
        let mut words = format!("prior {value} ± {}", error.unwrap_or_default());
        if away > DISAGREES {
            words += &format!("; the records disagree with it by {away:.1} standard errors");
        }
        Some(words)
    }
}

/// Residual tests of one fit, of its first record but for `input_p`; the bounds are for 95 %.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResidualTests {
    /// Autocorrelation of the simulation residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub autocorrelation: Vec<f64>,
    /// Cross-correlation of the whitened input with the whitened residual at lags 0, 1, ...
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub cross_correlation: Vec<f64>,
    /// Half-width of the 95 % band of the autocorrelation.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub autocorrelation_bound: f64,
    /// Half-width of the 95 % band of the cross-correlation.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub cross_correlation_bound: f64,
    /// p-value of the Ljung-Box test: whiteness of the simulation residual.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub whiteness_p: f64,
    /// p-value of the portmanteau test of the cross-correlation with the input (in a simulated loop the reference), of all records.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub input_p: f64,
}

/// The residual in one bin of something: a time window, a range of level, of flow, ...
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Position of the record that a window lies in, fitted ones first; `None` where all fitted records are counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub record: Option<usize>,
    /// Lower edge.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub from: f64,
    /// Upper edge.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub to: f64,
    /// Samples in it; of frequencies the lines of the spectrum.
    pub count: usize,
    /// Mean residual (measured minus model), in the output's unit; zero of frequencies.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub mean: f64,
    /// Root mean square of the residual, in the output's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub rms: f64,
    /// It fails: its mean square is clearly above what the noise would show there.
    pub fails: bool,
}

/// Where a model fails, in all records that it was fitted to.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Failures {
    /// By time \[s\], record by record.
    pub by_time: Vec<Bin>,
    /// By the model's level, in the output's unit.
    pub by_level: Vec<Bin>,
    /// By the command to the actuator (the flow into the process), in the input's unit.
    pub by_flow: Vec<Bin>,
    /// By direction of change of the model's level: falling, steady, rising (the edges are rates per second).
    pub by_direction: Vec<Bin>,
    /// By frequency \[Hz\]: the root mean square of the residual in octave bands.
    pub by_frequency: Vec<Bin>,
    /// The same in words, the worst first.
    pub sentences: Vec<String>,
}

/// One model on the way: the base, or the base and the effects added so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The effect that this step added; `None` for the base.
    pub added: Option<String>,
    /// The vessel or pump it acts in, where the plant has more than one: `upper` or `lower` of two tanks.
    pub place: Option<String>,
    /// Root mean square of the simulation error on the fitted records, in the output's unit; NaN, and not written, of several outputs.
    #[serde(skip_serializing_if = "none", default = "no_number")]
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub rmse: f64,
    /// The same on the held-out record, whose first five samples set its initial states and are not scored.
    pub rmse_test: Option<f64>,
    /// `rmse` of each output by its name.
    pub rmse_per_output: PerOutput,
    /// `rmse_test` of each output by its name.
    pub rmse_test_per_output: Option<PerOutput>,
    /// Root mean square of the simulation errors of all outputs, each divided by the noise floor of its output: one is the noise.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub weighted_rmse: f64,
    /// The same on the held-out record.
    pub weighted_rmse_test: Option<f64>,
    /// Bayesian information criterion with this model's own noise colour; smaller is better.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub bic: f64,
    /// Parameters in chain order, initial states last.
    pub parameters: Vec<Parameter>,
    /// How many starts were tried.
    pub starts: usize,
    /// How many of them ended in the best minimum.
    pub starts_agree: usize,
    /// What it shows at each output, in order.
    pub outputs: Vec<OutputStep>,
    /// The model's simulated outputs, one series per fitted record and, within it, output, then those of the held-out records.
    #[serde(skip)]
    pub simulated: Vec<Vec<f64>>,
}

/// What one model shows at one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputStep {
    /// Its name.
    pub name: String,
    /// Root mean square of the simulation error on the fitted records, in the output's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub rmse: f64,
    /// The same on the held-out records.
    pub rmse_test: Option<f64>,
    /// The parts of `rmse_test`; `None` without held-out records.
    pub held_out_error: Option<HeldOutError>,
    /// Residual tests.
    pub tests: ResidualTests,
    /// Where it fails.
    pub failures: Failures,
}

/// There is no such number.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn none(value: &f64) -> bool {
    value.is_nan()
}

/// Reads a number that may not be finite, which JSON writes as `null`.
pub(crate) fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

/// The same of several.
pub(crate) fn numbers<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
    let all = Vec::<Option<f64>>::deserialize(from)?;
    Ok(all.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect())
}

fn no_number() -> f64 {
    f64::NAN
}

/// How times are said where no calendar is known.
fn plain_clock() -> Clock {
    Clock::of([])
}

/// A number for each output, by its name, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PerOutput(pub Vec<(String, f64)>);

impl PerOutput {
    /// Values in the order of the outputs.
    pub(crate) fn of(outputs: &[Channel], values: &[f64]) -> Self {
        let names = outputs.iter().map(|output| output.name.clone());
        Self(names.zip(values.iter().copied()).collect())
    }

    /// The numbers in order.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|(_, value)| *value)
    }
}

impl Serialize for PerOutput {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de> Deserialize<'de> for PerOutput {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(InOrder)
    }
}

/// Reads a [`PerOutput`] in the order in which it was written.
struct InOrder;

impl<'de> serde::de::Visitor<'de> for InOrder {
    type Value = PerOutput;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("a number for each output, by its name")
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<PerOutput, A::Error> {
        let mut all = Vec::new();
        while let Some((name, value)) = map.next_entry::<String, Option<f64>>()? {
            all.push((name, value.unwrap_or(f64::NAN)));
        }
        Ok(PerOutput(all))
    }
}

/// One candidate of the catalogue at the first step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// The effect.
    pub effect: String,
    /// The vessel or pump it acts in, where the plant has more than one.
    pub place: Option<String>,
    /// Fall of the Bayesian information criterion when it is added and everything is refitted; larger is better.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub bic_gain: f64,
    /// Simulation error after the refit, in the output's unit; NaN, and not written, of several outputs.
    #[serde(skip_serializing_if = "none", default = "no_number")]
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub rmse: f64,
    /// The same of all outputs, each divided by the noise floor of its output.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub weighted_rmse: f64,
    /// `|p|/|j|`: the part of the effect's signature that the fitted parameters cannot imitate.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub visibility: f64,
    /// The size that was found: the effect's leading parameter.
    pub size: Option<Parameter>,
    /// The smallest size that these data would show, in the unit of `size`; `None` where the effect has no signature while it is absent, or
    /// the fitted parameters imitate all of it.
    pub smallest_visible: Option<f64>,
}

/// The acceptance test of the effects that are reported or, where none is, of the best that were refused: one test for all
/// verdicts.
///
/// An effect is the answer (`effect`, `undecided`) where it leaves noise, or explains `required` of the excess error; it is a
/// part of the answer (`partial`) where it explains `required_partial`; else nothing explains the record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Acceptance {
    /// The effects that were tested; empty where no candidate lowers the error.
    pub effects: Vec<String>,
    /// Part of the excess error that they explain on the fitted records: the fall of the mean squared simulation error over
    /// its excess above `floor` squared, at most 1; of several outputs errors are divided by `floor` first.
    pub share: Option<f64>,
    /// The same on the held-out records; it takes no part in the verdict.
    pub share_test: Option<f64>,
    /// Least `share` of an answer that leaves more than noise.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub required: f64,
    /// Least `share` of a partial answer.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub required_partial: f64,
    /// Standard deviation of the noise that is no excess, by output \[output unit\].
    pub floor: PerOutput,
    /// Fall of the criterion (BIC), each model under the noise model of its own residual.
    pub bic_fall: Option<f64>,
    /// What it has to exceed.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub required_bic_fall: f64,
    /// Why the effects were refused, or are a part of the answer only; empty where they are the answer.
    pub reasons: Vec<String>,
}

/// Where an effect may act, and how likely each place is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceScore {
    /// The vessel or pump.
    pub place: String,
    /// Likelihood relative to the best place, 0 to 1, everything else refitted.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub relative_likelihood: f64,
}

/// The mean squared error on held-out records, split into what an offset, a gain and neither of them explains, as root mean
/// squares \[output unit\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOutError {
    /// Mean of measured minus model, record by record.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub offset: f64,
    /// What a factor on the model's deviations from its mean explains beside the offset.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub gain: f64,
    /// What is left: the shape.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub shape: f64,
}

/// The single effects ranked under two weightings of the residual.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Rankings {
    /// By the simulation error (white noise), best first.
    pub white: Vec<String>,
    /// Prewhitened by the noise model (GLS), best first; empty where the noise is white.
    pub prewhitened: Vec<String>,
    /// The best effects differ beyond what data of this kind tell apart.
    pub disagree: bool,
}

/// What was spent, and what the limit on the time left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Effort {
    /// Limit on the search \[s\]; `None`: no limit.
    pub limit: Option<f64>,
    /// Steps of the search that were cut short or left out; empty where all were done.
    pub left_out: Vec<String>,
    /// The user ended the search, and this is the best so far.
    pub interrupted: bool,
}

/// The noise floor of an output and how it was obtained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    /// Name of the output.
    pub output: String,
    /// Standard deviation of the noise, in the output's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub level: f64,
    /// Standard deviation of what cannot be predicted from its own past, in the output's unit.
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub innovation: f64,
    /// Autoregressive coefficients of the noise: `v[k] = sum a_i v[k-i] + e[k]`; empty for white noise.
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub coefficients: Vec<f64>,
    /// In words: which model's residual it was estimated from.
    pub source: String,
}

impl NoiseFloor {
    /// The noise that a residual is judged against: that of the floor's level and, where that is the noise's own, of its
    /// colour.
    fn model(&self) -> Result<ArModel, ct_signals::Error> {
        if self.level > self.innovation {
            ArModel::from_coefficients(&self.coefficients, self.innovation)
        } else {
            Ok(ArModel::white(self.level))
        }
    }
}

/// The noise floors of all outputs.
#[derive(Debug, Clone)]
pub(crate) struct Floors(pub Vec<NoiseFloor>);

impl Floors {
    /// The noise that residuals are judged against.
    pub fn noise(&self) -> Result<Noise, ct_signals::Error> {
        let models: Result<_, _> = self.0.iter().map(NoiseFloor::model).collect();
        Ok(Noise::of(models?))
    }

    /// The floors, which no model that was fitted lies below: what it leaves holds the noise.
    pub fn at_most(mut self, rmse: &[f64]) -> Self {
        for (floor, rmse) in self.0.iter_mut().zip(rmse) {
            floor.level = floor.level.min(*rmse);
            floor.innovation = floor.innovation.min(*rmse);
        }
        self
    }

    /// The floors where the residual is not noise alone: what a model lacks is in the residual too, but hardly in what
    /// cannot be predicted from the residual's own past.
    pub fn of_what_is_new(mut self) -> Self {
        for floor in &mut self.0 {
            floor.level = floor.innovation;
            floor.source = format!("what the past of {} does not predict", floor.source);
        }
        self
    }
}

/// The loop that the records come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlLoop {
    /// The loop was simulated from its reference; otherwise the model ran on the measured command.
    pub simulated: bool,
    /// p-value of the test that the noise does not show in the command; `None` where a controller is known.
    pub feedback_p: Option<f64>,
    /// Measured command less the one that the controller gives on the measured reading, root mean square, in the input's
    /// unit; `None` where that was not looked at.
    pub mismatch: Option<f64>,
    /// What the user should know of it, in words.
    pub said: Vec<String>,
}

impl ControlLoop {
    /// A loop whose model ran on the measured command, and what that means.
    pub(crate) fn measured(feedback_p: Option<f64>, mismatch: Option<f64>, said: String) -> Self {
        Self {
            simulated: false,
            feedback_p,
            mismatch,
            said: vec![said],
        }
    }

    /// Standard errors have to allow for what feedback does.
    pub(crate) fn widens(known: Option<&Self>) -> bool {
        known.is_some_and(|known| !known.simulated)
    }
}

/// A record as the report shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// Name.
    pub name: String,
    /// It took no part in any fit or choice.
    pub held_out: bool,
    /// Sampling instants \[s\].
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub time: Vec<f64>,
    /// The inputs that the model runs on; of a plant the command first.
    pub inputs: Vec<ShownInput>,
    /// Readings, a series for each output.
    pub outputs: Vec<Vec<f64>>,
}

/// An input of a record as the report shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShownInput {
    /// How it is called: `input`, `input 2`, or its own name.
    pub name: String,
    /// Its unit; empty where none is known.
    pub unit: String,
    /// Its samples \[unit\].
    #[serde(deserialize_with = "crate::diagnosis::numbers")]
    pub values: Vec<f64>,
}

impl Shown {
    /// A record; `held_out`: it takes no part in any fit or choice.
    #[must_use]
    pub fn of(record: &Record, held_out: bool) -> Self {
        Self {
            name: record.name.clone(),
            held_out,
            time: record.time.clone(),
            inputs: record
                .inputs
                .iter()
                .enumerate()
                .map(|(k, input)| ShownInput {
                    name: if record.inputs.len() > 1 {
                        format!("input {}", k + 1)
                    } else {
                        "input".to_string()
                    },
                    unit: input.unit.clone(),
                    values: input.values.clone(),
                })
                .collect(),
            outputs: record.outputs.iter().map(|y| y.values.clone()).collect(),
        }
    }

    /// Readings that are there, of all outputs.
    #[must_use]
    pub fn samples(&self) -> usize {
        let readings = self.outputs.iter().flatten();
        readings.filter(|y| !y.is_nan()).count()
    }
}

/// What a diagnosis found. Read again from JSON it has all that is written there; records, simulated series and the clock are not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// Version of this layout.
    pub schema: u32,
    /// The finding.
    pub verdict: Verdict,
    /// How the times of the records are said.
    #[serde(skip, default = "plain_clock")]
    pub clock: Clock,
    /// What was done about rows and samples of inputs that are missing; `None` where none are.
    pub gaps: Option<MendedGaps>,
    /// The effects that were added, in order.
    pub effects: Vec<String>,
    /// For each of them itself, then all that cannot be told apart from it on these data, best first.
    pub groups: Vec<Vec<String>>,
    /// For each of them whether it is in doubt: its size ends at the edge of what is plausible, so that it describes the data
    /// rather than explains them.
    pub in_doubt: Vec<bool>,
    /// For each of them the places where it may act, most likely first; one where there is no choice.
    pub places: Vec<Vec<PlaceScore>>,
    /// The acceptance test; `None` after a comparison, which searches nothing, and where the model is adequate.
    pub acceptance: Option<Acceptance>,
    /// What the last model leaves is more than noise: something is missing still, or a disturbance acts.
    pub residual_unexplained: bool,
    /// The single effects, best first, at the first step; `none` first when the model is adequate.
    pub ranked: Vec<String>,
    /// The base model and every model after it.
    pub steps: Vec<Step>,
    /// Standard deviation of the noise, in the output's unit; NaN, and not written, of several outputs.
    #[serde(skip_serializing_if = "none", default = "no_number")]
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub noise_floor: f64,
    /// The noise floor of each output, and how it was found.
    pub noise: Vec<NoiseFloor>,
    /// The single effects under both weightings.
    pub rankings: Rankings,
    /// The limit on the time, and what it left out.
    pub effort: Effort,
    /// The scores of the single effects at the first step, best first.
    pub scores: Vec<Score>,
    /// What is missing where the catalogue does not explain it.
    pub unknown: Option<Unknown>,
    /// The loop that the records come from, where there is one.
    pub control_loop: Option<ControlLoop>,
    /// The findings in words.
    pub sentences: Vec<String>,
    /// The plant, as the model file names it.
    pub plant: String,
    /// The effects and the terms that the model file already had.
    pub known_effects: Vec<String>,
    /// Unit of the input.
    pub input_unit: String,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Unit of the outputs.
    pub output_unit: String,
    /// Unit of each output where they differ; else empty.
    #[serde(skip)]
    pub output_units: Vec<String>,
    /// The records, fitted ones first.
    #[serde(skip)]
    pub records: Vec<Shown>,
    /// How long it took \[s\].
    #[serde(deserialize_with = "crate::diagnosis::number")]
    pub seconds: f64,
}

impl Diagnosis {
    /// The domain of the model, which says what things are called.
    #[must_use]
    pub fn domain(&self) -> Domain {
        domain_of(&self.plant, &self.output_unit)
    }

    /// The unit of an output, by its position.
    #[must_use]
    pub fn unit_of(&self, output: usize) -> &str {
        self.output_units.get(output).unwrap_or(&self.output_unit)
    }

    /// Adds what is known of the loop, and what there is to say of it.
    pub(crate) fn speak_of_the_loop(&mut self, known: Option<ControlLoop>) {
        if let Some(known) = &known {
            self.sentences.extend_from_slice(&known.said);
        }
        self.control_loop = known;
    }
}

/// The domain of a plant by its name and of its output's unit.
pub(crate) fn domain_of(plant: &str, output_unit: &str) -> Domain {
    let plant: Result<Plant, _> = plant.parse();
    plant.map_or(Domain::Hydraulic, |plant| Domain::of(plant, output_unit))
}
