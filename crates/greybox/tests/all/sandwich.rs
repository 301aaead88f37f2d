//! Standard errors for a noise that differs from the weighting, compared with dense algebra.

use crate::support::{PRECISE, Rig};
use approx::assert_relative_eq;
use ct_signals::ArModel;
use greybox::{Noise, fit_from, robust};
use nalgebra::DMatrix;

/// The covariance of unit innovations, one block for each record.
fn covariance(noise: &ArModel, lengths: &[usize]) -> DMatrix<f64> {
    let n = lengths.iter().sum();
    let mut v = DMatrix::zeros(n, n);
    let mut from = 0;
    for &length in lengths {
        // The whitener's columns are those of the inverse of the factor.
        let mut inverse = DMatrix::zeros(length, length);
        for j in 0..length {
            let mut unit = vec![0.0; length];
            unit[j] = 1.0;
            inverse.column_mut(j).copy_from_slice(&noise.whiten(&unit));
        }
        let factor = inverse.try_inverse().unwrap();
        v.view_mut((from, from), (length, length))
            .copy_from(&(&factor * factor.transpose()));
        from += length;
    }
    v
}

#[test]
fn agrees_with_dense_algebra_whatever_the_metric() {
    let rig = Rig {
        rho: 0.8,
        ..Rig::cascaded_tanks()
    };
    let records = [70, 45].map(|samples| {
        Rig {
            samples,
            ..rig.clone()
        }
        .record(samples as u64)
    });
    let setup = rig.setup(&records);
    for metric in [
        Noise::white(1),
        Noise::of(vec![ArModel::from_coefficients(&[0.6, 0.2], 1.0).unwrap()]),
    ] {
        let fit = fit_from(&setup, &[rig.truth(2)], &metric, PRECISE).unwrap();
        let ours = robust(&setup, &fit, 3).unwrap();
        assert!(ours.noise.order() > 0);
        let rows = setup.rows(&fit.x).unwrap();
        let j = DMatrix::from_row_slice(115, rows.columns, &rows.values)
            .columns(0, rows.columns - 1)
            .into_owned();
        let weighted = covariance(metric.output(0), &[70, 45])
            .try_inverse()
            .unwrap()
            * &j;
        let bread = (j.transpose() * &weighted).try_inverse().unwrap();
        let filling =
            weighted.transpose() * covariance(ours.noise.output(0), &[70, 45]) * &weighted;
        let dense = &bread * filling * &bread * ours.noise.output(0).sigma().powi(2);
        for (i, ours) in ours.std_errors.iter().enumerate() {
            assert_relative_eq!(ours.unwrap(), dense[(i, i)].sqrt(), max_relative = 1e-7);
        }
    }
    // With the noise model as weighting it equals the ordinary standard error.
    let fit = fit_from(&setup, &[rig.truth(2)], &Noise::white(1), PRECISE).unwrap();
    let same = robust(&setup, &fit, 0).unwrap().std_errors;
    for (a, b) in same.iter().zip(fit.std_errors()) {
        assert_relative_eq!(a.unwrap(), b.unwrap(), max_relative = 1e-9);
    }
}
