//! What `ctid tables udink` prints.

use paper_tables::udink::gains::Gains;
use paper_tables::udink::{Cell, Changed, Comparison, ConstantGain, Contrast, LargerP, Study};

use super::udink_sentences as sentences;
use crate::look::{Look, Side, table, table_text};
use crate::numbers;

/// The text, complete.
pub(crate) fn text(study: &Study, look: Look) -> String {
    let mut text = format!(
        "{}\n",
        look.heading("A. J. Udink ten Cate, WP-85-54, IIASA, 1985: tables 1 to 4")
    );
    let lead = format!(
        "The printed figures against {} runs, each with another noise realisation: median and 5 to 95 % range, by Euler's rule and by the \
         exact step; * marks a printed figure outside.",
        study.runs
    );
    text += &look.paragraph("  ", &lead);
    text += &cells(study, look);
    text += &summary(study, look);
    text += &format!(
        "{}\n",
        look.heading("Assumed, as the paper does not print it")
    );
    for sentence in &study.assumptions {
        text += &look.paragraph("  - ", sentence);
    }
    text.push('\n');
    let checked = format!("Its own bounds on c^: {}.", study.filter_bounds);
    text += &look.paragraph("  ", &checked);
    text.push('\n');
    text + &contrasts(&study.contrasts, look)
        + &power(&study.power, look)
        + &constant_gains(&study.constant_gains, look)
        + &larger_p(&study.larger_p, look)
        + &gains(&study.gains, look)
}

fn cells(study: &Study, look: Look) -> String {
    let heading = ["", "paper", "Euler", "5 to 95 % ", "exact", "5 to 95 % "];
    let mut rows = Vec::new();
    let mut last = 0;
    for (euler, exact) in study.euler.tables.iter().zip(&study.exact.tables) {
        if euler.table != last {
            last = euler.table;
            let mut first = heading.map(|name| look.faint(name));
            first[0] = look.strong(format!("Table {last}"));
            rows.push(first.to_vec());
        }
        let mut row = vec![format!("  {}", euler.cell), printed(euler)];
        row.extend(of_rule(euler, look));
        row.extend(of_rule(exact, look));
        rows.push(row);
    }
    let [left, right] = [Side::Left, Side::Right];
    let mut text = String::new();
    let sides = [left, right, right, right, right, right];
    for line in table(&sides, &rows) {
        if line.contains("Table ") {
            text.push('\n');
        }
        text += &format!("{line}\n");
    }
    text.push('\n');
    text
}

fn of_rule(cell: &Cell, look: Look) -> [String; 2] {
    let mark = if cell.inside {
        " ".to_owned()
    } else {
        look.warning("*")
    };
    [figure(cell.median), sentences::range(cell, " .. ") + &mark]
}

/// The printed figure with the decimals of the paper.
fn printed(cell: &Cell) -> String {
    format!("{:.*}", cell.decimals, cell.paper)
}

/// A number with three digits, four from 100 on.
fn figure(value: f64) -> String {
    numbers::significant(value, if value.abs() >= 100.0 { 4 } else { 3 })
}

fn summary(study: &Study, look: Look) -> String {
    let mut text = format!(
        "{}\n",
        look.strong(format!("Against the paper: {}", sentences::verdict(study)))
    );
    text += &look.paragraph("  ", &sentences::beside_the_verdict(study));
    for (name, comparison) in [
        ("Euler's rule", &study.euler),
        ("the exact step", &study.exact),
    ] {
        let Comparison {
            inside, of, failed, ..
        } = comparison;
        let lost = match failed {
            0 => "no run failed".to_owned(),
            1 => "1 run failed".to_owned(),
            lost => format!("{lost} runs failed"),
        };
        text += &look.paragraph(
            "  ",
            &format!("{name}: {inside} of {of} cells inside; {lost}"),
        );
        for cell in &comparison.outside {
            let line = format!("table {}, {}: {}", cell.table, cell.cell, cell.why);
            text += &look.paragraph("    - ", &line);
        }
    }
    text.push('\n');
    text
}

fn contrasts(contrasts: &[Contrast], look: Look) -> String {
    let mut text = format!("{}\n", look.heading(sentences::CONTRASTS));
    text += &look.paragraph("  ", sentences::CONTRASTS_MEANING);
    let [left, right] = [Side::Left, Side::Right];
    for contrast in contrasts {
        let [first, second] = contrast.between;
        let mut rows = vec![
            [
                look.strong(format!("Table {second} - {first}")),
                look.faint("paper"),
                look.faint("median"),
                look.faint("5 to 95 % "),
            ]
            .to_vec(),
        ];
        for cell in &contrast.cells {
            let mut row = vec![format!("  {}", cell.cell), printed(cell)];
            row.extend(of_rule(cell, look));
            rows.push(row);
        }
        text.push('\n');
        for line in table(&[left, right, right, right], &rows) {
            text += &format!("{line}\n");
        }
        text += &look.paragraph("  ", &sentences::contrast(contrast));
    }
    text.push('\n');
    text
}

