//! The page of `ctid tables udink`.

mod figures;

use paper_tables::udink::gains::{Gains, Row};
use paper_tables::udink::{Cell, Changed, Comparison, ConstantGain, Contrast, LargerP, Study};

use self::figures::{all_figures, table_numbers};
use super::figures::{SCRIPT, json};
use super::page::{self, NOTICES, Page, figure, items, large, section};
use super::tables::table;
use super::text::{escape, significant};
use crate::tables::udink_sentences as sentences;

/// The page as a complete HTML file. The same study gives the same bytes.
pub fn html(study: &Study) -> String {
    let body: String = [
        headline(study),
        "<main>".to_owned(),
        responses(),
        cells(study),
        contrasts(&study.contrasts),
        power(&study.power),
        constant_gains(&study.constant_gains),
        larger_p(&study.larger_p),
        gains(&study.gains),
        page::footer(""),
    ]
    .concat();
    page::html(&Page {
        title: "ctid: tables 1 to 4 of Udink ten Cate",
        body: &body,
        data: &json(&all_figures(study)),
        script: SCRIPT,
    })
}

fn headline(study: &Study) -> String {
    let trail: String = [("Euler's rule", &study.euler), ("exact step", &study.exact)]
        .iter()
        .map(|(name, comparison)| {
            large(
                &comparison.inside.to_string(),
                &format!("of {}", comparison.of),
                &format!("cells inside with {name}"),
                "",
            )
        })
        .collect();
    let assumptions = items(&study.assumptions);
    format!(
        "<header>\n<p class=\"kicker\">ctid report · A. J. Udink ten Cate, WP-85-54, IIASA, 1985</p>\n\
         <h1>Tables 1 to 4: {}</h1>\n\
         <div class=\"verdict\"><p>The paper prints one run of each table. Here are {} runs, each with another noise realisation, \
         the same in every table. A cell is inside where the printed figure, give or take its rounding, lies in the \
         5 to 95 % range of the runs; of cells that agree, one in ten lies outside by chance.</p><p>{}</p></div>\n\
         <ol class=\"trail apart\">\n{trail}</ol>\n\
         <details><summary>What the paper does not print, and is assumed</summary><ul>\n{assumptions}</ul></details>\n<p>The paper\u{2019}s own bounds on c^: {}.</p>\n\
         {NOTICES}</header>\n",
        sentences::verdict(study),
        study.runs,
        escape(&sentences::beside_the_verdict(study)),
        escape(&study.filter_bounds)
    )
}

fn responses() -> String {
    section(
        "responses",
        "Figure 1, drawn again",
        "The responses of table 3 for the first noise realisation, with Euler's rule. Dashed: the true values, K = 1 and tau = 10 s. \
         E is the criterion: the sum over time of the squared relative errors of K and tau.",
        &figure("responses", "Output, estimates and criterion", ""),
    )
}

fn cells(study: &Study) -> String {
    let mut content = String::from("<div class=\"pairs\">\n");
    for number in table_numbers(study) {
        content += &figure(
            &format!("cells-{number}"),
            &format!("Table {number}: share of the runs below the printed figure"),
            "",
        );
    }
    content += "</div>\n";
    for number in table_numbers(study) {
        content += &cells_table(study, number);
    }
    content += &outside(study);
    section(
        "cells",
        "The printed figures against the runs",
        "Shaded: 5 to 95 %. E250 is the criterion at 250 s; differences of it are given besides, as its values share their past.",
        &content,
    )
}

fn cells_table(study: &Study, number: usize) -> String {
    let rows: String = study
        .euler
        .tables
        .iter()
        .zip(&study.exact.tables)
        .filter(|(cell, _)| cell.table == number)
        .map(|(euler, exact)| {
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"number\">{}</td>{}{}</tr>\n",
                euler.cell,
                format_args!("{:.*}", euler.decimals, euler.paper),
                of_rule(euler),
                of_rule(exact)
            )
        })
        .collect();
    table(
        &format!("Table {number}"),
        "<tr><th scope=\"col\">Cell</th><th scope=\"col\" class=\"number\">Paper</th>\
         <th scope=\"col\" class=\"number\">Euler: median</th><th scope=\"col\" class=\"number\">5 to 95 %</th><th scope=\"col\"></th>\
         <th scope=\"col\" class=\"number\">Exact: median</th><th scope=\"col\" class=\"number\">5 to 95 %</th><th scope=\"col\"></th></tr>",
        &rows,
        "",
    )
}

