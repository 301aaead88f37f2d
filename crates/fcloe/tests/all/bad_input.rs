//! Inputs that cannot be fitted are rejected, with the numbers that disagree.

use crate::support::drive;
use ct_lti::Hold;
use fcloe::{
    Controller, Coordinates, Error, LoopRecord, Noise, Offsets, OperatingPoint, Orders, PlantModel,
    Problem, Settings, Stop, continuous_loop, controller_mismatch, noise_at_snr,
};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const ORDERS: Orders = Orders { n: 1, m: 0 };

fn plant() -> PlantModel {
    PlantModel::first_order(6.0, 110.0).unwrap()
}

fn pi() -> Controller {
    Controller::pi(0.2292, 0.0021).unwrap()
}

fn record() -> LoopRecord {
    let r: Vec<f64> = drive(100).iter().flat_map(|r| [*r; 20]).collect();
    let data = continuous_loop(&plant(), &pi(), 1.0, &r, Hold::Zero, Noise::None).unwrap();
    LoopRecord::closed_loop(1.0, r, Some(data.u), data.y, Offsets::Deviations)
}

fn refusal(record: LoopRecord, controller: &Controller) -> String {
    Problem::new(&[record], controller, ORDERS)
        .unwrap_err()
        .to_string()
}

#[test]
fn an_unstable_loop_at_the_start() {
    let problem = Problem::new(&[record()], &pi(), ORDERS).unwrap();
    let start = PlantModel::first_order(-6.0, 110.0).unwrap();
    let error = problem.fit(&start, &Settings::default()).unwrap_err();
    assert!(matches!(error, Error::UnstableLoop { real_part } if real_part > 0.0));
    // P = 110 p^2 + (1 - 6 * 0.2292) p - 6 * 0.0021.
    assert!(error.to_string().contains("1.2"), "{error}");
}

/// An output with the opposite sign needs a negative gain, which this controller does not stabilise: the fit stays in the stable region,
/// and reports why it ended.
#[test]
fn a_fit_never_leaves_the_stable_loops() {
    let mut record = record();
    record.u = None;
    record.y.iter_mut().for_each(|y| *y = -*y);
    let problem = Problem::new(&[record], &pi(), ORDERS).unwrap();
    let start = PlantModel::first_order(3.0, 60.0).unwrap();
    for method in [Settings::default().method, fcloe::Method::GaussNewton] {
        let settings = Settings {
            method,
            ..Settings::default()
        };
        let fit = problem.fit(&start, &settings).unwrap();
        assert!(fit.refused > 0 && !fit.stop.was_successful(), "{fit:?}");
        for at in &fit.way {
            let plant = PlantModel::from_theta(ORDERS, &at.theta).unwrap();
            assert!(fcloe::ClosedLoop::new(&plant, &pi()).unwrap().is_stable());
        }
        assert!(fit.way.windows(2).all(|pair| pair[1].cost < pair[0].cost));
    }
}

/// Constant levels do not count as changes: they do not hide a wrong controller.
#[test]
fn a_controller_that_does_not_match_raw_levels() {
    let mut raw = record();
    raw.r.iter_mut().flatten().for_each(|r| *r += 50.0);
    raw.y.iter_mut().for_each(|y| *y += 50.0);
    raw.u.iter_mut().flatten().for_each(|u| *u += 7.0);
    let wrong = Controller::pi(0.3, 0.0021 / 0.2292 * 0.3).unwrap();
    let of = |record: &LoopRecord| controller_mismatch(record, &wrong).unwrap().unwrap();
    let (raw_size, size) = (of(&raw).size, of(&record()).size);
    assert!((raw_size / size - 1.0).abs() < 0.02, "{raw_size} {size}");
    assert!(refusal(raw, &wrong).contains("R/S"));
}

#[test]
fn a_controller_that_does_not_match() {
    let wrong = |kp: f64, ki: f64| Controller::pi(kp, ki).unwrap();
    for controller in [
        wrong(0.3, 0.0021),
        wrong(0.2292, 0.004),
        wrong(0.2292, 0.126),
        wrong(-0.2292, -0.0021),
    ] {
        let message = refusal(record(), &controller);
        assert!(
            message.contains("not R/S (r - y)") && message.contains('%'),
            "{message}"
        );
    }
    // The size is right: u = C (r - y) with half the gain misses half of u.
    let half = wrong(0.1146, 0.00105);
    let mismatch = controller_mismatch(&record(), &half).unwrap().unwrap();
    assert!(
        (mismatch.systematic / mismatch.size - 0.5).abs() < 0.05,
        "{mismatch:?}"
    );
    // r and y exchanged.
    let mut exchanged = record();
    exchanged.y = exchanged.r.replace(exchanged.y.clone()).unwrap();
    assert!(refusal(exchanged, &pi()).contains("not R/S"));
}

