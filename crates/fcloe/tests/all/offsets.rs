//! Levels of r, u and y: known, from the first rows, estimated; and the effect of wrong ones. Several records.

use crate::support::drive;
use ct_lti::Hold;
use fcloe::{
    Controller, LoopRecord, Noise, Offsets, OperatingPoint, Orders, PlantModel, Problem, Settings,
    continuous_loop,
};

const POINT: OperatingPoint = OperatingPoint {
    r: 20.0,
    u: 7.7,
    y: 20.0,
};

fn plant() -> PlantModel {
    PlantModel::new(&[210.0, 9000.0], &[5.0, 40.0]).unwrap()
}

fn pi() -> Controller {
    Controller::pi(0.3, 0.004).unwrap()
}

/// A loop that rests at the point for 5 samples and then follows the drive, raw levels recorded.
fn record(
    controller: &Controller,
    n: usize,
    point: OperatingPoint,
    offsets: Offsets,
) -> LoopRecord {
    let mut drive = drive(n);
    drive[..5].fill(0.0);
    let data = continuous_loop(&plant(), controller, 4.0, &drive, Hold::Zero, Noise::None).unwrap();
    let raise = |v: Vec<f64>, level: f64| -> Vec<f64> { v.iter().map(|v| v + level).collect() };
    let (u, y) = (raise(data.u, point.u), raise(data.y, point.y));
    if controller.is_open_loop() {
        LoopRecord::open_loop(4.0, u, y, offsets)
    } else {
        LoopRecord::closed_loop(4.0, raise(drive, point.r), Some(u), y, offsets)
    }
}

fn fit(records: &[LoopRecord], controller: &Controller) -> (Problem, fcloe::Fit) {
    let problem = Problem::new(records, controller, plant().orders()).unwrap();
    let start = PlantModel::new(&[170.0, 11000.0], &[6.0, 30.0]).unwrap();
    let fit = problem.fit(&start, &Settings::default()).unwrap();
    (problem, fit)
}