fn of_rule(cell: &Cell) -> String {
    let (class, word) = if cell.inside {
        ("", "inside")
    } else {
        (" class=\"chosen\"", "outside")
    };
    format!(
        "<td class=\"number\">{}</td><td class=\"number\">{}</td><td{class}>{word}</td>",
        significant(cell.median, 4),
        sentences::range(cell, " to ").replace('-', "−")
    )
}

fn outside(study: &Study) -> String {
    let list = |name: &str, comparison: &Comparison| {
        let outside = comparison.outside.iter();
        let cells =
            items(outside.map(|cell| format!("table {}, {}: {}", cell.table, cell.cell, cell.why)));
        format!("<h3>Outside with {name}</h3>\n<ul>\n{cells}</ul>\n")
    };
    list("Euler's rule", &study.euler) + &list("the exact step", &study.exact)
}

fn contrasts(contrasts: &[Contrast]) -> String {
    let tables: String = contrasts
        .iter()
        .map(|contrast| {
            let rows: String = contrast
                .cells
                .iter()
                .map(|cell| {
                    format!(
                        "<tr><th scope=\"row\">{}</th><td class=\"number\">{:.*}</td>{}</tr>\n",
                        cell.cell,
                        cell.decimals,
                        cell.paper,
                        of_rule(cell)
                    )
                })
                .collect();
            let [first, second] = contrast.between;
            table(
                &format!("Table {second} minus table {first}"),
                "<tr><th scope=\"col\">Cell</th><th scope=\"col\" class=\"number\">Paper</th>\
                 <th scope=\"col\" class=\"number\">Median</th><th scope=\"col\" class=\"number\">5 to 95 %</th><th scope=\"col\"></th></tr>",
                &rows,
                &sentences::contrast(contrast),
            )
        })
        .collect();
    section(
        "contrasts",
        sentences::CONTRASTS,
        sentences::CONTRASTS_MEANING,
        &tables,
    )
}

fn power(changed: &[Changed]) -> String {
    let rows: String = changed
        .iter()
        .map(|changed| {
            let (class, noticed) = if changed.noticed {
                ("", "yes")
            } else {
                (" class=\"chosen\"", "no")
            };
            format!(
                "<tr><th scope=\"row\">{}</th><td class=\"number\">{} of {}</td><td class=\"number\">{}</td><td{class}>{noticed}</td></tr>\n",
                escape(changed.setting),
                changed.inside,
                changed.of,
                changed.failed
            )
        })
        .collect();
    section(
        "power",
        sentences::OTHER_SETTINGS,
        &escape(&sentences::other_settings(changed)),
        &table(
            "Tables 1 to 4 with other settings",
            "<tr><th scope=\"col\">Changed</th><th scope=\"col\" class=\"number\">Cells inside</th><th scope=\"col\" class=\"number\">Runs lost</th><th scope=\"col\">Noticed</th></tr>",
            &rows,
            "Noticed: the tables are no longer called consistent.",
        ),
    )
}

fn constant_gains(gains: &[ConstantGain]) -> String {
    let rows: String = gains
        .iter()
        .map(|gain| {
            let figures: String = gain
                .criterion
                .into_iter()
                .chain([gain.gain_average, gain.time_constant_average])
                .map(|value| format!("<td class=\"number\">{}</td>", significant(value, 4)))
                .collect();
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td>{figures}</tr>\n",
                gain.gain,
                gain.rule.name()
            )
        })
        .collect();
    section(
        "constant",
        sentences::CONSTANT_GAINS,
        "The paper prints no values for the diagonal gain. Medians of the runs; E: the criterion [s].",
        &table(
            "Constant gains",
            "<tr><th scope=\"col\">Gain</th><th scope=\"col\">Rule</th><th scope=\"col\" class=\"number\">E250</th>\
             <th scope=\"col\" class=\"number\">E500</th><th scope=\"col\" class=\"number\">E750</th>\
             <th scope=\"col\" class=\"number\">E1000</th><th scope=\"col\" class=\"number\">K, average</th>\
             <th scope=\"col\" class=\"number\">tau, average (s)</th></tr>",
            &rows,
            "",
        ),
    )
}

