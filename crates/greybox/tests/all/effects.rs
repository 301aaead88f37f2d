//! Quality of each effect's starts: on simulated records with a missing effect about as large as the noise, a fit from these starts finds
//! the true parameters within their standard errors.

use std::collections::BTreeMap;

use crate::support::known;
use ct_signals::{Channel, Record, excitation, noise};
use greybox::{Noise, Setup, Stopping, fit_from, keep_best_simulated, with_other_speeds};
use plants::{Command, EffectInfo, Placed, Plant, Scales, Simulator, Structure};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const SAMPLES: usize = 800;
const INTERVAL: f64 = 4.0;
/// A width above this \[V\] keeps a valve where it is over most of a record.
const WIDE: f64 = 0.8;
const STOPPING: Stopping = Stopping {
    evaluations: 80,
    cost: 1e-8,
};

/// An effect built into a plant, with its parameters.
struct Case {
    plant: Plant,
    id: &'static str,
    vessel: usize,
    parameters: Vec<f64>,
}

/// Every effect with a threshold, a time, a period or steps, and the smooth ones, for both kinds of outlet, for one and two tanks, in
/// either tank.
fn cases() -> Vec<Case> {
    let t = SAMPLES as f64 * INTERVAL;
    let mut cases = Vec::new();
    let mut add = |plant: Plant, id, vessel, parameters: Vec<f64>| {
        cases.push(Case {
            plant,
            id,
            vessel,
            parameters,
        });
    };
    for plant in [
        Plant::SingleTank,
        Plant::SingleTankLinear,
        Plant::CascadedTanks,
        Plant::CascadedTanksLinear,
    ] {
        let linear = matches!(plant, Plant::SingleTankLinear | Plant::CascadedTanksLinear);
        // Throughput and the coefficient of a hole, in the units of the plant.
        let (flow, hole) = if linear { (30.0, 1.5) } else { (50.0, 3.0) };
        for vessel in 0..plant.vessels() {
            add(plant, "leak_at_height", vessel, vec![hole, 16.0]);
            add(plant, "valve_drift", vessel, vec![-0.04]);
            add(plant, "valve_step", vessel, vec![0.03, 0.437 * t]);
            let swing = vec![0.01 * flow, 0.015 * flow, t / 11.3];
            add(plant, "periodic_disturbance", vessel, swing);
        }
        if !linear {
            add(plant, "pipe_height", plant.vessels() - 1, vec![3.0]);
        }
        if plant.vessels() == 1 {
            add(plant, "coupled_tank", 0, vec![0.2, 70.0]);
        } else if !linear {
            add(plant, "coupled_tank", 0, vec![0.2]);
        }
        if plant.vessels() == 1 && !linear {
            // A good third of what comes in.
            add(plant, "const_leak", 0, vec![0.35 * flow]);
        }
        // Slightly above the lowest fifth of the commands' range.
        add(plant, "pump_saturation", 0, vec![4.4]);
        add(plant, "pump_gain_drift", 0, vec![0.04, 0.25 * t]);
        add(plant, "stiction_backlash", 0, vec![0.4, 0.0, 0.0]);
        add(plant, "stiction_backlash", 0, vec![0.4, 1.0, 0.0]);
        add(plant, "sensor_drift", 0, vec![0.5]);
        add(plant, "sensor_nonlinearity", 0, vec![0.1]);
        add(plant, "coarse_quantisation", 0, vec![0.6, 0.0]);
    }
    cases
}

impl Case {
    fn placed(&self) -> Placed {
        Placed {
            effect: EffectInfo::find(self.id).unwrap(),
            vessel: self.vessel,
        }
    }

    fn base(&self) -> (Vec<f64>, Vec<f64>) {
        match self.plant {
            Plant::SingleTank => (vec![10.0, 12.5], vec![14.0]),
            Plant::CascadedTanks => (vec![10.0, 15.0, 12.5], vec![10.0, 14.0]),
            Plant::SingleTankLinear => (vec![6.4, 100.0, -16.0], vec![14.0]),
            _ => (vec![6.4, 60.0, 100.0, -16.0], vec![30.0, 14.0]),
        }
    }

