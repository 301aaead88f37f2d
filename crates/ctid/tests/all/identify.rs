//! Identification from a record: results, uncertainty, and errors.

#![allow(clippy::unwrap_used)]

mod program;

use ct_lti::{Simulator, StateSpace, TransferFunction};
use ct_signals::{Channel, Hold, Record, excitation, noise};
use linear_identification::{Identification, Method, Order, Request, Warning, identify};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;

const STEP: f64 = 1.0;

/// A plant, its operating point, and the noise on its output.
#[derive(Clone, Copy)]
pub struct Plant {
    pub a: &'static [f64],
    pub b: &'static [f64],
    /// Input and output at rest, about which both move.
    pub rest: (f64, f64),
    pub noise: f64,
    /// Correlation of the noise from sample to sample.
    pub colour: f64,
    pub hold: Hold,
}

pub const FIRST: Plant = Plant {
    a: &[1.0, 20.0],
    b: &[3.0],
    rest: (5.0, 40.0),
    noise: 0.0,
    colour: 0.0,
    hold: Hold::Zero,
};

pub const SECOND: Plant = Plant {
    a: &[1.0, 25.0, 150.0],
    ..FIRST
};

impl Plant {
    pub fn record(&self, rows: usize, seed: u64) -> Record {
        self.sampled(rows, seed, |_| STEP)
    }

    /// With steps of `step(k)` s.
    fn sampled(&self, rows: usize, seed: u64, step: impl Fn(usize) -> f64) -> Record {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let u = excitation::steps(rows, 10..=40, -1.0, 1.0, &mut rng).unwrap();
        let v = noise::ar1(rows, self.noise, self.colour, &mut rng);
        let model = TransferFunction::from_coefficients(self.b, self.a).unwrap();
        let hold = match self.hold {
            Hold::Zero => ct_lti::Hold::Zero,
            Hold::First => ct_lti::Hold::First,
        };
        let mut plant = Simulator::new(StateSpace::controllable(&model).unwrap(), hold);
        let before = |k: usize| if k == 0 { 0.0 } else { step(k - 1) };
        let y = (0..rows).map(|k| self.rest.1 + plant.update(u[k], before(k)).unwrap() + v[k]);
        Record {
            name: "simulated".into(),
            outputs: vec![Channel::new("y", "cm", y.collect())],
            time: (0..rows)
                .scan(100.0, |time, k| {
                    *time += before(k);
                    Some(*time)
                })
                .collect(),
            inputs: vec![
                Channel::new("u", "V", u.iter().map(|u| u + self.rest.0).collect())
                    .with_hold(self.hold),
            ],
            ..Record::default()
        }
    }

    /// The parameters, the offset last.
    fn truth(&self) -> Vec<f64> {
        let offset = self.rest.1 - self.b[0] * self.rest.0;
        [&self.a[1..], self.b, &[offset]].concat()
    }

    fn order(&self) -> Order {
        Order {
            n: self.a.len() - 1,
            m: self.b.len() - 1,
        }
    }
}

fn found(record: &Record, method: Method, order: Order) -> Identification {
    let request = Request::new(method, order);
    identify(record, &request).unwrap()
}

const METHODS: [Method; 2] = [Method::CtRls, Method::StabilizedOe];

#[test]
fn without_noise_the_plant_is_found_in_its_units() {
    let zero = Plant {
        b: &[3.0, 12.0],
        ..SECOND
    };
    let third = Plant {
        a: &[1.0, 30.0, 275.0, 750.0],
        ..FIRST
    };
    let line = Plant {
        hold: Hold::First,
        ..SECOND
    };
    for (plant, close) in [
        (FIRST, 0.01),
        (SECOND, 0.02),
        (zero, 0.03),
        (third, 0.1),
        (line, 0.02),
    ] {
        for method in METHODS {
            let found = found(&plant.record(3000, 1), method, plant.order());
            for (parameter, truth) in found.parameters.iter().zip(plant.truth()) {
                assert!(
                    (parameter.value - truth).abs() < close * truth.abs(),
                    "{method:?}: {} is {}, not {truth}",
                    parameter.name,
                    parameter.value
                );
            }
            assert!(found.fit_percent > 99.0, "{}", found.fit_percent);
            assert_eq!(found.warnings, Vec::<Warning>::new(), "{method:?}");
        }
    }
}

