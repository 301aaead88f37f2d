//! The report of a comparison or a diagnosis of a user's own model: the document of the plants, filled from the model's signals.

use std::collections::BTreeMap;

use ct_signals::{Clock, Record, parts};
use effect_search::{Estimate, NoiseFloor, Step, Unknown};
use missing_effect::{
    Diagnosis, Effort, NoiseSource, Parameter, PerOutput, Rankings, Score, Shown, ShownInput,
    Verdict,
};
use serde::Serialize;

use super::compare::Comparison;
use super::diagnose::{heading, sentences};
use super::file::{OwnModelFile, Records};
use super::words::{EffectWords, Site, shown_unit};
use crate::MessageNames;
use crate::output::Found;
use crate::report::{self, ComparedPort, MissingTerm};
use crate::sentences::of_gaps;

/// A result that is written as JSON, and its page.
#[derive(Debug, Serialize)]
pub(crate) struct Paged<'t, T> {
    #[serde(flatten)]
    found: &'t T,
    #[serde(skip)]
    page: String,
    #[serde(skip)]
    unknown: Option<String>,
}

impl<'t, T> Paged<'t, T> {
    /// With the page for this document, if one is requested.
    pub fn new(found: &'t T, shown: Option<&Document>) -> Self {
        Self {
            found,
            page: shown.map(Document::html).unwrap_or_default(),
            unknown: None,
        }
    }

    /// With the shape of the unexplained error as a file.
    pub fn with_unknown(self, unknown: Option<String>) -> Self {
        Self { unknown, ..self }
    }
}

impl<T: Serialize> Found for Paged<'_, T> {
    fn page(&self) -> String {
        self.page.clone()
    }

    fn unknown(&self) -> Option<String> {
        self.unknown.clone()
    }
}

/// Content of the report.
#[derive(Debug, Clone)]
pub struct Document {
    /// Curves and tables.
    pub diagnosis: Diagnosis,
    /// The findings in sentences, with the names of the model; empty for a comparison.
    pub sentences: Vec<String>,
    /// The verdict in a few words.
    pub verdict: String,
    /// The unexplained error, as a function at a port.
    pub(crate) term: Option<MissingTerm>,
}

impl Document {
    /// The report as a complete HTML file.
    #[must_use]
    pub fn html(&self) -> String {
        let term = self.term.as_ref();
        report::html_with(&self.diagnosis, &self.sentences, term, &self.verdict)
    }
}

/// The shape of the error that no candidate explains, as it is shown.
pub(crate) fn missing_term(words: &EffectWords, unknown: &Unknown) -> MissingTerm {
    let shown_term = match words.sites(&unknown.effect) {
        [Site::Input(u), ..] => format!("added to the input {u}"),
        [Site::Output(y), ..] => format!("added to the output {y}"),
        [Site::Equation(x), ..] => format!("added to the equation of {x}"),
        [Site::Value(p), ..] => format!("the relative change of {p}"),
        [] => "the missing term".to_string(),
    };
    let shown_term = if unknown.is_centred {
        format!("{shown_term}, less its mean")
    } else {
        shown_term
    };
    let places = unknown.places.iter().map(|place| {
        let placed = words.placed(&place.effect);
        ComparedPort::new(placed, place.bic_gain, place.share_left_out)
    });
    MissingTerm {
        effect: unknown.effect.clone(),
        placed: words.placed(&unknown.effect),
        variable: unknown.variable.clone(),
        variable_unit: shown_unit(&unknown.variable_unit).to_string(),
        shown_term,
        unit: shown_unit(&unknown.unit).to_string(),
        knots: unknown.at.clone(),
        ordinates: unknown.value.clone(),
        ordinate_errors: unknown.std_error.clone(),
        command: "ctid add NAME --model M.toml --from RESULT.json".to_string(),
        places: places.collect(),
    }
}

