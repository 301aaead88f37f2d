//! The tab of a request: its session, and work on it outside the threads of the server.

use axum::Json;
use axum::http::StatusCode;
use serde::Deserialize;
use serde_json::Value;
use tokio::task::spawn_blocking;

use super::app::App;
use super::guard::Refusal;
use super::session::{Session, lock};
use super::sessions::Shared;
use super::state;

/// What a request is answered with: JSON, or a refusal.
pub(super) type Answer = Result<Json<Value>, Refusal>;

/// The requesting tab.
#[derive(Debug, Deserialize)]
pub(super) struct Tab {
    pub session: String,
}

/// The session of a request.
pub(super) fn find(app: &App, id: &str) -> Result<Shared, Refusal> {
    app.sessions.find(id).ok_or_else(|| {
        Refusal::new(
            StatusCode::GONE,
            "this tab's work is no longer kept: ctid was started anew, or other tabs needed the room; load the page again",
        )
    })
}

/// Runs a slow operation, such as reading a large file, outside the threads of the server.
pub(super) async fn aside<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let broke = |_| {
        Refusal::new(
            StatusCode::INTERNAL_SERVER_ERROR,
            "the request failed because of an error in ctid",
        )
    };
    spawn_blocking(work).await.map_err(broke)?
}

/// Applies a function to the session, and answers with the session's state.
pub(super) async fn with(
    app: &App,
    id: &str,
    work: impl FnOnce(&mut Session) -> Result<(), Refusal> + Send + 'static,
) -> Answer {
    let session = find(app, id)?;
    aside(move || {
        let mut session = lock(&session);
        work(&mut session)?;
        Ok(Json(state::state(&mut session)))
    })
    .await
}
