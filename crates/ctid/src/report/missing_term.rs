//! The unexplained error of a user's own model: a smooth function at one of its ports, for the report and the page.

use missing_effect::numbers;
use serde::Serialize;

use super::page::{figure, section};
use super::tables::table;
use super::text::{escape, prose, unit};

/// The unexplained error as a function. The page and the report draw it like the unknown of a plant: common fields have the same names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct MissingTerm {
    /// Identifier of the function: `shape(T,u)`.
    pub effect: String,
    /// Identifier with its port in words.
    pub placed: String,
    /// Variable that the function depends on.
    pub variable: String,
    pub variable_unit: String,
    /// How the function enters the port: `added to the equation of T`.
    pub shown_term: String,
    /// Unit of the term.
    pub unit: String,
    /// Arguments at which the function is given, over the visited range.
    pub knots: Vec<f64>,
    pub ordinates: Vec<f64>,
    /// Standard errors; `None` where the records do not determine them.
    pub ordinate_errors: Vec<Option<f64>>,
    /// The command that adds the function to the model file.
    pub command: String,
    /// Ports and variables that were compared, the best first.
    pub places: Vec<ComparedPort>,
}

/// A port with a variable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ComparedPort {
    pub placed: String,
    /// Fall of the criterion.
    pub bic_gain: String,
    /// Fall of the squared error on parts that were left out of the fit; empty if not computed.
    pub left_out: String,
}

impl ComparedPort {
    pub fn new(placed: String, bic_gain: f64, share_left_out: Option<f64>) -> Self {
        Self {
            placed,
            bic_gain: numbers::significant(bic_gain, 3),
            left_out: match share_left_out {
                None => String::new(),
                Some(share) if share > 0.0 => format!("{:.0} %", 100.0 * share),
                Some(_) => "it rises".to_string(),
            },
        }
    }
}

/// Explanation of [`ComparedPort`] for the reader.
pub(crate) const COMPARED: &str = "Each function was fitted together with all parameters. Left-out error: by how much the squared error falls on parts of the records \
     that the function was not fitted to; it was computed for the best functions of a state or an input.";

/// Section of the report on the unexplained error.
pub(super) fn html(term: &MissingTerm) -> String {
    let heading = format!(
        "{} against {}",
        escape(&term.effect),
        escape(&term.variable)
    );
    let picture = figure(
        "unknown-shape",
        &heading,
        "Fitted with all parameters of the model, over the range that the records visited; with its 95 % band.",
    );
    let rows: String = term
        .places
        .iter()
        .map(|place| {
            format!(
                "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
                escape(&place.placed),
                place.bic_gain,
                if place.left_out.is_empty() {
                    "–"
                } else {
                    &place.left_out
                }
            )
        })
        .collect();
    let compared = table(
        "Ports and variables that were compared",
        "<tr><th>function</th><th class=\"number\">fall of BIC</th><th class=\"number\">fall of the left-out error</th></tr>",
        &rows,
        COMPARED,
    );
    let of = match unit(&term.unit) {
        none if none.is_empty() => String::new(),
        unit => format!(", in {unit}"),
    };
    let lead = format!(
        "The best function is {placed}, of <code>{variable}</code>. It is {what}{of}. {keep}",
        placed = escape(&term.placed),
        variable = escape(&term.variable),
        what = escape(&term.shown_term),
        keep = prose(&format!(
            "`{}` keeps it in the model file until its physics is known; RESULT.json is what `ctid diagnose --json RESULT.json` writes.",
            term.command
        )),
    );
    section(
        "unknown",
        "The unexplained error",
        &lead,
        &format!("{picture}{compared}"),
    )
}
