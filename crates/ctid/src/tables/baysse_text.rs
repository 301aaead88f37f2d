//! What `ctid tables baysse` prints.

use paper_tables::baysse::{Cell, Study};

use crate::look::{Look, Side, table};
use crate::numbers;
use crate::plot::{self, Axis, Curve, plot};

/// The text, complete.
pub(crate) fn text(study: &Study, look: Look) -> String {
    let title =
        "A. Baysse, F. J. Carrillo, A. Habbadi, identification in closed loop: tables I and II";
    let mut text = format!("{}\n", look.heading(title));
    let lead = format!(
        "The printed figures compared with {} runs, each with another noise realisation. The band is where the figure of the runs has to be; * marks one outside. \
         + a printed figure outside the same band, which then is that of a reproduction and not of the paper. The standard deviation is that of the figure from one such set of runs to the next.",
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
            "Probable misprints of the paper",
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
            printed(cell) + paper_mark(cell),
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

/// The printed figure as the paper prints it, numbers below 0.01 in powers of ten.
pub(crate) fn printed(cell: &Cell) -> String {
    match cell.paper {
        Some(paper) if paper < SMALL => format!("{paper:.2e}"),
        Some(paper) => format!("{paper:.*}", cell.decimals),
        None => "-".to_owned(),
    }
}

/// The mark of a printed figure outside the band.
pub(crate) fn paper_mark(cell: &Cell) -> &'static str {
    match cell.paper_outside {
        Some(off) if off > 0.0 => "+",
        _ => " ",
    }
}

/// Number of printed figures inside the bands, and the others by name.
pub(crate) fn printed_inside_bands(study: &Study) -> String {
    let of = study.printed().count();
    let outside: Vec<String> = study
        .printed()
        .filter(|(_, off)| *off > 0.0)
        .map(|(cell, off)| {
            let share = numbers::significant(100.0 * off, 2);
            format!(
                "{} {} (by {share} % of the band's width)",
                cell.cell,
                printed(cell)
            )
        })
        .collect();
    let inside = of - outside.len();
    let mut sentence =
        format!("Of the {of} printed figures that have a band {inside} lie inside it");
    if !outside.is_empty() {
        sentence += &format!(
            "; outside are {}: the paper used other noise realisations, and its bands are unknown",
            outside.join(", ")
        );
    }
    sentence + "."
}

/// Numbers below this are written as powers of ten.
const SMALL: f64 = 0.01;

/// The figure of the runs, to the second digit of its standard deviation.
pub(crate) fn figure_of(cell: &Cell) -> String {
    if cell.mean.abs() < SMALL {
        return format!("{:.2e}", cell.mean);
    }
    let places = 1 - numbers::exponent(cell.sd);
    numbers::decimals(cell.mean, places.min(MOST_DECIMALS))
}

/// Largest number of decimals, however small the standard deviation is.
const MOST_DECIMALS: i32 = 4;

/// The ends of the band, `> 7.5` where it is open above; empty without a band.
pub(crate) fn band(cell: &Cell, between: &str) -> String {
    match cell.band {
        None => String::new(),
        Some([low, high]) if high.is_infinite() => format!("> {low}"),
        Some([low, high]) => {
            let places = 1 - numbers::exponent(high - low);
            let end = |end: f64| match end.abs() < SMALL {
                true => format!("{end:.1e}"),
                false => short(&numbers::decimals(end, places)),
            };
            format!("{}{between}{}", end(low), end(high))
        }
    }
}

/// A number without trailing zeros of its decimals.
fn short(number: &str) -> String {
    match number.contains('.') {
        true => number
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned(),
        false => number.to_owned(),
    }
}

fn summary(study: &Study, look: Look) -> String {
    let Study { inside, of, .. } = study;
    let verdict = look.strong(format!(
        "{inside} of {of} figures of the runs inside the bands"
    ));
    let mut text = format!("{verdict}\n");
    text += &look.paragraph("  ", &printed_inside_bands(study));
    for cell in study.outside() {
        let line = format!("table {}, {}: {}", cell.table, cell.cell, figure_of(cell));
        text += &look.paragraph("    - ", &line);
    }
    for sentence in notes(study) {
        text += &look.paragraph("  ", &sentence);
    }
    text
}

/// Sentences on results that the cells do not show: iterations, the tangent, the printed controller, figures that are not reproduced.
pub(crate) fn notes(study: &Study) -> Vec<String> {
    let mean = |counts: &[usize]| {
        let mean = counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64;
        numbers::decimals(mean, 2)
    };
    let counts = &study.first.iterations;
    let [gain, tau] = study.second.tangent;
    let cell = |method: &str, of: &str| {
        let mut cells = study.tables.iter();
        cells.find(|cell| cell.method == method && cell.of == of)
    };
    let printed = |of: &str| cell("Ki = 0.074", of).map_or(String::new(), figure_of);
    let (printed_k, printed_tau) = (printed("K"), printed("tau"));
    let tangent = [("K", gain), ("tau", tau)]
        .into_iter()
        .filter_map(|(of, truth)| Some((cell("F-CLOE theta", of)?, truth)));
    let (mut share, mut deviations) = (0.0_f64, 0.0_f64);
    for (cell, truth) in tangent {
        let off = (cell.mean - truth).abs();
        share = share.max(off / truth);
        deviations = deviations.max(off / cell.sd);
    }
    let beyond = match deviations > CHANCE {
        true => format!(
            "more than chance: up to {} standard deviations of its figures",
            numbers::significant(deviations, 2)
        ),
        false => "within chance".to_owned(),
    };
    let share = numbers::significant(100.0 * share, 1);
    let difference = match study.first.diagonal_difference {
        0.0 => "are the same to the last digit".to_owned(),
        share => format!(
            "differ by {} of themselves at most",
            numbers::significant(share, 1)
        ),
    };
    let mut notes = vec![
        format!(
            "With mu diag(J'') the estimates in theta and delta {difference}, and need {} and {} iterations.",
            mean(&counts.plain_diagonal),
            mean(&counts.normalised_diagonal),
        ),
        format!(
            "Table II took {} iterations in theta and {} in delta, from a start far from the minimum.",
            mean(&study.second.plain.iterations),
            mean(&study.second.normalised.iterations),
        ),
        format!(
            "The emulated tank has K = {gain:.3} and tau = {tau:.2} s at its operating point: with the sensor's filter in its model, the output \
             error estimates them to {share} %, {beyond}; instruments on raw levels estimate the secant gain, which depends on the pump's dead zone."
        ),
        format!(
            "With Ki = 0.074 as printed, in the rig and in the model, it finds K = {printed_k} and tau = {printed_tau} s: not what the paper prints."
        ),
    ];
    notes.extend(not_reproduced(study));
    notes
}

/// Figures without a band that differ from the printed ones by more than a factor of ten.
fn not_reproduced(study: &Study) -> Option<String> {
    let misses = |cell: &&Cell| {
        let ratio = cell.paper.map(|paper| cell.mean / paper);
        cell.band.is_none() && ratio.is_some_and(|ratio| !(1.0 / FAR..=FAR).contains(&ratio))
    };
    let sentence = |cell: &Cell| {
        let (paper, here) = (printed(cell), figure_of(cell));
        format!("{} ({paper} printed, {here} here)", cell.cell)
    };
    let missed: Vec<String> = study.tables.iter().filter(misses).map(sentence).collect();
    (!missed.is_empty()).then(|| {
        format!(
            "Not reproduced, and without a band: {}. They are not among the {} cells.",
            missed.join(", "),
            study.of
        )
    })
}

/// A ratio of more than this, or less than its inverse, is another order of magnitude.
const FAR: f64 = 10.0;

/// A difference above this number of standard deviations is significant.
const CHANCE: f64 = 3.0;

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
    format!(
        "\n{}\n{}",
        look.heading(
            "Figure 3: measured (cyan), by instruments (magenta), by output error (yellow) [cm]"
        ),
        plot(&curves, Axis::Times(&shown.time), limits, 9, look)
    )
}
