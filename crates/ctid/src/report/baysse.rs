//! The page of `ctid tables baysse`.

use paper_tables::baysse::{Cell, Study, TRUTH};

use super::figures::{self, Colour, Curve, Figure, Panel, Values};
use super::page::{self, NOTICES, Page, figure, items, large, section};
use super::tables::table;
use super::text::{escape, significant};
use crate::tables::baysse_text::{band, figure_of, notes, printed, printed_inside_bands};

/// The page as a complete HTML file. The same study gives the same bytes.
pub fn html(study: &Study) -> String {
    let body: String = [
        headline(study),
        "<main>".to_owned(),
        figure_three(),
        cells(study, 1, "Table I: the simulated loop"),
        clouds(),
        iterations(),
        cells(study, 2, "Table II: the rig, emulated"),
        misprints(study),
        page::footer(""),
    ]
    .concat();
    let figures = [
        figure_three_figure(study),
        clouds_figure(study),
        closer_figure(study),
        iterations_figure(study),
    ];
    page::html(&Page {
        title: "ctid: tables I and II of Baysse, Carrillo, Habbadi",
        body: &body,
        data: &figures::json(&figures),
        script: figures::SCRIPT,
    })
}

fn headline(study: &Study) -> String {
    let outside: Vec<String> = study
        .outside()
        .map(|cell| format!("Outside: {}, {}.", cell.cell, figure_of(cell)))
        .collect();
    let outside: String = outside
        .iter()
        .map(|sentence| format!("<p class=\"notice\">{}</p>\n", escape(sentence)))
        .collect();
    let time_by = |method: &str, label: &str| {
        let cell = study
            .tables
            .iter()
            .find(|cell| cell.method == method && cell.of == "mean tau");
        let mean = cell.map_or(String::new(), |cell| significant(cell.mean, 4));
        large(&mean, "s", label, "")
    };
    format!(
        "<header>\n<p class=\"kicker\">ctid report · A. Baysse, F. J. Carrillo, A. Habbadi: output error in closed loop</p>\n\
         <h1>Tables I and II: {} of {} figures of the runs inside the bands</h1>\n\
         <div class=\"verdict\"><p>A tank level in a loop, identified by least squares, by instruments, and by output error of the loop itself. \
         {} runs of each table, each with another noise realisation.</p></div>\n\
         <ol class=\"trail apart\">\n\
         {}{}{}</ol>\n{outside}\
         <ul>\n{}</ul>\n\
         <details><summary>What the paper does not print, and is assumed</summary><ul>\n{}</ul></details>\n{NOTICES}</header>\n",
        study.inside,
        study.of,
        study.runs,
        time_by("LS", "time constant by least squares"),
        time_by("IV", "by instruments"),
        time_by(
            "F-CLOE delta",
            &format!("by closed-loop output error; the truth is {} s", TRUTH[1])
        ),
        items(
            [printed_inside_bands(study)]
                .into_iter()
                .chain(notes(study))
        ),
        items(&study.assumptions),
    )
}

fn figure_three() -> String {
    section(
        "figure-3",
        "Figure 3, drawn again",
        "The emulated rig, the first noise realisation. Each estimate is put into the loop, which is then simulated from the set point alone.",
        &figure("outputs", "Output measured and simulated", ""),
    )
}

fn cells(study: &Study, number: usize, title: &str) -> String {
    let rows: String = study
        .tables
        .iter()
        .filter(|cell| cell.table == number)
        .map(row)
        .collect();
    let table = table(
        "Paper and runs",
        "<tr><th scope=\"col\">Method</th><th scope=\"col\">Of</th><th scope=\"col\" class=\"number\">Paper</th>\
         <th scope=\"col\" class=\"number\">Here</th><th scope=\"col\" class=\"number\">Std. dev.</th>\
         <th scope=\"col\" class=\"number\">Band</th><th scope=\"col\"></th></tr>",
        &rows,
        "The standard deviation is that of the figure from one such set of runs to the next. Without a band: beside the paper for comparison only.",
    );
    section(&format!("table-{number}"), title, "", &table)
}

fn row(cell: &Cell) -> String {
    let (class, word) = match cell.inside {
        Some(true) => ("", "inside"),
        Some(false) => (" class=\"chosen\"", "outside"),
        None => ("", ""),
    };
    let word = match cell.paper_outside {
        Some(off) if off > 0.0 => format!("{word}; the paper's is outside"),
        _ => word.to_string(),
    };
    let numbers = [
        printed(cell),
        figure_of(cell),
        crate::numbers::significant(cell.sd, 2),
        escape(&band(cell, " to ")),
    ]
    .map(|number| format!("<td class=\"number\">{number}</td>"))
    .concat();
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td>{numbers}<td{class}>{word}</td></tr>\n",
        escape(cell.method),
        cell.of
    )
}

