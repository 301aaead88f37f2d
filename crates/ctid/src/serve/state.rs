//! State of the session for the page, sent after every change.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ct_signals::{Columns, Record};
use missing_effect::numbers;
use plants::{CATALOGUE, Domain, Outlet, Placed, Plant};
use serde_json::{Value, json};

use super::session::{Fitted, Found, Kind, Session, lock, same};
use super::settings::Settings;
use super::upload::Upload;
use super::words;
use crate::input::excitation;
use crate::model_file::ModelFile;
use crate::sentences::{interval, placed};

/// Progress of the computation, if one is running.
pub(super) fn job(session: &Session) -> Value {
    let Some(job) = &session.job else {
        return Value::Null;
    };
    let progress = *lock(&job.progress);
    json!({
        "what": match job.kind {
            Kind::Compare | Kind::Chain | Kind::Own => "compare",
            Kind::Diagnose => "diagnose",
            Kind::Design => "design",
        },
        "phase": progress.map(|p| p.phase),
        "done": progress.map(|p| p.done),
        "total": progress.map(|p| p.total),
        "seconds": job.begun.elapsed().as_secs_f64(),
        "limit": job.limit.map(|limit| limit.as_secs()),
        "ending": job.interrupt.load(Ordering::Relaxed),
    })
}

/// The complete state except curves.
pub(super) fn state(session: &mut Session) -> Value {
    let (columns, options) = session.layout();
    let records: Vec<Value> = session
        .records
        .iter_mut()
        .map(|upload| {
            let read = upload.record(&columns, &options);
            json!({
                "name": upload.name,
                "held_out": upload.held_out,
                "read": read.as_ref().ok().map(|record| about(record)),
                "error": read.err(),
            })
        })
        .collect();
    let fitted = session.records.iter().filter(|upload| !upload.held_out);
    let fitted: Vec<&Record> = fitted.filter_map(Upload::as_read).collect();
    // The warnings refer to a single command.
    let excited = if session.own.is_some() {
        Vec::new()
    } else {
        fitted
    };
    let warnings = excitation::of_records(excited.into_iter());
    let remarks = session.records.iter().filter_map(Upload::remark);
    let warnings: Vec<String> = remarks
        .chain(warnings.iter().map(ToString::to_string))
        .collect();
    // The form offers the columns of the first file; all files need the same columns.
    let headings = session
        .records
        .first()
        .map(|first| first.headings.as_slice());
    let guessed = headings.map(Columns::guessed).unwrap_or_default();
    let model = session.model();
    let error = model.as_ref().err().map(ToString::to_string);
    let model = model.ok();
    let current = model.as_ref().and_then(|model| session.fit_of(model));
    let trail = model
        .as_ref()
        .map_or(Vec::new(), |model| session.trail(model));
    let kin = model
        .as_ref()
        .map_or(Vec::new(), |model| session.kin(model));
    let choices = model
        .as_ref()
        .map_or(Vec::new(), |model| choices(session, model, &kin));
    let controlled = model
        .as_ref()
        .is_some_and(|model| model.controller.is_some());
    let diagnosis = session.diagnosis.as_deref().map(|found| {
        let mut words = words::diagnosis(found);
        words["of_this_model"] = json!(is_of(found, session));
        words["of"] = json!(chain_name(&effects_of(&found.model)));
        words
    });
    json!({
        "version": session.version,
        "own": session.own.as_ref().map(|own| own.state(session.data)),
        "file": session.file.as_ref().map(|path| path.display().to_string()),
        "text": session.text,
        "model_error": error,
        "settings": Settings::of(&session.text),
        "effects": words::effects(session),
        "offered": model.as_ref().map_or(Vec::new(), |model| sites(model, session.domain(model))),
        "waiting": model.as_ref().map_or(Vec::new(), words::waiting),
        "records": records,
        "warnings": warnings,
        "headings": headings,
        "guessed": guessed,
        "current": current.map(|fitted| fitted.id),
        "trail": trail.iter().map(|fitted| point(fitted)).collect::<Vec<_>>(),
        "models": kin.iter().map(|fitted| point(fitted)).collect::<Vec<_>>(),
        "chains": choices.iter().map(|chain| json!({ "name": chain_name(chain), "effects": chain })).collect::<Vec<_>>(),
        "loop": json!({ "known": controlled, "measured": session.measured }),
        "diagnosis": diagnosis,
        "design": session.design.as_deref().map(|found| words::design(found.id, &found.found.0)),
        "job": job(session),
        "failure": session.failure,
    })
}

fn is_of<T>(found: &Found<T>, session: &Session) -> bool {
    let model = session.model();
    found.data == session.data
        && found.measured == session.measured
        && model.is_ok_and(|model| same(&model, &found.model))
}

/// Description of a record.
fn about(record: &Record) -> Value {
    let signal = |signal: &ct_signals::Channel| {
        let unit = &signal.unit;
        json!({ "name": signal.name, "unit": unit, "range": interval(signal.range(), " to ", unit) })
    };
    json!({
        "samples": record.len(),
        "length": numbers::duration(record.duration()),
        "interval": numbers::duration(record.sample_interval()),
        "input": record.inputs.first().map(signal),
        "inputs": record.inputs.iter().map(signal).collect::<Vec<_>>(),
        "outputs": record.outputs.iter().map(signal).collect::<Vec<_>>(),
        "reference": record.references.first().map(signal),
    })
}