#[test]
fn units_and_dynamics_are_those_of_the_record() {
    let plant = Plant {
        b: &[3.0, 12.0],
        ..SECOND
    };
    let found = found(&plant.record(3000, 1), Method::CtRls, plant.order());
    let units: Vec<&str> = found.parameters.iter().map(|p| &*p.unit).collect();
    assert_eq!(units, ["s", "s^2", "cm/V", "s cm/V", "cm"]);
    let [slow, fast] = found.time_constants[..] else {
        unreachable!()
    };
    assert!((slow - 15.0).abs() < 0.5 && (fast - 10.0).abs() < 0.5);
    let trajectory = found.trajectory.unwrap();
    assert_eq!(trajectory.time.last(), Some(&3099.0));
    assert!(
        trajectory
            .values
            .iter()
            .all(|values| values.len() == trajectory.time.len())
    );
}

/// Standard errors compared with the spread over noises, and 1.96 of them with the truth.
#[test]
fn the_output_error_says_how_sure_it_is() {
    const NOISES: u64 = 60;
    for (plant, colour) in [(FIRST, 0.0), (SECOND, 0.0), (FIRST, 0.9), (SECOND, 0.9)] {
        let plant = Plant {
            noise: 0.3,
            colour,
            ..plant
        };
        let truth = plant.truth();
        let results: Vec<Vec<(f64, f64)>> = (0..NOISES)
            .into_par_iter()
            .map(|seed| {
                let record = plant.record(3000, seed);
                let found = found(&record, Method::StabilizedOe, plant.order());
                let pair = |p: &missing_effect::Parameter| (p.value, p.std_error.unwrap());
                found.parameters.iter().map(pair).collect()
            })
            .collect();
        let count = NOISES as f64;
        for (i, truth) in truth.iter().enumerate() {
            let of = |f: fn((f64, f64)) -> f64| results.iter().map(move |r| f(r[i]));
            let mean = of(|r| r.0).sum::<f64>() / count;
            let scatter = (of(|r| r.0).map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
            let said = of(|r| r.1).sum::<f64>() / count;
            let covered = results
                .iter()
                .filter(|r| (r[i].0 - truth).abs() < 1.96 * r[i].1);
            let covered = covered.count() as f64 / count;
            // Scatter of 60 runs: 9 %.
            let ratio = said / scatter;
            println!(
                "parameter {i}, colour {colour}: said/scatter {ratio:.2}, covered {covered:.2}"
            );
            assert!(
                (0.65..1.7).contains(&ratio),
                "parameter {i}, colour {colour}: says {said}, scatters by {scatter}"
            );
            assert!(
                covered >= 0.8,
                "parameter {i}, colour {colour}: covers {covered}"
            );
        }
    }
}

#[test]
fn steps_longer_than_the_time_constant_do_not_become_it() {
    let time_constant = |step: fn(usize) -> f64| {
        let plant = Plant {
            noise: 0.01,
            ..FIRST
        };
        let record = plant.sampled(1500, 2, step);
        let found = found(&record, Method::StabilizedOe, plant.order());
        let told = found
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::BelowStep { .. }));
        (found.parameters[0].value, told)
    };
    // Between samples the output is not linear, which biases the estimate; steps longer than a time constant give a warning.
    let (short, told) = time_constant(|k| if k % 2 == 0 { 0.5 } else { 1.5 });
    assert!((short - 20.0).abs() < 0.2 && !told, "{short}");
    let (turns, told) = time_constant(|k| if k % 2 == 0 { 5.0 } else { 25.0 });
    assert!((turns - 20.0).abs() < 2.0 && told, "{turns}");
    let (long, told) = time_constant(|_| 30.0);
    assert!((long - 20.0).abs() < 2.0 && told, "{long}");
}

#[test]
fn where_a_bound_has_held_a_parameter_no_standard_error_is_given() {
    let plant = Plant {
        noise: 0.1,
        ..FIRST
    };
    let record = plant.sampled(1500, 2, |_| 5.0);
    let request = Request {
        memory: Some(100.0),
        ..Request::new(Method::StabilizedOe, Order { n: 3, m: 0 })
    };
    let found = identify(&record, &request).unwrap();
    let second = Some(Order { n: 2, m: 0 });
    let held = |warning: &Warning| matches!(warning, Warning::HeldByBound { steps: 1.., lower } if *lower == second);
    assert!(found.warnings.iter().any(held), "{:?}", found.warnings);
    assert!(found.parameters.iter().all(|p| p.std_error.is_none()));
    assert!(found.drift.is_none());
}

#[test]
fn noise_biases_the_equation_error_and_the_program_says_so() {
    let plant = Plant {
        noise: 0.3,
        ..SECOND
    };
    let record = plant.record(3000, 3);
    let [biased, sound] = METHODS.map(|method| found(&record, method, plant.order()));
    assert!(biased.parameters[1].value < 0.6 * 150.0);
    assert!(biased.simulation_rmse > sound.simulation_rmse);
    let parameter = &sound.parameters[1];
    assert!((parameter.value - 150.0).abs() < 3.0 * parameter.std_error.unwrap());
}

