//! Where a model fails.

use ct_signals::Clock;
use effect_search::{Failure, FailureKind, OutputStep};
use missing_effect::Diagnosis;
use plants::Plant;

use super::{interval, with_unit};
use crate::numbers;

/// Names and units of a result, for sentences about one of its outputs.
#[derive(Debug, Clone)]
pub struct FailureWords<'a> {
    /// Format of times.
    pub clock: &'a Clock,
    /// Names of the fitted records.
    pub fitted: Vec<&'a str>,
    /// Name of the output: `level`, `T2`.
    pub output: &'a str,
    /// The output at several of its values: `levels`, `T2`.
    pub outputs: &'a str,
    /// Unit of the output.
    pub unit: &'a str,
    /// Name of the only input; `None`: inputs have the names of the signals.
    pub input: Option<&'a str>,
}

/// Sentences about the regions where a model fails at an output, the worst first; `at`: the position of the output.
#[must_use]
pub fn of_failures(diagnosis: &Diagnosis, output: &OutputStep, at: usize) -> Vec<String> {
    let of_plant = diagnosis.plant.parse::<Plant>().is_ok();
    let level = diagnosis.domain().level_words("level");
    let several = format!("{level}s");
    let fitted = diagnosis.records.iter().filter(|record| !record.held_out);
    let inputs = diagnosis.records.first().map_or(0, |r| r.inputs.len());
    FailureWords {
        clock: &diagnosis.clock,
        fitted: fitted.map(|record| record.name.as_str()).collect(),
        output: if of_plant { level } else { &output.name },
        outputs: if of_plant { &several } else { &output.name },
        unit: diagnosis.unit_of(at),
        input: (of_plant && inputs < 2).then_some("commands"),
    }
    .sentences(output)
}

impl FailureWords<'_> {
    /// Sentences about the regions where a model fails at the output, the worst first.
    #[must_use]
    pub fn sentences(&self, output: &OutputStep) -> Vec<String> {
        let worst = output.failures.worst.iter();
        let said: Vec<String> = worst.map(|failure| self.of_failure(failure)).collect();
        if said.is_empty() {
            let place = match self.input {
                Some(_) => format!("windows, {}s, flows and directions", self.output),
                None => "windows of time, values of the signals and directions".to_string(),
            };
            return vec![format!(
                "no region stands out: the error is about as large in all {place}"
            )];
        }
        said
    }

    fn of_failure(&self, failure: &Failure) -> String {
        let Failure { by, bin, .. } = failure;
        let unit = self.unit;
        let range = |name: &str, unit: &str| {
            format!(
                "at {name} of {}",
                interval((bin.from, bin.to), " to ", unit)
            )
        };
        let place = match by {
            FailureKind::Time => {
                let record = bin.record.and_then(|record| self.fitted.get(record));
                let record = record.filter(|_| self.fitted.len() > 1);
                let record = record.map_or(String::new(), |name| format!("in {name}, "));
                record + &self.clock.span(bin.from, bin.to)
            }
            FailureKind::Output => range(self.outputs, unit),
            FailureKind::Input => range(self.input.unwrap_or(&failure.signal), &failure.unit),
            FailureKind::State => range(&failure.signal, &failure.unit),
            FailureKind::Direction => {
                let way = if bin.from < 0.0 && bin.to > 0.0 {
                    "is steady"
                } else if bin.from + bin.to > 0.0 {
                    "rises"
                } else {
                    "falls"
                };
                // A name such as y needs no article.
                let article = if self.output == self.outputs {
                    ""
                } else {
                    "the "
                };
                format!("while {article}{} {way}", self.output)
            }
            FailureKind::Frequency => {
                return format!(
                    "most at periods of {}: {} rms",
                    self.clock.lengths(1.0 / bin.to, 1.0 / bin.from),
                    with_unit(&numbers::significant(bin.rms, 2), unit)
                );
            }
        };
        format!(
            "{place}: {:.0} % of the squared error in {:.0} % of the samples; the model reads {} by {} there on average",
            100.0 * failure.error_share,
            100.0 * failure.sample_share,
            if bin.mean > 0.0 {
                "too low"
            } else {
                "too high"
            },
            with_unit(&numbers::significant(bin.mean.abs(), 2), unit),
        )
    }
}
