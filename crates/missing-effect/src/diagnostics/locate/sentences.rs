//! Sentences about where a model fails.

use super::Located;
use crate::{Bin, Failures};

/// The worst of each kind, the worst first.
pub(super) fn sentences(located: &Located, residual: &[f64], failures: &Failures) -> Vec<String> {
    let present = residual.iter().filter(|r| !r.is_nan());
    let total: f64 = present.map(|r| r * r).sum();
    let (y, u) = (located.output_unit, located.input_unit);
    let level = located.domain.level_words("level");
    let share = |bin: &Bin| bin.rms * bin.rms * bin.count as f64 / total.max(f64::MIN_POSITIVE);
    let mut found: Vec<(f64, String)> = Vec::new();
    // A bin stands out if its share of the error exceeds its share of the samples.
    let mut worst = |bins: &[Bin], what: &dyn Fn(&Bin) -> String| {
        let samples: usize = bins.iter().map(|bin| bin.count).sum();
        let best = bins
            .iter()
            .filter(|bin| bin.fails)
            .map(|bin| (share(bin) - bin.count as f64 / samples.max(1) as f64, bin))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((excess, bin)) = best.filter(|(excess, _)| *excess > 0.05) {
            found.push((
                excess,
                format!(
                    "{}: {:.0} % of the squared error in {:.0} % of the samples; the model reads {} by {:.3} {y} there on average",
                    what(bin),
                    100.0 * share(bin),
                    100.0 * bin.count as f64 / samples.max(1) as f64,
                    if bin.mean > 0.0 { "too low" } else { "too high" },
                    bin.mean.abs(),
                ),
            ));
        }
    };
    worst(&failures.by_time, &|bin| {
        let record = bin
            .record
            .filter(|_| located.series.len() > 1)
            .and_then(|k| located.series.get(k));
        let record = record.map_or(String::new(), |one| format!("in {}, ", one.name));
        record + &located.clock.span(bin.from, bin.to)
    });
    worst(&failures.by_level, &|bin| {
        format!("at {level}s of {:.3} to {:.3} {y}", bin.from, bin.to)
    });
    worst(&failures.by_flow, &|bin| {
        format!("at commands of {:.3} to {:.3} {u}", bin.from, bin.to)
    });
    worst(&failures.by_direction, &|bin| {
        let middle = 0.5 * (bin.from + bin.to);
        let way = if bin.from < 0.0 && bin.to > 0.0 {
            "is steady"
        } else if middle > 0.0 {
            "rises"
        } else {
            "falls"
        };
        format!("while the {level} {way}")
    });
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut sentences: Vec<String> = found.into_iter().map(|(_, sentence)| sentence).collect();
    let band = failures
        .by_frequency
        .iter()
        .filter(|bin| bin.fails)
        .max_by(|a, b| a.rms.total_cmp(&b.rms));
    if let Some(bin) = band {
        sentences.push(format!(
            "most at periods of {}: {:.3} {y} rms",
            located.clock.lengths(1.0 / bin.to, 1.0 / bin.from),
            bin.rms
        ));
    }
    if sentences.is_empty() {
        sentences.push(format!(
            "no region stands out: in no window, {level}, flow or direction does the error exceed the noise"
        ));
    }
    sentences
}
