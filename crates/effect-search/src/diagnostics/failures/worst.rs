//! The worst bins of each kind.

use super::{Bin, Failure, FailureKind, Failures};

/// A bin is among the worst if its share of the error exceeds its share of the samples by more than this.
const EXCESS: f64 = 0.05;

/// The worst bin of each kind in which the model fails, sorted by how far its share of the squared error exceeds its share of the samples; the
/// frequency band comes last.
pub(super) fn worst(residual: &[f64], failures: &Failures) -> Vec<Failure> {
    let present = residual.iter().filter(|r| !r.is_nan());
    let total: f64 = present.map(|r| r * r).sum();
    let count = |bins: &[Bin]| bins.iter().map(|bin| bin.count).sum::<usize>().max(1) as f64;
    let failure = |by: FailureKind, bins: &[Bin], bin: &Bin, squares: f64| Failure {
        by,
        signal: String::new(),
        unit: String::new(),
        bin: bin.clone(),
        error_share: squares / total.max(f64::MIN_POSITIVE),
        sample_share: bin.count as f64 / count(bins),
    };
    let excess = |failure: &Failure| failure.error_share - failure.sample_share;
    let worst_of = |by: FailureKind, bins: &[Bin]| {
        bins.iter()
            .filter(|bin| bin.fails)
            .map(|bin| failure(by, bins, bin, bin.rms.powi(2) * bin.count as f64))
            .max_by(|a, b| excess(a).total_cmp(&excess(b)))
            .filter(|worst| excess(worst) > EXCESS)
    };
    let kinds = [
        (FailureKind::Time, &failures.by_time),
        (FailureKind::Output, &failures.by_output),
        (FailureKind::Direction, &failures.by_direction),
    ];
    let of_kind = kinds.into_iter();
    let mut worst: Vec<Failure> = of_kind
        .filter_map(|(by, bins)| worst_of(by, bins))
        .collect();
    for (by, signals) in [
        (FailureKind::Input, &failures.by_input),
        (FailureKind::State, &failures.by_state),
    ] {
        let of_signal = signals.iter().filter_map(|signal| {
            Some(Failure {
                signal: signal.name.clone(),
                unit: signal.unit.clone(),
                ..worst_of(by, &signal.bins)?
            })
        });
        worst.extend(of_signal);
    }
    worst.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    let bands = &failures.by_frequency;
    let band = bands
        .iter()
        .filter(|bin| bin.fails)
        .max_by(|a, b| a.rms.total_cmp(&b.rms));
    worst.extend(band.map(|bin| {
        let samples = residual.iter().filter(|r| !r.is_nan()).count() as f64;
        failure(
            FailureKind::Frequency,
            bands,
            bin,
            bin.rms.powi(2) * samples,
        )
    }));
    worst
}
