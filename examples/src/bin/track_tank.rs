//! Follows the gain and the time constant of a tank while its level moves: a linear model, `tau y' + y = K u + o`, that
//! holds near one level only, estimated on the way.
//!
//! State variable filters give y' without differentiating, recursive least squares with forgetting the parameters
//! (crates `ct-lti` and `ct-rls`). First on a simulated tank, where Torricelli's law says what there is to find:
//! `tau = 2 S sqrt(H)/alpha`, `K = pump_gain tau/S`. Then on a record from a file: the measured Cascaded Tanks where
//! they lie beside the checkout, otherwise the bundled record of the tour, whose tank runs over now and then. A linear
//! model whose gain and time constant leave what the law allows shows that an effect is missing.
//!
//! `cargo run --release -p ctid-examples --bin track_tank` prints plots and tables and writes `track_tank.svg`.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use ct_lti::{Hold, Start, StateVariableFilter};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use ct_signals::{Channel, Columns, ReadOptions, Record, excitation, noise, read_csv};
use ctid_examples::picture::{self, Curve, Panel};
use nalgebra::{SMatrix, SVector};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use textplots::{Chart, Plot, Shape};

/// Cross-section \[cm^2\], inflow for a volt \[cm^3/(V s)\], outflow coefficient \[cm^2.5/s\] of the simulated tank.
const AREA: f64 = 154.0;
const PUMP_GAIN: f64 = 9.0;
const ALPHA: f64 = 11.0;

/// Settings of the tracking.
struct Tracking {
    /// Bandwidth of the filters \[rad/s\]: some times that of the tank.
    lambda: f64,
    /// Memory \[s\]: several time constants, and short compared with the drift of the level.
    memory: f64,
    /// First guess of the time constant \[s\]; how little is known of it, too.
    tau: f64,
}

/// Time constant \[s\] and gain at a level, by Torricelli's law.
type TankLaw = fn(f64) -> [f64; 2];

fn torricelli(level: f64) -> [f64; 2] {
    let tau = 2.0 * AREA * level.sqrt() / ALPHA;
    [tau, PUMP_GAIN * tau / AREA]
}

