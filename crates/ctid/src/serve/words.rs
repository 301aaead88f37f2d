//! Results for the page: plots as in the report, numbers as in the terminal.

use missing_effect::design::{Candidate, Design, Kind};
use missing_effect::{Diagnosis, Parameter, Score, Step, Verdict, numbers};
use plants::{Domain, EffectInfo};
use serde_json::{Value, json, value::RawValue};

use super::session::{Found, Session};
use crate::findings::{self, Reader};
use crate::model_file::ModelFile;
use crate::report;
use crate::sentences::{self, interval, placed, with_unit};

/// Number of experiments in the design's table.
const EXPERIMENTS: usize = 8;

/// A fitted model: curves, failures, parameters, sentences.
pub(super) fn fitted(id: u64, diagnosis: &Diagnosis) -> String {
    let drawing = RawValue::from_string(report::drawing(diagnosis)).ok();
    let step = diagnosis.steps.last();
    #[derive(serde::Serialize)]
    struct Body {
        id: u64,
        drawing: Option<Box<RawValue>>,
        parameters: Vec<Value>,
        starts: usize,
        starts_agree: usize,
        /// Parts of the error on held-out data.
        held_out_error: Option<String>,
        sentences: Vec<String>,
        noise: String,
        seconds: f64,
    }
    let mut sentences = sentences::of_diagnosis(diagnosis);
    sentences.extend(findings::effort(&diagnosis.effort, Reader::Page));
    let body = Body {
        id,
        drawing,
        parameters: step.map_or(Vec::new(), |step| {
            step.parameters.iter().map(parameter).collect()
        }),
        starts: step.map_or(0, |step| step.starts),
        starts_agree: step.map_or(0, |step| step.starts_agree),
        held_out_error: step.and_then(|step| held_out_errors(diagnosis, step)),
        sentences,
        noise: noise(diagnosis),
        seconds: diagnosis.seconds,
    };
    // Writing plain structs to memory cannot fail.
    serde_json::to_string(&body).unwrap_or_else(|_| "{}".to_owned())
}

/// `held-out error 1.9 degC: offset 1.9, gain 0.1, shape 0.3 degC`, of all outputs.
fn held_out_errors(diagnosis: &Diagnosis, step: &Step) -> Option<String> {
    let errors = findings::held_out_errors(diagnosis, step);
    (!errors.is_empty()).then(|| errors.join("; "))
}

/// The noise floor of each output.
fn noise(diagnosis: &Diagnosis) -> String {
    let floors = findings::noise_floors(diagnosis);
    findings::per_output(&floors, 2, &diagnosis.output_unit)
}

/// The simulation error of each output.
fn errors(diagnosis: &Diagnosis, step: &Step) -> String {
    findings::per_output(&step.rmse_per_output, 3, &diagnosis.output_unit)
}

fn parameter(parameter: &Parameter) -> Value {
    let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
    json!({ "name": parameter.name, "value": value, "error": error, "unit": parameter.unit })
}

fn size(parameter: &Parameter) -> String {
    let name = parameter.name.rsplit('.').next().unwrap_or_default();
    let value = numbers::with_error(parameter.value, parameter.std_error);
    with_unit(&format!("{name} {value}"), &parameter.unit)
}

