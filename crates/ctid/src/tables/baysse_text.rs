//! What `ctid tables baysse` prints.

use super::baysse::{Cell, Study};
use crate::look::{Look, Side, table};
use crate::numbers;
use crate::plot::{self, Curve, plot};

/// The whole of it.
#[must_use]
pub fn text(study: &Study, look: Look) -> String {
    let title =
        "A. Baysse, F. J. Carrillo, A. Habbadi, identification in closed loop: tables I and II";
    let mut text = format!("{}\n", look.heading(title));
    let lead = format!(
        "The printed figures beside {} runs, each with another noise. The band is where the figure of the runs has to be; * marks one outside. \
         The standard deviation is that of the figure from one such set of runs to the next.",
        study.runs
    );
    text += &look.paragraph("  ", &lead);
    text += &cells(study, look);
    text += &summary(study, look);
    text += &figure(study, look);
    for (title, sentences) in [
        (
            "Assumed, as the paper does not print it",
            study.assumptions.clone(),
        ),
        (
            "What cannot be as it is printed",
            study.misprints.iter().map(ToString::to_string).collect(),
        ),
    ] {
        text += &format!("\n{}\n", look.heading(title));
        for sentence in sentences {
            text += &look.paragraph("  - ", &sentence);
        }
    }
    text
}

fn cells(study: &Study, look: Look) -> String {
    let mut rows = Vec::new();
    let mut last = (0, "");
    for cell in &study.tables {
        if cell.table != last.0 {
            let heading = ["paper", "here", "std. dev.", "band"].map(|name| look.faint(name));
            let number = if cell.table == 1 { "I" } else { "II" };
            let mut row = vec![look.strong(format!("Table {number}")), String::new()];
            row.extend(heading);
            rows.push(row);
        }
        let name = if (cell.table, cell.method) == last {
            ""
        } else {
            cell.method
        };
        last = (cell.table, cell.method);
        let mark = match cell.inside {
            Some(false) => look.warning("*"),
            _ => " ".to_owned(),
        };
        rows.push(vec![
            format!("  {name}"),
            cell.of.to_owned(),
            printed(cell),
            figure_of(cell),
            numbers::significant(cell.sd, 2),
            band(cell, " .. ") + &mark,
        ]);
    }
    let [left, right] = [Side::Left, Side::Right];
    let mut text = String::new();
    for line in table(&[left, left, right, right, right, right], &rows) {
        if line.contains("Table ") {
            text.push('\n');
        }
        text += &format!("{line}\n");
    }
    text.push('\n');
    text
}

/// As the paper prints it, small numbers in powers of ten.
pub(crate) fn printed(cell: &Cell) -> String {
    match cell.paper {
        Some(paper) if paper < 0.01 => format!("{paper:.2e}"),
        Some(paper) => format!("{paper:.*}", cell.decimals),
        None => "-".to_owned(),
    }
}

/// To the second digit of its deviation.
pub(crate) fn figure_of(cell: &Cell) -> String {
    if cell.mean.abs() < 0.01 {
        return numbers::significant(cell.mean, 3);
    }
    numbers::value_and_error(cell.mean, Some(cell.sd)).0
}

/// Its ends, `> 7.5` where it is open, nothing without one.
pub(crate) fn band(cell: &Cell, between: &str) -> String {
    match cell.band {
        None => String::new(),
        Some([low, high]) if high.is_infinite() => format!("> {low}"),
        Some([low, high]) => {
            let digits = if low.abs() < 0.01 { 2 } else { 4 };
            let [low, high] = [low, high].map(|end| numbers::significant(end, digits));
            format!("{low}{between}{high}")
        }
    }
}

fn summary(study: &Study, look: Look) -> String {
    let Study { inside, of, .. } = study;
    let verdict = look.strong(format!("{inside} of {of} cells inside their bands"));
    let mut text = format!("{verdict}\n");
    for cell in study.outside() {
        let line = format!("table {}, {}: {}", cell.table, cell.cell, figure_of(cell));
        text += &look.paragraph("    - ", &line);
    }
    for sentence in notes(study) {
        text += &look.paragraph("  ", &sentence);
    }
    text
}

/// What the cells do not say.
pub(crate) fn notes(study: &Study) -> Vec<String> {
    let mean = |counts: &[usize]| {
        let mean = counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64;
        numbers::decimals(mean, 2)
    };
    let counts = &study.first.iterations;
    let [gain, tau] = study.second.tangent;
    let ended = study
        .second
        .ki_as_printed
        .iter()
        .filter(|run| run[0].is_finite());
    vec![
        format!(
            "With mu diag(J'') the estimates in theta and delta differ by {} of themselves at most, and need {} and {} iterations.",
            numbers::significant(study.first.diagonal_difference, 1),
            mean(&counts.plain_diagonal),
            mean(&counts.normalised_diagonal),
        ),
        format!(
            "Table II took {} iterations in theta and {} in delta, from a start that is far off.",
            mean(&study.second.plain.iterations),
            mean(&study.second.normalised.iterations),
        ),
        format!(
            "The emulated tank has K = {gain:.3} and tau = {tau:.2} s at its operating point: the output error finds them where it knows the sensor's filter, \
             instruments on raw levels find the secant, which a dead zone of the pump moves."
        ),
        format!(
            "With Ki = 0.074 as printed, {} of {} fits come to their end.",
            ended.count(),
            study.runs
        ),
    ]
}

fn figure(study: &Study, look: Look) -> String {
    let shown = &study.second.figure;
    let curves = [
        Curve {
            values: &shown.instruments,
            colour: plot::RESIDUAL,
        },
        Curve {
            values: &shown.measured,
            colour: plot::MEASURED,
        },
        Curve {
            values: &shown.output_error,
            colour: plot::MODEL,
        },
    ];
    let limits = plot::limits(curves.iter().map(|curve| curve.values));
    let (Some(first), Some(last)) = (shown.time.first(), shown.time.last()) else {
        return String::new();
    };
    format!(
        "\n{}\n{}",
        look.heading(
            "Figure 3: measured (cyan), by instruments (magenta), by output error (yellow) [cm]"
        ),
        plot(&curves, (0.0, last - first), limits, 9, look)
    )
}
