//! The estimates of a model as text: parameters, initial states, and the rows that those of held-out records take.

use effect_search::Step;

use super::words::shown_unit;
use crate::look::{Look, Side, table_text};
use crate::numbers;

/// Number of rows for the fit of the held-out records' initial states.
pub(super) fn state_rows(step: &Step) -> String {
    let Some(rows) = &step.state_rows else {
        return String::new();
    };
    let rows: Vec<String> = rows.iter().map(usize::to_string).collect();
    let whose = if let [only] = &rows[..] {
        format!("its first {only} rows")
    } else {
        format!(
            "the first {} rows of the records and their parts",
            rows.join(", ")
        )
    };
    format!("  held out: without {whose} that the initial states are fitted to\n")
}

/// Table of the parameters and initial states of a model.
pub(super) fn estimates(step: &Step, look: Look) -> String {
    let mut text = format!(
        "\n{}\n",
        look.heading("Parameters and initial states, with standard errors")
    );
    let rows: Vec<Vec<String>> = step
        .parameters
        .iter()
        .map(|parameter| {
            let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
            let error = match error {
                Some(error) => format!("± {error}"),
                None if parameter.known => "(known)".to_string(),
                None => "(at a bound, or not determined)".to_string(),
            };
            let unit = shown_unit(&parameter.unit).to_string();
            vec![parameter.name.clone(), value, error, unit]
        })
        .collect();
    text += &table_text(&[Side::Left, Side::Right, Side::Left, Side::Left], &rows);
    text
}
