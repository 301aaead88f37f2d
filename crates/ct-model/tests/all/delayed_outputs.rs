//! Delays that outputs alone read: a sensor with a dead time.

use ct_model::{Dual, Model, ModelSpec, Scalar, Simulation};

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