/// Report of a comparison.
pub fn compared(file: &OwnModelFile, records: &Records, found: &Comparison) -> Document {
    let noise = with_source(&found.noise, NoiseSource::OnlyModel, true);
    let mut shown = document(file, records, &found.steps, noise);
    shown.effort.clone_from(&found.effort);
    shown.seconds = found.seconds;
    Document {
        verdict: report::verdict(&shown),
        diagnosis: shown,
        sentences: {
            let gaps = found.gaps.as_ref().and_then(of_gaps).into_iter();
            let known = found.control_loop.iter();
            gaps.chain(known.map(|known| file.loop_sentence(known, &MessageNames::PROGRAM)))
                .collect()
        },
        term: None,
    }
}

/// Report of a diagnosis.
pub fn diagnosed(
    file: &OwnModelFile,
    records: &Records,
    found: &effect_search::Diagnosis,
) -> Document {
    let words = EffectWords::of(file);
    let noise = with_source(&found.noise, NoiseSource::LastModel, false);
    let mut shown = document(file, records, &found.steps, noise);
    shown.verdict = found.verdict;
    shown.effects.clone_from(&found.effects);
    shown.groups.clone_from(&found.groups);
    shown.in_doubt = vec![false; found.effects.len()];
    shown.places = vec![Vec::new(); found.effects.len()];
    shown.residual_unexplained = found.not_noise.is_some();
    shown.ranked.clone_from(&found.ranked);
    let floors: Vec<f64> = found.noise.iter().map(|noise| noise.level).collect();
    let singles = found.singles.iter().map(|single| {
        let errors: Vec<f64> = single.rmse_per_output.values().copied().collect();
        Score {
            effect: single.effect.clone(),
            place: None,
            bic_gain: single.bic_gain,
            rmse: only(&errors),
            weighted_rmse: weighted(&shown.outputs, &single.rmse_per_output, &floors),
            visibility: single.visibility.unwrap_or(f64::NAN),
            size: single.sizes.first().map(parameter),
            smallest_visible: single.smallest_visible,
        }
    });
    shown.scores = singles.collect();
    shown.seconds = found.seconds;
    let unknown = found.unknown.as_ref();
    Document {
        verdict: match found.verdict {
            Verdict::Partial => heading(found),
            _ => report::verdict(&shown),
        },
        diagnosis: shown,
        sentences: sentences(file, found, &words),
        term: unknown.map(|unknown| missing_term(&words, unknown)),
    }
}

/// The number of a single output; NaN for several.
fn only(values: &[f64]) -> f64 {
    match values {
        [one] => *one,
        _ => f64::NAN,
    }
}

/// Root mean square of the errors, each divided by its output's noise; all outputs have equal weight.
fn weighted(outputs: &[String], errors: &BTreeMap<String, f64>, floors: &[f64]) -> f64 {
    let errors = outputs.iter().filter_map(|name| errors.get(name).copied());
    let errors: Vec<f64> = errors.collect();
    greybox::weighted_rms(&errors, floors, &vec![1; errors.len()])
}

fn parameter(estimate: &Estimate) -> Parameter {
    Parameter {
        name: estimate.name.clone(),
        value: estimate.value,
        std_error: estimate.std_error,
        unit: shown_unit(&estimate.unit).to_string(),
        prior: None,
    }
}

/// The noise floors with their source.
fn with_source(
    noise: &[NoiseFloor],
    source: NoiseSource,
    of_innovation: bool,
) -> Vec<missing_effect::NoiseFloor> {
    let floors = noise.iter().map(|floor| missing_effect::NoiseFloor {
        output: floor.output.clone(),
        level: floor.level,
        innovation: floor.innovation,
        coefficients: floor.coefficients.clone(),
        source,
        of_innovation,
    });
    floors.collect()
}

