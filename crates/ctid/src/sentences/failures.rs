//! Where a model fails.

use missing_effect::{Diagnosis, Failure, FailureKind, OutputStep};

/// Sentences about the regions where a model fails at an output, the worst first; `at`: the position of the output.
#[must_use]
pub fn of_failures(diagnosis: &Diagnosis, output: &OutputStep, at: usize) -> Vec<String> {
    let worst = output.failures.worst.iter();
    let said: Vec<String> = worst
        .map(|failure| of_failure(diagnosis, failure, diagnosis.unit_of(at)))
        .collect();
    if said.is_empty() {
        let level = diagnosis.domain().level_words("level");
        return vec![format!(
            "no region stands out: in no window, {level}, flow or direction does the error exceed the noise"
        )];
    }
    said
}

fn of_failure(diagnosis: &Diagnosis, failure: &Failure, unit: &str) -> String {
    let Failure { by, bin, .. } = failure;
    let clock = &diagnosis.clock;
    let level = diagnosis.domain().level_words("level");
    let place = match by {
        FailureKind::Time => {
            let fitted: Vec<&str> = diagnosis
                .records
                .iter()
                .filter(|record| !record.held_out)
                .map(|record| record.name.as_str())
                .collect();
            let record = bin.record.and_then(|record| fitted.get(record));
            let record = record.filter(|_| fitted.len() > 1);
            let record = record.map_or(String::new(), |name| format!("in {name}, "));
            record + &clock.span(bin.from, bin.to)
        }
        FailureKind::Level => format!("at {level}s of {:.3} to {:.3} {unit}", bin.from, bin.to),
        FailureKind::Flow => format!(
            "at commands of {:.3} to {:.3} {}",
            bin.from, bin.to, diagnosis.input_unit
        ),
        FailureKind::Direction => {
            let way = if bin.from < 0.0 && bin.to > 0.0 {
                "is steady"
            } else if bin.from + bin.to > 0.0 {
                "rises"
            } else {
                "falls"
            };
            format!("while the {level} {way}")
        }
        FailureKind::Frequency => {
            return format!(
                "most at periods of {}: {:.3} {unit} rms",
                clock.lengths(1.0 / bin.to, 1.0 / bin.from),
                bin.rms
            );
        }
    };
    format!(
        "{place}: {:.0} % of the squared error in {:.0} % of the samples; the model reads {} by {:.3} {unit} there on average",
        100.0 * failure.error_share,
        100.0 * failure.sample_share,
        if bin.mean > 0.0 {
            "too low"
        } else {
            "too high"
        },
        bin.mean.abs(),
    )
}