#[test]
fn an_order_too_high_is_said() {
    let plant = Plant {
        noise: 0.1,
        ..FIRST
    };
    let order = Order { n: 2, m: 0 };
    let found = found(&plant.record(2000, 4), Method::StabilizedOe, order);
    let first = Some(Order { n: 1, m: 0 });
    let too_high = |warning: &Warning| match warning {
        Warning::NotSignificant { lower, .. } | Warning::BelowStep { lower, .. } => *lower == first,
        _ => false,
    };
    assert!(found.warnings.iter().any(too_high), "{:?}", found.warnings);
}

#[test]
fn drift_with_the_operating_point_leaves_the_band() {
    // The gain doubles half way: the estimates before and after differ significantly.
    let plant = Plant {
        noise: 0.1,
        ..FIRST
    };
    let mut record = plant.record(4000, 5);
    for y in &mut record.outputs[0].values[2000..] {
        *y = 40.0 + 2.0 * (*y - 40.0);
    }
    let found = found(&record, Method::StabilizedOe, plant.order());
    let trajectory = found.trajectory.unwrap();
    let at = |t: f64| trajectory.time.iter().position(|time| *time >= t).unwrap();
    let (before, after) = (at(2090.0), trajectory.time.len() - 1);
    let [(low, low_error), (high, high_error)] =
        [before, after].map(|k| (trajectory.values[1][k], trajectory.std_errors[1][k]));
    assert!(low + 3.0 * low_error < high - 3.0 * high_error);
}

/// A tank with Torricelli's law, `20 y' = 8 u - 2 sqrt(y)`, or its linearisation near `y = 16`; the input drifts, with steps added.
fn wandering(linear: bool, seed: u64) -> Record {
    let (rows, fine) = (12_000, 5);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let steps = excitation::steps(rows, 20..=80, -0.1, 0.1, &mut rng).unwrap();
    let noise = noise::ar1(rows, 0.3, 0.7, &mut rng);
    let (mut y, mut output, mut input) = (16.0_f64, Vec::new(), Vec::new());
    for k in 0..rows {
        let slow = (k as f64 / 8000.0 * std::f64::consts::TAU).sin();
        let u = 1.0 + 0.4 * slow + steps[k];
        output.push(y + noise[k]);
        input.push(u);
        for _ in 0..fine {
            let outflow = if linear {
                4.0 + y / 4.0
            } else {
                2.0 * y.sqrt()
            };
            y += STEP / fine as f64 * (8.0 * u - outflow) / 20.0;
        }
    }
    Record {
        name: "tank".into(),
        time: (0..rows).map(|k| k as f64 * STEP).collect(),
        inputs: vec![Channel::new("u", "V", input)],
        outputs: vec![Channel::new("y", "cm", output)],
        ..Record::default()
    }
}

#[test]
fn drift_with_the_level_is_told_of_a_tank_and_not_of_a_linear_process() {
    let order = Order { n: 1, m: 0 };
    let drift = |linear, seed| {
        let request = Request {
            memory: Some(600.0),
            ..Request::new(Method::StabilizedOe, order)
        };
        identify(&wandering(linear, seed), &request)
            .unwrap()
            .drift
            .unwrap()
    };
    let tank = drift(false, 1);
    assert!(tank.gain.difference > 3.0, "{tank:?}");
    assert!(tank.gain.moves());
    assert!(tank.level.is_sorted());
    // By Torricelli's law the gain is proportional to the root of the level, here a ratio of 1.9; the recursion's memory reduces the ratio.
    let [low, high] = [0, tank.level.len() - 1].map(|i| tank.gain.values[i]);
    assert!((1.3..2.2).contains(&(high / low)), "{tank:?}");

    let blamed = (0..20)
        .into_par_iter()
        .map(|seed| drift(true, seed))
        .filter(|drift| drift.gain.moves() || drift.time_constant.moves())
        .count();
    assert!(blamed <= 1, "{blamed} of 20 linear processes are blamed");
}

#[test]
fn a_memory_too_short_for_standard_errors_is_said() {
    let request = Request {
        memory: Some(60.0),
        ..Request::new(Method::StabilizedOe, SECOND.order())
    };
    let found = identify(&SECOND.record(2000, 1), &request).unwrap();
    assert!(found.parameters.iter().all(|p| p.std_error.is_none()));
    assert!(found.drift.is_none());
    let said = |warning: &Warning| matches!(warning, Warning::StdErrorsUnknown { memory, needed, .. } if needed > memory);
    assert!(found.warnings.iter().any(said), "{:?}", found.warnings);
}
