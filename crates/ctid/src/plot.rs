//! A small plot for the terminal, drawn in braille dots.

use console::{Color, Style};
use ct_signals::range_of;
use textplots::{Chart, Plot, Shape};

use crate::look::Look;
use crate::numbers;

/// Dots in a character cell.
const ACROSS: usize = 2;
const DOWN: usize = 4;
/// The cell without dots; the dots of a cell are the bits above it.
const BLANK: u32 = 0x2800;

/// Colour of measured values.
pub(crate) const MEASURED: Color = Color::Cyan;
/// Colour of the model's output.
pub(crate) const MODEL: Color = Color::Yellow;
/// Colour of the residual.
pub(crate) const RESIDUAL: Color = Color::Magenta;

/// A line through points; with more points than dots it becomes a band.
pub(crate) struct Curve<'a> {
    pub values: &'a [f64],
    pub colour: Color,
}

/// The abscissa of curves.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Axis<'a> {
    /// Values at even distances between these instants \[s\].
    Even(f64, f64),
    /// The instants of a record \[s\]; labelled from its begin.
    Times(&'a [f64]),
}

impl Axis<'_> {
    /// The first and last label \[s\].
    fn ends(self) -> (f64, f64) {
        match self {
            Self::Even(from, to) => (from, to),
            Self::Times([first, .., last]) => (0.0, last - first),
            Self::Times(_) => (0.0, 0.0),
        }
    }

    /// Place of a value among `count`, as a share of the width.
    fn place(self, k: usize, count: usize) -> f64 {
        match self {
            Self::Times(times) if times.len() == count && count > 1 => {
                (times[k] - times[0]) / (times[count - 1] - times[0])
            }
            _ => k as f64 / count.saturating_sub(1).max(1) as f64,
        }
    }
}

/// Draws curves with a common abscissa; `rows` lines high, within the width, with the ordinate's limits at the left and the ends of the
/// abscissa below.
pub(crate) fn plot(curves: &[Curve], x: Axis, y: (f64, f64), rows: usize, look: Look) -> String {
    let labels = [y.1, y.0].map(|limit| numbers::significant(limit, 3));
    let margin = labels
        .iter()
        .map(|label| label.chars().count())
        .max()
        .unwrap_or(0)
        .max(6)
        + 2;
    let columns = look.width.saturating_sub(margin + 3).max(20);
    // The canvas has one more dot than requested, in both directions.
    let (width, height) = (columns * ACROSS - 1, rows * DOWN - 1);
    // A flat curve still needs a scale.
    let (low, high) = if y.1 > y.0 { y } else { (y.0 - 1.0, y.0 + 1.0) };

    let mut cells = vec![vec![(BLANK, None); columns]; rows];
    for curve in curves {
        let points = points((curve.values, x), width, (low, high));
        for (row, line) in drawn(&points, width, height).lines().enumerate() {
            for (column, cell) in line.chars().enumerate() {
                let dots = u32::from(cell).saturating_sub(BLANK);
                // A later curve covers an earlier one.
                if dots > 0
                    && let Some(cell) = cells.get_mut(row).and_then(|row| row.get_mut(column))
                {
                    *cell = (cell.0 | dots, Some(curve.colour));
                }
            }
        }
    }

    let mut text = String::new();
    for (row, cells) in cells.iter().enumerate() {
        let label = match row {
            0 => labels[0].as_str(),
            last if last + 1 == rows => labels[1].as_str(),
            _ => "",
        };
        let line = coloured(cells, look);
        text += &format!("{} {line}\n", look.faint(format!("{label:>margin$} │")));
    }
    let (from, to) = x.ends();
    let (from, to) = (numbers::duration(from), numbers::duration(to));
    let gap = columns.saturating_sub(from.chars().count() + to.chars().count());
    let ticks = format!(
        "{}{from}{}{to}",
        " ".repeat(margin + 3),
        " ".repeat(gap.max(1))
    );
    text + &look.faint(ticks) + "\n"
}

/// A plot of measured values, if there are any, and of the model's output.
pub(crate) fn overlay(measured: &[f64], model: &[f64], x: Axis, look: Look) -> String {
    let curves = [(measured, MEASURED), (model, MODEL)];
    let curves = curves.map(|(values, colour)| Curve { values, colour });
    plot(&curves, x, limits([measured, model]), 9, look)
}

/// A curve in braille, its corner at the lower left.
fn drawn(points: &[(f32, f32)], width: usize, height: usize) -> String {
    let shape = Shape::Lines(points);
    let mut chart =
        Chart::new_with_y_range(width as u32, height as u32, 0.0, width as f32, 0.0, 1.0);
    let chart = chart.lineplot(&shape);
    chart.figures();
    chart.frame()
}

