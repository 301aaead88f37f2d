//! Data for the page's plots, and downloads.

use std::path::Path;
use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use ct_signals::Clock;
use missing_effect::Shown;
use serde::Deserialize;

use super::app::App;
use super::guard::Refusal;
use super::session::{UNNAMED, lock};
use super::tab::{Tab, aside, find};
use super::upload::plain_name;
use super::{own, words};
use crate::design::Proposal;
use crate::input;
use crate::output::Found as _;
use crate::report;

pub(super) fn routes() -> Router<Arc<App>> {
    Router::new()
        .route("/api/data", get(data))
        .route("/api/model", get(model))
        .route("/api/file", get(file))
}

/// The records before any fit.
async fn data(State(app): State<Arc<App>>, Query(tab): Query<Tab>) -> Result<Response, Refusal> {
    let session = find(&app, &tab.session)?;
    let text = aside(move || {
        let mut session = lock(&session);
        let (columns, options) = session.layout();
        let (mut read, mut held_out) = (Vec::new(), Vec::new());
        for upload in &mut session.records {
            if let Ok(record) = upload.record(&columns, &options) {
                read.push(record.as_ref().clone());
                held_out.push(upload.held_out);
            }
        }
        input::on_one_clock(&mut read);
        let signals = read.first().map(|record| {
            let outputs = record.outputs.iter().map(|output| output.name.clone());
            let units = [&record.inputs[0].unit, &record.outputs[0].unit];
            (outputs.collect::<Vec<_>>(), units.map(String::clone))
        });
        let shown = read.iter().zip(held_out);
        let shown = shown.map(|(record, held_out)| Shown::of(record, held_out));
        let mut shown: Vec<Shown> = shown.collect();
        let (outputs, [input, output]) = signals.unwrap_or_default();
        // Fitted records come first, as in the report.
        shown.sort_by_key(|record| record.held_out);
        let clock = Clock::of(&read);
        Ok(report::drawing_of_records(
            &shown, &input, &outputs, &output, &clock,
        ))
    });
    Ok(as_json(text.await?.into()))
}

fn as_json(body: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], body).into_response()
}

#[derive(Debug, Deserialize)]
struct Which {
    session: String,
    id: u64,
}

async fn model(
    State(app): State<Arc<App>>,
    Query(which): Query<Which>,
) -> Result<Response, Refusal> {
    let session = find(&app, &which.session)?;
    aside(move || {
        let session = lock(&session);
        let own = session.own.as_ref().and_then(|own| own.fit.as_ref());
        if let Some(fit) = own.filter(|fit| fit.id == which.id) {
            return Ok(as_json(fit.body.clone()));
        }
        if let Some(of) = session.diagnosis.as_ref().filter(|of| of.id == which.id) {
            return Ok(as_json(words::fitted(of.id, &of.found).into()));
        }
        let fitted = session.models.iter().find(|fitted| fitted.id == which.id);
        let missing = || {
            Refusal::new(
                StatusCode::NOT_FOUND,
                "this fit is no longer kept; compare again",
            )
        };
        Ok(as_json(fitted.ok_or_else(missing)?.body.clone()))
    })
    .await
}

/// Available downloads.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Wanted {
    Model,
    /// The text of a user's own model.
    Text,
    Report,
    Experiment,
}

#[derive(Debug, Deserialize)]
struct Download {
    session: String,
    of: Wanted,
}

async fn file(
    State(app): State<Arc<App>>,
    Query(download): Query<Download>,
) -> Result<Response, Refusal> {
    let session = find(&app, &download.session)?;
    aside(move || {
        let session = lock(&session);
        let missing = |what: &str| Refusal::new(StatusCode::NOT_FOUND, what);
        let (name, kind, text) = match download.of {
            Wanted::Model | Wanted::Text if session.own.is_some() => {
                let own = session.own.clone().unwrap_or_default();
                match download.of {
                    Wanted::Text => (
                        "model.mo".to_string(),
                        "text/plain; charset=utf-8",
                        own.text,
                    ),
                    _ => (own::FILE.to_string(), "application/toml", own.file),
                }
            }
            Wanted::Text => return Err(missing("there is no model of your own")),
            Wanted::Model => {
                let path = session.file.as_deref().unwrap_or(Path::new(UNNAMED));
                let name = path
                    .file_name()
                    .map_or(UNNAMED.into(), |name| name.to_string_lossy());
                (plain_name(&name), "application/toml", session.text.clone())
            }
            Wanted::Report if session.own.is_some() => {
                let shown = session.own.as_ref().and_then(|own| own.shown.clone());
                let shown = shown.ok_or_else(|| missing("nothing was computed yet; fit first"))?;
                (
                    "report.html".to_string(),
                    "text/html; charset=utf-8",
                    shown.html(),
                )
            }
            Wanted::Report => {
                // The latest result.
                let latest = [&session.fitted, &session.diagnosis].into_iter().flatten();
                let latest = latest.max_by_key(|found| found.id);
                let latest =
                    latest.ok_or_else(|| missing("nothing was computed yet; compare first"))?;
                (
                    "report.html".to_string(),
                    "text/html; charset=utf-8",
                    report::html(&latest.found),
                )
            }
            Wanted::Experiment if session.own.is_some() => {
                let own = session.own.as_ref();
                let design = own.and_then(|own| own.design.as_ref());
                let design = design.ok_or_else(|| missing("no experiment was designed yet"))?;
                let text = design.record.clone();
                let text =
                    text.ok_or_else(|| missing("no experiment distinguishes the two effects"))?;
                ("next.csv".to_string(), "text/csv; charset=utf-8", text)
            }
            Wanted::Experiment => {
                let found = session.design.as_ref();
                let found = found.ok_or_else(|| missing("no experiment was designed yet"))?;
                let (design, columns) = &found.found;
                let text = Proposal::new(design.clone(), columns).record();
                let text =
                    text.ok_or_else(|| missing("no experiment distinguishes the two effects"))?;
                ("next.csv".to_string(), "text/csv; charset=utf-8", text)
            }
        };
        let mut headers = HeaderMap::new();
        headers.insert(header::CONTENT_TYPE, header::HeaderValue::from_static(kind));
        let safe: String = name
            .chars()
            .filter(|c| c.is_ascii_alphanumeric() || "-_.".contains(*c))
            .collect();
        if let Ok(value) = format!("attachment; filename=\"{safe}\"").parse() {
            headers.insert(header::CONTENT_DISPOSITION, value);
        }
        Ok((headers, text).into_response())
    })
    .await
}
