//! The folded rows against central differences of the simulation and dense whitening.

use crate::support::Rig;
use approx::assert_relative_eq;
use ct_signals::{ArModel, Hold, Record};
use greybox::{Noise, Setup};
use nalgebra::DMatrix;
use plants::Plant;
use std::collections::BTreeMap;

/// Effects with a reading that is a staircase in some parameter have the slope of a chord, which a central difference does not show.
const STEPPED: [&str; 2] = ["stiction_backlash", "coarse_quantisation"];

/// The derivatives of all readings, column by column over the free entries, by central differences.
fn differences(setup: &Setup, x: &[f64]) -> DMatrix<f64> {
    let readings = |x: &[f64]| -> Vec<f64> { setup.simulate(x).unwrap().output.concat() };
    let mut j = DMatrix::zeros(setup.samples(), setup.free().len());
    for (column, &i) in setup.free().iter().enumerate() {
        let h = 1e-5 * x[i].abs().max(0.1);
        let at = |by: f64| {
            let mut moved = x.to_vec();
            moved[i] += by * h;
            readings(&moved)
        };
        let (a, b, c, d) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
        for k in 0..setup.samples() {
            j[(k, column)] = (a[k] - 8.0 * b[k] + 8.0 * c[k] - d[k]) / (12.0 * h);
        }
    }
    j
}

fn rows(setup: &Setup, x: &[f64]) -> DMatrix<f64> {
    let rows = setup.rows(x).unwrap();
    DMatrix::from_row_slice(setup.samples(), rows.columns, &rows.values)
}

fn check_rows(what: &str, setup: &Setup, x: &[f64]) {
    let rows = rows(setup, x);
    let expected = differences(setup, x);
    let p = setup.free().len();
    for column in 0..p {
        let size = expected.column(column).amax();
        assert!(
            size > 1e-6,
            "{what}: {} shows nowhere",
            setup.names()[setup.free()[column]]
        );
        let worst = (rows.column(column) - expected.column(column)).amax() / size;
        println!(
            "{} size {size:e} worst {worst:e}",
            setup.names()[setup.free()[column]]
        );
        assert!(
            worst < 1e-6,
            "{what}: {} is off by {worst:e}",
            setup.names()[setup.free()[column]]
        );
    }
    let residuals = setup.residuals(x).unwrap().concat();
    assert_eq!(rows.column(p).as_slice(), residuals.as_slice());
}

fn two_records(rig: &Rig) -> Vec<Record> {
    vec![
        Rig {
            samples: 60,
            ..rig.clone()
        }
        .record(1),
        Rig {
            samples: 37,
            ..rig.clone()
        }
        .record(2),
    ]
}

/// The truth, moved a little, so that no residual vanishes; each record's levels differ.
fn near_truth(rig: &Rig, records: usize) -> Vec<f64> {
    rig.truth(records)
        .iter()
        .enumerate()
        .map(|(i, x)| x * (1.0 + 0.013 * (1.0 + i as f64).sin()))
        .collect()
}

#[test]
fn every_plant_in_two_records_under_both_holds() {
    for hold in [Hold::Zero, Hold::First] {
        for rig in Rig::all() {
            let rig = Rig { hold, ..rig };
            let records = two_records(&rig);
            let setup = rig.setup(&records);
            let x = near_truth(&rig, 2);
            let what = format!("{} {hold:?}", rig.plant.id());
            check_rows(&what, &setup, &x);
            // A record's initial levels affect that record alone.
            let rows = rows(&setup, &x);
            let n = rig.plant.vessels();
            let own = rig.theta.len();
            for vessel in 0..n {
                assert!(rows.view((60, own + vessel), (37, 1)).amax() == 0.0);
                assert!(rows.view((0, own + n + vessel), (60, 1)).amax() == 0.0);
            }
        }
    }
}

#[test]
fn every_effect_on_both_tanks() {
    let mut tried = 0;
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        let records = two_records(&rig);
        for placed in rig.setup(&records).structure.candidates() {
            if STEPPED.contains(&placed.effect.id) {
                continue;
            }
            let setup = rig.setup(&records);
            let structure = setup.structure.with(placed).unwrap();
            let setup = setup.with_structure(structure).unwrap();
            let x = with_effects(&rig, &setup, 2);
            // A column that this record does not show has nothing to be compared.
            let shown = rows(&setup, &x);
            if (0..setup.free().len()).all(|j| shown.column(j).amax() > 0.0) {
                check_rows(placed.effect.id, &setup, &x);
                tried += 1;
            }
        }
    }
    assert!(tried >= 20, "{tried}");
}

