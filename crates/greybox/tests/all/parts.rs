//! Parts of one experiment share a clock: functions of time continue through them as in the whole record.

use std::collections::BTreeMap;

use ct_signals::{Channel, Record, excitation, noise};
use greybox::{Noise, Setup, Stopping, fit_from};
use plants::{
    Command, EffectInfo, Fitted, Known, Place, Placed, Plant, Scales, Simulator, Structure, Term,
    Variable,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const SAMPLES: usize = 600;
const INTERVAL: f64 = 2.0;
/// First sample of the second part.
const CUT: usize = 250;
/// Time stamp of the first sample.
const BEGIN: f64 = 1000.0;
const BASE: [f64; 2] = [10.0, 12.5];

fn structure() -> Structure {
    let known = Known {
        area: [Some(154.0), None, None],
        ..Known::default()
    };
    let duration = INTERVAL * (SAMPLES - 1) as f64;
    let scales = Scales::from_ranges((3.5, 6.5), (5.0, 30.0), INTERVAL, duration);
    Structure::new(Plant::SingleTank, known, scales)
}

fn with(id: &str) -> Structure {
    let effect = EffectInfo::find(id).unwrap();
    structure().with(Placed { effect, vessel: 0 }).unwrap()
}

/// Structures with a function of time, and their parameters.
fn cases() -> Vec<(Structure, Vec<f64>)> {
    let end = INTERVAL * (SAMPLES - 1) as f64;
    let mut cases: Vec<(Structure, Vec<f64>)> = [
        ("valve_drift", vec![-0.1]),
        ("sensor_drift", vec![1.5]),
        ("valve_step", vec![0.1, 0.2 * end]),
        ("valve_step", vec![0.1, 0.7 * end]),
        ("periodic_disturbance", vec![2.0, 3.0, 0.13 * end]),
        ("pump_gain_drift", vec![-0.1, 0.3 * end]),
    ]
    .into_iter()
    .map(|(id, parameters)| (with(id), parameters))
    .collect();
    for place in [Place::Actuator, Place::Vessel, Place::Sensor] {
        let term = Term {
            name: "course".to_string(),
            place,
            vessel: 0,
            variable: Variable::Time,
            knots: vec![0.0, 0.3 * end, 0.8 * end, end],
            ordinates: vec![0.0, 0.5, -0.5, 0.2],
            fitted: Fitted::Scale,
        };
        cases.push((structure().with_term(term).unwrap(), vec![1.0]));
    }
    cases
}

/// The whole record without noise, and the level at the cut.
fn whole(structure: &Structure, own: &[f64], seed: u64) -> (Record, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let u = excitation::steps(SAMPLES, 20..=60, 3.5, 6.5, &mut rng).unwrap();
    let theta = [&BASE, own].concat();
    let mut simulator = Simulator::new(structure, &theta, &[16.0], u[0]).unwrap();
    simulator.set_substeps(4);
    let (mut y, mut at_cut) = (Vec::new(), 0.0);
    for (k, &u) in u.iter().enumerate() {
        if k == CUT {
            at_cut = simulator.levels()[0];
        }
        y.push(simulator.read(0));
        simulator.advance(Command::held(u), INTERVAL);
    }
    let record = Record {
        name: "whole".into(),
        time: (0..SAMPLES).map(|k| BEGIN + k as f64 * INTERVAL).collect(),
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![Channel::new("y", "cm", y)],
        ..Record::default()
    };
    (record, at_cut)
}

fn parts(whole: &Record) -> [Record; 2] {
    [whole.rows(0..CUT), whole.rows(CUT..SAMPLES)]
}

/// Largest difference of two series.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

#[test]
fn what_follows_time_runs_through_the_parts() {
    for (structure, own) in cases() {
        let (whole, at_cut) = whole(&structure, &own, 1);
        let parts = parts(&whole);
        let x = [&BASE[..], &own, &[16.0, at_cut]].concat();
        let simulated = |records: &[Record]| {
            let mut setup = Setup::new(structure.clone(), records, BTreeMap::new()).unwrap();
            setup.substeps = 4;
            // The rows with derivatives are of the same simulation.
            let rows = setup.rows(&x).unwrap();
            let residuals = setup.residuals(&x).unwrap().concat();
            let of_rows = rows.residuals().concat();
            assert!(apart(&residuals, &of_rows) < 1e-9);
            setup.simulate(&x).unwrap().output
        };
        let name = structure.parameter_names().join(" ");
        let together = simulated(&parts);
        assert!(
            apart(&together.concat(), &whole.outputs[0].values) < 1e-9,
            "{name}"
        );
        // With a separate time zero, the second part is another experiment.
        let [first, mut second] = parts.clone();
        second.time.iter_mut().for_each(|t| *t -= whole.time[CUT]);
        let unrelated = simulated(&[first, second]);
        assert_eq!(together[0], unrelated[0], "{name}");
        assert!(apart(&together[1], &unrelated[1]) > 1e-3, "{name}");
    }
}

#[test]
fn a_held_out_record_continues_the_clock_where_it_lies_after() {
    let drift = with("valve_drift");
    let (whole, at_cut) = whole(&drift, &[-0.1], 1);
    let [first, second] = parts(&whole);
    let fitted = [first.clone()];
    let mut setup = Setup::new(drift, &fitted, BTreeMap::new()).unwrap();
    setup.substeps = 4;
    let x = [10.0, 12.5, -0.1, at_cut];
    let held_out = |record: &Record| {
        let records = std::slice::from_ref(record);
        let own = setup.with_records(records).unwrap();
        // A change of the structure does not reset it.
        let own = own.with_structure(own.structure.clone()).unwrap();
        own.simulate(&x).unwrap().output.concat()
    };
    assert!(apart(&held_out(&second), &whole.outputs[0].values[CUT..]) < 1e-9);
    let mut unrelated = second.clone();
    unrelated
        .time
        .iter_mut()
        .for_each(|t| *t -= whole.time[CUT]);
    assert!(apart(&held_out(&unrelated), &whole.outputs[0].values[CUT..]) > 1e-3);
}

#[test]
fn the_same_drift_is_found_in_the_parts_and_in_the_whole() {
    let change = -0.1;
    let (mut whole, at_cut) = whole(&with("valve_drift"), &[change], 1);
    let noise = noise::white(SAMPLES, 0.05, &mut ChaCha8Rng::seed_from_u64(2));
    for (y, e) in whole.outputs[0].values.iter_mut().zip(noise) {
        *y += e;
    }
    let parts = parts(&whole);
    let stopping = Stopping {
        evaluations: 80,
        cost: 1e-10,
    };
    let found = |records: &[Record], levels: &[f64]| {
        let effect = EffectInfo::find("valve_drift").unwrap();
        let known = structure().known.clone();
        let placed = [Placed { effect, vessel: 0 }];
        let setup =
            Setup::from_records(Plant::SingleTank, known, &placed, records, BTreeMap::new());
        let setup = setup.unwrap();
        assert_eq!(
            setup.structure.scales.duration,
            INTERVAL * (SAMPLES - 1) as f64
        );
        let start = [&BASE[..], &[0.0], levels].concat();
        let fit = fit_from(&setup, &[start], &Noise::white(1), stopping).unwrap();
        (fit.x[2], fit.std_errors()[2].unwrap())
    };
    let (one, error) = found(std::slice::from_ref(&whole), &[16.0]);
    let (two, error_of_parts) = found(&parts, &[16.0, at_cut]);
    println!("change {one} ± {error} in the whole, {two} ± {error_of_parts} in the parts");
    for (value, error) in [(one, error), (two, error_of_parts)] {
        assert!((value - change).abs() < 3.0 * error, "{value} ± {error}");
    }
    assert!((one - two).abs() < error && error_of_parts < 1.2 * error);
}