fn error(fit: &fcloe::Fit) -> f64 {
    let plant = plant();
    let pairs = plant.theta().iter().zip(fit.plant.theta());
    pairs.map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn levels_known_read_or_estimated_give_the_plant() {
    for controller in [pi(), Controller::none()] {
        for offsets in [
            Offsets::Known(POINT),
            Offsets::FirstRows(5),
            Offsets::Estimated,
        ] {
            let (_, fit) = fit(&[record(&controller, 1200, POINT, offsets)], &controller);
            assert!(error(&fit) < 1e-8, "{offsets:?}: {:.1e}", error(&fit));
        }
    }
}

/// The levels are estimated although the record begins during a transient, where the first row is no operating point.
#[test]
fn levels_are_estimated_from_a_wrong_first_row() {
    let point = OperatingPoint {
        r: 3.0,
        u: 1.0,
        y: 5.0,
    };
    let mut wrong = record(&pi(), 1200, point, Offsets::Estimated);
    wrong.r.as_mut().unwrap()[0] += 2.0;
    wrong.u = None;
    let data = {
        let r: Vec<f64> = wrong
            .r
            .as_ref()
            .unwrap()
            .iter()
            .map(|r| r - point.r)
            .collect();
        continuous_loop(&plant(), &pi(), 4.0, &r, Hold::Zero, Noise::None).unwrap()
    };
    wrong.y = data.y.iter().map(|y| y + point.y).collect();
    let (problem, fit) = fit(&[wrong], &pi());
    assert!(error(&fit) < 1e-7, "{:.1e}", error(&fit));
    assert!((fit.levels[0].drive - 3.0).abs() < 1e-6 && (fit.levels[0].y - 5.0).abs() < 1e-6);
    assert_eq!(problem.uncertainty(&fit, None).unwrap().covariance.len(), 6);
}

/// Raw levels that are declared as deviations are reported: the loop seems to start with a step, and the residual shows this.
#[test]
fn raw_levels_called_deviations_leave_a_residual() {
    let raw = record(&pi(), 1200, POINT, Offsets::Deviations);
    let (_, fit) = fit(&[LoopRecord { u: None, ..raw }], &pi());
    assert!(fit.residual_rms() > 0.1);
    assert!(error(&fit) > 0.05);
}

/// Each record keeps its own levels and begins at rest: a joint fit is better than a fit of the concatenated records.
#[test]
fn several_records_with_levels_of_their_own() {
    let other = OperatingPoint {
        r: -4.0,
        u: 0.3,
        y: -4.0,
    };
    let one = record(&pi(), 700, POINT, Offsets::Estimated);
    let two = record(&pi(), 450, other, Offsets::FirstRows(3));
    let (problem, together) = fit(&[one.clone(), two.clone()], &pi());
    assert_eq!(problem.samples(), 1150);
    assert!(error(&together) < 1e-8, "{:.1e}", error(&together));
    assert!((together.levels[0].drive - 20.0).abs() < 1e-6);
    assert_eq!(together.levels[1].drive, -4.0);

    let glue = |a: &[f64], b: &[f64], by: f64| -> Vec<f64> {
        a.iter().copied().chain(b.iter().map(|b| b - by)).collect()
    };
    let glued = LoopRecord::closed_loop(
        4.0,
        glue(one.r.as_ref().unwrap(), two.r.as_ref().unwrap(), -24.0),
        None,
        glue(&one.y, &two.y, -24.0),
        Offsets::FirstRows(5),
    );
    assert!(error(&fit(&[glued], &pi()).1) > 1e-3);
}

/// The same recordings split into two with different sampling intervals.
#[test]
fn records_may_have_steps_of_their_own() {
    let mut coarse = record(&pi(), 800, POINT, Offsets::Known(POINT));
    let fine = {
        let drive = drive(900);
        let data = continuous_loop(&plant(), &pi(), 1.5, &drive, Hold::First, Noise::None).unwrap();
        LoopRecord {
            r_hold: Hold::First,
            ..LoopRecord::closed_loop(1.5, drive, Some(data.u), data.y, Offsets::Deviations)
        }
    };
    coarse.name = "coarse".into();
    let (_, both) = fit(&[coarse, fine], &pi());
    assert!(error(&both) < 1e-8, "{:.1e}", error(&both));
}

#[test]
fn a_file_becomes_a_record() {
    use ct_signals::{Channel, Record};
    let n = 40;
    let record = |time: Vec<f64>| Record {
        name: "loop.csv".into(),
        time,
        inputs: vec![Channel::new("u", "V", vec![1.0; n])],
        outputs: vec![Channel::new("y", "cm", vec![2.0; n])],
        references: vec![Channel::new("r", "cm", vec![3.0; n])],
        ..Record::default()
    };
    let even = record((0..n).map(|k| 0.5 * k as f64).collect());
    let found = LoopRecord::from_record(&even, Offsets::Means).unwrap();
    assert_eq!((found.step, found.len()), (0.5, n));
    assert_eq!(
        found.operating_point(),
        OperatingPoint {
            r: 3.0,
            u: 1.0,
            y: 2.0
        }
    );
    let mut time = even.time.clone();
    time[30..].iter_mut().for_each(|t| *t += 0.2);
    let error = LoopRecord::from_record(&record(time), Offsets::Means).unwrap_err();
    assert!(error.to_string().contains("time[30] is 0.69"), "{error}");
    // a millionth of the step, whatever the unit of time
    for step in [1e-3, 1.0, 1e3] {
        for (share, even) in [(5e-7, true), (5e-6, false)] {
            let mut time: Vec<f64> = (0..n).map(|k| step * k as f64).collect();
            time[20] += share * step;
            let found = LoopRecord::from_record(&record(time), Offsets::Means);
            assert_eq!(found.is_ok(), even, "{step} {share}");
        }
    }
    let orders = Orders { n: 1, m: 0 };
    assert!(
        Problem::new(&[found], &pi(), orders)
            .unwrap_err()
            .to_string()
            .contains("throughout")
    );
}
