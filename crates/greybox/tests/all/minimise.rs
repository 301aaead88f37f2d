//! The minimiser against the crate `levenberg-marquardt`, its bounds, and what it says of its end.

use std::collections::BTreeMap;

use crate::support::{PRECISE, Rig};
use approx::assert_relative_eq;
use ct_signals::ArModel;
use greybox::{
    Error, FitOptions, NoFit, Noise, Setup, Start, Stop, Stopping, fit, fit_from, fit_onward,
    random_starts,
};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use plants::Plant;

struct Peer<'a> {
    setup: &'a Setup<'a>,
    x: DVector<f64>,
}

impl Peer<'_> {
    fn rows(&self) -> Option<DMatrix<f64>> {
        let rows = self.setup.rows(self.x.as_slice())?;
        Some(DMatrix::from_row_slice(
            self.setup.samples(),
            rows.columns,
            &rows.values,
        ))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Peer<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.clone_from(x);
    }
    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }
    fn residuals(&self) -> Option<DVector<f64>> {
        let rows = self.rows()?;
        Some(rows.column(rows.ncols() - 1).into_owned())
    }
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let rows = self.rows()?;
        // The residual is measured minus model.
        Some(-rows.columns(0, rows.ncols() - 1))
    }
}

/// Euclidean length of the gradient over the lengths of its factors, the worst of all entries: the cosine between
/// residual and sensitivity.
fn slope(setup: &Setup, x: &[f64], noise: &Noise) -> Vec<f64> {
    let triangle = setup.linearise(x, noise).unwrap();
    (0..setup.free().len())
        .map(|j| triangle.descent(j) / (triangle.column_norm(j) * triangle.cost().sqrt()))
        .collect()
}

#[test]
fn ends_where_another_implementation_ends() {
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        let records = [rig.record(3)];
        let setup = rig.setup(&records);
        let start: Vec<f64> = rig.truth(1).iter().map(|x| 1.1 * x).collect();
        let peer = Peer {
            setup: &setup,
            x: DVector::from_vec(start.clone()),
        };
        let (peer, report) = LevenbergMarquardt::new().minimize(peer);
        assert!(report.termination.was_successful());
        let ours = fit_from(&setup, &[start], &Noise::white(1), PRECISE).unwrap();
        for (a, b) in ours.x.iter().zip(&peer.x) {
            assert_relative_eq!(a, b, max_relative = 1e-8);
        }
        assert_relative_eq!(
            ours.cost,
            2.0 * report.objective_function,
            max_relative = 1e-12
        );
        assert_eq!(ours.stop, Stop::Converged);
    }
}

/// The record's true threshold is negative: the pump runs ahead of its command.
#[test]
fn a_parameter_that_ends_at_its_bound_has_no_error() {
    let rig = Rig::single_tank();
    let mut record = rig.record(5);
    for u in &mut record.inputs[0].values {
        *u -= 0.5;
    }
    let records = [record];
    let model = Rig {
        effects: vec![("pump_deadzone", 0, vec![0.5])],
        ..rig
    };
    let setup = model.setup(&records);
    let fit = fit(
        &setup,
        &FitOptions {
            noise_order: 0,
            ..FitOptions::default()
        },
    )
    .unwrap();
    assert_eq!(fit.x[2], 0.0);
    let errors = fit.std_errors();
    assert!(errors[2].is_none() && fit.half_widths(0.95)[2].is_none());
    for i in [0, 1, 3] {
        assert!(errors[i].unwrap() > 0.0);
    }
    let slope = slope(&setup, &fit.x, &fit.noise);
    assert!(slope[2] < -1e-3, "the gradient holds it: {slope:?}");
    for i in [0, 1, 3] {
        assert!(slope[i].abs() < 1e-5, "{slope:?}");
    }
    // The other parameters end where they end with the threshold fixed there.
    let fixed = BTreeMap::from([("pump_deadzone.threshold".to_string(), 0.0)]);
    let setup = Setup::from_records(
        Plant::SingleTank,
        model.known(),
        &model.placed(),
        &records,
        fixed,
    )
    .unwrap();
    let start = std::slice::from_ref(&fit.x);
    let reference = fit_from(&setup, start, &Noise::white(1), PRECISE).unwrap();
    for i in [0, 1, 3] {
        assert_relative_eq!(fit.x[i], reference.x[i], max_relative = 1e-5);
        assert_relative_eq!(
            errors[i].unwrap(),
            reference.std_errors()[i].unwrap(),
            max_relative = 0.01
        );
    }
}

#[test]
fn fixed_parameters_stay_put() {
    let rig = Rig::cascaded_tanks();
    let records = [rig.record(7)];
    let fixed = BTreeMap::from([("alpha_upper".to_string(), 17.3)]);
    let setup =
        Setup::from_records(Plant::CascadedTanks, rig.known(), &[], &records, fixed).unwrap();
    let fit = fit(&setup, &FitOptions::default()).unwrap();
    assert_eq!(fit.x[1], 17.3);
    assert!(fit.std_errors()[1].is_none());
    assert!(fit.std_errors()[0].is_some());
    // A start with another value is overruled.
    let other = fit_from(
        &setup,
        &[vec![10.0, 99.0, 12.0, 7.0, 14.0]],
        &Noise::white(1),
        PRECISE,
    );
    assert_eq!(other.unwrap().x[1], 17.3);
}