/// A document without a finding: records, steps, locations of the failures, tests of the residuals.
fn document(
    file: &OwnModelFile,
    records: &Records,
    steps: &[Step],
    noise: Vec<missing_effect::NoiseFloor>,
) -> Diagnosis {
    let spec = &file.base;
    let fitted = &parts::joined(&records.records);
    let held_out = parts::joined(&records.test);
    let all_parts = [records.records.as_slice(), &records.test].concat();
    let units: Vec<String> = spec.about_outputs().map(|y| y.unit.clone()).collect();
    let outputs: Vec<String> = spec.about_outputs().map(|y| y.name.clone()).collect();
    let shown = |record: &Record, held_out: bool| {
        let inputs = spec.inputs.iter().zip(&record.inputs);
        let inputs = inputs.map(|(input, channel)| ShownInput {
            name: input.about.name.clone(),
            unit: input.about.unit.clone(),
            values: channel.values.clone(),
        });
        Shown {
            inputs: inputs.collect(),
            ..Shown::of(record, held_out)
        }
    };
    let all = fitted.iter().map(|record| shown(record, false));
    let all = all.chain(held_out.iter().map(|record| shown(record, true)));
    let floors: Vec<f64> = noise.iter().map(|noise| noise.level).collect();
    let steps: Vec<missing_effect::Step> = steps
        .iter()
        .map(|step| of_step(step, &outputs))
        .map(|mut step| {
            if let Some(test) = &step.rmse_test_per_output {
                let errors = test.0.iter().cloned().collect();
                step.weighted_rmse_test = Some(weighted(&outputs, &errors, &floors));
            }
            step.simulated = parts::joined_series(&all_parts, outputs.len(), &step.simulated);
            step
        })
        .collect();
    let unit = units.first().cloned().unwrap_or_default();
    Diagnosis {
        schema: 4,
        verdict: Verdict::Adequate,
        clock: Clock::of(fitted),
        gaps: None,
        effects: Vec::new(),
        groups: Vec::new(),
        in_doubt: Vec::new(),
        places: Vec::new(),
        acceptance: None,
        residual_unexplained: false,
        not_noise: None,
        ranked: Vec::new(),
        steps,
        noise_floor: only(&floors),
        noise,
        rankings: Rankings::default(),
        effort: Effort::default(),
        scores: Vec::new(),
        unknown: None,
        control_loop: None,
        remarks: Vec::new(),
        plant: spec.name.clone(),
        known_effects: file.effects.on.clone(),
        input_unit: spec
            .inputs
            .first()
            .map_or(String::new(), |input| input.about.unit.clone()),
        output_units: if units.iter().all(|other| *other == unit) {
            Vec::new()
        } else {
            units
        },
        outputs,
        output_unit: unit,
        records: all.collect(),
        seconds: 0.0,
    }
}

fn of_step(step: &Step, outputs: &[String]) -> missing_effect::Step {
    let named = |errors: &BTreeMap<String, f64>| {
        let values = outputs.iter().map(|name| {
            let value = errors.get(name).copied().unwrap_or(f64::NAN);
            (name.clone(), value)
        });
        PerOutput(values.collect())
    };
    let test = step.rmse_test_per_output.as_ref();
    missing_effect::Step {
        added: step.added.clone(),
        place: None,
        rmse: step.rmse.unwrap_or(f64::NAN),
        rmse_test: match test
            .map(|test| test.values().copied().collect::<Vec<_>>())
            .as_deref()
        {
            Some([one]) => Some(*one),
            _ => None,
        },
        rmse_per_output: named(&step.rmse_per_output),
        rmse_test_per_output: test.map(named),
        weighted_rmse: step.weighted_rmse,
        weighted_rmse_test: None,
        bic: step.bic,
        parameters: step.parameters.iter().map(parameter).collect(),
        starts: step.starts,
        starts_agree: step.starts_agree,
        outputs: step.outputs.clone(),
        simulated: step.simulated.clone(),
    }
}

#[cfg(test)]
mod tests;
