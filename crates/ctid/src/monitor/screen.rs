//! What a person sees on standard error: lines, and on a terminal a plot of the innovations below them.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::time::{Duration, Instant};

use ::monitor::{Estimate, Innovation, Monitor, Progress, instant};
use console::{Term, truncate_str};

use crate::look::Look;
use crate::numbers::{significant, value_and_error};
use crate::plot::{Curve, RESIDUAL, plot};

/// Innovations that are drawn.
const DRAWN: usize = 400;
/// The plot is drawn again after so long, where rows have come.
pub(super) const DRAWN_EVERY: Duration = Duration::from_millis(250);
/// Lines of the plot.
const ROWS: usize = 6;
/// The plot shows at least so many standard deviations.
const LEAST: f64 = 4.0;

pub(super) struct Screen {
    look: Look,
    /// Standard error, where it is a terminal.
    term: Option<Term>,
    /// Lines of the plot on the terminal now.
    drawn: usize,
    innovations: VecDeque<(f64, f64)>,
    residual: f64,
    unit: String,
    fresh: bool,
    last: Option<Instant>,
}

impl Screen {
    pub(super) fn new(look: Look) -> Self {
        let term = Term::stderr();
        Self {
            look,
            term: term.is_term().then_some(term),
            drawn: 0,
            innovations: VecDeque::with_capacity(DRAWN),
            residual: 0.0,
            unit: String::new(),
            fresh: false,
            last: None,
        }
    }

    /// The unit of the reading.
    pub(super) fn units(&mut self, output: &str) {
        self.unit = output.to_string();
    }

    /// A line; whoever has closed standard error does not miss it.
    pub(super) fn say(&mut self, text: &str) {
        self.clear();
        let _ = writeln!(io::stderr(), "{text}");
    }

    /// The sentence of an alarm.
    pub(super) fn warn(&mut self, time: f64, sentence: &str) {
        let text = format!("t = {} s: {sentence}", instant(time));
        let text = self.look.warning(text);
        self.say(&text);
    }

    pub(super) fn estimates(&mut self, time: f64, estimates: &[Estimate], progress: Progress) {
        let parameters: Vec<String> = estimates
            .iter()
            .filter(|estimate| estimate.half_width.is_some())
            .map(|estimate| {
                let (value, band) = value_and_error(estimate.value, estimate.half_width);
                let band = band.map_or(String::new(), |band| format!(" ± {band}"));
                format!("{} {value}{band} {}", estimate.name, estimate.unit)
                    .trim_end()
                    .to_string()
            })
            .collect();
        let state = match progress {
            Progress::Learning(_) => return,
            Progress::Watching { score, threshold } => {
                format!("fits (score {score:.1} of {threshold:.1})")
            }
            Progress::Alarmed { score, threshold } => {
                format!("does not fit (score {score:.1}, threshold {threshold:.1})")
            }
        };
        self.say(&format!(
            "t = {} s: {}; the model {state}",
            instant(time),
            parameters.join(", ")
        ));
    }

    pub(super) fn innovation(&mut self, time: f64, innovation: Innovation) {
        if self.term.is_none() {
            return;
        }
        if self.innovations.len() == DRAWN {
            self.innovations.pop_front();
        }
        self.innovations.push_back((time, innovation.standardised));
        self.residual = innovation.residual;
        self.fresh = true;
    }

    /// Takes the plot away.
    pub(super) fn clear(&mut self) {
        if let Some(term) = &self.term {
            let _ = term.clear_last_lines(self.drawn);
            self.drawn = 0;
        }
    }

    /// Draws the plot again where something has come; nothing where standard error is no terminal.
    pub(super) fn draw(&mut self, monitor: &Monitor) {
        let learning = matches!(monitor.progress(), Progress::Learning(_));
        if self.term.is_none() || !(self.fresh || learning) {
            return;
        }
        if self.last.is_some_and(|last| last.elapsed() < DRAWN_EVERY) {
            return;
        }
        self.last = Some(Instant::now());
        self.fresh = false;
        self.clear();
        let text = match monitor.progress() {
            Progress::Learning(rows) => {
                format!("learning: {rows} rows\n")
            }
            Progress::Watching { score, threshold } | Progress::Alarmed { score, threshold } => {
                let values: Vec<f64> = self.innovations.iter().map(|(_, v)| *v).collect();
                let most = values.iter().fold(LEAST, |most, v| most.max(v.abs()));
                let times = match (self.innovations.front(), self.innovations.back()) {
                    (Some((from, _)), Some((to, _))) => (*from, *to),
                    _ => return,
                };
                let curve = Curve {
                    values: &values,
                    colour: RESIDUAL,
                };
                let plot = plot(&[curve], times, (-most, most), ROWS, self.look);
                let width = self.term.as_ref().map_or(0, |term| term.size().1);
                let heading = heading(self.residual, &self.unit, (score, threshold), width);
                format!("{heading}\n{plot}")
            }
        };
        self.drawn = text.lines().count();
        let _ = io::stderr().write_all(text.as_bytes());
    }
}

/// The line above the plot. A terminal would break a longer one in two, and one of them would stay when the plot is taken away.
fn heading(residual: f64, unit: &str, (score, threshold): (f64, f64), width: u16) -> String {
    let whole = format!(
        "innovations [standard deviations], residual now {} {unit}, score {score:.1} of {threshold:.1}",
        significant(residual, 3),
    );
    truncate_str(&whole, usize::from(width), "").into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_above_the_plot_is_one_line() {
        let wide = heading(-0.0122, "cm", (2.7, 5.4), 100);
        assert!(wide.ends_with("now -0.0122 cm, score 2.7 of 5.4"), "{wide}");
        for width in [80, 40] {
            let line = heading(-1.23456e-7, "litres", (123.4, 105.4), width);
            assert_eq!(
                console::measure_text_width(&line),
                usize::from(width),
                "{line}"
            );
        }
    }
}
