//! The figures on the page of `ctid tables udink`.

use paper_tables::udink::gains::{GainKind, Gains, Limits, TRUTH};
use paper_tables::udink::{Cell, Comparison, Rule, Study};

use super::super::figures::{Colour, Curve, Figure, Panel, Values};

/// All figures, in the order of the page.
pub(super) fn all_figures(study: &Study) -> Vec<Figure> {
    let mut all = vec![responses_figure(study)];
    all.extend(
        table_numbers(study)
            .into_iter()
            .map(|n| cells_figure(study, n)),
    );
    all.extend([
        counterexample_figure(&study.gains),
        gains_figure(&study.gains),
    ]);
    all
}

/// Numbers of the tables.
pub(super) fn table_numbers(study: &Study) -> Vec<usize> {
    let mut numbers: Vec<usize> = study.euler.tables.iter().map(|cell| cell.table).collect();
    numbers.dedup();
    numbers
}

fn responses_figure(study: &Study) -> Figure {
    let shown = &study.figure;
    let panels = [
        ("y", "", None),
        ("K^", "", Some(study.settings.gain)),
        ("tau^", "s", Some(study.settings.time_constant)),
        ("c^", "s", None),
        ("E", "s", None),
    ]
    .map(|(title, unit, truth)| Panel {
        lines: truth.into_iter().collect(),
        ..Panel::new(title, unit)
    });
    let curves = [
        ("disturbed output y", &shown.y, Colour::Named("measured")),
        ("K^", &shown.gain, Colour::Of(1)),
        ("tau^", &shown.time_constant, Colour::Of(0)),
        ("c^", &shown.filter, Colour::Of(2)),
        ("criterion", &shown.criterion, Colour::Of(3)),
    ];
    let curves = curves
        .into_iter()
        .enumerate()
        .map(|(panel, (name, values, colour))| {
            Curve::line(name, panel, colour, (&shown.time, values))
        });
    Figure::over_time("responses", 820, panels.into(), curves.collect())
}

fn cells_figure(study: &Study, number: usize) -> Figure {
    let curve = |name: &str, comparison: &Comparison, colour, marker| {
        let cells: Vec<&Cell> = comparison
            .tables
            .iter()
            .filter(|cell| cell.table == number)
            .collect();
        let shares: Vec<f64> = cells.iter().map(|cell| 100.0 * cell.below).collect();
        Curve {
            marker: Some(marker),
            y: Values::Names(cells.iter().map(|cell| cell.cell).collect()),
            x: shares,
            ..Curve::line(name, 0, colour, (&[], &[]))
        }
        .named()
    };
    let curves = vec![
        curve("Euler", &study.euler, Colour::Of(0), "circle"),
        curve("exact", &study.exact, Colour::Of(1), "diamond"),
    ];
    let count = curves
        .iter()
        .map(|curve| curve.x.len())
        .max()
        .unwrap_or_default();
    Figure {
        x_title: "runs below the printed figure",
        x_unit: "%".to_owned(),
        x_range: Some([-3.0, 103.0]),
        x_band: Some([5.0, 95.0]),
        categories: true,
        ..Figure::over_time(
            &format!("cells-{number}"),
            90 + 21 * count as u32,
            vec![Panel::new("", "")],
            curves,
        )
    }
}

/// Colour and dash of a gain, the same in both figures.
fn look(kind: GainKind) -> (Colour, &'static str) {
    match kind {
        GainKind::BlockDiagonal => (Colour::Of(0), "solid"),
        GainKind::Full => (Colour::Of(1), "dash"),
        GainKind::Constant => (Colour::Of(2), "dot"),
    }
}

fn counterexample_figure(gains: &Gains) -> Figure {
    let panels = [("a1", "s"), ("a2", "s^2"), ("b0", "")]
        .into_iter()
        .zip(TRUTH)
        .map(|((name, unit), truth)| Panel {
            lines: vec![truth],
            ..Panel::new(name, unit)
        });
    let panels: Vec<Panel> = panels.chain([Panel::new("V", "")]).collect();
    let mut curves = Vec::new();
    for found in &gains.counterexample {
        let (colour, dash) = look(found.gain);
        let values = found.theta.iter().chain([&found.lyapunov]);
        for (panel, values) in values.enumerate() {
            let curve = Curve::line(found.gain.name(), panel, colour, (&found.time, values));
            let curve = curve.dashed(dash);
            curves.push(if panel == 0 { curve.named() } else { curve });
        }
    }
    Figure::over_time("counterexample", 660, panels, curves)
}

/// Errors over time, a panel for each set of bounds; lines of Euler's rule are thin.
fn gains_figure(gains: &Gains) -> Figure {
    let titles = [
        "error, no bounds",
        "error, wide bounds",
        "error, sure bounds",
    ];
    let panels = titles.map(|title| Panel {
        log: true,
        range: Some([-2.3, 1.3]),
        ..Panel::new(title, "")
    });
    let curves = gains.rows.iter().map(|row| {
        let (colour, dash) = look(row.variant.gain);
        let exact = row.variant.rule == Rule::Exact;
        let name = format!("{}, {}", row.variant.gain.name(), row.variant.rule.name());
        let panel = row.variant.bounds as usize;
        let data = (&row.curve.time[..], &row.curve.values[..]);
        let curve = Curve {
            width: if exact { 2.2 } else { 1.0 },
            legend: row.variant.bounds == Limits::None,
            ..Curve::line(&name, panel, colour, data)
        };
        curve.dashed(if exact { "solid" } else { dash })
    });
    Figure::over_time("gains", 760, panels.into(), curves.collect())
}
