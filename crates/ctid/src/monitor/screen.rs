//! Display on standard error: lines, and on a terminal a plot of each output's innovations below them.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::time::{Duration, Instant};

use ::monitor::{Estimate, Innovation, Monitor, Progress};
use console::{Term, truncate_str};
use ct_signals::quoted;

use crate::look::Look;
use crate::numbers::{significant, value_and_error};
use crate::plot::{Axis, Curve, RESIDUAL, plot};

/// Number of plotted innovations.
const DRAWN: usize = 400;
/// Interval between redraws of the plot, if there are new rows.
pub(super) const DRAWN_EVERY: Duration = Duration::from_millis(250);
/// Lines of a plot.
const ROWS: usize = 6;
/// Least range of the plot in standard deviations.
const LEAST: f64 = 4.0;

pub(super) struct Screen {
    look: Look,
    /// Standard error, if it is a terminal.
    term: Option<Term>,
    /// Number of the plot's lines on the terminal.
    drawn: usize,
    /// The signals that are plotted, one for each output.
    signals: Vec<Signal>,
    fresh: bool,
    last: Option<Instant>,
}

/// The innovations of an output.
struct Signal {
    /// The output, where there are several.
    name: Option<String>,
    /// The unit of its readings.
    unit: String,
    /// Time and innovation, the latest of them.
    innovations: VecDeque<(f64, f64)>,
    residual: f64,
}

impl Screen {
    pub(super) fn new(look: Look) -> Self {
        let term = Term::stderr();
        Self {
            look,
            term: term.is_term().then_some(term),
            drawn: 0,
            signals: Vec::new(),
            fresh: false,
            last: None,
        }
    }

    /// The outputs: their names, and the units of their readings.
    pub(super) fn outputs<'a>(&mut self, outputs: impl Iterator<Item = (&'a str, &'a str)>) {
        let outputs: Vec<(&str, &str)> = outputs.collect();
        let several = outputs.len() > 1;
        let signal = |(name, unit): (&str, &str)| Signal {
            name: several.then(|| quoted(name)),
            unit: unit.to_string(),
            innovations: VecDeque::with_capacity(DRAWN),
            residual: 0.0,
        };
        self.signals = outputs.into_iter().map(signal).collect();
    }

    /// Writes a line; a closed standard error is no error.
    pub(super) fn say(&mut self, text: &str) {
        self.clear();
        let _ = writeln!(io::stderr(), "{text}");
    }

    /// The sentence of an alarm; `at`: when.
    pub(super) fn warn(&mut self, at: &str, sentence: &str) {
        let text = format!("{at}: {sentence}");
        let text = self.look.warning(text);
        self.say(&text);
    }

    pub(super) fn estimates(&mut self, at: &str, estimates: &[Estimate], progress: Progress) {
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
            "{at}: {}; the model {state}",
            parameters.join(", ")
        ));
    }

    /// Adds the innovations of a row, if there are any.
    pub(super) fn innovations(&mut self, time: f64, innovations: &[Option<Innovation>]) {
        if self.term.is_none() {
            return;
        }
        for (signal, innovation) in self.signals.iter_mut().zip(innovations) {
            let Some(innovation) = innovation else {
                continue;
            };
            if signal.innovations.len() == DRAWN {
                signal.innovations.pop_front();
            }
            signal
                .innovations
                .push_back((time, innovation.standardised));
            signal.residual = innovation.residual;
            self.fresh = true;
        }
    }

    /// Removes the plot.
    pub(super) fn clear(&mut self) {
        if let Some(term) = &self.term {
            let _ = term.clear_last_lines(self.drawn);
            self.drawn = 0;
        }
    }

    /// Redraws the plot after new data; no plot if standard error is no terminal.
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
                let plots = self
                    .signals
                    .iter()
                    .map(|s| self.plot(s, (score, threshold)));
                plots.collect()
            }
        };
        self.drawn = text.lines().count();
        let _ = io::stderr().write_all(text.as_bytes());
    }
}

impl Screen {
    /// The plot of an output below its line; nothing where it has shown nothing yet.
    fn plot(&self, signal: &Signal, scores: (f64, f64)) -> String {
        let values: Vec<f64> = signal.innovations.iter().map(|(_, v)| *v).collect();
        let most = values.iter().fold(LEAST, |most, v| most.max(v.abs()));
        let times = match (signal.innovations.front(), signal.innovations.back()) {
            (Some((from, _)), Some((to, _))) => Axis::Even(*from, *to),
            _ => return String::new(),
        };
        let curve = Curve {
            values: &values,
            colour: RESIDUAL,
        };
        let plot = plot(&[curve], times, (-most, most), ROWS, self.look);
        let width = self.term.as_ref().map_or(0, |term| term.size().1);
        let of = signal.name.as_deref();
        let heading = heading(of, signal.residual, &signal.unit, scores, width);
        format!("{heading}\n{plot}")
    }
}

/// Heading of the plot.
fn heading(
    of: Option<&str>,
    residual: f64,
    unit: &str,
    (score, threshold): (f64, f64),
    width: u16,
) -> String {
    let of = of.map_or(String::new(), |name| format!(" of \"{name}\""));
    let whole = format!(
        "innovations{of} [standard deviations], residual now {} {unit}, score {score:.1} of {threshold:.1}",
        significant(residual, 3),
    );
    truncate_str(&whole, usize::from(width), "").into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_above_the_plot_is_one_line() {
        let wide = heading(None, -0.0122, "cm", (2.7, 5.4), 100);
        assert!(wide.ends_with("now -0.0122 cm, score 2.7 of 5.4"), "{wide}");
        for width in [80, 40] {
            let line = heading(None, -1.23456e-7, "litres", (123.4, 105.4), width);
            assert_eq!(
                console::measure_text_width(&line),
                usize::from(width),
                "{line}"
            );
        }
    }
}
