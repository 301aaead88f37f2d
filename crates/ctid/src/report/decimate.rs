//! Thins a long series for display without losing its peaks.

/// Indices to keep of a series: at most `limit` of them (but never fewer than four), among them
/// the first, the last, and the smallest and the largest value of every stretch. A stretch without
/// a finite value keeps its first index, so that a gap stays a gap.
pub(crate) fn min_max(values: &[f64], limit: usize) -> Vec<usize> {
    if values.len() <= limit.max(4) {
        return (0..values.len()).collect();
    }
    let last = values.len() - 1;
    let stretches = (limit.max(4) - 2) / 2;
    let mut kept = vec![0];
    for stretch in 0..stretches {
        // The first and the last sample are always kept: the intervals divide the samples between.
        let from = 1 + stretch * (last - 1) / stretches;
        let to = 1 + (stretch + 1) * (last - 1) / stretches;
        let finite = || (from..to).filter(|&i| values[i].is_finite());
        let low = finite().min_by(|&a, &b| values[a].total_cmp(&values[b]));
        let high = finite().max_by(|&a, &b| values[a].total_cmp(&values[b]));
        match (low, high) {
            (Some(low), Some(high)) if low != high => {
                kept.extend([low.min(high), low.max(high)]);
            }
            (Some(one), _) | (None, Some(one)) => kept.push(one),
            (None, None) => kept.push(from),
        }
    }
    kept.push(last);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_series_stays_whole() {
        assert_eq!(min_max(&[3.0, 1.0, 2.0], 10), [0, 1, 2]);
        assert!(min_max(&[], 10).is_empty());
    }

    #[test]
    fn extremes_and_ends_are_kept() {
        let mut values: Vec<f64> = (0..20_000).map(|k| (k as f64 / 700.0).sin()).collect();
        values[7_777] = 50.0;
        values[15_001] = -50.0;
        let kept = min_max(&values, 1_000);
        assert!(kept.len() <= 1_000);
        assert!(kept.len() > 900);
        for index in [0, 7_777, 15_001, 19_999] {
            assert!(kept.contains(&index), "{index} was lost");
        }
        assert!(kept.windows(2).all(|w| w[0] < w[1]), "in order, none twice");
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let mut values = vec![1.0; 10_000];
        values[4_000..6_000].fill(f64::NAN);
        let kept = min_max(&values, 100);
        assert!(kept.iter().any(|&i| values[i].is_nan()));
        assert!(kept.iter().any(|&i| i > 9_000));
    }
}