/// Truth of the plant, a start of every effect.
fn with_effects(rig: &Rig, setup: &Setup, records: usize) -> Vec<f64> {
    let mut x = near_truth(rig, 0);
    for &placed in setup.structure.effects() {
        for info in setup.structure.effect_parameters(placed) {
            // At the first start of a rim the level just touches it, within the steps of the differences: differences across a corner are
            // no slopes.
            let index = usize::from(info.name == "rim");
            x.push(info.starts[index]);
        }
    }
    let lags = setup.structure.lags();
    for _ in 0..records {
        x.extend(&rig.levels);
        x.extend(lags.iter().map(|_| 0.6));
    }
    x
}

/// More columns than one simulator has derivatives: several simulators are used.
#[test]
fn more_columns_than_lanes() {
    let rig = Rig::cascaded_tanks();
    let records = two_records(&rig);
    let mut setup = rig.setup(&records);
    for placed in setup.structure.candidates() {
        let once = setup
            .structure
            .effects()
            .iter()
            .all(|on| on.effect.id != placed.effect.id);
        // The reading of a sensor with hysteresis has no derivative where it starts to move.
        let sticks = placed.effect.id == "sensor_hysteresis" || STEPPED.contains(&placed.effect.id);
        if once && !sticks {
            let structure = setup.structure.with(placed).unwrap();
            setup = setup.with_structure(structure).unwrap();
        }
    }
    let mut x = with_effects(&rig, &setup, 2);
    // A pump that saturates, a rim that is reached, and levels that start below it.
    for (name, value) in setup.names().iter().zip(&mut x) {
        match name.as_str() {
            "pump_saturation.limit" => *value = 5.0,
            "overflow.rim" => *value = 4.5,
            "leak_at_height.height" => *value = 3.0,
            "sensor_saturation.limit" => *value = 13.0,
            "level_upper(0), record 1" | "level_upper(0), record 2" => *value = 4.0,
            // A reading that begins below the sensor's limit.
            "sensor_lag.before, record 1" | "sensor_lag.before, record 2" => *value = -6.0,
            _ => {}
        }
    }
    let lanes = setup.parameter_count() + 2;
    assert!(lanes > 16, "{lanes} lanes");
    check_rows("many effects", &setup, &x);
}

/// The triangle squared is `[J, r]' V^-1 [J, r]` with the covariance of the noise written down from its
/// autocorrelation, record by record.
#[test]
fn whitening_is_that_of_dense_algebra() {
    let (a1, a2): (f64, f64) = (1.1, -0.4);
    let noise = Noise::of(vec![ArModel::from_coefficients(&[a1, a2], 0.3).unwrap()]);
    let correlation = {
        let mut rho = vec![1.0, a1 / (1.0 - a2)];
        for k in 2..60 {
            rho.push(a1 * rho[k - 1] + a2 * rho[k - 2]);
        }
        rho
    };
    let power = (1.0 - a2) / ((1.0 + a2) * ((1.0 - a2).powi(2) - a1 * a1));
    for rig in Rig::all() {
        let records = two_records(&rig);
        let setup = rig.setup(&records);
        let x = near_truth(&rig, 2);
        let triangle = setup.linearise(&x, &noise).unwrap();
        let rows = rows(&setup, &x);
        let columns = rows.ncols();
        let mut expected = DMatrix::zeros(columns, columns);
        let mut from = 0;
        for record in &records {
            let n = record.len();
            let covariance = DMatrix::from_fn(n, n, |i, j| power * correlation[i.abs_diff(j)]);
            let own = rows.rows(from, n).into_owned();
            expected += own.transpose() * covariance.cholesky().unwrap().solve(&own);
            from += n;
        }
        for i in 0..columns {
            for j in 0..columns {
                let ours: f64 = (0..columns)
                    .map(|k| triangle.at(k, i) * triangle.at(k, j))
                    .sum();
                let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
                assert_relative_eq!(ours / size, expected[(i, j)] / size, epsilon = 1e-10);
            }
        }
    }
}

/// Columns of fixed parameters are absent, the others do not change.
#[test]
fn fixed_parameters_have_no_column() {
    let rig = Rig::cascaded_tanks();
    let records = two_records(&rig);
    let all = rig.setup(&records);
    let fixed = BTreeMap::from([("alpha_upper".to_string(), 18.0)]);
    let some =
        Setup::from_records(Plant::CascadedTanks, rig.known(), &[], &records, fixed).unwrap();
    let x = near_truth(&rig, 2);
    let (all, some) = (rows(&all, &x), rows(&some, &x));
    assert_eq!(some, all.remove_column(1));
}
