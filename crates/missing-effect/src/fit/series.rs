//! Series: the outputs of all records, those of one record after the other, in the order in which residuals come.

use ct_signals::{Channel, Record};

/// Every output with its record.
pub(crate) fn series(records: &[Record]) -> impl Iterator<Item = (&Record, &Channel)> {
    records
        .iter()
        .flat_map(|record| record.outputs.iter().map(move |output| (record, output)))
}

/// Series divided by the root mean square over all series of an output: outputs then have weights by their noise. An output of zeros does
/// not change.
pub(crate) fn standardised(mut series: Vec<Vec<f64>>, outputs: usize) -> Vec<Vec<f64>> {
    for output in 0..outputs {
        let own = || series.iter().skip(output).step_by(outputs);
        let present = || own().flatten().filter(|value| !value.is_nan());
        let squares: f64 = present().map(|value| value * value).sum();
        let scale = (squares / present().count().max(1) as f64).sqrt();
        if scale > 0.0 {
            let own = series.iter_mut().skip(output).step_by(outputs);
            own.flatten().for_each(|value| *value /= scale);
        }
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_count_by_their_own_size() {
        let gap = f64::NAN;
        // Two records of two outputs.
        let all = vec![
            vec![3.0, -3.0],
            vec![0.0, 0.1],
            vec![gap, 3.0],
            vec![-0.1, 0.1],
        ];
        let all = standardised(all, 2);
        assert_eq!(all[0], [1.0, -1.0]);
        assert!(all[2][0].is_nan() && all[2][1] == 1.0);
        let squares: f64 = all[1].iter().chain(&all[3]).map(|v| v * v).sum();
        assert!((squares / 4.0 - 1.0).abs() < 1e-12);
        assert_eq!(standardised(vec![vec![0.0; 2]], 1), [vec![0.0; 2]]);
    }
}