fn clouds() -> String {
    section(
        "clouds",
        "All runs of table I",
        "One point for each run; the dashed line is the true time constant.",
        &format!(
            "<div class=\"pairs\">\n{}{}</div>\n",
            figure("clouds", "Least squares, instruments, output error", ""),
            figure("closer", "Output error alone", "")
        ),
    )
}

fn iterations() -> String {
    section(
        "iterations",
        "Iterations",
        "Number of runs against the iterations until no parameter changes by more than 1 %. With mu I the normalisation saves iterations; with mu diag(J″) it changes nothing.",
        &figure("iterations", "Table I", ""),
    )
}

fn misprints(study: &Study) -> String {
    let misprints = items(&study.misprints);
    section(
        "misprints",
        "Probable misprints of the paper",
        "",
        &format!("<ul>\n{misprints}</ul>\n"),
    )
}

fn figure_three_figure(study: &Study) -> Figure {
    let shown = &study.second.figure;
    let line = |name: &str, colour, values: &[f64]| {
        Curve::line(name, 0, colour, (&shown.time, values)).named()
    };
    let curves = vec![
        Curve {
            held: true,
            width: 1.0,
            ..line("set point", Colour::Named("faint"), &shown.reference)
        },
        line("by instruments", Colour::Of(3), &shown.instruments).dashed("dash"),
        line("measured", Colour::Named("measured"), &shown.measured),
        line("by output error", Colour::Of(1), &shown.output_error),
    ];
    Figure::over_time("outputs", 420, vec![Panel::new("level", "cm")], curves)
}

/// The runs as points: K across, tau (s) upwards.
fn cloud(name: &str, colour: usize, marker: &'static str, runs: &[[f64; 2]]) -> Curve {
    Curve {
        marker: Some(marker),
        x: runs.iter().map(|run| run[0]).collect(),
        y: Values::Numbers(runs.iter().map(|run| run[1]).collect()),
        ..Curve::line(name, 0, Colour::Of(colour), (&[], &[]))
    }
    .named()
}

fn truth() -> Curve {
    Curve {
        colour: Colour::Named("text"),
        ..cloud("truth", 0, "cross", &[TRUTH])
    }
}

fn cloud_figure(id: &str, curves: Vec<Curve>) -> Figure {
    Figure {
        x_title: "K",
        x_unit: String::new(),
        ..Figure::over_time(
            id,
            420,
            vec![Panel {
                lines: vec![TRUTH[1]],
                ..Panel::new("tau", "s")
            }],
            curves,
        )
    }
}

fn clouds_figure(study: &Study) -> Figure {
    let first = &study.first;
    let curves = vec![
        cloud("LS", 0, "diamond", &first.least_squares),
        cloud("IV", 3, "square", &first.instruments),
        cloud("F-CLOE", 1, "circle", &first.normalised),
        truth(),
    ];
    cloud_figure("clouds", curves)
}

fn closer_figure(study: &Study) -> Figure {
    let curves = vec![
        cloud("F-CLOE", 1, "circle", &study.first.normalised),
        truth(),
    ];
    cloud_figure("closer", curves)
}

fn iterations_figure(study: &Study) -> Figure {
    let counts = &study.first.iterations;
    let series = [
        ("theta, mu I", &counts.plain, Colour::Of(0), "circle"),
        ("delta, mu I", &counts.normalised, Colour::Of(1), "square"),
        (
            "theta, mu diag",
            &counts.plain_diagonal,
            Colour::Of(2),
            "diamond",
        ),
        (
            "delta, mu diag",
            &counts.normalised_diagonal,
            Colour::Of(3),
            "x",
        ),
    ];
    let curves = series.map(|(name, counts, colour, marker)| {
        let number = |step: usize| counts.iter().filter(|count| **count == step).count();
        let most = counts.iter().copied().max().unwrap_or_default();
        let (x, y) = (1..=most)
            .map(|step| (step as f64, number(step) as f64))
            .filter(|(_, number)| *number > 0.0)
            .unzip();
        Curve {
            marker: Some(marker),
            x,
            y: Values::Numbers(y),
            ..Curve::line(name, 0, colour, (&[], &[]))
        }
        .named()
    });
    Figure {
        x_title: "iterations",
        x_unit: String::new(),
        ..Figure::over_time(
            "iterations",
            300,
            vec![Panel::new("runs", "")],
            curves.into(),
        )
    }
}