/// Noise that the controller never saw follows r by chance, and by about as much as is told: in a quarter of the records it does so by
/// more.
#[test]
fn what_follows_r_by_chance_is_taken_off() {
    let r: Vec<f64> = drive(40).iter().flat_map(|r| [*r; 10]).collect();
    let clean = continuous_loop(&plant(), &pi(), 1.0, &r, Hold::Zero, Noise::None).unwrap();
    let (runs, mut above) = (100, 0);
    for seed in 0..runs {
        let w = noise_at_snr(&clean.y, 20.0, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
        let data = continuous_loop(&plant(), &pi(), 1.0, &r, Hold::Zero, Noise::OnRecord(&w));
        let data = data.unwrap();
        let record =
            LoopRecord::closed_loop(1.0, r.clone(), Some(data.u), data.y, Offsets::Deviations);
        let found = controller_mismatch(&record, &pi()).unwrap().unwrap();
        assert!(found.by_chance > 0.0 && found.by_chance < found.rms);
        above += u32::from(found.systematic > 0.0);
    }
    println!("above in {above} of {runs}");
    assert!((12..=40).contains(&above), "{above}");
}

/// Noise at any point, offsets, a sampled controller and printed digits do not count as a mismatch.
#[test]
fn a_controller_that_matches_is_believed() {
    let clean = record();
    let r = clean.r.clone().unwrap();
    let own = controller_mismatch(&clean, &pi()).unwrap().unwrap();
    assert!(own.rms < 1e-2 * own.size, "{own:?}");
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let w = noise_at_snr(&clean.y, 5.0, &mut rng).unwrap();
    for noise in [Noise::InLoop(&w), Noise::OnRecord(&w)] {
        let data = continuous_loop(&plant(), &pi(), 1.0, &r, Hold::Zero, noise).unwrap();
        let u = data.u.iter().map(|u| u + 3.0).collect();
        let record = LoopRecord::closed_loop(1.0, r.clone(), Some(u), data.y, Offsets::Deviations);
        Problem::new(&[record], &pi(), ORDERS).unwrap();
    }
    let sampled = fcloe::sampled_loop(&plant(), &pi(), 1.0, 1, &r, Noise::None, None).unwrap();
    let record = LoopRecord::closed_loop(1.0, r, Some(sampled.u), sampled.y, Offsets::Deviations);
    Problem::new(&[record], &pi(), ORDERS).unwrap();
    let printed = Controller::pi(0.2292, 1.0 / 480.0).unwrap();
    let mismatch = controller_mismatch(&clean, &printed).unwrap().unwrap();
    // Rounding of the coefficients is visible without noise, but is no reason for rejection.
    assert!(mismatch.systematic > 50.0 * own.systematic);
    assert!(mismatch.systematic < 0.01 * mismatch.size);
}

#[test]
fn records_that_say_nothing() {
    let with = |change: &dyn Fn(&mut LoopRecord)| {
        let mut record = record();
        change(&mut record);
        refusal(record, &pi())
    };
    let constant = with(&|record| record.r = Some(vec![2.5; record.y.len()]));
    assert!(constant.contains("r is 2.5 throughout"), "{constant}");
    let missing = with(&|record| record.r = None);
    assert!(missing.contains("no reference r"), "{missing}");
    let infinite = with(&|record| record.y[17] = f64::INFINITY);
    assert!(infinite.contains("y[17] is inf"), "{infinite}");
    let none = with(&|record| record.y.fill(f64::NAN));
    assert!(none.contains("y has no readings"), "{none}");
    let few = with(&|record| record.y[3..].fill(f64::NAN));
    assert!(few.contains("3 samples in all, besides"), "{few}");
    let infinite = with(&|record| record.r.as_mut().unwrap()[3] = f64::INFINITY);
    assert!(infinite.contains("r[3] is inf"), "{infinite}");
    let uneven = with(&|record| record.r.as_mut().unwrap().truncate(7));
    assert!(
        uneven.contains("r has 7 samples but y has 2000"),
        "{uneven}"
    );
    let step = with(&|record| record.step = 0.0);
    assert!(step.contains("sampling interval is 0"), "{step}");
    let short = with(&|record| {
        record.y.truncate(12);
        record.r.as_mut().unwrap().truncate(12);
        record.u = None;
    });
    assert!(
        short.contains("12 samples in all, but 20 are needed"),
        "{short}"
    );
    let rows = with(&|record| record.offsets = Offsets::FirstRows(0));
    assert!(rows.contains("first rows"), "{rows}");
    assert!(
        Problem::new(&[], &pi(), ORDERS)
            .unwrap_err()
            .to_string()
            .contains("no record")
    );
    let open = Problem::new(
        &[LoopRecord {
            u: None,
            ..record()
        }],
        &Controller::none(),
        ORDERS,
    );
    assert!(open.unwrap_err().to_string().contains("no input u"));
    let empty = LoopRecord::closed_loop(1.0, vec![], Some(vec![]), vec![], Offsets::Means);
    assert!(refusal(empty, &pi()).contains("0 samples"));
}

#[test]
fn models_and_settings_that_are_none() {
    assert!(matches!(
        PlantModel::new(&[], &[1.0]),
        Err(Error::OrderZero)
    ));
    assert!(matches!(
        PlantModel::new(&[1.0], &[]),
        Err(Error::Length { .. })
    ));
    assert!(matches!(
        PlantModel::new(&[1.0], &[1.0; 3]),
        Err(Error::Improper { n: 1, m: 2 })
    ));
    assert!(matches!(
        PlantModel::new(&[1.0, 0.0], &[1.0]),
        Err(Error::LeadingZero { n: 2 })
    ));
    assert!(PlantModel::first_order(f64::NAN, 1.0).is_err());
    let p = ct_lti::Polynomial::p();
    assert!(matches!(
        Controller::new(p.pow(2), p.clone()),
        Err(Error::ImproperController { r: 2, s: 1 })
    ));
    assert!(Controller::pid(1.0, 1.0, 1.0, 0.0).is_err());
    assert!(pi().with_sensor_filter(-1.0).is_err());
    assert!(Controller::none().with_sensor_filter(1.0).is_err());
    let problem = Problem::new(&[record()], &pi(), ORDERS).unwrap();
    let zero = PlantModel::first_order(0.0, 110.0);
    let delta = Settings {
        coordinates: Coordinates::Delta,
        ..Settings::default()
    };
    // K = 0 leaves the integrator without a loop: rejected before other checks.
    assert!(problem.fit(&zero.unwrap(), &delta).is_err());
    let tolerance = Settings {
        tolerance: 0.0,
        ..Settings::default()
    };
    assert!(
        problem
            .fit(&plant(), &tolerance)
            .unwrap_err()
            .to_string()
            .contains("tolerance")
    );
    let other = PlantModel::new(&[110.0, 3.0], &[6.0]).unwrap();
    assert!(matches!(
        problem.fit(&other, &Settings::default()),
        Err(Error::Length { .. })
    ));
}

/// Two parameters of which only the product is determined: no standard errors are reported.
#[test]
fn what_the_data_leave_open_has_no_standard_error() {
    // A plant of second order fitted to one of first order without noise: pole and zero may cancel anywhere.
    let orders = Orders { n: 2, m: 1 };
    let problem = Problem::new(&[record()], &pi(), orders).unwrap();
    let start = PlantModel::new(&[140.0, 3300.0], &[6.5, 190.0]).unwrap();
    let fit = problem.fit(&start, &Settings::default()).unwrap();
    assert!(fit.residual_rms() < 1e-6);
    match problem.uncertainty(&fit, None) {
        Err(Error::NotDetermined { parameters: 4, .. }) => {}
        Ok(found) => assert!(found.std_errors.iter().all(|s| s.is_finite())),
        Err(other) => panic!("{other}"),
    }
    let settings = Settings {
        method: fcloe::Method::GaussNewton,
        ..Settings::default()
    };
    let newton = problem.fit(&fit.plant, &settings).unwrap();
    assert!(
        newton.stop == Stop::Singular || newton.stop.was_successful(),
        "{:?}",
        newton.stop
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// For any numbers there is a result or an error.
    #[test]
    fn nothing_panics(
        y in proptest::collection::vec(prop_oneof![-1e3..1e3f64, Just(0.0), Just(1e300), Just(-1e-300)], 0..60),
        r in proptest::collection::vec(prop_oneof![-1e3..1e3f64, Just(1e300)], 60),
        theta in proptest::collection::vec(prop_oneof![-1e3..1e3f64, 0.1..10.0f64, Just(1e200)], 3),
        gains in (-10.0..10.0f64, -1.0..10.0f64),
        step in prop_oneof![0.01..10.0f64, Just(1e-200), Just(1e200)],
        offsets in prop_oneof![
            Just(Offsets::Deviations),
            Just(Offsets::Means),
            Just(Offsets::Estimated),
            Just(Offsets::FirstRows(3)),
            Just(Offsets::Known(OperatingPoint { r: 1.0, u: 2.0, y: 1e200 })),
        ],
    ) {
        let controller = Controller::pi(gains.0, gains.1).unwrap();
        let n = y.len();
        let record = LoopRecord::closed_loop(step, r[..n].to_vec(), None, y, offsets);
        let orders = Orders { n: 2, m: 0 };
        let (Ok(problem), Ok(start)) = (
            Problem::new(&[record], &controller, orders),
            PlantModel::from_theta(orders, &theta),
        ) else {
            return Ok(());
        };
        let settings = Settings { max_iterations: 5, ..Settings::default() };
        if let Ok(fit) = problem.fit(&start, &settings) {
            prop_assert!(fit.plant.theta().iter().all(|t| t.is_finite()));
            let _ = problem.uncertainty(&fit, None);
        }
    }
}
