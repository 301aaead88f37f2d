//! Access control: requests need the access key of this run, and have to come from pages of this server.
//!
//! Every address begins with the access key, which is only in the printed address: other users of the machine can connect, but get no
//! answer without the key. It is no cookie, which a browser would also send to the servers of others at other ports of this machine.
//!
//! A page of another site that is open in the same browser can send requests to any local server. Its requests have its own `Origin`,
//! which is rejected. A host name that it resolves to 127.0.0.1 later is in `Host`, which is rejected too.
//! And it does not have the access key.

use std::hint::black_box;

use axum::Json;
use axum::http::uri::PathAndQuery;
use axum::http::{HeaderMap, HeaderValue, Request, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// The largest accepted body \[bytes\].
pub(super) const LARGEST_BODY: usize = 64 << 20;

/// Content security policy of the page: everything comes from this server. Plotly writes styles into its elements, and draws saved pictures
/// from a blob.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; object-src 'none'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// An answer with the error and the correction.
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

    /// The content of the request cannot be used.
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

/// Names of this server that requests may use, and the access key.
#[derive(Debug)]
pub(super) struct Guard {
    hosts: Vec<String>,
    secret: String,
}

impl Guard {
    pub(super) fn new(port: u16) -> Self {
        let names = ["127.0.0.1", "localhost"];
        let mut hosts = names.map(|host| format!("{host}:{port}")).to_vec();
        // Browsers omit the default port.
        if port == 80 {
            hosts.extend(names.map(str::to_owned));
        }
        Self {
            hosts,
            secret: format!("{:032x}", rand::random::<u128>()),
        }
    }

    /// The first part of every address.
    pub(super) fn secret(&self) -> &str {
        &self.secret
    }

    /// Whether the request may be answered; its address is then the part after the access key.
    ///
    /// # Errors
    /// Why it is refused.
    pub(super) fn admit<B>(&self, request: &mut Request<B>) -> Result<(), Refusal> {
        self.is_of_this_server(request.headers())?;
        let behind = self.behind_the_secret(request.uri());
        *request.uri_mut() = behind.ok_or_else(|| {
            forbidden(
                "the address lacks the access key of this run of ctid; open the one that ctid printed",
            )
        })?;
        Ok(())
    }

    fn is_of_this_server(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let ours = |host: &str| self.hosts.iter().any(|known| known == host);
        if !text(headers, header::HOST).is_some_and(ours) {
            return Err(forbidden(
                "this server answers to 127.0.0.1 alone; open the address that ctid printed",
            ));
        }
        let origin = text(headers, header::ORIGIN)
            .map(|origin| origin.strip_prefix("http://").unwrap_or("?"));
        if !origin.is_none_or(ours) {
            return Err(forbidden(
                "the request comes from another page than this server's own",
            ));
        }
        Ok(())
    }

    fn behind_the_secret(&self, uri: &Uri) -> Option<Uri> {
        let path = uri.path_and_query().map_or("", PathAndQuery::as_str);
        let (given, behind) = path
            .strip_prefix('/')?
            .split_at_checked(self.secret.len())?;
        if !is_same(given, &self.secret) || !behind.starts_with('/') {
            return None;
        }
        behind.parse().ok()
    }
}

/// Whether two texts of one length are equal, in constant time, so that the duration does not show where they differ.
fn is_same(given: &str, secret: &str) -> bool {
    let pairs = given.bytes().zip(secret.bytes());
    pairs.fold(0, |differing, (a, b)| black_box(differing | (a ^ b))) == 0
}

fn forbidden(what: &str) -> Refusal {
    Refusal::new(StatusCode::FORBIDDEN, what)
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    let value = headers.get(name)?;
    Some(value.to_str().unwrap_or("?"))
}

/// Rejects a body whose header gives too large a length, before it is read.
pub(super) fn check_length(headers: &HeaderMap) -> Result<(), Refusal> {
    let length = text(headers, header::CONTENT_LENGTH).and_then(|text| text.parse::<u64>().ok());
    if length.is_some_and(|length| length > LARGEST_BODY as u64) {
        return Err(Refusal::too_large());
    }
    Ok(())
}

/// Sets the security headers of the answer.
pub(super) fn restrict<B>(response: &mut Response<B>) {
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
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_address_begins_with_the_secret() {
        let guard = Guard::new(8420);
        let secret = guard.secret().to_string();
        assert_eq!(secret.len(), 32);
        let behind = |address: &str| {
            let host = ("Host", "127.0.0.1:8420");
            let request = Request::builder().header(host.0, host.1).uri(address);
            let mut request = request.body(()).unwrap();
            guard
                .admit(&mut request)
                .map(|()| request.uri().to_string())
        };
        assert_eq!(behind(&format!("/{secret}/")).unwrap(), "/");
        assert_eq!(
            behind(&format!("/{secret}/api/x?a=1")).unwrap(),
            "/api/x?a=1"
        );
        let mut other = secret.clone().into_bytes();
        other[31] = if other[31] == b'0' { b'1' } else { b'0' };
        let other = String::from_utf8(other).unwrap();
        for wrong in [
            "/".to_string(),
            "/api/state".to_string(),
            format!("/{secret}"),
            format!("/{}/", &secret[..31]),
            format!("/{other}/"),
            format!("/{secret}0/"),
            format!("/?{secret}/"),
        ] {
            let refused = behind(&wrong).unwrap_err().to_string();
            assert!(
                refused.contains("open the one that ctid printed"),
                "{wrong}"
            );
        }
    }
}
