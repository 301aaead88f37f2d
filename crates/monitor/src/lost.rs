//! Replacement of missing readings for computations that need a complete record.

use ct_signals::ArModel;

/// Sweeps over the missing values; one is enough if no two are within the noise's order.
const SWEEPS: usize = 30;

/// Linear interpolation of missing values, at an end with the nearest value; `None` if there is no value.
pub(crate) fn interpolated(values: &[Option<f64>]) -> Option<Vec<f64>> {
    let first = values.iter().position(Option::is_some)?;
    let mut before = values[first]?;
    let mut filled = vec![before; first];
    let mut missing = 0;
    for value in &values[first..] {
        let Some(next) = *value else {
            missing += 1;
            continue;
        };
        let slope = (next - before) / f64::from(missing + 1);
        filled.extend((1..=missing).map(|k| before + slope * f64::from(k)));
        filled.push(next);
        (before, missing) = (next, 0);
    }
    filled.resize(values.len(), before);
    Some(filled)
}

/// Sets the `lost` values of a noise to their conditional mean given the others: least squares of the innovations.
pub(crate) fn expect(noise: &ArModel, values: &mut [f64], lost: &[usize]) {
    let filter: Vec<f64> = std::iter::once(1.0)
        .chain(noise.coefficients().iter().map(|a| -a))
        .collect();
    let innovation = |values: &[f64], t: usize| -> f64 {
        let past = filter.iter().take(t + 1).enumerate();
        past.map(|(i, f)| f * values[t - i]).sum()
    };
    for _ in 0..SWEEPS {
        for &k in lost {
            let (mut slope, mut curvature) = (0.0, 0.0);
            for (j, f) in filter.iter().enumerate().take(values.len() - k) {
                slope += f * innovation(values, k + j);
                curvature += f * f;
            }
            values[k] -= slope / curvature;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_values_lie_between_their_neighbours() {
        let values = [None, Some(1.0), None, None, Some(4.0), None];
        assert_eq!(
            interpolated(&values).unwrap(),
            [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
        );
        assert_eq!(interpolated(&[None, None]), None);
        assert_eq!(interpolated(&[Some(2.0)]).unwrap(), [2.0]);
    }

    #[test]
    fn what_is_expected_of_a_lost_value_follows_from_both_sides() {
        let (a, noise) = (0.8, ArModel::from_coefficients(&[0.8], 1.0).unwrap());
        let mut values = [1.0, 2.0, 77.0, -1.0, 3.0];
        expect(&noise, &mut values, &[2]);
        assert!((values[2] - a * (2.0 - 1.0) / (1.0 + a * a)).abs() < 1e-12);
        // At the end of the series only earlier values are used.
        expect(&noise, &mut values, &[4]);
        assert!((values[4] + a).abs() < 1e-12);
        let mut white = [1.0, 5.0];
        expect(&ArModel::white(1.0), &mut white, &[1]);
        assert_eq!(white, [1.0, 0.0]);
    }
}
