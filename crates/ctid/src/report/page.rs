//! Parts that every page shares: the frame that contains style, data and scripts, and the places for its content.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::text::escape;

const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data: blob:; connect-src 'none'; base-uri 'none'; form-action 'none'";
pub(crate) static STYLE: &str = include_str!("report.css");
/// Colours, axes and the unpacking of plotly.js: included before the page's own script.
pub(crate) static PLOTS: &str = include_str!("plots.js");
/// plotly.js, gzipped. A `static`: the program contains a constant once for each place that uses it.
pub(crate) static PLOTLY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// Message on a page whose scripts do not run.
pub(super) const NOTICES: &str = "<noscript><p class=\"notice\">The plots need a browser that runs scripts; \
     the findings and the tables do not.</p></noscript>\n\
     <p class=\"notice\" id=\"no-plots\" hidden></p>\n";

/// Parts of a page.
pub(super) struct Page<'a> {
    /// HTML.
    pub title: &'a str,
    /// HTML.
    pub body: &'a str,
    /// JSON, safe inside a `<script>` element.
    pub data: &'a str,
    /// Script that draws the figures.
    pub script: &'a str,
}

/// Beginning of every page, with a mark of ctid: a file with this mark may be overwritten.
#[must_use]
pub fn head() -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"generator\" content=\"ctid\">\n"
    )
}

/// The complete file.
pub(super) fn html(page: &Page) -> String {
    let Page {
        title,
        body,
        data,
        script,
    } = page;
    let plotly = STANDARD.encode(PLOTLY);
    format!(
        "{}\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}\n\
         <script type=\"application/json\" id=\"data\">{data}</script>\n\
         <script type=\"text/plain\" id=\"plotly\">{plotly}</script>\n\
         <script>\n{PLOTS}{script}</script>\n</body>\n</html>\n",
        head()
    )
}

/// End of a page; `said`: sentences about its numbers, each with a blank behind it.
pub(super) fn footer(said: &str) -> String {
    format!(
        "</main><footer><p>Written by ctid. {said}This file holds all its data and loads nothing.</p></footer>"
    )
}

/// A part of the page under a heading; `title`, `lead` and `content` are HTML.
pub(super) fn section(id: &str, title: &str, lead: &str, content: &str) -> String {
    let lead = if lead.is_empty() {
        String::new()
    } else {
        format!("<p class=\"lead\">{lead}</p>\n")
    };
    format!(
        "<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{title}</h2>\n{lead}{content}</section>\n"
    )
}

/// A place for a plot. `heading` is HTML, `caption` is text.
pub(super) fn figure(id: &str, heading: &str, caption: &str) -> String {
    figure_with(id, heading, &escape(caption))
}

/// A place for a plot, heading and caption in HTML.
pub(super) fn figure_with(id: &str, heading: &str, caption: &str) -> String {
    let caption = if caption.is_empty() {
        String::new()
    } else {
        format!("<p class=\"caption\">{caption}</p>")
    };
    format!(
        "<figure aria-labelledby=\"plot-{id}-name\">\n<figcaption><h3 id=\"plot-{id}-name\">{heading}</h3>\
         {caption}</figcaption>\n<div class=\"plot\" id=\"plot-{id}\"></div>\n</figure>\n"
    )
}

/// A number in large type, its label, and further text below: an item of a list of class `trail`; all arguments are HTML.
pub(super) fn large(number: &str, unit: &str, label: &str, below: &str) -> String {
    format!(
        "<li><span class=\"number\">{number} <small>{unit}</small></span>\
         <span class=\"label\">{label}</span>{below}</li>\n"
    )
}

/// Sentences as items of a list, each on a line.
pub(super) fn items<S: AsRef<str>>(sentences: impl IntoIterator<Item = S>) -> String {
    sentences
        .into_iter()
        .map(|sentence| format!("<li>{}</li>\n", escape(sentence.as_ref())))
        .collect()
}