fn power(changed: &[Changed], look: Look) -> String {
    let mut text = format!("{}\n", look.heading(sentences::OTHER_SETTINGS));
    text += &look.paragraph("  ", &sentences::other_settings(changed));
    let mut rows = vec![
        ["other setting", "cells inside", "lost", "noticed"]
            .map(|name| look.faint(name))
            .to_vec(),
    ];
    for changed in changed {
        let noticed = if changed.noticed {
            "yes".to_owned()
        } else {
            look.warning("no")
        };
        rows.push(vec![
            changed.setting.to_owned(),
            format!("{} of {}", changed.inside, changed.of),
            changed.failed.to_string(),
            noticed,
        ]);
    }
    text += &table_text(&[Side::Left, Side::Right, Side::Right, Side::Right], &rows);
    text.push('\n');
    text
}

fn constant_gains(gains: &[ConstantGain], look: Look) -> String {
    let heading = [
        "gain", "rule", "E250", "E500", "E750", "E1000", "K avg", "tau avg",
    ];
    let mut rows = vec![heading.map(|name| look.faint(name)).to_vec()];
    for gain in gains {
        let mut row = vec![gain.gain.to_owned(), gain.rule.name().to_owned()];
        row.extend(gain.criterion.map(figure));
        row.extend([gain.gain_average, gain.time_constant_average].map(figure));
        rows.push(row);
    }
    let [left, right] = [Side::Left, Side::Right];
    let sides = [left, left, right, right, right, right, right, right];
    let mut text = format!("{}\n", look.heading(sentences::CONSTANT_GAINS));
    text += &table_text(&sides, &rows);
    text.push('\n');
    text
}

fn larger_p(rows: &[LargerP], look: Look) -> String {
    let heading = [
        "P(0)",
        "Euler lost",
        "exact lost",
        "Euler E1000",
        "exact E1000",
    ];
    let mut lines = vec![heading.map(|name| look.faint(name)).to_vec()];
    for row in rows {
        let lost = |count: usize| {
            let text = format!("{count} of {}", row.runs);
            if count > 0 { look.warning(text) } else { text }
        };
        lines.push(vec![
            format!("x {}", sentences::factor(row)),
            lost(row.euler_failed),
            lost(row.exact_failed),
            figure(row.euler_criterion),
            figure(row.exact_criterion),
        ]);
    }
    let title = "Table 1 with larger P(0): runs lost, and the median of the criterion";
    let mut text = format!("{}\n", look.heading(title));
    text += &table_text(&[Side::Right; 5], &lines);
    text.push('\n');
    text
}

fn gains(gains: &Gains, look: Look) -> String {
    let heading = [
        "gain",
        "rule",
        "c in",
        "end: a1, a2, b0",
        "error",
        "5 to 95 %",
        "lost",
    ];
    let mut lines = vec![heading.map(|name| look.faint(name)).to_vec()];
    for row in &gains.rows {
        let end = row.quiet_end.map_or("lost".to_owned(), |end| {
            end.map(|value| format!("{value:.3}")).join(", ")
        });
        let [low, high] = [row.noisy_q05, row.noisy_q95].map(|q| numbers::significant(q, 2));
        let range = match row.noisy_error.is_finite() {
            true => format!("{low} .. {high}"),
            false => "-".to_owned(),
        };
        lines.push(vec![
            row.variant.gain.name().to_owned(),
            row.variant.rule.name().to_owned(),
            row.variant.bounds.name().to_owned(),
            end,
            numbers::significant(row.noisy_error, 2),
            range,
            row.noisy_failed.to_string(),
        ]);
    }
    let sides = [
        Side::Left,
        Side::Left,
        Side::Left,
        Side::Left,
        Side::Right,
        Side::Right,
        Side::Right,
    ];
    let mut text = format!(
        "{}\n",
        look.heading("Three gains on one experiment of second order")
    );
    text += &table_text(&sides, &lines);
    let note = format!(
        "The truth is 1, 1, 1. End: the estimates without noise, at 2000 s. Error: with 1 % of noise, of the worst parameter, mean over the last \
         quarter of 1000 s; median of {} noises. The block-diagonal gain of the paper ends elsewhere without noise, which its theorem \
         excludes; with bounds on c it does not.",
        gains.noises
    );
    text += &look.paragraph("  ", &note);
    for checked in &gains.checked {
        let line = format!("{} bounds: {}.", checked.bounds.name(), checked.says);
        text += &look.paragraph("  ", &line);
    }
    text
}
