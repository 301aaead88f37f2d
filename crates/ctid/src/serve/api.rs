//! Routes of the page's requests; the head of the module `serve` describes their inputs and outputs.

mod run;

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Query, Request, State};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{self, Next};
use axum::response::Response;
use axum::routing::{get, post};
use axum::{Json, Router};
use plants::{Domain, EffectInfo};
use serde::Deserialize;
use serde_json::json;

use self::run::{cancel, finish, run};
use super::app::App;
use super::body::whole;
use super::guard::{LARGEST_BODY, Refusal, check_length};
use super::session::lock;
use super::settings::Form;
use super::tab::{Answer, Tab, aside, find, with};
use super::upload::{Upload, plain_name};
use super::{downloads, own_change, state};
use crate::term_file::TermFile;
use crate::{MessageNames, edit};

/// Largest request in JSON \[bytes\].
pub(super) const LARGEST_REQUEST: usize = 1 << 20;

pub(super) fn routes(app: &Arc<App>) -> Router<Arc<App>> {
    Router::new()
        .route("/api/session", post(open))
        .route("/api/state", get(show))
        .route("/api/settings", post(settings))
        .route("/api/text", post(text))
        .route("/api/own", post(own))
        .route("/api/effect", post(effect))
        .route("/api/loop", post(treat_loop))
        .route("/api/run", post(run))
        .route("/api/cancel", post(cancel))
        .route("/api/finish", post(finish))
        .route("/api/forget", post(forget))
        .merge(downloads::routes())
        .layer(middleware::from_fn_with_state(app.clone(), read_first))
        // The handler reads the body itself.
        .route("/api/record", post(record))
}

/// Reads the request before it is processed.
async fn read_first(
    State(app): State<Arc<App>>,
    request: Request,
    next: Next,
) -> Result<Response, Refusal> {
    let (parts, body) = request.into_parts();
    let too_large = || {
        Refusal::new(
            StatusCode::PAYLOAD_TOO_LARGE,
            "the request is larger than 1 MB, which is the most that the page takes; shorten the model file",
        )
    };
    let (body, _room) = whole(body, LARGEST_REQUEST, &app.asking, too_large).await?;
    Ok(next.run(Request::from_parts(parts, body.into())).await)
}

#[derive(Debug, Deserialize)]
struct Open {
    session: Option<String>,
}

async fn open(State(app): State<Arc<App>>, Json(open): Json<Open>) -> Answer {
    aside(move || {
        let known = open
            .session
            .and_then(|id| Some((id.clone(), app.sessions.find(&id)?)));
        let (id, session) = known.unwrap_or_else(|| app.sessions.open());
        let mut session = lock(&session);
        session.refresh();
        let state = state::state(&mut session);
        Ok(Json(
            json!({ "session": id, "state": state, "plants": state::plants(), "examples": own_change::examples() }),
        ))
    })
    .await
}

#[derive(Debug, Deserialize)]
struct Since {
    session: String,
    since: Option<u64>,
}

async fn show(State(app): State<Arc<App>>, Query(asked): Query<Since>) -> Answer {
    let session = find(&app, &asked.session)?;
    aside(move || {
        let mut session = lock(&session);
        session.refresh();
        if asked.since == Some(session.version) {
            return Ok(Json(
                json!({ "version": session.version, "job": state::job(&session) }),
            ));
        }
        Ok(Json(state::state(&mut session)))
    })
    .await
}

#[derive(Debug, Deserialize)]
struct NewRecord {
    session: String,
    name: String,
    #[serde(default)]
    held_out: bool,
}

async fn record(
    State(app): State<Arc<App>>,
    Query(new): Query<NewRecord>,
    headers: HeaderMap,
    body: Body,
) -> Answer {
    check_length(&headers)?;
    let session = find(&app, &new.session)?;
    let (content, _room) = whole(body, LARGEST_BODY, &app.uploading, Refusal::too_large).await?;
    let all = app.clone();
    aside(move || {
        let upload = Upload::new(&plain_name(&new.name), new.held_out, content)?;
        let answer = {
            let mut session = lock(&session);
            session.take(upload)?;
            Json(state::state(&mut session))
        };
        all.sessions.make_room();
        Ok(answer)
    })
    .await
}

#[derive(Debug, Deserialize)]
struct Forget {
    name: String,
}

async fn forget(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(forget): Json<Forget>,
) -> Answer {
    with(&app, &tab.session, move |session| {
        session.drop_record(&forget.name);
        Ok(())
    })
    .await
}

async fn settings(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(form): Json<Form>,
) -> Answer {
    with(&app, &tab.session, move |session| {
        session.change(|file, text| form.written_into(file, text))?;
        Ok(())
    })
    .await
}

#[derive(Debug, Deserialize)]
struct Text {
    text: String,
    /// The displayed text.
    #[serde(default)]
    from: String,
}

async fn text(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(text): Json<Text>,
) -> Answer {
    with(&app, &tab.session, move |session| {
        Ok(session.replace(&text.from, text.text)?)
    })
    .await
}

async fn own(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(change): Json<own_change::Change>,
) -> Answer {
    let answer = with(&app, &tab.session, move |session| {
        own_change::change(session, change)
    });
    let answer = answer.await?;
    let all = app.clone();
    aside(move || {
        all.sessions.make_room();
        Ok(answer)
    })
    .await
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Way {
    Add,
    Remove,
    /// Adds the unexplained error of the diagnosis, as a term of this name.
    Keep,
}

#[derive(Debug, Deserialize)]
struct Effect {
    #[serde(rename = "do")]
    way: Way,
    effect: String,
    place: Option<String>,
}

async fn effect(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(Effect { way, effect, place }): Json<Effect>,
) -> Answer {
    with(&app, &tab.session, move |session| {
        let diagnosis = session.diagnosis.clone();
        let unknown = diagnosis.as_ref().and_then(|of| of.found.unknown.as_ref());
        let shape = match (way, unknown) {
            (Way::Keep, None) => {
                return Err(Refusal::input(
                    "the residual shows no function of a variable; diagnose first",
                ));
            }
            (Way::Keep, Some(unknown)) => Some(TermFile::from(unknown)),
            _ => None,
        };
        if let (Way::Add, Ok(model), Some(info)) = (way, session.model(), EffectInfo::find(&effect))
        {
            Domain::check(info, model.plant, session.output_unit(&model))
                .map_err(|error| Refusal::input(error.worded(&MessageNames::PROGRAM.fit.plants)))?;
        }
        session.change(|file, text| match (way, &shape) {
            (Way::Keep, Some(shape)) => edit::with_term(file, text, &effect, "the shape", shape),
            (Way::Remove, _) => edit::without_effect(file, text, &effect),
            _ => edit::with_effect(file, text, &effect, place.as_deref()),
        })?;
        Ok(())
    })
    .await
}

#[derive(Debug, Deserialize)]
struct Treated {
    measured: bool,
}

async fn treat_loop(
    State(app): State<Arc<App>>,
    Query(tab): Query<Tab>,
    Json(treated): Json<Treated>,
) -> Answer {
    with(&app, &tab.session, move |session| {
        session.treat_loop(treated.measured);
        Ok(())
    })
    .await
}
