//! Files of the page. All are built into the program; the script of the plots is that of the report.

use std::sync::Arc;

use axum::Router;
use axum::http::header;
use axum::response::IntoResponse;
use axum::routing::get;

use super::app::App;
use crate::report;

const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const PAGE: &str = "text/html; charset=utf-8";

/// Path, kind and content of constant files.
static FILES: [(&str, &str, &str); 18] = [
    ("/", PAGE, include_str!("page/index.html")),
    ("/report.css", STYLE, report::STYLE),
    ("/page.css", STYLE, include_str!("page/page.css")),
    ("/plots.js", SCRIPT, report::PLOTS),
    ("/diagnosis_figures.js", SCRIPT, report::DIAGNOSIS_FIGURES),
    ("/app.js", SCRIPT, include_str!("page/app.js")),
    ("/server.js", SCRIPT, include_str!("page/server.js")),
    ("/dom.js", SCRIPT, include_str!("page/dom.js")),
    ("/data.js", SCRIPT, include_str!("page/data.js")),
    ("/model.js", SCRIPT, include_str!("page/model.js")),
    ("/fit.js", SCRIPT, include_str!("page/fit.js")),
    ("/own.js", SCRIPT, include_str!("page/own.js")),
    (
        "/own_unknown.js",
        SCRIPT,
        include_str!("page/own_unknown.js"),
    ),
    (
        "/own_experiment.js",
        SCRIPT,
        include_str!("page/own_experiment.js"),
    ),
    ("/chains.js", SCRIPT, include_str!("page/chains.js")),
    ("/findings.js", SCRIPT, include_str!("page/findings.js")),
    ("/unknown.js", SCRIPT, include_str!("page/unknown.js")),
    ("/experiment.js", SCRIPT, include_str!("page/experiment.js")),
];

pub(super) fn routes() -> Router<Arc<App>> {
    let mut router = Router::new().route("/plotly.js", get(plotly));
    for (path, kind, content) in FILES {
        let file = move || async move { ([(header::CONTENT_TYPE, kind)], content) };
        router = router.route(path, get(file));
    }
    router
}

async fn plotly() -> impl IntoResponse {
    let headers = [
        (header::CONTENT_TYPE, SCRIPT),
        (header::CONTENT_ENCODING, "gzip"),
    ];
    (headers, report::PLOTLY)
}
