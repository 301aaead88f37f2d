//! Plants with numbers, inputs, and a reference that integrates the written equations by other means.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod reference;

use plants::{
    CATALOGUE, Command, Dual, Known, Outlet, ParameterInfo, Placed, Plant, Scalar, Scales,
    Simulator, SimulatorNumber, Structure,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A plant with realistic parameters.
#[derive(Clone)]
pub struct Case {
    pub structure: Structure,
    /// The plant's own parameters, then each effect's.
    pub theta: Vec<f64>,
    /// Level of each vessel, then the output of each lag.
    pub levels: Vec<f64>,
    pub at_rest: f64,
    /// Second input for a given first input.
    pub second: fn(Command) -> Command,
    /// Nominal sampling interval \[s\].
    pub h: f64,
}

pub fn effect(id: &str) -> &'static plants::EffectInfo {
    plants::EffectInfo::find(id).expect("an effect of the catalogue")
}

/// A plant whose levels stay between about 4 and 20 for commands between 3.5 and 6.5, with `h/tau` near 0.03.
pub fn base(plant: Plant) -> Case {
    let (theta, levels, area, flow, h): (Vec<f64>, Vec<f64>, _, f64, f64) = match plant {
        Plant::SingleTank => (
            vec![9.0, 13.0],
            vec![11.0],
            [Some(154.0), None, None],
            45.0,
            3.0,
        ),
        Plant::CascadedTanks => (
            vec![3.3, 5.0, 4.6],
            vec![9.5, 12.0],
            [Some(28.0), Some(32.0), None],
            16.5,
            1.5,
        ),
        Plant::SingleTankLinear => (vec![2.0, 80.0, 1.5], vec![11.0], [None; 3], 10.0, 3.0),
        Plant::CascadedTanksLinear => (
            vec![2.0, 60.0, 90.0, 1.5],
            vec![9.5, 12.0],
            [None; 3],
            10.0,
            3.0,
        ),
        Plant::FirstOrder => (vec![2.2, 80.0], vec![11.0], [None; 3], 11.0, 3.0),
        // T3 is measured; the heads are a few centimetres in either direction.
        Plant::ThreeTank => (
            vec![3.4, 3.1, 9.1, 8.7, 12.0],
            vec![15.0, 11.5, 8.2],
            [Some(122.0), Some(128.0), Some(120.0)],
            31.0,
            1.0,
        ),
    };
    let known = Known {
        area,
        measured: plant.joined().then_some(1).into_iter().collect(),
        ..Known::default()
    };
    let mut scales = Scales::from_ranges((3.5, 6.5), (6.0, 17.0), h, 400.0 * h);
    scales.input_range = 10.0;
    scales.operating_level = [10.0, 11.0, 9.0];
    scales.input_2 = Some((3.5, 6.5));
    scales.flow = flow;
    Case {
        structure: Structure::new(plant, known, scales),
        theta,
        levels,
        at_rest: 4.7,
        second: mirrored,
        h,
    }
}

/// The plant with a measured disturbance into a vessel: a quarter of the pump's flow, with either sign.
pub fn disturbed(plant: Plant, vessel: usize, sign: f64) -> Case {
    let mut case = base(plant);
    let mut scales = case.structure.scales.clone();
    scales.input_2 = Some((3.3, 6.3));
    let known = Known {
        disturbance: Some(vessel),
        ..case.structure.known.clone()
    };
    case.structure = Structure::new(plant, known, scales);
    case.theta.push(0.25 * sign * case.theta[0]);
    case
}

/// The plant with a vessel whose time constant is the sampling interval over `ratio`, at the same levels.
pub fn fast(plant: Plant, vessel: usize, ratio: f64) -> Case {
    let mut case = base(plant);
    if plant.outlet() == Outlet::Linear {
        case.theta[1 + vessel] = case.h / ratio;
    } else {
        // tau = 2 S sqrt(H)/alpha = 2 S H/Q
        let scales = &mut case.structure.scales;
        scales.area[vessel] = case.h / ratio * scales.flow / (2.0 * 11.0);
    }
    case
}

/// Every effect of the catalogue at every place that it takes on this plant.
pub fn placements(plant: Plant) -> Vec<Placed> {
    CATALOGUE
        .iter()
        .flat_map(|&effect| {
            let sites = effect.sites(plant, &Known::default());
            sites.map(move |vessel| Placed { effect, vessel })
        })
        .collect()
}