    /// The levels that the plant visits: upper tanks of linear plants count from another zero.
    fn parameters(&self) -> Vec<f64> {
        let mut parameters = self.parameters.clone();
        if self.id == "leak_at_height" && self.vessel + 1 < self.plant.vessels() {
            parameters[1] = if self.plant == Plant::CascadedTanks {
                11.5
            } else {
                32.0
            };
        }
        parameters
    }

    /// Steps under a slow drift, so that the command turns at many heights.
    fn command(rng: &mut ChaCha8Rng) -> Vec<f64> {
        let steps = excitation::steps(SAMPLES, 10..=40, 3.5, 6.5, rng).unwrap();
        let drive = excitation::steps(SAMPLES, 5..=20, 3.5, 6.5, rng).unwrap();
        let mut slow = 5.0;
        steps
            .iter()
            .zip(&drive)
            .map(|(step, drive)| {
                slow += 0.1 * (drive - slow);
                0.5 * (step + slow)
            })
            .collect()
    }

    fn record(&self, u: &[f64], noise: &[f64], scales: &Scales) -> Record {
        let structure = Structure::new(self.plant, known(self.plant), scales.clone());
        let structure = structure.with(self.placed()).unwrap();
        let (mut theta, levels) = self.base();
        theta.extend(self.parameters());
        let mut simulator = Simulator::new(&structure, &theta, &levels, u[0]).unwrap();
        simulator.set_substeps(2);
        let y = u
            .iter()
            .zip(noise)
            .map(|(&u, noise)| {
                let reading = simulator.read(0) + noise;
                simulator.advance(Command::held(u), INTERVAL);
                reading
            })
            .collect();
        Record {
            name: self.id.into(),
            time: (0..u.len()).map(|k| k as f64 * INTERVAL).collect(),
            inputs: vec![Channel::new("u", "V", u.to_vec())],
            outputs: vec![Channel::new("y", "cm", y)],
            ..Record::default()
        }
    }
}

/// The believed model from the plant's true parameters: two tanks in series fit almost as well with exchanged time constants, and the
/// choice between the two minima is not the task of the effect's starts.
fn base_fit<'a>(case: &Case, records: &'a [Record]) -> (Setup<'a>, Vec<f64>, f64) {
    let fixed = BTreeMap::new;
    let setup = Setup::from_records(case.plant, known(case.plant), &[], records, fixed()).unwrap();
    let (theta, levels) = case.base();
    let own = [theta, levels].concat();
    let fit = fit_from(&setup, &[own], &Noise::white(1), STOPPING).unwrap();
    let scales = setup.scales_at(&fit.x).unwrap();
    let structure = Structure::new(case.plant, known(case.plant), scales);
    let setup = setup.with_structure(structure).unwrap();
    (setup, fit.x, fit.rmse[0])
}

/// Result of one record.
struct Outcome {
    /// Error of every parameter in standard errors; none if it ends at a bound.
    z: Vec<Option<f64>>,
    estimate: Vec<f64>,
    /// Error of the fit over the noise.
    left: f64,
    /// Error of the base model over the noise.
    base: f64,
}

