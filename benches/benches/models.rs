//! Time per sample of models as text: the plants next to their kernels, and models that are stiff, swing, meet a limit, stick or have
//! delays.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ct_model::{Dual, Given, Model, ModelSpec, Scalar, Simulation, SimulationNumber, TOLERANCE};
use plants::{Command, Known, Plant, Scales, Simulator, SimulatorNumber, Structure};

const SAMPLES: usize = 1000;

/// A plant with realistic numbers: parameters, first levels, areas, interval \[s\].
struct Rig {
    plant: Plant,
    theta: &'static [f64],
    levels: &'static [f64],
    area: [Option<f64>; 3],
    interval: f64,
}

const RIGS: [Rig; 3] = [
    Rig {
        plant: Plant::SingleTank,
        theta: &[9.0, 13.0],
        levels: &[11.0],
        area: [Some(154.0), None, None],
        interval: 3.0,
    },
    Rig {
        plant: Plant::CascadedTanks,
        theta: &[3.3, 5.0, 4.6],
        levels: &[9.5, 12.0],
        area: [Some(28.0), Some(32.0), None],
        interval: 1.5,
    },
    Rig {
        plant: Plant::ThreeTank,
        theta: &[3.4, 3.1, 9.1, 8.7, 12.0],
        levels: &[15.0, 11.5, 8.2],
        area: [Some(122.0), Some(128.0), Some(120.0)],
        interval: 1.0,
    },
];

fn command(k: usize) -> f64 {
    3.5 + ((k / 10) * 7 % 11) as f64 * 0.3
}

fn second(u: f64) -> f64 {
    9.8 - u
}

fn duals<const N: usize>(values: &[f64], first: usize) -> Vec<Dual<N>> {
    let values = values.iter().enumerate();
    values
        .map(|(i, &value)| Dual::variable(value, first + i))
        .collect()
}

fn kernel<T: SimulatorNumber>(
    structure: &Structure,
    rig: &Rig,
    theta: &[T],
    levels: &[T],
) -> Option<T> {
    let rest = [command(0), second(command(0))];
    let mut simulator = Simulator::with_inputs(structure, theta, levels, rest).ok()?;
    let mut sum = T::constant(0.0);
    for k in 0..SAMPLES {
        sum = sum + simulator.read(0);
        let u = command(k);
        simulator.advance_both([u, second(u)].map(Command::held), rig.interval);
    }
    Some(sum)
}

/// Error of a kernel's step, and the tolerance of a text with the same error.
const OF_KERNELS: f64 = 1e-7;

/// The fitted parameters are `theta`, the others those of the model.
fn text<T: SimulationNumber>(
    model: &Model,
    (interval, tolerance): (f64, f64),
    theta: &[T],
    levels: &[T],
) -> Option<T> {
    let spec = model.spec();
    let mut fitted = theta.iter().copied();
    let parameters: Vec<T> = spec
        .parameters
        .iter()
        .map(|parameter| match parameter.given {
            Given::Fitted => fitted.next(),
            _ => Some(T::constant(parameter.value)),
        })
        .collect::<Option<_>>()?;
    let simulation = Simulation::new(model, &parameters, levels, 0.0);
    let mut simulation = simulation.with_tolerance(tolerance);
    let mut read = vec![T::constant(0.0); spec.outputs.len()];
    let mut sum = T::constant(0.0);
    for k in 0..SAMPLES {
        let u = [command(k), second(command(k))];
        let inputs = &u[..spec.inputs.len()];
        simulation.read(inputs, &mut read);
        sum = sum + read[0];
        simulation
            .advance(inputs, inputs, (k + 1) as f64 * interval)
            .ok()?;
    }
    Some(sum)
}