/// Texts of a diagnosis.
pub(super) fn diagnosis(found: &Found<Diagnosis>) -> Value {
    let diagnosis = &found.found;
    let unit = &diagnosis.output_unit;
    let sentences = sentences::of_diagnosis(diagnosis);
    let ranked = diagnosis
        .scores
        .iter()
        .map(|score| ranked(diagnosis, score));
    let groups = diagnosis.effects.iter().zip(&diagnosis.groups).enumerate();
    let groups = groups.map(|(k, (effect, group))| {
        json!({
            "effect": effect,
            "place": findings::tank(diagnosis, k),
            "size": diagnosis.steps.last().and_then(|step| own_size(step, effect)),
            "rmse": diagnosis.steps.get(k + 1).map(|step| errors(diagnosis, step)),
            "sentence": sentences.get(k),
            "in_doubt": diagnosis.in_doubt.get(k),
            "places": diagnosis.places.get(k).filter(|places| places.len() > 1).map(|places| findings::place_scores(diagnosis.domain(), places)),
            "others": group.iter().filter(|other| *other != effect).collect::<Vec<_>>(),
        })
    });
    let (headline, tone) = headline(diagnosis);
    let acceptance = diagnosis.acceptance.as_ref().map(|test| {
        json!({
            "title": findings::acceptance_title(diagnosis, test),
            "rows": findings::acceptance_rows(test, unit),
            "reasons": sentences::of_rejections(test),
        })
    });
    let rankings = findings::rankings(diagnosis);
    let rankings = (!rankings.is_empty()).then(|| {
        json!({ "why": findings::RANKINGS_DISAGREE, "heads": findings::RANKINGS_HEADS, "rows": rankings })
    });
    json!({
        "id": found.id,
        "headline": headline,
        "tone": tone,
        "groups": groups.collect::<Vec<_>>(),
        // The first sentences belong to the groups.
        "sentences": sentences.get(diagnosis.groups.len()..).unwrap_or_default(),
        "before": diagnosis.steps.first().map_or("-".to_owned(), |step| errors(diagnosis, step)),
        "noise": noise(diagnosis),
        "acceptance": acceptance,
        "rankings": rankings,
        "held_out_error": diagnosis.steps.last().and_then(|step| held_out_errors(diagnosis, step)),
        "effort": findings::effort(&diagnosis.effort, Reader::Page),
        "ranking": ranked.collect::<Vec<_>>(),
        // Variable of the unexplained error.
        "unknown": diagnosis.unknown.as_ref().map(|unknown| unknown.variable),
        "seconds": diagnosis.seconds,
    })
}

/// Number of ranked effects that are offered for a separate fit.
const RANKED: usize = 8;

/// The effects that were found and the best of the ranking, each with its place.
pub(super) fn candidates(diagnosis: &Diagnosis) -> Vec<(String, Option<String>)> {
    let found = diagnosis.effects.iter().enumerate();
    let found = found.map(|(k, effect)| {
        (
            effect.clone(),
            findings::tank(diagnosis, k).map(str::to_string),
        )
    });
    let ranked = diagnosis
        .scores
        .iter()
        .filter(|score| score.effect != "none");
    let ranked = ranked
        .take(RANKED)
        .map(|score| (score.effect.clone(), score.place.clone()));
    found.chain(ranked).collect()
}

fn headline(diagnosis: &Diagnosis) -> (String, &'static str) {
    match diagnosis.verdict {
        Verdict::Effect => (
            format!("Missing: {}", diagnosis.effects.join(", ")),
            "found",
        ),
        Verdict::Undecided => (
            "Something is missing, and more than one effect fits these data".to_owned(),
            "open",
        ),
        Verdict::Partial => (findings::partial_headline(diagnosis), "open"),
        Verdict::Unexplained => (
            "The residual is not noise, and no effect of the catalogue explains it".to_owned(),
            "open",
        ),
        Verdict::Adequate => ("The model is adequate".to_owned(), "good"),
    }
}

/// The leading parameter of an effect in a model.
fn own_size(step: &Step, effect: &str) -> Option<String> {
    let own = format!("{effect}.");
    let mut parameters = step.parameters.iter();
    parameters.find(|p| p.name.starts_with(&own)).map(size)
}

fn ranked(diagnosis: &Diagnosis, score: &Score) -> Value {
    let info = EffectInfo::find(&score.effect);
    let domain = diagnosis.domain();
    // The confirmation texts refer to tanks.
    let confirm = info.filter(|_| domain == Domain::Hydraulic);
    let unit = score.size.as_ref().map_or("", |size| size.unit.as_str());
    let (error, error_unit) = findings::score_error(diagnosis, score);
    let visible = score.smallest_visible.filter(|size| size.is_finite());
    json!({
        "effect": score.effect,
        "place": score.place,
        "gain": score.bic_gain.is_finite().then_some(score.bic_gain),
        "evidence": numbers::whole(score.bic_gain),
        "rmse": with_unit(&numbers::significant(error, 3), error_unit),
        "size": score.size.as_ref().map(size),
        "visible": visible.map(|size| with_unit(&numbers::significant(size, 2), unit)),
        "physics": info.map(|effect| effect.in_words(domain)),
        "equation": info.map(|effect| effect.equation),
        "confirm": confirm.map(|effect| effect.confirm),
        "found": findings::is_added(diagnosis, score),
        "equal": findings::fits_as_well(diagnosis, score),
    })
}