/// Effects with their places, if there is a choice; terms of the user's own by their name.
type Chain = Vec<(String, Option<String>)>;

fn effects_of(model: &ModelFile) -> Chain {
    let placed = model.effects.iter().map(|placed| {
        let place = placed.place_name(model.plant, &model.known);
        (placed.effect.id.to_string(), place.map(str::to_string))
    });
    let terms = model.terms.iter().map(|own| (own.term.name.clone(), None));
    placed.chain(terms).collect()
}

fn chain_name(chain: &Chain) -> String {
    if chain.is_empty() {
        return "base model".to_string();
    }
    let named = chain.iter();
    let named = named.map(|(effect, place)| placed(effect, place.as_deref()));
    named.collect::<Vec<_>>().join(" + ")
}

/// Sets of effects to compare: none, the model's own, the fitted ones, and each found or ranked effect added to the present model.
fn choices(session: &Session, model: &ModelFile, kin: &[&Arc<Fitted>]) -> Vec<Chain> {
    let now = effects_of(model);
    let mut all = vec![Chain::new(), now.clone()];
    all.extend(kin.iter().map(|fitted| effects_of(&fitted.model)));
    let found = session.diagnosis.iter();
    for (effect, place) in found.flat_map(|found| words::candidates(&found.found)) {
        if now.iter().all(|(on, _)| *on != effect) {
            all.push([now.clone(), vec![(effect, place)]].concat());
        }
    }
    let mut choices: Vec<Chain> = Vec::new();
    for chain in all {
        if !choices.contains(&chain) {
            choices.push(chain);
        }
    }
    choices
}

fn point(fitted: &Fitted) -> Value {
    let effects = effects_of(&fitted.model);
    // Separately fitted models have no common noise, so the errors of several outputs are not combined.
    let several = fitted.errors.0.len() > 1;
    let errors = fitted.errors.0.iter().enumerate();
    let errors = errors.map(|(k, (name, rmse))| {
        let test = fitted.errors_test.as_ref();
        let test = test.and_then(|test| test.values().nth(k));
        json!({
            "output": several.then_some(name),
            "rmse": rmse,
            "text": numbers::significant(*rmse, 3),
            "test": test.map(|rmse| numbers::significant(rmse, 3)),
        })
    });
    json!({
        "id": fitted.id,
        "plant": fitted.model.plant.id(),
        "name": chain_name(&effects),
        "effects": effects,
        "errors": errors.collect::<Vec<_>>(),
        "bic": numbers::whole(fitted.bic),
        "adequate": fitted.adequate,
    })
}

/// The plants to choose from.
pub(super) fn plants() -> Value {
    let plants = Plant::ALL.into_iter().map(|plant| {
        json!({
            "id": plant.id(),
            "known": known_of(plant),
            "pumps": plant.pumps(),
            "levels": vessel_names(plant),
            // With one reading, a plant whose tanks are not joined measures its last level.
            "joined": plant.joined(),
            "model": equation(plant),
        })
    });
    plants.collect()
}

/// Known constants that a plant may have, by their keys in the model file.
fn known_of(plant: Plant) -> Vec<&'static str> {
    let areas: &[&str] = match (plant.outlet(), plant.vessels()) {
        (Outlet::Torricelli, 1) => &["area"],
        (Outlet::Torricelli, 2) => &["area_upper", "area_lower"],
        (Outlet::Torricelli, _) => &["area", "area_1", "area_2", "area_3", "pipe_area", "gravity"],
        _ => &[],
    };
    [areas, &["tank_height", "input_range"]].concat()
}

/// The vessels of a plant that has several, in the order of their names.
fn vessel_names(plant: Plant) -> Vec<&'static str> {
    let mut names: Vec<_> = (0..plant.vessels())
        .filter_map(|i| plant.vessel_name(i))
        .collect();
    names.sort_unstable();
    names
}

/// Every effect of the domain, at every place where it can act on a plant.
fn sites(model: &ModelFile, domain: Domain) -> Vec<Value> {
    let (plant, known) = (model.plant, &model.known);
    let offered = CATALOGUE.iter().filter(|effect| domain.offers(effect));
    let sites = offered.flat_map(|effect| {
        effect
            .sites(plant, known)
            .map(move |vessel| json!({ "effect": effect.id, "place": Placed { effect, vessel }.place_name(plant, known) }))
    });
    sites.collect()
}

fn equation(plant: Plant) -> &'static str {
    match plant {
        Plant::SingleTank => "S dH/dt = pump_gain·u − alpha·√H",
        Plant::SingleTankLinear => "tau·dy/dt + y = K·u + offset",
        Plant::CascadedTanks => {
            "two square-root tanks in series; one reading is of the lower level"
        }
        Plant::CascadedTanksLinear => "two lags in series",
        Plant::FirstOrder => "tau·dy/dt + y = K·u",
        Plant::ThreeTank => {
            "tanks T1, T3, T2 in a row, joined by valves; an outlet at T2, pumps into T1 and T2"
        }
    }
}
