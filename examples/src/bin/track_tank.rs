//! Follows the gain and the time constant of a tank while its level moves: a linear model, `tau y' + y = K u + o`, that
//! holds near one level only, estimated on the way.
//!
//! State variable filters give y' without differentiating, recursive least squares with forgetting the parameters
//! (crates `ct-lti` and `ct-rls`). First on a simulated tank, where Torricelli's law says what there is to find:
//! `tau = 2 S sqrt(H)/alpha`, `K = pump_gain tau/S`; then, where the data lie beside the checkout, on the measured
//! Cascaded Tanks.
//!
//! `cargo run --release -p ctid-examples --bin track_tank`

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use ct_lti::{Hold, Start, StateVariableFilter};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use ct_signals::{Columns, Record, Signal, excitation, noise, read_csv};
use nalgebra::{SMatrix, SVector};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use textplots::{Chart, Plot, Shape};

/// Cross-section \[cm^2\], inflow for a volt \[cm^3/(V s)\], outflow coefficient \[cm^2.5/s\] of the simulated tank.
const AREA: f64 = 154.0;
const PUMP_GAIN: f64 = 9.0;
const ALPHA: f64 = 11.0;

/// How it is followed.
struct Tracking {
    /// Bandwidth of the filters \[rad/s\]: some times that of the tank.
    lambda: f64,
    /// What is remembered \[s\]: some time constants, and short beside the wandering of the level.
    memory: f64,
    /// First guess of the time constant \[s\]; how little is known of it, too.
    tau: f64,
}

/// What is believed at one sample.
struct Estimate {
    time: f64,
    level: f64,
    /// Mean of the level, weighted as the estimator remembers: what the estimates belong to.
    remembered: f64,
    tau: f64,
    gain: f64,
}

/// A tank at the law's word, its level drifting up and down twice, with a pseudo-random signal on top.
fn simulated() -> Result<Record, Box<dyn Error>> {
    let (samples, interval) = (6000, 2.0);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let wobble = excitation::prbs(samples, 30, -0.3, 0.3, 9)?;
    // Rests at 6 to 20 cm.
    let inputs = wobble.iter().enumerate().map(|(k, wobble)| {
        let drift = (2.0 * TAU * k as f64 / samples as f64).cos();
        4.2 - 1.2 * drift + wobble
    });
    let inputs: Vec<f64> = inputs.collect();
    let scales = Scales::from_ranges((2.0, 6.0), (4.0, 25.0), interval, samples as f64 * interval);
    let known = Known {
        area: [Some(AREA), None],
        ..Known::default()
    };
    let tank = Structure::new(Plant::SingleTank, known, scales);
    let mut tank = Simulator::<f64>::new(&tank, &[PUMP_GAIN, ALPHA], &[6.0], 3.0)?;
    tank.set_substeps(4);
    let mut levels = Vec::with_capacity(samples);
    for (u, noise) in inputs.iter().zip(noise::white(samples, 0.02, &mut rng)) {
        levels.push(tank.read() + noise);
        tank.advance(Command::held(*u), interval);
    }
    let record = Record {
        name: "simulated tank".into(),
        time: (0..samples).map(|k| k as f64 * interval).collect(),
        input: Signal::new("u", "V", inputs),
        output: Signal::new("y", "cm", levels),
        reference: None,
        hold: ct_signals::Hold::Zero,
    };
    record.validate()?;
    Ok(record)
}

fn track(record: &Record, tracking: &Tracking) -> Result<Vec<Estimate>, Box<dyn Error>> {
    let Tracking {
        lambda,
        memory,
        tau,
    } = *tracking;
    // One filter for both, but the input is held between samples and the level is not.
    let filter = |hold| StateVariableFilter::with_bandwidth(2, lambda, hold);
    let mut filter_u = filter(Hold::Zero)?.starting(Start::Rest);
    let mut filter_y = filter(Hold::First)?.starting(Start::Rest);
    let (low, high) = record.output_range();
    let (u_low, u_high) = record.input_range();
    let (level, gain) = (high - low, (high - low) / (u_high - u_low));
    let known = SVector::from([tau, gain, level]);
    let p = SMatrix::from_diagonal(&known.component_mul(&known));
    let mut rls = ContinuousRls::<3>::new(
        SVector::from([tau, gain, 0.0]),
        p,
        Weights::least_squares(1.0 / memory)?,
    )?;

    let mut estimates = Vec::with_capacity(record.len());
    let mut last: Option<(f64, Sample<3>)> = None;
    let rows = record.time.iter().zip(&record.input.values);
    for ((&time, &u), &y) in rows.zip(&record.output.values) {
        let step = last.map_or(0.0, |(before, _)| time - before);
        let u = filter_u.update(u, step)?;
        let y = filter_y.update(y, step)?;
        let sample = Sample::new([-y[1], u[0], 1.0], y[0]);
        if let Some((_, before)) = &last {
            rls.update(&before.midway(&sample), step);
        }
        last = Some((time, sample));
        let before = estimates.last().map_or(y[0], |e: &Estimate| e.remembered);
        estimates.push(Estimate {
            time,
            level: y[0],
            remembered: y[0] + (before - y[0]) * (-step / memory).exp(),
            tau: rls.theta()[0],
            gain: rls.theta()[1],
        });
    }
    Ok(estimates)
}