/// Effects whose output is a staircase function of some parameter. Its derivative at a point is useless, so they return the slope of a
/// secant.
pub const STEPPED: [&str; 2] = ["stiction_backlash", "coarse_quantisation"];

/// An effect that begins with a root at a level: a Runge-Kutta step across the level is of order one and a half, and a difference across it
/// is no derivative.
pub fn begins_with_a_root(effects: &[Placed]) -> bool {
    effects.iter().any(|p| p.effect.id == "leak_at_height")
}

pub fn label(placed: &[Placed], plant: Plant) -> String {
    let names: Vec<String> = placed
        .iter()
        .map(|p| format!("{}@{}", p.effect.id, p.vessel))
        .collect();
    format!("{} with [{}]", plant.id(), names.join(", "))
}

/// A value at which the effect shows.
pub fn interior(case: &Case, placed: Placed, info: &ParameterInfo) -> f64 {
    let (h, flow) = (case.h, case.structure.scales.flow);
    match (placed.effect.id, info.name) {
        ("transport_delay", _) => 2.37 * h,
        ("pump_deadzone", _) => 0.37,
        ("pump_saturation", _) => 5.61,
        ("pump_nonlinearity", _) => 0.31,
        ("pump_lag", _) => 3.3 * h,
        ("sqrt_outflow", _) => 0.8,
        ("laminar_outflow", _) => 0.02 * flow,
        ("const_leak", _) => 0.1 * flow,
        ("area_varies", _) => 0.4,
        ("overflow", "rim") => 11.3,
        ("overflow", _) => 0.4,
        ("sensor_lag", _) => 2.7 * h,
        ("sensor_offset", _) => 0.7,
        ("sensor_hysteresis", "step") => 0.8,
        ("sensor_hysteresis", "drop") => 9.05,
        ("sensor_hysteresis", _) => 2.1,
        ("sensor_saturation", _) => 12.3,
        ("stiction_backlash", "width") => 0.61,
        ("stiction_backlash", "jump") => 0.43,
        ("stiction_backlash", _) => -0.57,
        ("pump_gain_drift", "change") => 0.17,
        ("pump_gain_drift", _) => 93.0 * h,
        ("pipe_height", _) => 1.9,
        ("valve_drift", _) => 0.23,
        ("valve_step", "change") => -0.12,
        ("valve_step", _) => 41.37 * h,
        ("coupled_tank", "time_constant") => 23.0 * h,
        ("coupled_tank", _) => 0.31,
        ("leak_at_height", "coefficient") => 0.05 * flow,
        ("leak_at_height", _) => 9.4,
        ("periodic_disturbance", "sine") => 0.11 * flow,
        ("periodic_disturbance", "cosine") => -0.06 * flow,
        ("periodic_disturbance", _) => 37.3 * h,
        ("sensor_drift", _) => 1.3,
        ("sensor_nonlinearity", _) => 0.21,
        ("coarse_quantisation", "step") => 0.83,
        ("coarse_quantisation", _) => 0.24,
        _ => info.starts[0],
    }
}

/// The absent value of the parameter, or its first start if it has none.
pub fn absent(info: &ParameterInfo) -> f64 {
    if info.absent.is_nan() {
        info.starts[0]
    } else {
        info.absent
    }
}

impl Case {
    /// The case with effects and their parameters from `value`.
    pub fn with(
        &self,
        effects: &[Placed],
        value: impl Fn(&Case, Placed, &ParameterInfo) -> f64,
    ) -> Self {
        let mut case = self.clone();
        for &placed in effects {
            case.structure = case.structure.with(placed).expect("it applies");
        }
        for &placed in case.structure.effects() {
            for info in case.structure.effect_parameters(placed) {
                case.theta.push(value(self, placed, &info));
            }
        }
        // Lags that have not settled when the record begins.
        case.levels.truncate(case.structure.plant.vessels());
        case.levels
            .extend(case.structure.lags().iter().map(|_| 1.3));
        case
    }

    pub fn with_interior(&self, effects: &[Placed]) -> Self {
        self.with(effects, interior)
    }

