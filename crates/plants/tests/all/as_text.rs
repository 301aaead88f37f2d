//! The plants as text give what their kernels give.

use ct_model::{Dual, Given, Method, Model, ModelSpec, Scalar, Simulation};
use plants::{Command, Plant};

use crate::support::{Case, DRIVES, Drive, base, input};

/// Largest number of parameters with derivatives.
const LANES: usize = 15;

fn spec(plant: Plant) -> ModelSpec {
    ModelSpec::parse(plant.text()).unwrap()
}

/// The text with the parameter values of the case.
fn model(case: &Case) -> Model {
    let scales = &case.structure.scales;
    let mut spec = spec(case.structure.plant);
    for parameter in &mut spec.parameters {
        parameter.value = match parameter.about.name.as_str() {
            "area" | "area_upper" | "area_1" => scales.area[0],
            "area_lower" | "area_3" => scales.area[1],
            "area_2" => scales.area[2],
            "orifice" => scales.orifice.unwrap_or(1.0),
            "width" => 1e-4 * scales.level[1].1,
            _ => continue,
        };
    }
    Model::new(spec)
}

/// The output with its derivatives by the fitted parameters and the initial levels.
fn run(case: &Case, model: &Model, input: &[(Command, f64)]) -> (Vec<Dual<LANES>>, Method) {
    let spec = model.spec();
    let mut lane = 0;
    let mut variable = |value| {
        lane += 1;
        Dual::variable(value, lane - 1)
    };
    let mut theta = case.theta.iter();
    let parameters: Vec<Dual<LANES>> = spec
        .parameters
        .iter()
        .map(|parameter| match parameter.given {
            Given::Fitted => variable(*theta.next().unwrap()),
            _ => Dual::variable(parameter.value, LANES),
        })
        .collect();
    let levels: Vec<_> = case.levels.iter().map(|&level| variable(level)).collect();
    let mut simulation = Simulation::new(model, &parameters, &levels, 0.0);
    let (mut read, mut time) = ([Dual::variable(0.0, LANES)], 0.0);
    let outputs = input
        .iter()
        .map(|&(command, h)| {
            let pumps = [command, (case.second)(command)];
            let from = pumps.map(|command| command.from);
            let to = pumps.map(|command| command.to.unwrap_or(command.from));
            let count = spec.inputs.len();
            simulation.read(&from[..count], &mut read);
            time += h;
            simulation
                .advance(&from[..count], &to[..count], time)
                .unwrap();
            read[0]
        })
        .collect();
    (outputs, simulation.method())
}

/// Difference between the text's simulation and the kernel with `substeps` parts of an interval, as shares of ranges: the output, and the
/// worst derivative.
fn off(case: &Case, input: &[(Command, f64)], substeps: usize) -> (f64, f64) {
    let kernel = case.run_dual(input, substeps);
    let (text, _) = run(case, &model(case), input);
    let of = |entry: &dyn Fn(&Dual<LANES>) -> f64| {
        let values = || kernel.iter().map(entry);
        let (low, high) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        let pairs = values().zip(text.iter().map(entry));
        pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / (high - low)
    };
    let entries = case.theta.len() + case.levels.len();
    let slopes = (0..entries).map(|i| of(&|y| y.eps[i]));
    (of(&|y| y.re), slopes.fold(0.0, f64::max))
}

#[test]
fn names_are_those_of_the_model_file() {
    for plant in Plant::ALL {
        let (spec, case) = (spec(plant), base(plant));
        let fitted = spec.parameters.iter().filter(|p| p.given == Given::Fitted);
        let fitted: Vec<&str> = fitted.map(|p| p.about.name.as_str()).collect();
        let own = plant.parameters(&case.structure.scales);
        let own: Vec<&str> = own.iter().map(|info| info.name).collect();
        assert_eq!(fitted, own, "{}", plant.id());
        let levels: Vec<&str> = spec.states.iter().map(|s| s.about.name.as_str()).collect();
        let vessels = 0..plant.vessels();
        let own: Vec<&str> = vessels.map(|vessel| plant.level_name(vessel)).collect();
        assert_eq!(levels, own, "{}", plant.id());
        assert_eq!(spec.inputs.len(), plant.pumps(), "{}", plant.id());
    }
}

#[test]
fn outputs_and_derivatives_are_those_of_the_kernel() {
    for plant in Plant::ALL {
        let case = base(plant);
        for drive in DRIVES {
            let (output, slopes) = off(&case, &input(drive, 250, case.h, 7), 128);
            assert!(
                output < 1e-9 && slopes < 1e-9,
                "{} {drive:?}: {output:e}, derivatives {slopes:e}",
                plant.id()
            );
        }
    }
}

/// Within the width where a head changes its sign the root bends sharply: derivatives are those of steps that follow the values.
#[test]
fn heads_of_either_sign_are_the_same_in_both() {
    let mut case = base(Plant::ThreeTank);
    // One pump after the other: the water flows back and forth.
    case.second = |command| Command::held(if command.from > 0.0 { 2.0 } else { 9.0 });
    let input: Vec<_> = (0..1800)
        .map(|k| {
            (
                Command::held(if k / 300 % 2 == 0 { 2.0 } else { 0.0 }),
                case.h,
            )
        })
        .collect();
    let model = model(&case);
    let text = Plant::ThreeTank.text();
    let head = "  Real d13 = level_1 - level_3;\nequation\n";
    let mut spec = ModelSpec::parse(&text.replace("equation\n", head)).unwrap();
    spec.parameters.clone_from(&model.spec().parameters);
    spec.outputs[0].variable = spec.find("d13").unwrap();
    let (heads, _) = run(&case, &Model::new(spec), &input);
    let crossings = heads
        .windows(2)
        .filter(|d| (d[0].re > 0.0) != (d[1].re > 0.0));
    assert!(crossings.count() >= 4);
    let (output, slopes) = off(&case, &input, 512);
    assert!(
        output < 1e-9 && slopes < 1e-5,
        "{output:e}, derivatives {slopes:e}"
    );
}

#[test]
fn linear_plants_are_simulated_exactly() {
    for plant in Plant::ALL {
        let case = base(plant);
        let held = Drive {
            ramped: false,
            jittered: false,
        };
        let (_, method) = run(&case, &model(&case), &input(held, 50, case.h, 7));
        let linear = plant.outlet() == plants::Outlet::Linear;
        assert_eq!(method == Method::Exact, linear, "{}", plant.id());
    }
}

/// An empty tank is fast, and its level lies below what the text's steps resolve: derivatives are those of such steps.
#[test]
fn a_tank_runs_empty_in_both() {
    for plant in [Plant::SingleTank, Plant::CascadedTanks] {
        let case = base(plant);
        let mut input = input(DRIVES[0], 150, case.h, 3);
        for (command, _) in &mut input[20..110] {
            *command = Command::held(0.0);
        }
        let lowest = case
            .run(&input, 1)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(lowest < 1e-4, "{lowest}");
        let (output, slopes) = off(&case, &input, 8192);
        assert!(
            output < 1e-9 && slopes < 1e-6,
            "{}: {output:e}, derivatives {slopes:e}",
            plant.id()
        );
    }
}
