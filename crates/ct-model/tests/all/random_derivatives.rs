//! Derivatives of random models, through whatever events their expressions have, against central differences.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use ct_model::{Dual, Model, ModelSpec, Scalar, Simulation, SimulationNumber};

const PARAMETERS: usize = 3;
const ROWS: usize = 40;
const STEP: f64 = 0.2;
/// Derivatives: three parameters and at most four initial states.
const LANES: usize = 8;
/// Largest error of a derivative, as a share of its largest value over the record, ...
const ERROR: f64 = 1e-5;
/// ... at a row in which two central differences, of which one has half the step, agree within this share.
const AGREE: f64 = 3e-6;

/// Without the offset of a comparison, its two sides may touch without crossing, as `x` and `sin(x)` almost do at zero: the time of such an
/// event is not determined.
///
/// An expression of the parameters `p0`..`p2`, the states `x0`.. and the input `u`.
fn expression(states: usize) -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        2 => (0..PARAMETERS).prop_map(|i| format!("p{i}")),
        3 => (0..states).prop_map(|i| format!("x{i}")),
        2 => Just("u".to_string()),
        1 => Just("time".to_string()),
        1 => (0.1..2.0).prop_map(|value: f64| format!("{value:.3}")),
    ];
    leaf.prop_recursive(4, 16, 4, |inner| {
        let two = (inner.clone(), inner.clone());
        let four = (inner.clone(), inner.clone(), inner.clone(), inner.clone());
        prop_oneof![
            (two.clone(), prop_oneof![Just("+"), Just("-"), Just("*")])
                .prop_map(|((a, b), operator)| format!("({a} {operator} {b})")),
            two.clone()
                .prop_map(|(a, b)| format!("({a})/(1 + ({b})^2)")),
            two.prop_map(|(a, b)| format!("max({a}, {b})")),
            inner.clone().prop_map(|a| format!("sin({a})")),
            inner.clone().prop_map(|a| format!("exp(-({a})^2)")),
            inner.prop_map(|a| format!("abs({a})")),
            four.prop_map(|(a, b, c, d)| format!("(if {a} > {b} + 0.137 then {c} else {d})")),
        ]
    })
}

/// No two of the values are equal, so that no model begins at a corner. States that decay, each pushed by an expression of limited size.
fn text() -> impl Strategy<Value = String> {
    (1..=4_usize).prop_flat_map(|states| {
        proptest::collection::vec(expression(states), states).prop_map(move |pushes| {
            let declared: String = (0..states)
                .map(|i| format!("  Real x{i}(start={});\n", 0.313 * i as f64 - 0.217))
                .collect();
            let equations = pushes.iter().enumerate();
            let equations: String = equations
                .map(|(i, push)| format!("  der(x{i}) = tanh({push}) - {}*x{i};\n", 0.3 + i as f64))
                .collect();
            let sum: Vec<String> = (0..states).map(|i| format!("x{i}")).collect();
            format!(
                "model Random\n  parameter Real p0 = 0.713;\n  parameter Real p1 = -0.417;\n  parameter Real p2 = 1.327;\n  input Real u;\n{declared}  \
                 output Real y = {} + 0*(p0 + p1 + p2 + u);\nequation\n{equations}end Random;\n",
                sum.join(" + ")
            )
        })
    })
}

/// The output in all rows; `None` if the simulation ends.
fn output<T: SimulationNumber>(model: &Model, parameters: &[T], initial: &[T]) -> Option<Vec<T>> {
    let mut simulation = Simulation::new(model, parameters, initial, 0.0);
    let mut y = [T::constant(0.0)];
    let mut rows = Vec::new();
    for k in 0..ROWS {
        let u = [if (k / 7) % 2 == 0 { 0.523 } else { -1.119 }];
        simulation.read(&u, &mut y);
        rows.push(y[0]);
        simulation.advance(&u, &u, STEP * (k + 1) as f64).ok()?;
    }
    Some(rows)
}

proptest! {
    // The same models in every run.
    #![proptest_config(ProptestConfig { max_shrink_iters: 200, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn derivatives_are_those_of_differences(text in text()) {
        let model = Model::new(ModelSpec::parse(&text).unwrap());
        let parameters = model.parameters();
        let all = [parameters.clone(), model.starts(&parameters)].concat();
        let duals: Vec<_> = (0..all.len()).map(|i| Dual::<LANES>::variable(all[i], i)).collect();
        let exact = output(&model, &duals[..PARAMETERS], &duals[PARAMETERS..]);
        prop_assume!(exact.is_some());
        let exact = exact.unwrap();
        let difference = |i: usize, step: f64| -> Option<Vec<f64>> {
            let at = |moved: f64| {
                let mut all = all.clone();
                all[i] += moved;
                output(&model, &all[..PARAMETERS], &all[PARAMETERS..])
            };
            let pairs = at(step)?.into_iter().zip(at(-step)?);
            Some(pairs.map(|(up, down)| (up - down) / (2.0 * step)).collect())
        };
        let mut compared = 0;
        for i in 0..all.len() {
            let (Some(coarse), Some(fine)) = (difference(i, 4e-4), difference(i, 2e-4)) else {
                continue;
            };
            let largest = fine.iter().fold(1.0, |largest: f64, d| largest.max(d.abs()));
            for k in 0..ROWS {
                // An event that moves across a row, and a corner, have two differences.
                if (coarse[k] - fine[k]).abs() > AGREE * largest {
                    continue;
                }
                let error = (exact[k].eps[i] - fine[k]).abs() / largest;
                prop_assert!(error < ERROR, "{text}\nentry {i}, row {k}: {} and {}", exact[k].eps[i], fine[k]);
                compared += 1;
            }
        }
        prop_assert!(2 * compared >= all.len() * ROWS, "{text}\n{compared} of {}", all.len() * ROWS);
    }
}