fn plants_both_ways(criterion: &mut Criterion) {
    for rig in &RIGS {
        let known = Known {
            area: rig.area,
            measured: rig.plant.joined().then_some(1).into_iter().collect(),
            ..Known::default()
        };
        let duration = SAMPLES as f64 * rig.interval;
        let mut scales = Scales::from_ranges((3.5, 6.5), (6.0, 17.0), rig.interval, duration);
        scales.input_2 = Some((3.3, 6.3));
        let structure = Structure::new(rig.plant, known, scales);
        let Ok(mut spec) = ModelSpec::parse(rig.plant.text()) else {
            continue;
        };
        for parameter in &mut spec.parameters {
            let vessel = match parameter.about.name.as_str() {
                "area" | "area_upper" | "area_1" => 0,
                "area_lower" | "area_3" => 1,
                "area_2" => 2,
                _ => continue,
            };
            parameter.value = rig.area[vessel].unwrap_or(1.0);
        }
        let model = Model::new(spec);
        let theta = duals::<8>(rig.theta, 0);
        let levels = duals::<8>(rig.levels, rig.theta.len());
        let mut group = criterion.benchmark_group(rig.plant.id());
        group.throughput(Throughput::Elements(SAMPLES as u64));
        group.bench_function("kernel, f64", |b| {
            b.iter(|| kernel(black_box(&structure), rig, rig.theta, rig.levels));
        });
        group.bench_function("kernel, 8 derivatives", |b| {
            b.iter(|| kernel(black_box(&structure), rig, &theta, &levels));
        });
        for tolerance in [OF_KERNELS, TOLERANCE] {
            let steps = (rig.interval, tolerance);
            group.bench_function(format!("text to {tolerance:e}, f64"), |b| {
                b.iter(|| text(black_box(&model), steps, rig.theta, rig.levels));
            });
            group.bench_function(format!("text to {tolerance:e}, 8 derivatives"), |b| {
                b.iter(|| text(black_box(&model), steps, &theta, &levels));
            });
        }
        group.finish();
    }
}

/// Time constants of 1 ms and 1000 s; an oscillation of twenty samples a period; a limit that is met twice in each; an arm that friction
/// holds; delays of both kinds.
const OTHERS: [(&str, f64, &str); 5] = [
    (
        "stiff",
        20.0,
        "model Stiff parameter Real fast = 1e3; parameter Real slow = 1e-3; input Real u; output Real y = x; Real x(start=1); Real w(start=0.2); equation der(x) = -fast*(x - w - 0.3*w^3 - 0.1*u); der(w) = -slow*(w^3 + x - 0.2*u); end Stiff;",
    ),
    (
        "oscillating",
        0.314,
        "model Pendulum parameter Real w2 = 1; parameter Real c = 0.05; input Real u; output Real y = phi; Real phi(start=0.5); Real v(start=0); equation der(phi) = v; der(v) = -w2*sin(phi) - c*v + 0.02*(u - 5); end Pendulum;",
    ),
    (
        "limit",
        2.0,
        "model Saw parameter Real limit = 0.8; parameter Real w = 1; input Real u; output Real y = x; Real x(start=0); Real s(start=0); Real c(start=1); equation der(s) = w*c; der(c) = -w*s; der(x) = max(s - limit, 0) - 0.1*x + 0*u*x; end Saw;",
    ),
    (
        "friction",
        0.3,
        "model Arm parameter Real f = 0.5; parameter Real k = 0.8; input Real u; output Real y = x; Real x(start=0.2); Real w(start=0.3); equation der(x) = w; der(w) = u - 4.5 - k*x - 0.3*w - f*sign(w); end Arm;",
    ),
    (
        "delay",
        1.0,
        "model Late parameter Real d = 3.3; parameter Real e = 2.1; input Real u; output Real y = w; Real x(start=1); Real w(start=1); equation 7*der(x) = 2*delay(u, d) - x; 4*der(w) = delay(x, e) - w - 0.1*w^2; end Late;",
    ),
];

fn others(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("text");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for (name, interval, source) in OTHERS {
        let Ok(spec) = ModelSpec::parse(source) else {
            continue;
        };
        let model = Model::new(spec);
        let theta = model.parameters();
        let levels = model.starts(&theta);
        let (d8, l8) = (duals::<8>(&theta, 0), duals::<8>(&levels, theta.len()));
        group.bench_function(format!("{name}, f64"), |b| {
            b.iter(|| text(black_box(&model), (interval, TOLERANCE), &theta, &levels));
        });
        group.bench_function(format!("{name}, 8 derivatives"), |b| {
            b.iter(|| text(black_box(&model), (interval, TOLERANCE), &d8, &l8));
        });
    }
    group.finish();
}

criterion_group!(benches, plants_both_ways, others);
criterion_main!(benches);
