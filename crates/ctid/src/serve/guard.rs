//! Who may ask: pages that this server has sent, on this machine, and nobody else.
//!
//! A page of another site that is open in the same browser can send requests to any local server. Three things keep it out.
//! Its requests carry its own `Origin`, which is refused. A name that it has pointed at 127.0.0.1 after it was loaded stands in
//! `Host`, which is refused too. And what changes anything needs a token that only this server's own page holds, which no
//! other page can read.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::json;

use super::App;

/// The largest body that is taken \[bytes\].
pub(super) const LARGEST_BODY: usize = 64 << 20;

/// Carries the token.
const TOKEN: &str = "x-ctid-token";

/// What the browser may do with the page: everything comes from here. Plotly writes styles into its elements, and draws the
/// picture that it saves from a blob.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; object-src 'none'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// An answer that says what is wrong and the mend.
#[derive(Debug)]
pub(super) struct Refusal {
    status: StatusCode,
    what: String,
}

impl Refusal {
    pub(super) fn new(status: StatusCode, what: impl Into<String>) -> Self {
        Self {
            status,
            what: crate::one_line(&what.into()),
        }
    }

    /// What was sent cannot be used.
    pub(super) fn input(what: impl ToString) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, what.to_string())
    }

    pub(super) fn too_large() -> Self {
        let most = LARGEST_BODY >> 20;
        Self::new(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!(
                "the file is larger than {most} MB, which is the most that the page takes; keep the columns that are in use, or \
                 fewer rows, or run `ctid diagnose` on it"
            ),
        )
    }
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.what)
    }
}

impl From<crate::Error> for Refusal {
    fn from(error: crate::Error) -> Self {
        match error {
            crate::Error::Changed { .. } => Self::new(StatusCode::CONFLICT, error.to_string()),
            _ => Self::input(error),
        }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.what }))).into_response()
    }
}

/// Who may speak for this server, and the token.
#[derive(Debug)]
pub(super) struct Guard {
    hosts: Vec<String>,
    token: String,
}

impl Guard {
    pub(super) fn new(port: u16) -> Self {
        let names = ["127.0.0.1", "localhost"];
        let mut hosts = names.map(|host| format!("{host}:{port}")).to_vec();
        // A browser leaves out the port that it would take anyway.
        if port == 80 {
            hosts.extend(names.map(str::to_owned));
        }
        Self {
            hosts,
            token: format!("{:032x}", rand::random::<u128>()),
        }
    }

    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// Why a request is refused, if it is.
    fn refuses(&self, method: &Method, headers: &HeaderMap) -> Option<Refusal> {
        let text = |name| {
            headers
                .get(name)
                .map(|value: &HeaderValue| value.to_str().unwrap_or("?"))
        };
        let ours = |host: &str| self.hosts.iter().any(|known| known == host);
        let forbidden = |what| Some(Refusal::new(StatusCode::FORBIDDEN, what));
        if !text(header::HOST).is_some_and(ours) {
            return forbidden(
                "this server answers to 127.0.0.1 alone; open the address that ctid printed",
            );
        }
        let origin =
            text(header::ORIGIN).map(|origin| origin.strip_prefix("http://").unwrap_or("?"));
        if !origin.is_none_or(ours) {
            return forbidden("the request comes from another page than this server's own");
        }
        let safe = method == Method::GET || method == Method::HEAD;
        if !safe && text(header::HeaderName::from_static(TOKEN)) != Some(&self.token) {
            return forbidden("the page is of another run of ctid; load it again");
        }
        let length = text(header::CONTENT_LENGTH).and_then(|length| length.parse::<u64>().ok());
        if length.is_some_and(|length| length > LARGEST_BODY as u64) {
            return Some(Refusal::too_large());
        }
        None
    }
}

/// Lets through what may pass, and tells the browser what the answer may do.
pub(super) async fn guard(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let mut response = match app.guard.refuses(request.method(), request.headers()) {
        Some(refusal) => refusal.into_response(),
        None => next.run(request).await,
    };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::CACHE_CONTROL, "no-store"),
        (
            header::HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        response
            .headers_mut()
            .insert(name, HeaderValue::from_static(value));
    }
    response
}
