//! The unexplained function, as text and as a file.

use effect_search::Unknown;

use super::words::{EffectWords, shown_unit};
use crate::csv_text::header;
use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::term_file::of_curve;

/// Describes the function in one or two sentences.
pub(super) fn said(unknown: &Unknown, words: &EffectWords) -> String {
    let left_out = unknown.share_left_out.map_or(String::new(), |share| {
        if share > 0.0 {
            format!(
                ", and lowers it by {:.0} % on parts of the records that it was not fitted to",
                100.0 * share
            )
        } else {
            ", but does not lower it on parts of the records that it was not fitted to".to_string()
        }
    });
    format!(
        "A function of every state, input and time was fitted at every port: the best is a function of {}. {} explains {:.0} % of the squared error above the noise{left_out}{mean}; `ctid add NAME --from RESULT.json` keeps it under a name of your choice until its physics is known.",
        unknown.variable,
        words.placed(&unknown.effect),
        100.0 * unknown.share,
        mean = if unknown.is_centred {
            " (its values are shown less their mean, for which the parameters of the model compensate)"
        } else {
            ""
        },
    )
}

/// Some of its values, as a table.
pub(super) fn values(unknown: &Unknown, look: Look) -> String {
    /// Distance between listed values.
    const EVERY: usize = 4;
    let head = |name: &str, unit: &str| header(name, shown_unit(unit));
    let mut rows = vec![vec![
        head(&unknown.variable, &unknown.variable_unit),
        head("term", &unknown.unit),
        "std. error".to_string(),
    ]];
    let values = unknown.at.iter().zip(&unknown.value);
    for ((at, value), error) in values.zip(&unknown.std_error).step_by(EVERY) {
        let error = error.map_or("not determined".to_string(), |error| {
            numbers::significant(error, 2)
        });
        rows.push(vec![
            numbers::significant(*at, 3),
            numbers::significant(*value, 3),
            error,
        ]);
    }
    let mut text = format!("\n{}\n", look.heading(&unknown.effect));
    text += &table_text(&[Side::Right; 3], &rows);
    text
}

/// The file that `ctid diagnose --unknown` writes.
pub(crate) fn file(unknown: &Unknown) -> String {
    let values = unknown.at.iter().zip(&unknown.value);
    let rows = values.zip(&unknown.std_error);
    of_curve(
        // A comma separates the two variables of a port.
        (&format!("\"{}\"", unknown.effect), &unknown.variable),
        (&unknown.variable_unit, &unknown.unit),
        rows.map(|((at, value), error)| (*at, *value, *error)),
    )
}