    pub fn with_absent(&self, effects: &[Placed]) -> Self {
        self.with(effects, |_, _, info| absent(info))
    }

    pub fn run(&self, input: &[(Command, f64)], substeps: usize) -> Vec<f64> {
        simulate(
            &self.structure,
            &self.theta,
            &self.levels,
            (self.at_rest, self.second),
            input,
            substeps,
        )
    }

    /// Parameters, then initial levels: what a fit may move.
    pub fn variables(&self) -> Vec<f64> {
        self.theta.iter().chain(&self.levels).copied().collect()
    }

    /// The output at other variables.
    pub fn run_at<T: SimulatorNumber>(
        &self,
        variables: &[T],
        input: &[(Command, f64)],
        substeps: usize,
    ) -> Vec<T> {
        let (theta, levels) = variables.split_at(self.theta.len());
        simulate(
            &self.structure,
            theta,
            levels,
            (self.at_rest, self.second),
            input,
            substeps,
        )
    }

    /// The output with its derivatives by all variables.
    pub fn run_dual(&self, input: &[(Command, f64)], substeps: usize) -> Vec<Dual<15>> {
        let variables: Vec<Dual<15>> = self
            .variables()
            .iter()
            .enumerate()
            .map(|(i, &v)| Dual::variable(v, i))
            .collect();
        assert!(variables.len() <= 15);
        self.run_at(&variables, input, substeps)
    }
}

/// Second pump's command for a given first command.
pub fn mirrored(command: Command) -> Command {
    let mirror = |u: f64| 9.8 - u;
    Command {
        from: mirror(command.from),
        to: command.to.map(mirror),
    }
}

/// One reading before each command.
pub fn simulate<T: SimulatorNumber>(
    structure: &Structure,
    theta: &[T],
    levels: &[T],
    (at_rest, second): (f64, fn(Command) -> Command),
    input: &[(Command, f64)],
    substeps: usize,
) -> Vec<T> {
    let at_rest = [at_rest, second(Command::held(at_rest)).from];
    let mut simulator = Simulator::with_inputs(structure, theta, levels, at_rest).expect("counts");
    simulator.set_substeps(substeps);
    input
        .iter()
        .map(|&(command, h)| {
            let y = simulator.read(0);
            simulator.advance_both([command, second(command)], h);
            y
        })
        .collect()
}

/// Sampling and input of a record.
#[derive(Debug, Clone, Copy)]
pub struct Drive {
    pub ramped: bool,
    pub jittered: bool,
}

pub const DRIVES: [Drive; 4] = [
    Drive {
        ramped: false,
        jittered: false,
    },
    Drive {
        ramped: false,
        jittered: true,
    },
    Drive {
        ramped: true,
        jittered: false,
    },
    Drive {
        ramped: true,
        jittered: true,
    },
];

/// Random steps (held) or random ramps between 3.5 and 6.5, changing every few samples.
pub fn input(drive: Drive, n: usize, h: f64, seed: u64) -> Vec<(Command, f64)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut target = rng.random_range(3.5..6.5);
    let mut u: f64 = 4.7;
    let mut left = 0;
    (0..n)
        .map(|_| {
            if left == 0 {
                left = rng.random_range(4..24);
                target = rng.random_range(3.5..6.5);
                if !drive.ramped {
                    u = target;
                }
            }
            let step = if drive.jittered {
                h * rng.random_range(0.6..1.4)
            } else {
                h
            };
            let command = if drive.ramped {
                let to = u + (target - u) / f64::from(left);
                let command = Command::ramp(u, to);
                u = to;
                command
            } else {
                Command::held(u)
            };
            left -= 1;
            (command, step)
        })
        .collect()
}

/// Largest difference, as a share of the largest magnitude of the second.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter()
        .zip(b)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()))
        / scale
}

/// Random permitted sets of `size` effects.
pub fn random_sets(plant: Plant, size: usize, count: usize, seed: u64) -> Vec<Vec<Placed>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let all = placements(plant);
    (0..count)
        .map(|_| {
            let mut set: Vec<Placed> = Vec::new();
            while set.len() < size {
                let placed = all[rng.random_range(0..all.len())];
                if set.iter().all(|on| on.effect.id != placed.effect.id) {
                    set.push(placed);
                }
            }
            set
        })
        .collect()
}
