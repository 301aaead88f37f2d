//! Delays that outputs alone read: a sensor with a dead time.

use ct_model::{Dual, Method, Model, ModelSpec, Scalar, Simulation};

const ROWS: usize = 60;

/// The outputs at rows a second apart, with derivatives by `tau` and `d`.
fn outputs(text: &str, parameters: [f64; 2]) -> Vec<Dual<2>> {
    let model = Model::new(ModelSpec::parse(text).unwrap());
    let parameters = [
        Dual::variable(parameters[0], 0),
        Dual::variable(parameters[1], 1),
    ];
    let starts = model.starts(&parameters);
    let mut simulation = Simulation::new(&model, &parameters, &starts, 0.0);
    let mut read = [Dual::constant(0.0)];
    let mut all = Vec::new();
    for k in 0..ROWS {
        let input = [f64::from((k as i32 / 7 * 5) % 4)];
        simulation.read(&input, &mut read);
        all.push(read[0]);
        simulation.advance(&input, &input, (k + 1) as f64).unwrap();
    }
    all
}

fn text(slope: &str) -> String {
    format!(
        "model Late
           parameter Real tau(min=0.1) = 4;
           parameter Real d(min=0) = 1;
           input Real u;
           output Real y = delay(x, d);
           Real x(start=0.5);
         equation
           tau*der(x) = {slope};
         end Late;"
    )
}

/// A delay of whole rows gives earlier rows of the state; of a part of a row what lies between them, here by a fine reference.
#[test]
fn a_late_reading_is_that_of_an_earlier_time() {
    for slope in ["u - x", "u - x - 0.2*x^2", "u - max(x - 0.8, 0.3*x)"] {
        let now = outputs(&text(slope), [4.0, 0.0]);
        for rows in [1, 3] {
            let late = outputs(&text(slope), [4.0, rows as f64]);
            for k in 0..ROWS {
                let earlier = now[k.saturating_sub(rows)].re;
                assert!((late[k].re - earlier).abs() < 1e-6, "{slope} {rows} {k}");
            }
        }
        for d in [0.03, 0.4, 2.7] {
            let late = outputs(&text(slope), [4.0, d]);
            for (i, step) in [(0, 1e-4), (1, 1e-4)] {
                let moved = |by: f64| {
                    let mut parameters = [4.0, d];
                    parameters[i] += by;
                    outputs(&text(slope), parameters)
                };
                let (above, below) = (moved(step), moved(-step));
                for k in 0..ROWS {
                    let slope_there = (above[k].re - below[k].re) / (2.0 * step);
                    let error = (late[k].eps[i] - slope_there).abs();
                    assert!(error < 1e-4, "{slope} {d} {i} {k}: {error}");
                }
            }
        }
    }
}

/// Between rows: of a state with a known solution.
#[test]
fn a_late_reading_between_rows_is_exact() {
    let fading = text("0*u - x");
    for d in [0.03, 0.4, 2.7] {
        for (k, late) in outputs(&fading, [4.0, d]).iter().enumerate() {
            let since = (k as f64 - d).max(0.0);
            let error = (late.re - 0.5 * (-since / 4.0).exp()).abs();
            assert!(error < 1e-7, "{d} {k}: {error}");
        }
    }
}

/// Linear models are integrated exactly, also with several pieces in an interval and inputs in straight lines; with a branch in the delayed
/// signal, which bends within an interval, the steps end there.
#[test]
fn a_linear_model_with_a_late_reading_is_simulated_exactly() {
    let read = |text: &str, by: f64, rows: usize| {
        let model = Model::new(ModelSpec::parse(text).unwrap());
        let parameters = [0.7, by];
        let starts = model.starts(&parameters);
        let mut simulation = Simulation::<f64>::new(&model, &parameters, &starts, 0.0);
        let every = 0.7 / 3.0 * (60.0 / rows as f64);
        let input = |k: usize| (0.3 * k as f64 * every).sin();
        let mut all = Vec::new();
        for k in 0..rows {
            let mut y = [0.0];
            let (from, to) = ([input(k)], [input(k + 1)]);
            simulation.read(&from, &mut y);
            all.push(y[0]);
            simulation
                .advance(&from, &to, every * (k + 1) as f64)
                .unwrap();
        }
        (all, simulation.method())
    };
    let bent = text("u - x").replace("delay(x, d)", "delay(max(x - 0.4, 0), d)");
    for (text, method) in [(text("u - x"), Method::Exact), (bent, Method::Explicit)] {
        for by in [0.1, 1.3] {
            // The input of the finer rows is another one between those of the coarse ones: a smooth input differs little.
            let (fine, _) = read(&text, by, 6000);
            let (coarse, found) = read(&text, by, 600);
            assert_eq!(found, method);
            for (k, y) in coarse.iter().enumerate() {
                let error = (y - fine[10 * k]).abs();
                assert!(error < 1e-5, "{text} {by} {k}: {error}");
            }
        }
    }
    let text = text("u - x");
    let (few, method) = read(&text, 0.5, 20);
    assert_eq!(method, Method::Exact);
    assert!(few.iter().all(|y| y.abs() < 2.0), "{few:?}");
}

/// A delay of zero has the derivative of a small one.
#[test]
fn the_derivative_by_a_delay_of_zero_is_one_sided() {
    let none = outputs(&text("u - x"), [4.0, 0.0]);
    let some = outputs(&text("u - x"), [4.0, 1e-6]);
    for (k, (none, some)) in none.iter().zip(&some).enumerate().skip(1) {
        let slope = (some.re - none.re) / 1e-6;
        assert!(
            (none.eps[1] - slope).abs() < 1e-4,
            "{k}: {} {slope}",
            none.eps[1]
        );
    }
}
