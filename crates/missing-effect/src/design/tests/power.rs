//! The printed power is that of the test.

use super::*;

fn noisy(records: &[Record], seed: u64) -> Vec<Record> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut records = records.to_vec();
    for record in &mut records {
        let e = noise::white(record.len(), NOISE, &mut rng);
        for (y, e) in record.outputs[0].values.iter_mut().zip(e) {
            *y += e;
        }
    }
    records
}

/// Side measurements are part of the refits: beside such that are all but exact they agree with fits in which their parameters are fixed at
/// the values of the model that is taken to be true.
#[test]
fn a_side_measurement_counts_in_the_refits() {
    let mut problem = problem(Plant::SingleTank, ("const_leak", 4.0), 300);
    let plant = [("pump_gain", 10.0), ("alpha", 12.5)];
    for (name, value) in plant {
        let std_error = 1e-3;
        let exact = PriorValue { value, std_error };
        problem.priors.insert(name.into(), exact);
    }
    let fitted = leak_or_curve(&problem);
    let (a, b, metric) = (&fitted.nodes[0], &fitted.nodes[1], &fitted.metric);
    let cost = |records: &[Record], mut x: Vec<f64>, held: bool| {
        let mut fixed = b.setup.fixed.clone();
        if held {
            for (i, (name, _)) in plant.into_iter().enumerate() {
                assert!(a.setup.names()[i] == name && b.setup.names()[i] == name);
                x[i] = a.fit.x[i];
                fixed.insert(name.into(), x[i]);
            }
        }
        let mut setup = Setup::new(b.setup.structure.clone(), records, fixed).unwrap();
        setup.substeps = b.setup.substeps;
        setup.known_scales = Some(metric.scales.clone());
        let starts = starts_around(&setup, &x, 4, 1);
        let starts: Vec<Vec<f64>> = starts.into_iter().chain([x]).collect();
        fit_from(&setup, &starts, &metric.noise, FINE).unwrap().cost
    };
    let existing = noise_free(a).unwrap();
    let before = misfit_before(&existing, a, b, metric).unwrap();
    let held = cost(&existing, unlooped(b), true);
    let free = cost(&existing, unlooped(b), false);
    assert!(free < 0.9 * held, "{free}, {held}");
    assert!((before / held - 1.0).abs() < 0.02, "{before}, {held}");

    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let values = excitation::steps(300, 30..=60, 3.9, 6.1, &mut rng).unwrap();
    let simulated = simulate_experiment(a, &Loop::Open, &values, INTERVAL, 100.0).unwrap();
    let confirmed = refitted(&existing, &simulated, (a, b), before, metric).unwrap();
    let mut both = existing;
    both.push(simulated.record.clone());
    let mut x = unlooped(b);
    x.extend(&simulated.initial);
    let held = cost(&both, x.clone(), true);
    let free = cost(&both, x, false);
    let with = before + confirmed * metric.variance();
    assert!(free < 0.9 * held, "{free}, {held}");
    assert!((with / held - 1.0).abs() < 0.02, "{with}, {held}");
}