/// A line of cells; neighbours of the same colour share their escape codes.
fn coloured(cells: &[(u32, Option<Color>)], look: Look) -> String {
    let mut line = String::new();
    let drawn = cells.iter().rposition(|(dots, _)| *dots != BLANK);
    for run in cells[..drawn.map_or(0, |last| last + 1)].chunk_by(|a, b| a.1 == b.1) {
        let dots: String = run
            .iter()
            .filter_map(|(dots, _)| char::from_u32(*dots))
            .collect();
        match run.first().and_then(|(_, colour)| *colour) {
            Some(colour) => line += &look.paint(Style::new().fg(colour), dots),
            None => line += &dots,
        }
    }
    line
}

/// Points in dots across and shares of the height; for several values in one dot the smallest and the largest.
fn points((values, x): (&[f64], Axis), width: usize, (low, high): (f64, f64)) -> Vec<(f32, f32)> {
    let at = |k: usize| x.place(k, values.len()) * width as f64;
    let height = |value: f64| ((value - low) / (high - low)).clamp(0.0, 1.0) as f32;
    let finite = || {
        values
            .iter()
            .enumerate()
            .filter(|(_, value)| value.is_finite())
    };
    if values.len() <= 2 * width {
        return finite()
            .map(|(k, &value)| (at(k) as f32, height(value)))
            .collect();
    }
    let mut bands: Vec<Option<(f64, f64)>> = vec![None; width + 1];
    for (k, &value) in finite() {
        let band = &mut bands[(at(k).round() as usize).min(width)];
        *band = Some(band.map_or((value, value), |(least, most)| {
            (least.min(value), most.max(value))
        }));
    }
    bands
        .iter()
        .enumerate()
        .filter_map(|(dot, band)| band.map(|band| (dot as f32, band)))
        .flat_map(|(dot, (least, most))| [(dot, height(least)), (dot, height(most))])
        .collect()
}

/// Smallest and largest of all finite values.
pub(crate) fn limits<'a>(series: impl IntoIterator<Item = &'a [f64]>) -> (f64, f64) {
    let all = series
        .into_iter()
        .flatten()
        .filter(|value| value.is_finite());
    let (low, high) = range_of(all);
    if low <= high { (low, high) } else { (0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(values: &[f64], width: usize) -> Vec<String> {
        let curve = Curve {
            values,
            colour: MODEL,
        };
        let look = Look {
            colour: false,
            width,
        };
        let text = plot(&[curve], Axis::Even(0.0, 600.0), limits([values]), 5, look);
        text.lines().map(str::to_string).collect()
    }

    #[test]
    fn it_fits_the_width_whatever_the_data() {
        let wave = |n: usize| (0..n).map(|k| (k as f64 / 9.0).sin()).collect::<Vec<_>>();
        for values in [
            wave(50),
            wave(5000),
            vec![3.0; 40],
            vec![f64::NAN; 9],
            vec![1e9, -1e-9],
            vec![],
            vec![1.0],
        ] {
            for width in [48, 80, 100] {
                let lines = lines(&values, width);
                assert_eq!(lines.len(), 6);
                assert!(
                    lines.iter().all(|line| line.chars().count() <= width),
                    "{lines:#?}"
                );
            }
        }
    }

    #[test]
    fn a_rise_runs_from_the_lower_left_to_the_upper_right() {
        let rise: Vec<f64> = (0..=100).map(f64::from).collect();
        let lines = lines(&rise, 80);
        let blank = |c: char| c == ' ' || c == '\u{2800}';
        let (first, last) = (&lines[0], &lines[4]);
        assert!(first.contains("100 │") && last.contains("0 │"));
        assert!(
            last.split('│')
                .next_back()
                .unwrap()
                .trim_start()
                .chars()
                .next()
                .is_some_and(|c| !blank(c))
        );
        assert!(!blank(
            first.trim_end_matches(blank).chars().next_back().unwrap()
        ));
    }

    #[test]
    fn values_stand_at_their_instants() {
        // A record of which the middle is missing: nothing stands there, and the last value stays at the end.
        let times: Vec<f64> = (0..50).chain(150..200).map(f64::from).collect();
        let place = |k| Axis::Times(&times).place(k, times.len());
        assert!((place(50) - 150.0 / 199.0).abs() < 1e-12);
        assert_eq!((place(0), place(99)), (0.0, 1.0));
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let drawn = points((&values, Axis::Times(&times)), 400, (0.0, 99.0));
        assert!(drawn.iter().all(|(x, _)| *x < 100.0 || *x > 300.0));
    }
}