#[test]
fn a_start_far_away_stays_physical() {
    for rig in [Rig::single_tank(), Rig::cascaded_tanks()] {
        for seed in 0..10 {
            let records = [rig.record(seed)];
            let setup = rig.setup(&records);
            for size in [1.0, 1e-2, 1e3] {
                let start = vec![size; setup.names().len()];
                let white = Noise::white(1);
                let fit =
                    fit_from(&setup, &[start], &white, FitOptions::default().stopping).unwrap();
                for ((name, x), (lower, upper)) in
                    setup.names().iter().zip(&fit.x).zip(setup.bounds())
                {
                    assert!(
                        *x >= *lower && *x >= 0.0 && x <= upper,
                        "{name} = {x} from {size}"
                    );
                }
                if rig.plant == Plant::SingleTank {
                    let best = fit_from(&setup, &[rig.truth(1)], &white, PRECISE).unwrap();
                    assert_relative_eq!(fit.cost, best.cost, max_relative = 1e-6);
                }
            }
        }
    }
}

/// If the iteration reports convergence, further iterations gain nothing significant; if it was cut short, it reports this.
#[test]
fn what_it_says_of_its_end_is_true() {
    let options = FitOptions::default();
    let white = Noise::white(1);
    let mut converged = 0;
    for rig in [
        Rig::single_tank(),
        Rig::cascaded_tanks(),
        Rig::linear_tank(),
    ] {
        for seed in 0..8 {
            let records = [rig.record(seed)];
            let setup = rig.setup(&records);
            for start in random_starts(&setup, 12, seed) {
                let fit = fit_from(&setup, &[start], &white, options.stopping).unwrap();
                if fit.stop != Stop::Converged {
                    continue;
                }
                converged += 1;
                let further =
                    fit_from(&setup, std::slice::from_ref(&fit.x), &white, PRECISE).unwrap();
                let gain = fit.samples as f64 * (fit.cost / further.cost).ln();
                assert!(gain < 0.01, "{} {seed}: {gain} to be had", rig.plant.id());
            }
        }
    }
    assert!(converged > 200, "{converged}");

    let rig = Rig::cascaded_tanks();
    let records = [rig.record(1)];
    let setup = rig.setup(&records);
    let start: Vec<f64> = rig.truth(1).iter().map(|x| 1.5 * x).collect();
    let short = Stopping {
        evaluations: 3,
        cost: 1e-9,
    };
    let fit = fit_from(&setup, &[start], &white, short).unwrap();
    assert_eq!(fit.stop, Stop::Evaluations);
}

#[test]
fn a_fit_that_goes_on_is_the_fit_from_there() {
    let rough = Stopping {
        evaluations: 4,
        cost: 1e-3,
    };
    let coloured = Noise::of(vec![ArModel::from_coefficients(&[0.8], 0.3).unwrap()]);
    let white = Noise::white(1);
    for rig in Rig::all() {
        let records = [rig.record(1)];
        let setup = rig.setup(&records);
        let start = random_starts(&setup, 1, 5).remove(0);
        for (first, then) in [
            (&white, &coloured),
            (&coloured, &coloured),
            (&white, &white),
        ] {
            let begun = fit_from(&setup, std::slice::from_ref(&start), first, rough).unwrap();
            let end = Start::at_end(&begun, then);
            assert_eq!(end.triangle.is_some(), first == then);
            // Known results of a start outside the bounds belong to another start.
            let mut outside = end.clone();
            outside.x[1] = setup.bounds()[1].1 + 1.0;
            for start in [end, outside] {
                let again = fit_from(&setup, std::slice::from_ref(&start.x), then, PRECISE);
                let onward = fit_onward(&setup, vec![start], then, PRECISE).unwrap();
                assert_eq!(onward.x, again.unwrap().x);
            }
        }
    }
}

#[test]
fn a_simulation_that_is_not_finite_is_no_fit() {
    let rig = Rig::single_tank();
    let records = [rig.record(1)];
    let setup = rig.setup(&records);
    let starts = vec![vec![f64::NAN, 12.5, 14.0], vec![10.0, f64::NAN, 14.0]];
    let result = fit_from(&setup, &starts, &Noise::white(1), PRECISE);
    assert!(matches!(
        result,
        Err(Error::Estimation(NoFit::NoFiniteStart { starts: 2 }))
    ));
    // One good start among them is enough.
    let starts = vec![vec![f64::NAN, 12.5, 14.0], rig.truth(1)];
    let found = fit_from(&setup, &starts, &Noise::white(1), PRECISE).unwrap();
    assert_eq!((found.starts, found.agree), (2, 1));
    // Numbers beyond the floating-point range.
    let mut record = rig.record(1);
    for y in &mut record.outputs[0].values {
        *y *= 1e200;
    }
    let records = [record];
    let setup = rig.setup(&records);
    let result = fit(&setup, &FitOptions::default());
    assert!(
        matches!(result, Err(Error::Estimation(NoFit::NoFiniteStart { .. }))),
        "{:?}",
        result.map(|f| f.cost)
    );
}