/// The mean of the likelihood ratio over records with noise, both models refitted each time, is the power.
#[test]
fn the_power_is_the_mean_of_the_likelihood_ratio() {
    let problem = problem(Plant::SingleTank, ("const_leak", 4.0), 300);
    let fitted = leak_or_curve(&problem);
    let metric = &fitted.metric;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let values = excitation::steps(300, 30..=60, 3.9, 6.1, &mut rng).unwrap();
    for truth in 0..2 {
        let (a, b) = (&fitted.nodes[truth], &fitted.nodes[1 - truth]);
        let simulated = simulate_experiment(a, &Loop::Open, &values, INTERVAL, 100.0).unwrap();
        let predicted = linear(&simulated, b, &information(b, metric), metric).unwrap();
        let existing = noise_free(a).unwrap();
        let before = misfit_before(&existing, a, b, metric).unwrap();
        let confirmed = refitted(&existing, &simulated, (a, b), before, metric).unwrap();

        let cost = |node: &crate::fit::node::Node, records: &[Record]| {
            let setup = node.setup.with_records(records).unwrap();
            let mut x = unlooped(node);
            x.truncate(node.setup.parameter_count());
            for record in 0..records.len() {
                x.push(if record == 0 {
                    unlooped(node)[x.len()]
                } else {
                    simulated.initial[0]
                });
            }
            fit_from(&setup, &[x], &metric.noise, FINE).unwrap().cost
        };
        let ratios: Vec<f64> = (0..200u64)
            .into_par_iter()
            .map(|seed| {
                let mut both = existing.clone();
                both.push(simulated.record.clone());
                let both = noisy(&both, 100 + seed);
                let ratio = |records: &[Record]| cost(b, records) - cost(a, records);
                (ratio(&both) - ratio(&both[..1])) / metric.variance()
            })
            .collect();
        let n = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / n;
        let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        println!("predicted {predicted:.1}, refitted {confirmed:.1}, mean {mean:.1} +- {error:.1}");
        assert!(
            predicted > 5.0,
            "an experiment that shows something: {predicted}"
        );
        assert!((mean - confirmed).abs() < 3.0 * error, "{mean} {confirmed}");
        assert!((mean - predicted).abs() < 3.0 * error, "{mean} {predicted}");
        // Twice the logarithm of a likelihood ratio of two fixed means: variance 4 lambda.
        assert!(
            (variance / (4.0 * confirmed) - 1.0).abs() < 0.4,
            "{variance}"
        );
    }
}

/// A small effect, and no record before: the formula with the signatures is valid.
#[test]
fn for_a_small_effect_the_power_is_that_of_the_signatures() {
    let problem = problem(Plant::SingleTank, ("const_leak", 8.0), 300);
    let mut fitted = leak_or_curve(&problem);
    let size = 0.02;
    let base = fitted.base.fit.x.clone();
    for (node, own) in fitted.nodes.iter_mut().zip([size, 0.0]) {
        node.fit.x = vec![base[0], base[1], own, base[2]];
    }
    let [a, b] = &fitted.nodes;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let values = excitation::steps(300, 30..=60, 2.0, 8.0, &mut rng).unwrap();
    let mut simulated = simulate_experiment(b, &Loop::Open, &values, INTERVAL, 100.0).unwrap();
    // The same beginning for both: it is a part of the base.
    let records = std::slice::from_ref(&simulated.record).to_vec();
    let setup = a.setup.with_records(&records).unwrap();
    let shown = setup
        .simulate(&vector(a, &setup, &simulated))
        .unwrap()
        .output;
    simulated.record.outputs[0].values = shown[0].clone();
    let found = linear(&simulated, b, &Triangle::new(0), &fitted.metric).unwrap();

    let both = b.setup.structure.with(a.added[0]).unwrap();
    let setup = b.setup.with_records(&records).unwrap();
    let setup = setup.with_structure(both).unwrap();
    let mut x = vec![0.0; setup.names().len()];
    for (name, value) in setup.names().iter().zip(&mut x) {
        match name.as_str() {
            "pump_gain" => *value = base[0],
            "alpha" => *value = base[1],
            "level(0)" => *value = simulated.initial[0],
            _ => {}
        }
    }
    let rows = setup.linearise(&x, &fitted.metric.noise).unwrap();
    let of = |name: &str| setup.names().iter().position(|n| n == name).unwrap();
    let signature = of("const_leak.flow");
    let mut order: Vec<usize> = (0..setup.names().len())
        .filter(|i| *i != signature)
        .collect();
    order.push(signature);
    // |p_A|^2 (1 - rho^2): what is left of the column beside the base's and the other's.
    let last = order.len() - 1;
    let left = rows.select(&order).at(last, last);
    let expected = (size * left / NOISE).powi(2);
    assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
}

#[test]
fn exact_twins_have_no_power() {
    // On a linear tank the two lags give one transfer function in either order.
    let problem = problem(Plant::SingleTankLinear, ("pump_lag", 10.0), 400);
    let found = design(
        &problem,
        between("pump_lag", "sensor_lag"),
        &Limits {
            range: Some((2.0, 8.0)),
            ..Limits::default()
        },
        &Options::default(),
        &|_| {},
    )
    .unwrap();
    assert_eq!(found.prospect, Prospect::Twins);
    let most = found
        .candidates
        .iter()
        .map(|c| c.power.power)
        .fold(0.0, f64::max);
    assert!(most < 1e-2, "{most}");
}