/// Estimate at one sample.
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
        area: [Some(AREA), None, None],
        ..Known::default()
    };
    let tank = Structure::new(Plant::SingleTank, known, scales);
    let mut tank = Simulator::<f64>::new(&tank, &[PUMP_GAIN, ALPHA], &[6.0], 3.0)?;
    tank.set_substeps(4);
    let mut levels = Vec::with_capacity(samples);
    for (u, noise) in inputs.iter().zip(noise::white(samples, 0.02, &mut rng)) {
        levels.push(tank.read(0) + noise);
        tank.advance(Command::held(*u), interval);
    }
    let record = Record {
        name: "simulated tank".into(),
        time: (0..samples).map(|k| k as f64 * interval).collect(),
        inputs: vec![Channel::new("u", "V", inputs)],
        outputs: vec![Channel::new("y", "cm", levels)],
        ..Record::default()
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
    // The same filter for both, but the input is held between samples and the level is not.
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
    let rows = record.time.iter().zip(&record.inputs[0].values);
    for ((&time, &u), &y) in rows.zip(&record.outputs[0].values) {
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

/// A record, what was estimated on it, and the law of its tank where it is known.
struct Run {
    record: Record,
    /// Estimates after two memories of the estimator.
    estimates: Vec<Estimate>,
    law: Option<TankLaw>,
}

impl Run {
    fn new(
        record: Record,
        tracking: &Tracking,
        law: Option<TankLaw>,
    ) -> Result<Self, Box<dyn Error>> {
        let mut estimates = track(&record, tracking)?;
        estimates.retain(|e| e.time >= 2.0 * tracking.memory);
        if estimates.is_empty() {
            return Err(format!("{}: shorter than two memories", record.name).into());
        }
        Ok(Self {
            record,
            estimates,
            law,
        })
    }

    /// Level, time constant and gain over time, beside what the law says at the remembered level.
    fn panels(&self) -> Vec<Panel> {
        let curve = |name, quantity: &dyn Fn(&Estimate) -> f64| Curve {
            name,
            points: self
                .estimates
                .iter()
                .map(|e| (e.time, quantity(e)))
                .collect(),
        };
        let with_law = |title: String, estimated: Curve, i: usize| {
            let mut curves = vec![estimated];
            if let Some(law) = self.law {
                curves.push(curve("Torricelli's law", &|e| law(e.remembered)[i]));
            }
            Panel { title, curves }
        };
        let unit = &self.record.outputs[0].unit;
        let level = Panel {
            title: format!("level [{unit}]"),
            curves: vec![
                curve("filtered", &|e| e.level),
                curve("as remembered", &|e| e.remembered),
            ],
        };
        vec![
            level,
            with_law(
                "time constant [s]".into(),
                curve("estimated", &|e| e.tau),
                0,
            ),
            with_law(
                format!("gain [{unit}/V]"),
                curve("estimated", &|e| e.gain),
                1,
            ),
        ]
    }

    /// The first curve of each panel over time, and the means in bands of the level beside what the law says.
    fn show(&self) {
        println!("\n{}", self.record.name);
        for Panel { title, curves } in self.panels() {
            let points: Vec<(f32, f32)> = curves[0]
                .points
                .iter()
                .map(|&(time, value)| (time as f32, value as f32))
                .collect();
            println!("\n{title} over time [s]");
            Chart::new(140, 36, points[0].0, points[points.len() - 1].0)
                .lineplot(&Shape::Lines(&points))
                .nice();
        }

        let unit = &self.record.outputs[0].unit;
        let levels = || self.estimates.iter().map(|e| e.remembered);
        let low = levels().fold(f64::INFINITY, f64::min);
        let high = levels().fold(f64::NEG_INFINITY, f64::max);
        println!(
            "\nlevel, as remembered [{unit}]   tau [s]   gain [{unit}/V]   by the law: tau, gain"
        );
        for band in 0..5 {
            let edge = |k: i32| low + (high - low) * f64::from(k) / 5.0;
            let (from, to) = (edge(band), edge(band + 1));
            let here: Vec<&Estimate> = self
                .estimates
                .iter()
                .filter(|e| (from..=to).contains(&e.remembered))
                .collect();
            if here.is_empty() {
                continue;
            }
            let mean = |of: fn(&Estimate) -> f64| {
                here.iter().map(|e| of(e)).sum::<f64>() / here.len() as f64
            };
            let by_law = self.law.map_or("-".into(), |law| {
                let [tau, gain] = law(mean(|e| e.remembered));
                format!("{tau:.1}, {gain:.2}")
            });
            let (tau, gain) = (mean(|e| e.tau), mean(|e| e.gain));
            println!("{from:10.1} to {to:4.1} {tau:17.1} {gain:13.2}      {by_law}");
        }
    }
}

/// The measured tanks where they lie beside the checkout, otherwise the tank of the tour.
fn recorded() -> Result<Run, Box<dyn Error>> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &Path| {
        let reading = read_csv(file, &Columns::default(), &ReadOptions::default());
        reading.map(|reading| reading.record)
    };
    let measured = here.join("../../shared/data/cascaded_tanks/estimation.csv");
    if measured.exists() {
        let mut record = read(&measured)?;
        record.name = "measured: Cascaded Tanks, the lower of two as if it were one".into();
        let tracking = Tracking {
            lambda: 1.0 / 40.0,
            memory: 600.0,
            tau: 50.0,
        };
        return Run::new(record, &tracking, None);
    }
    println!(
        "the measured tanks are not there ({}); the bundled record instead",
        measured.display()
    );
    let mut record = read(&here.join("records/tour.csv"))?;
    record.name = "bundled: a tank that runs over at 20 cm".into();
    let tracking = Tracking {
        lambda: 1.0 / 20.0,
        memory: 200.0,
        tau: 50.0,
    };
    Run::new(record, &tracking, Some(torricelli))
}

fn main() -> Result<(), Box<dyn Error>> {
    let tracking = Tracking {
        lambda: 1.0 / 20.0,
        memory: 500.0,
        tau: 50.0,
    };
    let runs = [
        Run::new(simulated()?, &tracking, Some(torricelli))?,
        recorded()?,
    ];
    for run in &runs {
        run.show();
    }
    println!(
        "\nWhere gain and time constant fall as the level rises, or leave all sense (below 0), one tank with this law is not"
    );
    println!("what is there: an effect is missing. `ctid diagnose` names it.");
    let file = Path::new("track_tank.svg");
    picture::write(
        file,
        &runs.map(|run| (run.record.name.clone(), run.panels())),
    )?;
    println!("wrote {}", file.display());
    Ok(())
}