/// A plot over time, and the means in bands of the level beside what the law says, where it is known.
fn show(record: &Record, estimates: &[Estimate], settle: f64, law: Option<fn(f64) -> [f64; 2]>) {
    let unit = &record.output.unit;
    let settled: Vec<&Estimate> = estimates.iter().filter(|e| e.time >= settle).collect();
    let (Some(first), Some(last)) = (settled.first(), settled.last()) else {
        println!("{}: shorter than the memory of the estimator", record.name);
        return;
    };
    type Quantity = fn(&Estimate) -> f64;
    let quantities: [(String, Quantity); 3] = [
        (format!("level, filtered [{unit}]"), |e| e.level),
        ("time constant [s]".into(), |e| e.tau),
        (format!("gain [{unit}/V]"), |e| e.gain),
    ];
    println!("\n{}", record.name);
    for (title, quantity) in &quantities {
        let points: Vec<(f32, f32)> = settled
            .iter()
            .map(|e| (e.time as f32, quantity(e) as f32))
            .collect();
        println!("\n{title} over time [s]");
        Chart::new(140, 36, first.time as f32, last.time as f32)
            .lineplot(&Shape::Lines(&points))
            .nice();
    }

    let levels = || settled.iter().map(|e| e.remembered);
    let low = levels().fold(f64::INFINITY, f64::min);
    let high = levels().fold(f64::NEG_INFINITY, f64::max);
    println!("\nlevel, as remembered [{unit}]   tau [s]   gain [{unit}/V]   by the law: tau, gain");
    for band in 0..5 {
        let edge = |k: i32| low + (high - low) * f64::from(k) / 5.0;
        let (from, to) = (edge(band), edge(band + 1));
        let here: Vec<_> = settled
            .iter()
            .filter(|e| (from..=to).contains(&e.remembered))
            .collect();
        let mean = |of: Quantity| here.iter().map(|e| of(e)).sum::<f64>() / here.len() as f64;
        if here.is_empty() {
            continue;
        }
        let by_law = law.map(|law| law(mean(|e| e.remembered)));
        let by_law = by_law.map_or("-".into(), |[tau, gain]| format!("{tau:.1}, {gain:.2}"));
        let (tau, gain) = (mean(|e| e.tau), mean(|e| e.gain));
        println!("{from:10.1} to {to:4.1} {tau:17.1} {gain:13.2}      {by_law}");
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let record = simulated()?;
    let tracking = Tracking {
        lambda: 1.0 / 20.0,
        memory: 500.0,
        tau: 50.0,
    };
    let estimates = track(&record, &tracking)?;
    let law = |level: f64| {
        let tau = 2.0 * AREA * level.sqrt() / ALPHA;
        [tau, PUMP_GAIN * tau / AREA]
    };
    show(&record, &estimates, 2.0 * tracking.memory, Some(law));

    let measured = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/data/cascaded_tanks/estimation.csv");
    if !measured.exists() {
        println!(
            "\nmeasured tanks: skipped, {} is not there",
            measured.display()
        );
        return Ok(());
    }
    let mut record = read_csv(&measured, &Columns::default(), ct_signals::Hold::Zero)?;
    record.name = "measured: Cascaded Tanks, the lower of two, as if it were one".into();
    let tracking = Tracking {
        lambda: 1.0 / 40.0,
        memory: 600.0,
        tau: 50.0,
    };
    let estimates = track(&record, &tracking)?;
    show(&record, &estimates, 2.0 * tracking.memory, None);
    println!(
        "\nWhere the time constant leaves its place, even below 0, one tank with one law is not what is there."
    );
    Ok(())
}