fn larger_p(rows: &[LargerP]) -> String {
    let cells: String = rows
        .iter()
        .map(|row| {
            let failed = |count: usize| format!("{count} of {}", row.runs);
            let class = |count: usize| if count > 0 { " chosen" } else { "" };
            format!(
                "<tr><th scope=\"row\">× {}</th><td class=\"number{}\">{}</td><td class=\"number{}\">{}</td>\
                 <td class=\"number\">{}</td><td class=\"number\">{}</td></tr>\n",
                sentences::factor(row),
                class(row.euler_failed),
                failed(row.euler_failed),
                class(row.exact_failed),
                failed(row.exact_failed),
                significant(row.euler_criterion, 4),
                significant(row.exact_criterion, 4),
            )
        })
        .collect();
    section(
        "larger",
        "“Larger values lead to numerical difficulties”",
        "So the paper of P(0). It is Euler's rule that fails: it keeps P positive definite only while the step times phi′P phi stays below 1. \
         The exact step has no such limit.",
        &table(
            "Table 1 with larger P(0)",
            "<tr><th scope=\"col\">P(0)</th><th scope=\"col\" class=\"number\">Euler: runs lost</th>\
             <th scope=\"col\" class=\"number\">Exact: runs lost</th><th scope=\"col\" class=\"number\">Euler: E1000</th>\
             <th scope=\"col\" class=\"number\">Exact: E1000</th></tr>",
            &cells,
            "E1000: median of the criterion at 1000 s; lower is better. The largest P(0) is not the best one.",
        ),
    )
}

fn gains(gains: &Gains) -> String {
    let checked = gains.checked.iter();
    let checked = items(
        checked.map(|checked| format!("{} bounds: {}.", checked.bounds.name(), checked.says)),
    );
    let rows: String = gains
        .rows
        .iter()
        .map(|row| gain_row(row, gains.noises))
        .collect();
    let content = [
        figure(
            "counterexample",
            "Without noise: the estimates over time",
            "Exact step of 0.01 s, no bounds. Dashed: the truth. The block-diagonal gain ends elsewhere, \
             which the paper's theorem excludes; the other two have a proof, and converge. V = delta′P⁻¹ delta, over theta and c, falls for them; for the block-diagonal gain it rises.",
        ),
        figure(
            "gains",
            "With noise: largest error of a parameter over time",
            "Relative to the true value, which is 1. The first noise realisation; lines end where runs fail. Thin: Euler's rule.",
        ),
        table(
            "Three gains, two rules, with bounds on c and without",
            "<tr><th scope=\"col\">Gain</th><th scope=\"col\">Rule</th><th scope=\"col\">Bounds</th>\
             <th scope=\"col\" class=\"number\">Without noise: ends at</th>\
             <th scope=\"col\" class=\"number\">With noise: error</th><th scope=\"col\" class=\"number\">5 to 95 %</th>\
             <th scope=\"col\" class=\"number\">Runs lost</th></tr>",
            &rows,
            "Ends at: a1, a2, b0 at 2000 s, step 0.05 s; the truth is (1, 1, 1). Error: of the worst parameter, mean over the last quarter \
             of 1000 s, step 0.1 s, 1 % of noise; median of the noises. The constant gain stays at P(0) = I and does not average the noise out.",
        ),
        format!("<ul>\n{checked}</ul>\n"),
    ]
    .concat();
    section(
        "gains",
        "The three gains on one experiment of second order",
        "a2 y″ + a1 y′ + y = b0 u with all parameters 1, three sines, derivatives given, started from (2, 2, 0.5) with P(0) = I. \
         c is free, within wide bounds, or within bounds inside which C/A − 1/2 is strictly positive real.",
        &content,
    )
}

fn gain_row(row: &Row, noises: usize) -> String {
    let end = row.quiet_end.map_or("lost".to_owned(), |end| {
        let end = end.map(|value| format!("{value:.3}"));
        format!("({})", end.join(", "))
    });
    let lost = match row.noisy_failed {
        0 => "none".to_owned(),
        lost => format!("{lost} of {noises}"),
    };
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td class=\"number\">{end}</td>\
         <td class=\"number\">{}</td><td class=\"number\">{} to {}</td><td class=\"number\">{lost}</td></tr>\n",
        row.variant.gain.name(),
        row.variant.rule.name(),
        row.variant.bounds.name(),
        significant(row.noisy_error, 2),
        significant(row.noisy_q05, 2),
        significant(row.noisy_q95, 2),
    )
}