/// The experiment that was designed.
pub(super) fn design(id: u64, design: &Design) -> Value {
    let unit = &design.experiment.unit;
    let row = |candidate: &Candidate| {
        let range = |low: f64, high: f64, unit: &str| interval((low, high), " to ", unit);
        json!({
            "kind": candidate.kind.name(),
            "range": range(candidate.low, candidate.high, unit),
            "held": (candidate.kind != Kind::Again).then(|| numbers::duration(candidate.clock)),
            "level": candidate.reaches.last().map(|reach| range(reach.low, reach.high, &design.output_unit)),
            "power": format!("{}{}", if candidate.refitted { "" } else { "~" }, numbers::significant(candidate.power.power, 2)),
            "decides": format!("{:.0} %", 100.0 * candidate.power.decides),
        })
    };
    let candidates = design.candidates.iter().take(EXPERIMENTS);
    let sequence = &design.experiment;
    json!({
        "id": id,
        "between": design.between.each_ref().map(|one| placed(&one.effect, one.place.as_deref())),
        "sentences": sentences::of_design(design).into_iter().chain(findings::left_out(&design.effort)).collect::<Vec<_>>(),
        "rows": candidates.chain(&design.again).map(row).collect::<Vec<_>>(),
        "twins": design.twins(),
        "limits": format!(
            "{} ({}), {}",
            interval((design.limits.low, design.limits.high), " to ", unit),
            design.limits.range_from,
            numbers::duration(design.limits.duration)
        ),
        "name": sequence.name,
        "unit": unit,
        "time": sequence.time,
        "values": sequence.values,
    })
}

/// The user's own terms that are in the model file but not in the model.
pub(super) fn waiting(model: &ModelFile) -> Vec<Value> {
    let waiting = model.waiting.iter();
    let terms = waiting.filter_map(|table| table.strip_prefix("term."));
    terms
        .map(|name| json!({ "effect": name, "place": null }))
        .collect()
}

/// The effects and terms of the present model.
pub(super) fn effects(session: &Session) -> Vec<Value> {
    let Ok(model) = session.model() else {
        return Vec::new();
    };
    let domain = session.domain(&model);
    let placed = model.effects.iter().map(|placed| {
        let vessel = placed.place_name(model.plant, &model.known);
        json!({ "effect": placed.effect.id, "place": vessel, "physics": placed.effect.in_words(domain) })
    });
    let terms = model.terms.iter().map(
        |own| json!({ "effect": own.term.name, "place": null, "physics": "a term of your own" }),
    );
    placed.chain(terms).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::report::sample;

    fn found(found: Diagnosis) -> Value {
        let text = "plant = \"cascaded-tanks\"";
        diagnosis(&Found {
            id: 1,
            model: crate::model_file::parse("tanks.toml", text).unwrap(),
            text: text.to_string(),
            data: 1,
            measured: false,
            found,
        })
    }

    #[test]
    fn a_partial_answer_has_all_that_the_page_shows_of_it() {
        let told = found(sample::partial());
        assert!(
            told["headline"]
                .as_str()
                .unwrap()
                .starts_with("Mostly overflow: 85 % of the squared error")
        );
        assert_eq!(told["tone"], "open");
        assert_eq!(told["groups"][0]["effect"], "overflow");
        assert_eq!(
            told["groups"][0]["places"],
            "upper tank 1.00, lower tank 0.31: not determined"
        );
        assert_eq!(told["acceptance"]["rows"][0][1], "85 %");
        assert_eq!(
            told["rankings"]["rows"][0],
            json!(["1", "overflow", "sensor_saturation"])
        );
        assert!(told["held_out_error"].as_str().unwrap().contains("offset"));
        assert!(told["effort"][1].as_str().unwrap().contains("thorough"));
    }

    #[test]
    fn what_is_not_known_is_null() {
        let told = found(sample::two_tanks());
        for key in ["acceptance", "rankings", "held_out_error"] {
            assert!(told[key].is_null(), "{key}");
        }
        assert_eq!(told["effort"], json!([]));
    }
}