fn one(case: &Case, seed: u64) -> Outcome {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let u = Case::command(&mut rng);
    let duration = INTERVAL * (SAMPLES - 1) as f64;
    let rough = Scales::from_ranges((3.5, 6.5), (8.0, 24.0), INTERVAL, duration);
    let still = vec![0.0; SAMPLES];
    // Size of the effect without noise, relative to the scales of the fit.
    let seen = [case.record(&u, &still, &rough)];
    let (setup, _, structural) = base_fit(case, &seen);
    let scales = setup.structure.scales.clone();
    let sigma = structural
        / match case.id {
            "coarse_quantisation" => 4.0,
            // A valve that sticks over most of the record leaves a few steps of its position to find everything by.
            "stiction_backlash" if case.parameters[0] > WIDE => 4.0,
            _ => 1.0,
        };
    let e = noise::white(SAMPLES, sigma, &mut rng);
    let records = [case.record(&u, &e, &scales)];
    let (base, x, rmse) = base_fit(case, &records);
    let structure = base.structure.with(case.placed()).unwrap();
    let mut setup = base.with_structure(structure).unwrap();
    setup
        .choose_substeps(&start(&setup, &x, &base, &[]))
        .unwrap();
    // As in the search: every combination of the effect's own starts is ranked by one nearly undamped step, and the best two are fitted.
    let parameters = setup.structure.effect_parameters(case.placed());
    let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in &parameters {
        let longer = |begun: &Vec<f64>| -> Vec<Vec<f64>> {
            let with = |s: &f64| [begun.as_slice(), &[*s]].concat();
            parameter.starts.iter().map(with).collect()
        };
        grid = grid.iter().flat_map(longer).collect();
    }
    let white = Noise::white(1);
    let mut begun: Vec<Vec<f64>> = Vec::new();
    for values in &grid {
        let x = start(&setup, &x, &base, values);
        begun.extend(with_other_speeds(&setup, case.placed(), &x));
        begun.push(x);
    }
    keep_best_simulated(&setup, case.placed(), &mut begun, &white);
    let mut ranked: Vec<(f64, Vec<f64>)> = begun
        .into_iter()
        .filter_map(|x| {
            let triangle = setup.linearise(&x, &white)?;
            let free: Vec<usize> = (0..setup.free().len()).collect();
            let scale: Vec<f64> = free.iter().map(|&j| triangle.column_norm(j)).collect();
            let mut step = triangle.solve(&free, &scale, 1e-6);
            for (d, &i) in step.iter_mut().zip(setup.free()) {
                let (lower, upper) = setup.bounds()[i];
                let lower = if lower > 0.0 {
                    lower.max(0.2 * x[i])
                } else {
                    lower
                };
                *d = (x[i] + *d).clamp(lower, upper.max(lower)) - x[i];
            }
            Some((triangle.predicted(&step), x))
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    let starts: Vec<Vec<f64>> = ranked.into_iter().take(2).map(|(_, x)| x).collect();
    let fit = fit_from(&setup, &starts, &white, STOPPING).unwrap();
    let errors = fit.std_errors();
    let own = base.parameter_count();
    let truth = case.parameters();
    Outcome {
        z: (0..truth.len())
            .map(|i| Some((fit.x[own + i] - truth[i]) / errors[own + i]?))
            .collect(),
        estimate: fit.x[own..own + truth.len()].to_vec(),
        left: fit.rmse[0] / sigma,
        base: rmse / sigma,
    }
}

/// The base's vector with the effect's parameters in between.
fn start(setup: &Setup, x: &[f64], base: &Setup, values: &[f64]) -> Vec<f64> {
    let own = base.parameter_count();
    let added = setup.parameter_count() - own;
    let mut values = values.to_vec();
    if values.is_empty() {
        let placed = setup.structure.effects()[0];
        let parameters = setup.structure.effect_parameters(placed);
        values = parameters.iter().map(|info| info.starts[0]).collect();
    }
    assert_eq!(values.len(), added);
    [&x[..own], &values, &x[own..]].concat()
}

/// Within three standard errors in each parameter, with no more error than the noise.
///
/// Two effects have no slope that an error could be had from. What sticks and slips moves in jumps as its width is fitted: its
/// width is asked to a tenth. A reading in steps errs by whole steps where the level is near an edge, so that much error is
/// left: its step is asked to a thousandth.
fn found(case: &Case, outcome: &Outcome) -> bool {
    let within = |share: f64| {
        let truth = case.parameters();
        let mut pairs = outcome.estimate.iter().zip(&truth);
        pairs.all(|(estimate, truth)| (estimate - truth).abs() <= share * truth)
    };
    match case.id {
        "stiction_backlash" => {
            // The initial state in a narrow band affects a few readings only.
            let [width, jump, begin] = [0, 1, 2].map(|i| {
                let error = outcome.estimate[i] - case.parameters[i];
                error.abs()
            });
            let wide = case.parameters[0] > WIDE;
            width <= 0.1 * case.parameters[0] && jump == 0.0 && (!wide || begin < 0.3)
        }
        "coarse_quantisation" => within(1e-3) && outcome.left < outcome.base,
        _ => outcome.left < 1.1 && outcome.z.iter().flatten().all(|z| z.abs() < 3.0),
    }
}

/// Number of successes among the records, for every case whose name contains `wanted`.
fn table(wanted: &str, records: u64) -> Vec<(String, usize)> {
    let name = |case: &Case| format!("{}@{} {}", case.id, case.vessel, case.plant.id());
    cases()
        .par_iter()
        .filter(|case| name(case).contains(wanted))
        .map(|case| {
            let seeds = (1000..1000 + records).into_par_iter();
            let outcomes: Vec<Outcome> = seeds.map(|seed| one(case, seed)).collect();
            let (found, lost): (Vec<_>, Vec<_>) = outcomes.iter().partition(|o| found(case, o));
            let hits = found.len();
            let mean =
                |f: fn(&Outcome) -> f64| outcomes.iter().map(f).sum::<f64>() / records as f64;
            let name = format!("{} {:?}", name(case), case.parameters());
            let (base, left) = (mean(|o| o.base), mean(|o| o.left));
            println!("{hits:4} of {records}  error/noise {base:.2} -> {left:.3}  {name}");
            for o in lost {
                println!("      {:.4?} z {:.1?} left {:.3}", o.estimate, o.z, o.left);
            }
            (name, hits)
        })
        .collect()
}

#[test]
fn a_valve_with_a_wide_band_that_begins_within_it_is_found_again() {
    for jump in [0.0, 1.0] {
        for begin in [-0.5, 0.5] {
            let seeds = 1000..1004;
            let hits = seeds.filter(|&seed| {
                let u = Case::command(&mut ChaCha8Rng::seed_from_u64(seed));
                let (low, high) = u
                    .iter()
                    .fold((u[0], u[0]), |(low, high), &u| (u.min(low), u.max(high)));
                let case = Case {
                    plant: Plant::SingleTankLinear,
                    id: "stiction_backlash",
                    vessel: 0,
                    // The stiction band is nine tenths of the command's range.
                    parameters: vec![0.9 * (high - low) / (1.0 + jump), jump, begin],
                };
                let o = one(&case, seed);
                println!(
                    "{:.3?} for {:.3?}, error/noise {:.2} -> {:.3}",
                    o.estimate, case.parameters, o.base, o.left
                );
                found(&case, &o)
            });
            let hits = hits.count();
            assert!(hits >= 3, "{jump} {begin}: {hits} of 4");
        }
    }
}

#[test]
fn every_effect_of_one_tank_is_found_again_from_its_own_starts() {
    for (name, hits) in table(" single-tank", 1) {
        assert_eq!(hits, 1, "{name}");
    }
}

/// `RECORDS=20 EFFECT=valve_step cargo test -p greybox --test all effects:: -- --ignored --nocapture`; by default ten records of
/// every case.
#[test]
#[ignore = "takes minutes; the table of what is found again"]
fn most_records_of_every_effect_are_found_again() {
    let records = std::env::var("RECORDS").map_or(10, |n| n.parse().unwrap());
    let wanted = std::env::var("EFFECT").unwrap_or_default();
    let mut missed = Vec::new();
    for (name, hits) in table(&wanted, records) {
        // The weakest is a leak in a tank whose level is not measured (15 of 20): it moves the simulated level so far that
        // some fits do not converge to the true parameters.
        // A limit near the least command in front of two tanks (4 of 10) leaves too little excitation to distinguish their outflows.
        let least = if name.starts_with("pump_saturation@0 cascaded-tanks [") {
            3
        } else {
            7
        };
        if 10 * hits < least * records as usize {
            missed.push(format!("{name}: {hits} of {records}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
