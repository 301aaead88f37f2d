//! What `ctid identify` prints of several methods or orders.

use linear_identification::side_by_side::{Outcome, Row, SideBySide};

use crate::look::{Look, Side, table_text};
use crate::numbers;
use crate::sentences::{of_gaps, of_violation, of_warning};

/// The complete text.
#[must_use]
pub fn text(found: &SideBySide, look: Look) -> String {
    let mut text = format!(
        "{}\n",
        look.heading(&format!("{}: methods side by side", found.record))
    );
    text += &look.paragraph("  ", &measure(found));
    text.push('\n');
    text += &results(found, look);
    text += &parameters(found, look);
    text += &assumptions(found, look);
    text += &orders(found, look);
    text
}

/// Measure by which the methods are compared.
pub(crate) fn measure(found: &SideBySide) -> String {
    let test = match &found.test[..] {
        [] => String::new(),
        names => format!(", and on {}, which was not fitted", names.join(", ")),
    };
    let in_loop = if found.in_loop {
        " The controller feeds the noise back to the input. A model that attributes this feedback to \
         the plant fits better, so the fit does not show which method is right."
    } else {
        ""
    };
    let gaps = found.gaps.as_ref().and_then(of_gaps);
    let gaps = gaps.map_or_else(String::new, |sentence| format!(" {sentence}"));
    format!(
        "Fit: each model runs on the input alone, from an initial state and a level that are fitted, on the record{test}; it is not a \
         prediction error.{in_loop}{gaps}"
    )
}

/// The methods with a result.
pub(crate) fn with_results(found: &SideBySide) -> impl Iterator<Item = (&Row, &Outcome)> {
    let rows = found.methods.iter();
    rows.filter_map(|row| row.found.as_ref().map(|outcome| (row, outcome)))
}

/// A fit in %, with the error in the output's unit.
pub(crate) fn fit(percent: f64, rmse: f64, unit: &str) -> String {
    let percent = numbers::decimals(percent, 1);
    let rmse = numbers::significant(rmse, 3);
    format!("{percent} % ({rmse} {unit})").replace(" )", ")")
}

fn results(found: &SideBySide, look: Look) -> String {
    let unit = &found.shown.output.unit;
    let mut heading = vec!["method", "order", "fit", "time"];
    if !found.test.is_empty() {
        heading.insert(3, "on test");
    }
    let mut rows = vec![
        heading
            .iter()
            .map(|name| look.faint(name))
            .collect::<Vec<_>>(),
    ];
    for (row, outcome) in with_results(found) {
        let mut cells = vec![
            row.method.id().to_owned(),
            row.order.to_string(),
            fit(outcome.fit_percent, outcome.rmse, unit),
        ];
        if let (Some(percent), Some(rmse)) = (outcome.test_fit_percent, outcome.test_rmse) {
            cells.push(fit(percent, rmse, unit));
        }
        cells.push(format!("{} ms", numbers::significant(1e3 * row.seconds, 2)));
        rows.push(cells);
    }
    let sides: Vec<Side> = (0..heading.len())
        .map(|column| if column < 2 { Side::Left } else { Side::Right })
        .collect();
    table_text(&sides, &rows) + "\n"
}

fn parameters(found: &SideBySide, look: Look) -> String {
    let mut text = format!("{}\n", look.heading("Parameters, with standard errors"));
    let mut rows = vec![
        ["method", "parameter", "value", "std. error", ""]
            .map(|name| look.faint(name))
            .to_vec(),
    ];
    for (row, outcome) in with_results(found) {
        for (k, parameter) in outcome.parameters.iter().enumerate() {
            let (value, error) = numbers::value_and_error(parameter.value, parameter.std_error);
            let method = if k == 0 { row.method.id() } else { "" };
            rows.push(vec![
                method.to_owned(),
                parameter.name.clone(),
                value,
                error.unwrap_or_else(|| "not known".to_owned()),
                parameter.unit.clone(),
            ]);
        }
    }
    let sides = [Side::Left, Side::Left, Side::Right, Side::Right, Side::Left];
    text += &table_text(&sides, &rows);
    text.push('\n');
    text
}

/// Two tests of a simulation error, in words.
pub(crate) fn tests(outcome: &Outcome) -> String {
    let p = |p: f64| match p {
        p if p < 0.001 => "p < 0.001".to_owned(),
        p => format!("p = {}", numbers::decimals(p, 3)),
    };
    format!(
        "simulation error white: {}; uncorrelated with the input: {}",
        p(outcome.whiteness_p),
        p(outcome.input_p)
    )
}

fn assumptions(found: &SideBySide, look: Look) -> String {
    let mut text = format!(
        "{}\n",
        look.heading("What each assumes, and whether the record violates it")
    );
    for row in &found.methods {
        let name = row.method.id();
        text += &look.paragraph("  - ", &format!("{name} assumes {}", row.assumes));
        if let Some(reason) = &row.refused {
            text += &look.paragraph("      ", &format!("refused: {reason}"));
        }
        let Some(outcome) = &row.found else {
            continue;
        };
        for violation in &outcome.violated {
            let violated = of_violation(violation, row.method);
            text += &look.paragraph("      ", &format!("violated: {violated}"));
        }
        text += &look.paragraph("      ", &tests(outcome));
        for warning in &outcome.warnings {
            let note = format!("note: {}", of_warning(warning));
            text += &look.paragraph("      ", &note);
        }
    }
    text
}

fn orders(found: &SideBySide, look: Look) -> String {
    if found.orders.is_empty() {
        return String::new();
    }
    let heading = ["method", "order", "fit", "BIC", "YIC", "largest rel. error"];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for row in &found.orders {
        let mut cells = vec![row.method.id().to_owned(), row.order.to_string()];
        match &row.found {
            Some(outcome) => cells.extend([
                format!("{} %", numbers::decimals(outcome.fit_percent, 1)),
                numbers::decimals(outcome.bic, 1),
                or_dash(outcome.yic.map(|yic| numbers::decimals(yic, 1))),
                or_dash(
                    largest_error(outcome)
                        .map(|error| format!("{} %", numbers::significant(100.0 * error, 2))),
                ),
            ]),
            None => cells.extend(["refused", "-", "-", "-"].map(str::to_owned)),
        }
        rows.push(cells);
    }
    let [left, right] = [Side::Left, Side::Right];
    let mut text = format!("\n{}\n", look.heading("Orders"));
    text += &look.paragraph("  ", ORDERS);
    text += &table_text(&[left, left, right, right, right, right], &rows);
    text
}

/// Meaning of the table of orders.
pub(crate) const ORDERS: &str = "BIC of the simulation error beside an autoregressive noise model: shown above is the least of a method whose parameters differ \
     significantly from zero. \
     YIC: low for a model that fits and has small standard errors; it needs standard errors.";

/// The largest standard error of a parameter over its size.
pub(crate) fn largest_error(outcome: &Outcome) -> Option<f64> {
    let known = outcome.parameters.iter();
    known
        .filter(|parameter| parameter.name != "offset")
        .map(|parameter| {
            let error = parameter.std_error.filter(|error| *error > 0.0)?;
            Some(error / parameter.value.abs())
        })
        .try_fold(0.0_f64, |most, error| Some(most.max(error?)))
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "-".to_owned())
}
