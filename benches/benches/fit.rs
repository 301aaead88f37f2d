//! Time of one fit of two tanks in series, 1000 samples, from one start: the bounded minimiser of `greybox` next to the crate
//! `levenberg-marquardt` on the same rows; and the time of the parts of an evaluation.
//!
//! The ratio is printed first, from alternating runs, so that a busy machine slows both.
#![allow(missing_docs)]

use std::{collections::BTreeMap, hint::black_box, time::Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use ct_signals::{ArModel, Channel, Record};
use greybox::{FitOptions, Noise, Setup, Triangle, fit_from};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use plants::{Command, Known, Plant, Scales, Simulator, Structure};

const SAMPLES: usize = 1000;
const H: f64 = 4.0;
const TRUTH: [f64; 5] = [10.0, 18.0, 12.5, 7.0, 14.0];

fn known() -> Known {
    Known {
        area: [Some(154.0), Some(154.0), None],
        ..Known::default()
    }
}

/// Held steps, and a reading with a small oscillation that no model of the tanks explains.
fn record() -> Option<Record> {
    let u: Vec<f64> = (0..SAMPLES)
        .map(|k| 2.0 + ((k / 25) * 7 % 11) as f64 * 0.6)
        .collect();
    let scales = Scales::from_ranges((2.0, 8.0), (4.0, 32.0), H, H * SAMPLES as f64);
    let structure = Structure::new(Plant::CascadedTanks, known(), scales);
    let mut simulator = Simulator::<f64>::new(&structure, &TRUTH[..3], &TRUTH[3..], u[0]).ok()?;
    let y = (0..SAMPLES)
        .map(|k| {
            let wobble = ((k * k * 31 % 1009) as f64 / 1009.0 - 0.5) * 0.17;
            let reading = simulator.read(0) + wobble;
            simulator.advance(Command::held(u[k]), H);
            reading
        })
        .collect();
    Some(Record {
        name: "tanks".into(),
        time: (0..SAMPLES).map(|k| k as f64 * H).collect(),
        inputs: vec![Channel::new("u", "V", u)],
        outputs: vec![Channel::new("y", "cm", y)],
        ..Record::default()
    })
}

struct Peer<'a> {
    setup: &'a Setup<'a>,
    x: DVector<f64>,
    rows: Option<DMatrix<f64>>,
}

impl<'a> Peer<'a> {
    fn new(setup: &'a Setup<'a>, start: &[f64]) -> Self {
        let mut peer = Self {
            setup,
            x: DVector::from_row_slice(start),
            rows: None,
        };
        peer.evaluate();
        peer
    }

    /// Residual and Jacobian come from one simulation with derivatives, made once for each point.
    fn evaluate(&mut self) {
        self.rows = self
            .setup
            .rows(self.x.as_slice())
            .map(|rows| DMatrix::from_row_slice(SAMPLES, rows.columns, &rows.values));
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Peer<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.clone_from(x);
        self.evaluate();
    }
    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }
    fn residuals(&self) -> Option<DVector<f64>> {
        self.rows
            .as_ref()
            .map(|rows| rows.column(rows.ncols() - 1).into_owned())
    }
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        self.rows
            .as_ref()
            .map(|rows| -rows.columns(0, rows.ncols() - 1))
    }
}

fn benches(c: &mut Criterion) {
    let Some(record) = record() else { return };
    let records = [record];
    let Ok(setup) = Setup::from_records(
        Plant::CascadedTanks,
        known(),
        &[],
        &records,
        BTreeMap::new(),
    ) else {
        return;
    };
    let white = Noise::white(1);
    let stopping = FitOptions::default().stopping;
    let start: Vec<f64> = TRUTH.iter().map(|x| 1.3 * x).collect();
    let starts = [start.clone()];
    let ours = || fit_from(&setup, &starts, &white, stopping).map_or(f64::NAN, |fit| fit.cost);
    let peer = || {
        let (_, report) = LevenbergMarquardt::new()
            .with_ftol(stopping.cost)
            .minimize(Peer::new(&setup, &start));
        2.0 * report.objective_function
    };

    let mut times = [0.0, 0.0];
    for _ in 0..50 {
        for (time, fit) in times.iter_mut().zip([&ours as &dyn Fn() -> f64, &peer]) {
            let begun = Instant::now();
            black_box(fit());
            *time += begun.elapsed().as_secs_f64();
        }
    }
    println!(
        "fit: greybox {:.3} ms (cost {:.9}), levenberg-marquardt {:.3} ms (cost {:.9}), ratio {:.2}",
        times[0] * 20.0,
        ours(),
        times[1] * 20.0,
        peer(),
        times[0] / times[1]
    );

    let mut group = c.benchmark_group("fit");
    group.bench_function("greybox", |b| b.iter(ours));
    group.bench_function("levenberg-marquardt", |b| b.iter(peer));
    group.finish();

    let mut group = c.benchmark_group("evaluation");
    let coloured =
        ArModel::from_coefficients(&[1.1, -0.4, 0.1], 1.0).map(|model| Noise::of(vec![model]));
    group.bench_function("simulate", |b| b.iter(|| setup.simulate(&TRUTH)));
    group.bench_function("rows", |b| b.iter(|| setup.rows(&TRUTH)));
    group.bench_function("linearise, white", |b| {
        b.iter(|| setup.linearise(&TRUTH, &white))
    });
    if let Ok(noise) = coloured {
        group.bench_function("linearise, third order", |b| {
            b.iter(|| setup.linearise(&TRUTH, &noise))
        });
    }
    if let Some(rows) = setup.rows(&TRUTH) {
        group.bench_function("fold", |b| {
            b.iter(|| {
                let mut triangle = Triangle::new(rows.columns);
                for row in rows.values.chunks_exact(rows.columns) {
                    triangle.push(row);
                }
                triangle.finish();
                triangle
            });
        });
    }
    group.finish();
}

criterion_group!(fit, benches);
criterion_main!(fit);
