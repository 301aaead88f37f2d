//! The page of `ctid identify` with several methods or orders.

use super::figures::{self, Colour, Curve, Figure, Panel};
use super::page::{self, NOTICES, Page, figure, items, large, section};
use super::tables::table;
use super::text::{code, escape, significant, unit, with_error};
use crate::identify::side_by_side_text::{ORDERS, largest_error, measure, tests, with_results};
use crate::sentences::{of_violation, of_warning};
use linear_identification::side_by_side::{Row, SideBySide};

/// The page as a complete HTML file.
pub fn html(found: &SideBySide) -> String {
    let body: String = [
        headline(found),
        "<main>".to_owned(),
        section(
            "fit",
            "Measured against all simulations",
            "Drag to zoom, double-click to see all again; click a name to hide its curve.",
            &figure("fit", "Output, residual, and input", ""),
        ),
        parameters(found),
        assumptions(found),
        orders(found),
        page::footer(""),
    ]
    .concat();
    page::html(&Page {
        title: &format!("ctid: {}", escape(&found.record)),
        body: &body,
        data: &figures::json(&[fit_figure(found)]),
        script: figures::SCRIPT,
    })
}

fn headline(found: &SideBySide) -> String {
    let fits: String = with_results(found)
        .map(|(row, outcome)| {
            large(
                &significant(outcome.fit_percent, 3),
                "%",
                &format!("{}, order {}", row.method.id(), row.order),
                "",
            )
        })
        .collect();
    format!(
        "<header>\n<p class=\"kicker\">ctid report · {}</p>\n<h1>Linear models, method by method</h1>\n\
         <ol class=\"trail apart\">\n{fits}</ol>\n<p class=\"caption\">{}</p>\n{NOTICES}</header>\n",
        escape(&found.record),
        escape(&measure(found))
    )
}

fn parameters(found: &SideBySide) -> String {
    let output = &found.shown.output.unit;
    let mut names: Vec<(&str, &str)> = Vec::new();
    for (_, outcome) in with_results(found) {
        for parameter in &outcome.parameters {
            if !names.iter().any(|(name, _)| *name == parameter.name) {
                names.push((&parameter.name, &parameter.unit));
            }
        }
    }
    let columns: String = names
        .iter()
        .map(|(name, of)| {
            format!(
                "<th scope=\"col\" class=\"number\">{} {}</th>",
                code(name),
                unit(of)
            )
        })
        .collect();
    let tested = !found.test.is_empty();
    let rows: String = with_results(found)
        .map(|(row, outcome)| {
            let cells: String = names
                .iter()
                .map(|(name, _)| {
                    let mut of = outcome.parameters.iter();
                    of.find(|p| p.name == *name).map_or_else(
                        || "<td class=\"number\"></td>".to_owned(),
                        |p| format!("<td class=\"number\">{}</td>", with_error(p.value, p.std_error)),
                    )
                })
                .collect();
            let on_test = outcome.test_rmse.map_or_else(String::new, |rmse| {
                format!("<td class=\"number\">{}</td>", significant(rmse, 3))
            });
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td>{cells}<td class=\"number\">{}</td>{on_test}<td class=\"number\">{}</td></tr>\n",
                code(row.method.id()),
                row.order,
                significant(outcome.rmse, 3),
                significant(row.seconds, 2)
            )
        })
        .collect();
    let on_test = if tested {
        format!(
            "<th scope=\"col\" class=\"number\">Error on test {}</th>",
            unit(output)
        )
    } else {
        String::new()
    };
    section(
        "parameters",
        "The parameters",
        "",
        &table(
            "By method",
            &format!(
                "<tr><th scope=\"col\">Method</th><th scope=\"col\">Order</th>{columns}<th scope=\"col\" class=\"number\">Error {}</th>{on_test}\
                 <th scope=\"col\" class=\"number\">Time (s)</th></tr>",
                unit(output)
            ),
            &rows,
            "Value ± standard error, where the method says one. Error: root mean square of the simulation.",
        ),
    )
}

fn assumptions(found: &SideBySide) -> String {
    let of = |row: &Row| {
        let mut says: Vec<String> = row
            .refused
            .iter()
            .map(|reason| format!("Refused: {reason}"))
            .collect();
        if let Some(outcome) = &row.found {
            let violated = outcome.violated.iter();
            says.extend(violated.map(|it| format!("Violated: {}", of_violation(it, row.method))));
            says.push(tests(outcome));
            let warnings = outcome.warnings.iter();
            says.extend(warnings.map(|it| format!("Note: {}", of_warning(it))));
        }
        format!(
            "<h3>{}</h3>\n<p>Assumes {}.</p>\n<ul>\n{}</ul>\n",
            code(row.method.id()),
            escape(row.assumes),
            items(says)
        )
    };
    section(
        "assumptions",
        "What each assumes, and whether the record violates it",
        "",
        &found.methods.iter().map(of).collect::<String>(),
    )
}

fn orders(found: &SideBySide) -> String {
    if found.orders.is_empty() {
        return String::new();
    }
    let number = |value: Option<f64>| {
        let text = value.map_or_else(|| "–".to_owned(), |value| significant(value, 4));
        format!("<td class=\"number\">{text}</td>")
    };
    let rows: String = found
        .orders
        .iter()
        .map(|row| {
            let cells: String = match &row.found {
                Some(outcome) => [
                    Some(outcome.fit_percent),
                    Some(outcome.bic),
                    outcome.yic,
                    largest_error(outcome).map(|error| 100.0 * error),
                ]
                .map(number)
                .concat(),
                None => format!(
                    "<td colspan=\"4\">{}</td>",
                    escape(row.refused.as_deref().unwrap_or_default())
                ),
            };
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td>{cells}</tr>\n",
                code(row.method.id()),
                row.order
            )
        })
        .collect();
    section(
        "orders",
        "Orders",
        ORDERS,
        &table(
            "All orders",
            "<tr><th scope=\"col\">Method</th><th scope=\"col\">Order</th><th scope=\"col\" class=\"number\">Fit (%)</th>\
             <th scope=\"col\" class=\"number\">BIC</th><th scope=\"col\" class=\"number\">YIC</th>\
             <th scope=\"col\" class=\"number\">Largest relative standard error (%)</th></tr>",
            &rows,
            "",
        ),
    )
}

fn fit_figure(found: &SideBySide) -> Figure {
    let shown = &found.shown;
    let panels = Panel::of_fit(&shown.output.unit, &shown.input.unit);
    let measured = Colour::Named("measured");
    let output = &shown.output.values;
    let mut curves = vec![Curve::line("measured", 0, measured, (&shown.time, output)).named()];
    for (k, (row, outcome)) in with_results(found).enumerate() {
        let (name, colour) = (row.method.id(), Colour::Of(k));
        let simulated = (&shown.time[..], &outcome.simulated[..]);
        // What was analysed: plant, records, noise floor.
        let dash = ["solid", "dash", "dot"][k / 3 % 3];
        curves.push(Curve::line(name, 0, colour, simulated).dashed(dash).named());
        let residual: Vec<f64> = output
            .iter()
            .zip(&outcome.simulated)
            .map(|(y, m)| y - m)
            .collect();
        curves.push(Curve::line(name, 1, colour, (&shown.time, &residual)).dashed(dash));
    }
    curves.push(Curve::input(2, (&shown.time, &shown.input.values)));
    Figure::over_time("fit", 620, panels, curves)
}
